#include "store/column_file.hpp"

#include <blosc.h>
#include <fmt/format.h>

#include <cstring>
#include <utility>

#include "base/bytes.hpp"
#include "base/checksum.hpp"
#include "knap/error.hpp"
#include "store/as_scratch.hpp"

namespace knap {

namespace {

constexpr std::string_view kMagic = "KNAPCOLS";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kBlockHeaderSize = 16;
// Bytes of a value are put apart, then matched: a column costs what changes in it. Higher levels
// make files hardly smaller.
constexpr const char* kCompressor = "lz4";
constexpr int kLevel = 3;

std::vector<std::byte> header_of(std::span<const std::size_t> value_sizes) {
    std::vector<std::byte> header;
    for (const char letter : kMagic) {
        put(header, letter);
    }
    put(header, kVersion);
    put(header, static_cast<std::uint32_t>(value_sizes.size()));
    for (const std::size_t size : value_sizes) {
        put(header, static_cast<std::uint32_t>(size));
    }
    return header;
}

/// Appends the values in packed form.
void pack(std::span<const std::byte> values, std::size_t value_size, std::vector<std::byte>& out) {
    const std::size_t at = out.size();
    out.resize(at + values.size() + BLOSC_MAX_OVERHEAD);
    const int packed =
        blosc_compress_ctx(kLevel, BLOSC_SHUFFLE, value_size, values.size(), values.data(),
                           out.data() + at, out.size() - at, kCompressor, 0, 1);
    if (packed <= 0) {
        throw StorageError(fmt::format("cannot pack {} bytes of attributes", values.size()));
    }
    out.resize(at + static_cast<std::size_t>(packed));
}

/// Sizes in the head of a buffer; no if the bytes are none.
struct Buffer {
    std::size_t values = 0;  ///< bytes unpacked
    std::size_t packed = 0;  ///< bytes with the head

    explicit Buffer(std::span<const std::byte> bytes) {
        if (bytes.size() >= BLOSC_MIN_HEADER_LENGTH) {
            std::size_t block = 0;
            blosc_cbuffer_sizes(bytes.data(), &values, &packed, &block);
        }
    }
};

}  // namespace

ColumnWriter::ColumnWriter(const std::filesystem::path& path, std::vector<std::size_t> value_sizes)
    : file_(path, AtomicFile::Durability::kProcess), value_sizes_(std::move(value_sizes)) {
    file_.write(header_of(value_sizes_));
}

void ColumnWriter::add(std::span<const std::vector<std::byte>> columns, std::size_t first,
                       std::size_t count) {
    payload_.clear();
    for (std::size_t i = 0; i < value_sizes_.size(); ++i) {
        const std::size_t size = value_sizes_[i];
        pack(std::span(columns[i]).subspan(first * size, count * size), size, payload_);
    }
    write_block(static_cast<std::uint32_t>(count));
}

void ColumnWriter::write_block(std::uint32_t count) {
    std::vector<std::byte> header;
    put(header, count);
    put(header, static_cast<std::uint32_t>(payload_.size()));
    put(header, block_checksum(count, payload_));
    file_.write(header);
    file_.write(payload_);
}

std::uint64_t ColumnWriter::finish() {
    payload_.clear();
    write_block(0);
    file_.commit();
    return file_.size();
}

ColumnReader::ColumnReader(const std::filesystem::path& path, std::vector<std::size_t> value_sizes)
    : file_(as_scratch([&] { return InputFile(path); })), value_sizes_(std::move(value_sizes)) {
    const std::vector<std::byte> expected = header_of(value_sizes_);
    std::vector<std::byte> header(expected.size());
    if (as_scratch([&] { return file_.read_some(0, header); }) < header.size() ||
        header != expected) {
        throw_damaged("expected the header of a column file of these attributes");
    }
    at_ = header.size();
}

std::size_t ColumnReader::next(std::span<const std::size_t> wanted,
                               std::vector<std::vector<std::byte>>& columns) {
    std::vector<std::byte> header(kBlockHeaderSize);
    if (as_scratch([&] { return file_.read_some(at_, header); }) < header.size()) {
        throw_damaged("the file is cut short");
    }
    ByteReader fields(header);
    const auto count = fields.get<std::uint32_t>();
    const auto size = fields.get<std::uint32_t>();
    const auto checksum = fields.get<std::uint64_t>();
    const std::uint64_t payload_at = at_ + kBlockHeaderSize;
    if (size > file_.size() - payload_at) {
        throw_damaged("a block is cut short");
    }
    payload_.resize(size);
    if (as_scratch([&] { return file_.read_some(payload_at, payload_); }) < size ||
        block_checksum(count, payload_) != checksum) {
        throw_damaged("a block does not match its checksum");
    }
    std::vector<std::span<const std::byte>> buffers;
    std::span<const std::byte> rest = payload_;
    for (std::size_t i = 0; count > 0 && i < value_sizes_.size(); ++i) {
        const Buffer buffer(rest);
        if (buffer.values != count * value_sizes_[i] || buffer.packed > rest.size()) {
            throw_damaged("a block does not hold its columns");
        }
        buffers.push_back(rest.first(buffer.packed));
        rest = rest.subspan(buffer.packed);
    }
    columns.resize(wanted.size());
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        columns[i].resize(count * value_sizes_[wanted[i]]);
        if (count > 0 &&
            blosc_decompress_ctx(buffers[wanted[i]].data(), columns[i].data(), columns[i].size(),
                                 1) != static_cast<int>(columns[i].size())) {
            throw_damaged("a column cannot be unpacked");
        }
    }
    at_ = payload_at + size;
    return count;
}

void ColumnReader::throw_damaged(const char* what) const {
    throw StorageError(fmt::format("{}: scratch file is damaged at byte {}: {}",
                                   file_.path().string(), at_, what));
}

}  // namespace knap
