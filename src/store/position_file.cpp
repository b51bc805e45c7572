#include "store/position_file.hpp"

namespace knap {

namespace {

ItemFormat format_of(const PositionCodec& codec) {
    return {"KNAPPOS1", "position file", codec.size()};
}

}  // namespace

PositionWriter::PositionWriter(const std::filesystem::path& path, const PositionCodec& codec)
    : file_(path, format_of(codec)), codec_(codec) {}

void PositionWriter::add(std::span<const Vec3> positions) {
    if (positions.empty()) {
        return;
    }
    block_.resize(positions.size() * codec_.size());
    for (std::size_t i = 0; i < positions.size(); ++i) {
        codec_.pack(positions[i], block_.data() + i * codec_.size());
    }
    file_.add(block_);
}

PositionReader::PositionReader(const std::filesystem::path& path, const PositionCodec& codec)
    : file_(path, format_of(codec)), codec_(codec) {}

bool PositionReader::next(std::vector<Vec3>& positions) {
    const std::span<const std::byte> block = file_.next();
    positions.resize(block.size() / codec_.size());
    for (std::size_t i = 0; i < positions.size(); ++i) {
        positions[i] = codec_.unpack(block.data() + i * codec_.size());
    }
    return !positions.empty();
}

}  // namespace knap
