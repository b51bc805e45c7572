#include "store/brick_file.hpp"

#include <fmt/format.h>

#include <cstring>
#include <string_view>
#include <system_error>

#include "base/bytes.hpp"
#include "base/checksum.hpp"
#include "base/file.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

using TakePoint = std::function<void(PointId, const Vec3&, BrickPart)>;

constexpr std::string_view kMagic = "KNAPBRCK";
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderSize = 16;
constexpr std::size_t kBlockHeaderSize = 32;
constexpr std::size_t kChecksumAt = 24;

struct BlockHeader {
    std::uint32_t part = 0;
    std::uint32_t source = 0;
    std::uint32_t count = 0;
    std::uint32_t payload_size = 0;
    PointId first_id = 0;
    std::uint64_t checksum = 0;
};

// Of the header without its last field, followed by the payload.
std::uint64_t checksum_of(std::span<const std::byte> block, std::vector<std::byte>& work) {
    work.assign(block.begin(), block.begin() + kChecksumAt);
    work.insert(work.end(), block.begin() + kBlockHeaderSize, block.end());
    return xxh3_64(work);
}

[[noreturn]] void throw_damaged(const std::filesystem::path& path, std::uint64_t at,
                                const char* what) {
    throw StorageError(
        fmt::format("{}: scratch file is damaged at byte {}: {}", path.string(), at, what));
}

class Reader {
  public:
    Reader(const std::filesystem::path& path, const SourceTable& table)
        : file_(path), path_(path), table_(table) {
        std::vector<std::byte> header(kHeaderSize);
        const std::size_t got = file_.read_some(0, header);
        ByteReader fields{std::span(header).first(got)};
        const std::byte* magic = fields.take(kMagic.size());
        if (magic == nullptr || std::memcmp(magic, kMagic.data(), kMagic.size()) != 0 ||
            fields.get<std::uint32_t>() != kVersion ||
            fields.get<std::uint32_t>() != table.packed_size()) {
            throw_damaged(path_, 0, "expected the header of a brick file");
        }
        at_ = kHeaderSize;
    }

    /// False at the end of the file.
    bool next(BlockHeader& header) {
        if (at_ == file_.size()) {
            return false;
        }
        block_.resize(kBlockHeaderSize);
        if (file_.read_some(at_, block_) < kBlockHeaderSize) {
            throw_damaged(path_, at_, "a block header is cut short");
        }
        ByteReader fields(block_);
        header = {fields.get<std::uint32_t>(), fields.get<std::uint32_t>(),
                  fields.get<std::uint32_t>(), fields.get<std::uint32_t>(),
                  fields.get<PointId>(),       fields.get<std::uint64_t>()};
        if (header.payload_size > file_.size() - at_ - kBlockHeaderSize) {
            throw_damaged(path_, at_, "a block is cut short");
        }
        // Before the checksum is looked at: these two decide what is read, and how much memory for.
        const bool known = header.part == static_cast<std::uint32_t>(BrickPart::kCore) ||
                           header.part == static_cast<std::uint32_t>(BrickPart::kHalo);
        if (!known || header.count > header.payload_size / table_.packed_size()) {
            throw_damaged(path_, at_, "a block header holds values that cannot be");
        }
        return true;
    }

    void skip(const BlockHeader& header) { at_ += kBlockHeaderSize + header.payload_size; }

    void read(const BlockHeader& header, const TakePoint& take) {
        block_.resize(kBlockHeaderSize + header.payload_size);
        if (file_.read_some(at_, block_) < block_.size() ||
            checksum_of(block_, checked_) != header.checksum) {
            throw_damaged(path_, at_, "a block does not match its checksum");
        }
        ByteReader payload{std::span(block_).subspan(kBlockHeaderSize)};
        const std::size_t packed = table_.packed_size();
        const std::byte* positions = payload.take(packed * header.count);
        PointId id = header.first_id;
        for (std::size_t i = 0; i < header.count; ++i) {
            if (i > 0) {
                id += payload.get_varint();
            }
            if (!payload.ok()) {
                throw_damaged(path_, at_, "a block does not hold what its header says");
            }
            take(id, table_.unpack(header.source, positions + i * packed),
                 static_cast<BrickPart>(header.part));
        }
        skip(header);
    }

  private:
    InputFile file_;
    std::filesystem::path path_;
    const SourceTable& table_;
    std::uint64_t at_ = 0;
    std::vector<std::byte> block_;
    std::vector<std::byte> checked_;
};

}  // namespace

void BrickBlock::add(const SourceTable& table, PointId id, const Vec3& position) {
    const std::size_t at = positions.size();
    positions.resize(at + table.packed_size());
    table.pack(source, position, positions.data() + at);
    if (count == 0) {
        first_id = id;
    } else {
        put_varint(id_steps, id - last_id);
    }
    last_id = id;
    ++count;
}

void BrickBlock::clear() {
    count = 0;
    positions.clear();
    id_steps.clear();
}

void create_brick_file(const std::filesystem::path& path, const SourceTable& table) {
    std::vector<std::byte> header;
    for (const char c : kMagic) {
        put(header, c);
    }
    put(header, kVersion);
    put(header, static_cast<std::uint32_t>(table.packed_size()));
    std::error_code error;
    std::filesystem::remove(path, error);
    if (error) {
        throw StorageError(fmt::format("{}: cannot remove: {}", path.string(), error.message()));
    }
    append_to_file(path, header);
}

std::uint64_t append_block(const std::filesystem::path& path, const BrickBlock& block) {
    std::vector<std::byte> bytes;
    bytes.reserve(kBlockHeaderSize + block.size_bytes());
    put(bytes, static_cast<std::uint32_t>(block.part));
    put(bytes, block.source);
    put(bytes, block.count);
    put(bytes, static_cast<std::uint32_t>(block.size_bytes()));
    put(bytes, block.first_id);
    put(bytes, std::uint64_t{0});
    bytes.insert(bytes.end(), block.positions.begin(), block.positions.end());
    bytes.insert(bytes.end(), block.id_steps.begin(), block.id_steps.end());
    std::vector<std::byte> work;
    const std::uint64_t checksum = checksum_of(bytes, work);
    std::memcpy(bytes.data() + kChecksumAt, &checksum, sizeof checksum);
    append_to_file(path, bytes);
    return bytes.size();
}

void stream_brick_file(const std::filesystem::path& path, const SourceTable& table, bool with_halo,
                       const TakePoint& take) {
    try {
        Reader reader(path, table);
        for (BlockHeader header; reader.next(header);) {
            if (with_halo || header.part == static_cast<std::uint32_t>(BrickPart::kCore)) {
                reader.read(header, take);
            } else {
                reader.skip(header);
            }
        }
    } catch (const InputError& error) {
        // A scratch file that cannot be read is the machine's fault, not the input's.
        throw StorageError(error.what());
    }
}

}  // namespace knap
