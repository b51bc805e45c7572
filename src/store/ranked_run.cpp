#include "store/ranked_run.hpp"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <string_view>
#include <utility>

#include "base/bytes.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr std::string_view kMagic = "KNAPRUN1";
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kHeaderSize = 28;
constexpr std::size_t kBlockHeaderSize = 16;

// Bytes that hold every id below `points`.
std::size_t id_size_for(std::uint64_t points) {
    const auto bits = static_cast<int>(std::bit_width(points == 0 ? points : points - 1));
    return static_cast<std::size_t>(std::max(1, (bits + 7) / 8));
}

}  // namespace

RunWriter::RunWriter(const std::filesystem::path& path, const SourceTable& table,
                     const RunLayout& layout)
    : file_(path, AtomicFile::Durability::kProcess),
      table_(table),
      id_size_(id_size_for(table.points())),
      layout_(layout) {
    file_.write(kMagic);
    std::vector<std::byte> header;
    put(header, kVersion);
    put(header, static_cast<std::uint32_t>(table.packed_size()));
    put(header, static_cast<std::uint32_t>(id_size_));
    put(header, static_cast<std::uint32_t>(layout.block_points));
    put(header, static_cast<std::uint32_t>(layout.frames ? PackedFrame::kBytes : 0));
    file_.write(header);
}

void RunWriter::add(const RankedPoint& point) {
    const auto bits = std::bit_cast<std::uint64_t>(point.key);
    if (count_ == 0) {
        put(keys_, bits);
    } else {
        put_varint(keys_, last_bits_ - bits);
    }
    last_bits_ = bits;
    const std::size_t at = positions_.size();
    positions_.resize(at + table_.packed_size());
    table_.pack(table_.source_of(point.id), point.position, positions_.data() + at);
    put_bytes(ids_, point.id, id_size_);
    if (layout_.frames) {
        for (const std::uint8_t byte : point.frame.bytes()) {
            frames_.push_back(std::byte{byte});
        }
    }
    if (++count_ == layout_.block_points) {
        flush();
    }
}

void RunWriter::flush() {
    keys_.insert(keys_.end(), positions_.begin(), positions_.end());
    keys_.insert(keys_.end(), ids_.begin(), ids_.end());
    keys_.insert(keys_.end(), frames_.begin(), frames_.end());
    std::vector<std::byte> header;
    put(header, count_);
    put(header, static_cast<std::uint32_t>(keys_.size()));
    put(header, block_checksum(count_, keys_));
    file_.write(header);
    file_.write(keys_);
    count_ = 0;
    keys_.clear();
    positions_.clear();
    ids_.clear();
    frames_.clear();
}

std::uint64_t RunWriter::finish() {
    if (count_ > 0) {
        flush();
    }
    flush();
    file_.commit();
    return file_.size();
}

std::uint64_t write_run(const std::filesystem::path& path, const SourceTable& table,
                        std::span<const RankedPoint> points, const RunLayout& layout) {
    RunWriter writer(path, table, layout);
    for (const RankedPoint& point : points) {
        writer.add(point);
    }
    return writer.finish();
}

RunReader::RunReader(std::filesystem::path path, const SourceTable& table)
    : path_(std::move(path)), table_(&table) {}

void RunReader::read_header(const InputFile& file) {
    std::vector<std::byte> header(kHeaderSize);
    ByteReader fields{std::span(header).first(file.read_some(0, header))};
    const std::byte* magic = fields.take(kMagic.size());
    const auto version = fields.get<std::uint32_t>();
    const auto packed_size = fields.get<std::uint32_t>();
    id_size_ = fields.get<std::uint32_t>();
    fields.get<std::uint32_t>();  // points of a block
    const auto frame_size = fields.get<std::uint32_t>();
    has_frames_ = frame_size == PackedFrame::kBytes;
    if (magic == nullptr || std::memcmp(magic, kMagic.data(), kMagic.size()) != 0 ||
        version != kVersion || packed_size != table_->packed_size() ||
        id_size_ != id_size_for(table_->points()) || (frame_size != 0 && !has_frames_)) {
        throw_damaged("expected the header of a ranked run");
    }
    at_ = kHeaderSize;
}

bool RunReader::next(std::vector<RankedPoint>& points) {
    points.clear();
    if (ended_) {
        return false;
    }
    try {
        const InputFile file(path_);
        if (at_ == 0) {
            read_header(file);
        }
        std::vector<std::byte> bytes(kBlockHeaderSize);
        if (file.read_some(at_, bytes) < kBlockHeaderSize) {
            throw_damaged("the run is cut short");
        }
        ByteReader fields(bytes);
        const auto count = fields.get<std::uint32_t>();
        const auto payload_size = fields.get<std::uint32_t>();
        const auto checksum = fields.get<std::uint64_t>();
        if (payload_size > file.size() - at_ - kBlockHeaderSize) {
            throw_damaged("the run is cut short");
        }
        std::vector<std::byte> payload(payload_size);
        if (file.read_some(at_ + kBlockHeaderSize, payload) < payload.size() ||
            block_checksum(count, payload) != checksum) {
            throw_damaged("a block does not match its checksum");
        }
        points.resize(count);
        ByteReader reader(payload);
        std::uint64_t bits = 0;
        for (std::size_t i = 0; i < count; ++i) {
            bits = i == 0 ? reader.get<std::uint64_t>() : bits - reader.get_varint();
            points[i].key = std::bit_cast<double>(bits);
        }
        const std::size_t packed = table_->packed_size();
        const std::byte* positions = reader.take(packed * count);
        for (std::size_t i = 0; i < count; ++i) {
            points[i].id = reader.get_bytes(id_size_);
        }
        for (std::size_t i = 0; has_frames_ && i < count; ++i) {
            points[i].frame = PackedFrame(PackedFrame::Bytes{reader.get<std::uint8_t>(),
                                                             reader.get<std::uint8_t>(),
                                                             reader.get<std::uint8_t>()});
        }
        if (!reader.ok() || reader.left() != 0) {
            throw_damaged("a block does not hold what its header says");
        }
        for (std::size_t i = 0; i < count; ++i) {
            points[i].position =
                table_->unpack(table_->source_of(points[i].id), positions + i * packed);
        }
        at_ += kBlockHeaderSize + payload_size;
        ended_ = count == 0;
    } catch (const InputError& error) {
        throw StorageError(error.what());
    }
    return !ended_;
}

void RunReader::throw_damaged(const char* what) const {
    throw StorageError(
        fmt::format("{}: scratch file is damaged at byte {}: {}", path_.string(), at_, what));
}

}  // namespace knap
