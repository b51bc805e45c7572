#include "survey/position_stager.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace knap {

namespace {

constexpr std::uint64_t kFiles = 256;
constexpr std::uint64_t kFewestPoints = std::uint64_t{1} << 16;
constexpr std::uint64_t kMostPoints = std::uint64_t{1} << 20;

}  // namespace

PositionStager::PositionStager(std::filesystem::path folder, std::uint64_t points)
    : folder_(std::move(folder)),
      points_a_file_(std::clamp(points / kFiles, kFewestPoints, kMostPoints)) {}

void PositionStager::add(std::size_t range, std::size_t source, const CoordinateFormat& format,
                         const Chunk& chunk) {
    if (writer_ && (range != range_ || files_.back().count >= points_a_file_)) {
        close();
    }
    if (!writer_) {
        range_ = range;
        const std::filesystem::path path =
            folder_ / fmt::format("{:06}-{:012}.positions", source, chunk.first);
        writer_ = std::make_unique<PositionWriter>(path, PositionCodec(format));
        files_.push_back({path, source, chunk.first, 0, 0});
    }
    writer_->add(chunk.positions);
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
    }
}

}  // namespace knap
