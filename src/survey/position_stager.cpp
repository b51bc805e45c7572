#include "survey/position_stager.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "input/columns.hpp"

namespace knap {

namespace {

constexpr std::uint64_t kFiles = 256;
constexpr std::uint64_t kFewestPoints = std::uint64_t{1} << 16;
constexpr std::uint64_t kMostPoints = std::uint64_t{1} << 20;
// Who reads columns back holds a block of all of them, and more beside it.
constexpr std::size_t kBlockPoints = std::size_t{1} << 14;

}  // namespace

PositionStager::PositionStager(std::filesystem::path folder, std::uint64_t points)
    : folder_(std::move(folder)),
      points_a_file_(std::clamp(points / kFiles, kFewestPoints, kMostPoints)) {}

void PositionStager::add(std::size_t range, std::size_t source, const SourceInfo& info,
                         std::span<const std::size_t> columns, const Chunk& chunk) {
    if (writer_ && (range != range_ || files_.back().count >= points_a_file_)) {
        close();
    }
    if (!writer_) {
        range_ = range;
        const std::filesystem::path path =
            folder_ / fmt::format("{:06}-{:012}.positions", source, chunk.first);
        writer_ = std::make_unique<PositionWriter>(path, PositionCodec(info.coordinates));
        files_.push_back({path, source, chunk.first, 0, 0});
        if (!columns.empty()) {
            columns_ = std::make_unique<ColumnWriter>(files_.back().columns_path(),
                                                      value_sizes(info, columns));
        }
    }
    for (std::size_t at = 0; at < chunk.positions.size(); at += kBlockPoints) {
        const std::size_t count = std::min(kBlockPoints, chunk.positions.size() - at);
        writer_->add(std::span(chunk.positions).subspan(at, count));
        if (columns_) {
            columns_->add(chunk.columns, at, count);
        }
    }
    files_.back().count += chunk.positions.size();
}

std::vector<PositionFile> PositionStager::finish() {
    close();
    return std::exchange(files_, {});
}

void PositionStager::close() {
    if (writer_) {
        files_.back().bytes = writer_->finish();
        writer_.reset();
        if (columns_) {
            files_.back().column_bytes = columns_->finish();
            columns_.reset();
        }
    }
}

}  // namespace knap
