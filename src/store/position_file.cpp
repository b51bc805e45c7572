#include "store/position_file.hpp"

#include <fmt/format.h>

#include <cstring>
#include <string_view>

#include "base/bytes.hpp"
#include "base/checksum.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::string_view kMagic = "KNAPPOS1";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderSize = 16;
constexpr std::size_t kBlockHeaderSize = 16;

// A scratch file that cannot be read is the machine's fault, not the input's.
template <typename Read>
auto as_scratch(const Read& read) {
    try {
        return read();
    } catch (const InputError& error) {
        throw StorageError(error.what());
    }
}

}  // namespace

PositionWriter::PositionWriter(const std::filesystem::path& path, const PositionCodec& codec)
    : file_(path, AtomicFile::Durability::kProcess), codec_(codec) {
    file_.write(kMagic);
    std::vector<std::byte> header;
    put(header, kVersion);
    put(header, static_cast<std::uint32_t>(codec.size()));
    file_.write(header);
}

void PositionWriter::add(std::span<const Vec3> positions) {
    if (!positions.empty()) {
        write_block(positions);
    }
}

std::uint64_t PositionWriter::finish() {
    write_block({});
    file_.commit();
    return file_.size();
}

void PositionWriter::write_block(std::span<const Vec3> positions) {
    const std::size_t packed = codec_.size();
    block_.resize(kBlockHeaderSize + positions.size() * packed);
    const std::span<std::byte> payload = std::span(block_).subspan(kBlockHeaderSize);
    for (std::size_t i = 0; i < positions.size(); ++i) {
        codec_.pack(positions[i], payload.data() + i * packed);
    }
    std::vector<std::byte> header;
    const auto count = static_cast<std::uint32_t>(positions.size());
    put(header, count);
    put(header, std::uint32_t{0});
    put(header, block_checksum(count, payload));
    std::memcpy(block_.data(), header.data(), header.size());
    file_.write(block_);
}

PositionReader::PositionReader(const std::filesystem::path& path, const PositionCodec& codec)
    : file_(as_scratch([&] { return InputFile(path); })), codec_(codec) {
    std::vector<std::byte> header(kHeaderSize);
    const std::size_t got = as_scratch([&] { return file_.read_some(0, header); });
    ByteReader fields{std::span(header).first(got)};
    const std::byte* magic = fields.take(kMagic.size());
    if (magic == nullptr || std::memcmp(magic, kMagic.data(), kMagic.size()) != 0 ||
        fields.get<std::uint32_t>() != kVersion || fields.get<std::uint32_t>() != codec.size()) {
        throw_damaged("expected the header of a position file");
    }
    at_ = kHeaderSize;
}

bool PositionReader::next(std::vector<Vec3>& positions) {
    positions.clear();
    std::vector<std::byte> header(kBlockHeaderSize);
    if (as_scratch([&] { return file_.read_some(at_, header); }) < kBlockHeaderSize) {
        throw_damaged("the file is cut short");
    }
    ByteReader fields(header);
    const auto count = fields.get<std::uint32_t>();
    const auto reserved = fields.get<std::uint32_t>();
    const auto checksum = fields.get<std::uint64_t>();
    const std::uint64_t size = std::uint64_t{count} * codec_.size();
    const std::uint64_t payload_at = at_ + kBlockHeaderSize;
    if (size > file_.size() - payload_at) {
        throw_damaged("a block is cut short");
    }
    payload_.resize(size);
    if (as_scratch([&] { return file_.read_some(payload_at, payload_); }) < size || reserved != 0 ||
        block_checksum(count, payload_) != checksum) {
        throw_damaged("a block does not match its checksum");
    }
    positions.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
        positions[i] = codec_.unpack(payload_.data() + i * codec_.size());
    }
    at_ = payload_at + size;
    return count > 0;
}

void PositionReader::throw_damaged(const char* what) const {
    throw StorageError(fmt::format("{}: scratch file is damaged at byte {}: {}",
                                   file_.path().string(), at_, what));
}

}  // namespace knap
