#include "pipeline/sources.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "emit/attribute_plan.hpp"
#include "emit/output_check.hpp"
#include "emit/tile_layout.hpp"
#include "knap/source.hpp"

namespace knap {

namespace fs = std::filesystem;

std::vector<fs::path> find_sources(const Job& job, Progress& progress) {
    std::vector<std::string> patterns = job.input;
    if (!job.standard_input.empty()) {
        std::replace(patterns.begin(), patterns.end(), std::string(kStandardInput),
                     job.standard_input.string());
    }
    std::vector<fs::path> left_out;
    std::vector<fs::path> files = expand_sources(patterns, &left_out);
    if (!left_out.empty()) {
        progress.note(
            fmt::format("{} files of the input folders are no point clouds that knap reads, "
                        "and are left out; the first is {}",
                        left_out.size(), left_out.front().string()));
    }
    return files;
}

std::vector<SourceInfo> source_infos(const std::vector<fs::path>& files) {
    std::vector<SourceInfo> infos;
    infos.reserve(files.size());
    for (const fs::path& file : files) {
        infos.push_back(open_source(file)->info());
    }
    return infos;
}

void check_attributes(const Job& job, const std::vector<fs::path>& files) {
    const AttributePlan plan = plan_output(source_infos(files), job.output);
    const OutputKind kind = output_kind(job.output.path);
    if (kind == OutputKind::kArchive || kind == OutputKind::kDraco) {
        check_tile_attributes(plan.attributes);
    }
}

void tell_attributes(const Job& job, const SourceTable& table, Progress& progress) {
    const AttributePlan plan = plan_output(table.infos(), job.output);
    for (const std::string& note : attribute_notes(table, plan)) {
        progress.note(note);
    }
}

}  // namespace knap
