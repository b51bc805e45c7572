#include "store/item_file.hpp"

#include <fmt/format.h>

#include <cstring>

#include "base/bytes.hpp"
#include "base/checksum.hpp"
#include "knap/error.hpp"
#include "store/as_scratch.hpp"

namespace knap {

namespace {

constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderSize = 16;
constexpr std::size_t kBlockHeaderSize = 16;

}  // namespace

ItemWriter::ItemWriter(const std::filesystem::path& path, const ItemFormat& format)
    : file_(path, AtomicFile::Durability::kProcess), item_size_(format.item_size) {
    file_.write(format.magic);
    std::vector<std::byte> header;
    put(header, kVersion);
    put(header, static_cast<std::uint32_t>(item_size_));
    file_.write(header);
}

void ItemWriter::write_block(std::span<const std::byte> items) {
    std::vector<std::byte> header;
    const auto count = static_cast<std::uint32_t>(items.size() / item_size_);
    put(header, count);
    put(header, std::uint32_t{0});
    put(header, block_checksum(count, items));
    file_.write(header);
    file_.write(items);
}

std::uint64_t ItemWriter::finish() {
    write_block({});
    file_.commit();
    return file_.size();
}

ItemReader::ItemReader(const std::filesystem::path& path, const ItemFormat& format)
    : file_(as_scratch([&] { return InputFile(path); })), item_size_(format.item_size) {
    std::vector<std::byte> header(kHeaderSize);
    const std::size_t got = as_scratch([&] { return file_.read_some(0, header); });
    ByteReader fields{std::span(header).first(got)};
    const std::byte* magic = fields.take(format.magic.size());
    if (magic == nullptr || std::memcmp(magic, format.magic.data(), format.magic.size()) != 0 ||
        fields.get<std::uint32_t>() != kVersion || fields.get<std::uint32_t>() != item_size_) {
        throw_damaged(fmt::format("expected the header of a {}", format.name));
    }
    at_ = kHeaderSize;
}

std::span<const std::byte> ItemReader::next() {
    std::vector<std::byte> header(kBlockHeaderSize);
    if (as_scratch([&] { return file_.read_some(at_, header); }) < kBlockHeaderSize) {
        throw_damaged("the file is cut short");
    }
    ByteReader fields(header);
    const auto count = fields.get<std::uint32_t>();
    const auto reserved = fields.get<std::uint32_t>();
    const auto checksum = fields.get<std::uint64_t>();
    const std::uint64_t size = std::uint64_t{count} * item_size_;
    const std::uint64_t payload_at = at_ + kBlockHeaderSize;
    if (size > file_.size() - payload_at) {
        throw_damaged("a block is cut short");
    }
    items_.resize(size);
    if (as_scratch([&] { return file_.read_some(payload_at, items_); }) < size || reserved != 0 ||
        block_checksum(count, items_) != checksum) {
        throw_damaged("a block does not match its checksum");
    }
    at_ = payload_at + size;
    return items_;
}

void ItemReader::throw_damaged(std::string_view what) const {
    throw StorageError(fmt::format("{}: scratch file is damaged at byte {}: {}",
                                   file_.path().string(), at_, what));
}

}  // namespace knap
