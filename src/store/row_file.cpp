#include "store/row_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "base/bytes.hpp"
#include "base/checksum.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::string_view kMagic = "KNAPROWS";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderSize = 16;
constexpr std::size_t kBlockHeaderSize = 16;
constexpr std::size_t kBlockBytes = std::size_t{1} << 18;

std::size_t rows_in_block(std::size_t row_size) {
    return std::max<std::size_t>(kBlockBytes / row_size, 1);
}

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

RowWriter::RowWriter(const std::filesystem::path& path, std::size_t row_size)
    : file_(path, AtomicFile::Durability::kProcess), row_size_(row_size) {
    file_.write(kMagic);
    std::vector<std::byte> header;
    put(header, kVersion);
    put(header, static_cast<std::uint32_t>(row_size));
    file_.write(header);
}

void RowWriter::add(std::span<const std::byte> row) {
    rows_.insert(rows_.end(), row.begin(), row.end());
    if (rows_.size() == rows_in_block(row_size_) * row_size_) {
        write_block();
    }
}

std::uint64_t RowWriter::finish() {
    if (!rows_.empty()) {
        write_block();
    }
    write_block();
    file_.commit();
    return file_.size();
}

void RowWriter::write_block() {
    std::vector<std::byte> header;
    const auto count = static_cast<std::uint32_t>(rows_.size() / row_size_);
    put(header, count);
    put(header, std::uint32_t{0});
    put(header, block_checksum(count, rows_));
    file_.write(header);
    file_.write(rows_);
    rows_.clear();
}

RowReader::RowReader(const std::filesystem::path& path, std::size_t row_size)
    : file_(as_scratch([&] { return InputFile(path); })), row_size_(row_size) {
    std::vector<std::byte> header(kHeaderSize);
    const std::size_t got = as_scratch([&] { return file_.read_some(0, header); });
    ByteReader fields{std::span(header).first(got)};
    const std::byte* magic = fields.take(kMagic.size());
    if (magic == nullptr || std::memcmp(magic, kMagic.data(), kMagic.size()) != 0 ||
        fields.get<std::uint32_t>() != kVersion || fields.get<std::uint32_t>() != row_size) {
        throw_damaged("expected the header of a row file");
    }
    at_ = kHeaderSize;
}

std::span<const std::byte> RowReader::next() {
    if (next_ == rows_.size()) {
        read_block();
    }
    const std::span<const std::byte> row = std::span(rows_).subspan(next_, row_size_);
    next_ += row_size_;
    return row;
}

void RowReader::read_block() {
    std::vector<std::byte> header(kBlockHeaderSize);
    if (as_scratch([&] { return file_.read_some(at_, header); }) < kBlockHeaderSize) {
        throw_damaged("the file is cut short");
    }
    ByteReader fields(header);
    const auto count = fields.get<std::uint32_t>();
    const auto reserved = fields.get<std::uint32_t>();
    const auto checksum = fields.get<std::uint64_t>();
    const std::uint64_t size = std::uint64_t{count} * row_size_;
    const std::uint64_t payload_at = at_ + kBlockHeaderSize;
    if (count == 0 || size > file_.size() - payload_at) {
        throw_damaged("a block is cut short");
    }
    rows_.resize(size);
    if (as_scratch([&] { return file_.read_some(payload_at, rows_); }) < size || reserved != 0 ||
        block_checksum(count, rows_) != checksum) {
        throw_damaged("a block does not match its checksum");
    }
    next_ = 0;
    at_ = payload_at + size;
}

void RowReader::throw_damaged(const char* what) const {
    throw StorageError(fmt::format("{}: scratch file is damaged at byte {}: {}",
                                   file_.path().string(), at_, what));
}

}  // namespace knap
