#include "input/laz_decoder.hpp"

#include <fmt/format.h>

#include "knap/error.hpp"

#ifdef KNAP_HAVE_LASZIP
#include <laszip/laszip_api.h>

#include <cstring>
#include <istream>

#include "input/bytes.hpp"
#include "input/laz_stream.hpp"
#endif

namespace knap {

#ifdef KNAP_HAVE_LASZIP

namespace {

// The head that LASzip is shown: a LAS 1.4 header with the fields that decoding needs, and the
// LASzip record. What the file itself has there was read and checked by us.
constexpr std::size_t kHeaderSize = 375;
constexpr std::size_t kRecordHead = 54;
constexpr std::size_t kChunkSizeField = 12;

std::vector<std::byte> make_head(const LasHeader& header, const LazLayout& layout,
                                 const LazChunk& chunk) {
    const bool chunked = layout.compressor != LazLayout::kUnchunked;
    const std::size_t points_offset = kHeaderSize + kRecordHead + layout.record.size();
    std::vector<std::byte> head(points_offset + (chunked ? 8 : 0));
    std::byte* to = head.data();
    std::memcpy(to, "LASF", 4);
    store_little<std::uint8_t>(to + 24, 1);
    store_little<std::uint8_t>(to + 25, 4);
    store_little<std::uint16_t>(to + 94, kHeaderSize);
    store_little<std::uint32_t>(to + 96, static_cast<std::uint32_t>(points_offset));
    store_little<std::uint32_t>(to + 100, 1);  // variable-length records
    store_little<std::uint8_t>(to + 104, static_cast<std::uint8_t>(header.point_format | 0x80));
    store_little<std::uint16_t>(to + 105, header.record_length);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        store_little<double>(to + 131 + 8 * axis, 1.0);  // scale: unused, but must not be 0
    }
    store_little<std::uint64_t>(to + 247, chunk.points);
    std::byte* record = to + kHeaderSize;
    std::memcpy(record + 2, "laszip encoded", 14);
    store_little<std::uint16_t>(record + 18, 22204);
    store_little<std::uint16_t>(record + 20, static_cast<std::uint16_t>(layout.record.size()));
    std::memcpy(record + kRecordHead, layout.record.data(), layout.record.size());
    if (chunked) {
        // One chunk of just this size, and a table place that means there is no table.
        store_little<std::uint32_t>(record + kRecordHead + kChunkSizeField,
                                    static_cast<std::uint32_t>(chunk.points));
        store_little<std::uint64_t>(to + points_offset, points_offset);
    }
    return head;
}

}  // namespace

struct LazChunkDecoder::State {
    State(const InputFile& input, const LasHeader& header, const LazLayout& layout,
          const LazChunk& of)
        : file(input),
          chunk(of),
          left(of.points),
          buffer(make_head(header, layout, of), input, of.begin, of.end),
          stream(&buffer) {
        open();
    }
    ~State() { close(); }
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    void open() {
        laszip_BOOL compressed = 0;
        if (laszip_create(&reader) != 0) {
            throw InputError(fmt::format("{}: cannot start LASzip", file.path().string()));
        }
        // Of layered points only the coordinates are decoded.
        if (laszip_decompress_selective(reader, laszip_DECOMPRESS_SELECTIVE_CHANNEL_RETURNS_XY |
                                                    laszip_DECOMPRESS_SELECTIVE_Z) != 0 ||
            laszip_open_reader_stream(reader, stream, &compressed) != 0 ||
            laszip_get_point_pointer(reader, &point) != 0) {
            const std::string reason = message();
            close();
            fail(reason);
        }
    }

    void close() {
        if (reader != nullptr) {
            laszip_close_reader(reader);
            laszip_destroy(reader);
            reader = nullptr;
        }
    }

    std::string message() const {
        laszip_CHAR* text = nullptr;
        const bool known = laszip_get_error(reader, &text) == 0 && text != nullptr;
        return known ? text : "unknown reason";
    }

    [[noreturn]] void fail(const std::string& reason) const {
        buffer.rethrow_error();
        throw InputError(
            fmt::format("{}: LAZ: expected {} points in the chunk at bytes {} to {}, found it "
                        "corrupt after {} ({})",
                        file.path().string(), chunk.points, chunk.begin, chunk.end,
                        chunk.points - left, reason));
    }

    const InputFile& file;
    LazChunk chunk;
    std::uint64_t left;
    LazStreamBuffer buffer;
    std::istream stream;
    laszip_POINTER reader = nullptr;
    laszip_point_struct* point = nullptr;
};

bool has_laszip() {
    return true;
}

LazChunkDecoder::LazChunkDecoder(const InputFile& file, const LasHeader& header,
                                 const LazLayout& layout, const LazChunk& chunk)
    : state_(std::make_unique<State>(file, header, layout, chunk)) {}

LazChunkDecoder::~LazChunkDecoder() = default;

const LazChunk& LazChunkDecoder::chunk() const {
    return state_->chunk;
}

std::uint64_t LazChunkDecoder::remaining() const {
    return state_->left;
}

void LazChunkDecoder::read(std::span<LasIndex> points) {
    State& state = *state_;
    for (LasIndex& index : points) {
        if (laszip_read_point(state.reader) != 0) {
            state.fail(state.message());
        }
        index = {state.point->X, state.point->Y, state.point->Z};
        --state.left;
    }
    // A coder that is still in step ends exactly where its chunk does.
    if (state.left == 0 && state.buffer.remaining() > 0) {
        state.fail(fmt::format("{} bytes are left over", state.buffer.remaining()));
    }
}

#else

struct LazChunkDecoder::State {
    LazChunk chunk;
};

bool has_laszip() {
    return false;
}

LazChunkDecoder::LazChunkDecoder(const InputFile& file, const LasHeader&, const LazLayout&,
                                 const LazChunk&) {
    throw InputError(fmt::format("{}: cannot decode LAZ without LASzip", file.path().string()));
}

LazChunkDecoder::~LazChunkDecoder() = default;

const LazChunk& LazChunkDecoder::chunk() const {
    return state_->chunk;
}

std::uint64_t LazChunkDecoder::remaining() const {
    return 0;
}

void LazChunkDecoder::read(std::span<LasIndex>) {}

#endif

}  // namespace knap
