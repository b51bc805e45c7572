#include "pipeline/staging.hpp"

#include <algorithm>
#include <utility>

#include "emit/output_check.hpp"
#include "keep/keep.hpp"
#include "store/position_codec.hpp"
#include "survey/survey.hpp"

namespace knap {

namespace {

// Brick files, and the runs that they become, over the packed positions of the archive.
constexpr std::uint64_t kWorkShare = 3;

bool reads_sources_later(const Job& job, const std::vector<std::vector<std::size_t>>& columns) {
    return !job.range.keep.empty() || output_kind(job.output.path) == OutputKind::kCloud ||
           std::any_of(columns.begin(), columns.end(), [](const auto& of) { return !of.empty(); });
}

std::size_t largest_columns(const std::vector<SourceInfo>& infos,
                            const std::vector<std::vector<std::size_t>>& columns) {
    std::size_t largest = 0;
    for (std::size_t i = 0; i < infos.size(); ++i) {
        std::size_t size = 0;
        for (const std::size_t column : columns[i]) {
            size += infos[i].schema[column].value_size();
        }
        largest = std::max(largest, size);
    }
    return largest;
}

// Of all sources, as far as headers say: those that are not slow take as much.
std::uint64_t work_bytes(const std::vector<SourceInfo>& infos, std::uint64_t positions) {
    std::uint64_t bytes = positions;
    for (const SourceInfo& info : infos) {
        if (info.seek_granularity == 1) {
            bytes += info.declared_count.value_or(0) * PositionCodec(info.coordinates).size();
        }
    }
    return kWorkShare * bytes;
}

}  // namespace

std::vector<std::vector<std::size_t>> columns_read_later(const Job& job,
                                                         const std::vector<SourceInfo>& infos) {
    std::vector<std::vector<std::size_t>> columns =
        plan_attributes(infos, job.output.attributes).selected();
    if (!job.range.keep.empty()) {
        const auto asked = columns_of(KeepExpression(job.range.keep), infos);
        for (std::size_t i = 0; i < infos.size(); ++i) {
            columns[i].insert(columns[i].end(), asked[i].begin(), asked[i].end());
        }
    }
    for (std::vector<std::size_t>& of : columns) {
        std::sort(of.begin(), of.end());
        of.erase(std::unique(of.begin(), of.end()), of.end());
    }
    return columns;
}

Staging plan_staging(const Job& job, const std::vector<SourceInfo>& infos,
                     const std::filesystem::path& scratch, std::uint64_t free_bytes) {
    const std::uint64_t positions = position_bytes(infos);
    Staging staging;
    if (positions == 0) {
        return staging;
    }
    std::vector<std::vector<std::size_t>> columns = columns_read_later(job, infos);
    if (reads_sources_later(job, columns)) {
        const std::uint64_t bytes = positions + column_bytes(infos, columns);
        if (bytes + work_bytes(infos, positions) <= free_bytes) {
            staging.folder = scratch;
            staging.columns_size = largest_columns(infos, columns);
            staging.columns = std::move(columns);
            staging.stays = true;
            staging.bytes = bytes;
            return staging;
        }
    }
    // Brick files need more than positions do, and are checked against the disk once it is known
    // how many there are.
    if (2 * positions <= free_bytes) {
        staging.folder = scratch;
    }
    return staging;
}

}  // namespace knap
