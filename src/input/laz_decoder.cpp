#include "input/laz_decoder.hpp"

#include <fmt/format.h>

#include "knap/error.hpp"

#ifdef KNAP_HAVE_LASZIP
#include <laszip/laszip_api.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <initializer_list>
#include <istream>
#include <utility>

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

/// What LASzip calls the layers.
laszip_U32 selection_of(const LasLayers& layers) {
    constexpr std::array<std::pair<LasLayer, laszip_U32>, 10> kNames{
        {{LasLayer::kIntensity, laszip_DECOMPRESS_SELECTIVE_INTENSITY},
         {LasLayer::kClassification, laszip_DECOMPRESS_SELECTIVE_CLASSIFICATION},
         {LasLayer::kFlags, laszip_DECOMPRESS_SELECTIVE_FLAGS},
         {LasLayer::kScanAngle, laszip_DECOMPRESS_SELECTIVE_SCAN_ANGLE},
         {LasLayer::kUserData, laszip_DECOMPRESS_SELECTIVE_USER_DATA},
         {LasLayer::kPointSource, laszip_DECOMPRESS_SELECTIVE_POINT_SOURCE},
         {LasLayer::kGpsTime, laszip_DECOMPRESS_SELECTIVE_GPS_TIME},
         {LasLayer::kColour, laszip_DECOMPRESS_SELECTIVE_RGB},
         {LasLayer::kInfrared, laszip_DECOMPRESS_SELECTIVE_NIR},
         {LasLayer::kExtraBytes, laszip_DECOMPRESS_SELECTIVE_EXTRA_BYTES}}};
    laszip_U32 selection =
        laszip_DECOMPRESS_SELECTIVE_CHANNEL_RETURNS_XY | laszip_DECOMPRESS_SELECTIVE_Z;
    for (const auto& [layer, name] : kNames) {
        selection |= layers.test(static_cast<std::size_t>(layer)) ? name : 0;
    }
    return selection;
}

std::uint8_t packed(std::initializer_list<std::pair<unsigned, int>> fields) {
    unsigned byte = 0;
    int shift = 0;
    for (const auto& [value, bits] : fields) {
        byte |= value << static_cast<unsigned>(shift);
        shift += bits;
    }
    return static_cast<std::uint8_t>(byte);
}

/// Writes a point as a LAS file of its format has it.
class RecordWriter {
  public:
    explicit RecordWriter(const LasHeader& header)
        : format_(header.point_format),
          length_(header.record_length),
          base_(las_record_length(header.point_format)) {}

    std::size_t length() const { return length_; }

    void write(const laszip_point_struct& point, std::byte* to) const {
        store_little(to, point.X);
        store_little(to + 4, point.Y);
        store_little(to + 8, point.Z);
        store_little(to + 12, point.intensity);
        format_ <= 5 ? write_legacy(point, to) : write_new(point, to);
        if (length_ > base_) {
            std::memcpy(to + base_, point.extra_bytes, length_ - base_);
        }
    }

  private:
    void write_legacy(const laszip_point_struct& point, std::byte* to) const {
        store_little(to + 14, packed({{point.return_number, 3},
                                      {point.number_of_returns, 3},
                                      {point.scan_direction_flag, 1},
                                      {point.edge_of_flight_line, 1}}));
        store_little(to + 15, packed({{point.classification, 5},
                                      {point.synthetic_flag, 1},
                                      {point.keypoint_flag, 1},
                                      {point.withheld_flag, 1}}));
        store_little(to + 16, point.scan_angle_rank);
        store_little(to + 17, point.user_data);
        store_little(to + 18, point.point_source_ID);
        std::byte* next = to + 20;
        if (format_ != 0 && format_ != 2) {
            store_little(next, point.gps_time);
            next += sizeof point.gps_time;
        }
        if (format_ == 2 || format_ == 3 || format_ == 5) {
            next = write_channels(point, 3, next);
        }
        std::fill(next, to + base_, std::byte{0});
    }

    void write_new(const laszip_point_struct& point, std::byte* to) const {
        store_little(to + 14, packed({{point.extended_return_number, 4},
                                      {point.extended_number_of_returns, 4}}));
        store_little(to + 15, packed({{point.extended_classification_flags, 4},
                                      {point.extended_scanner_channel, 2},
                                      {point.scan_direction_flag, 1},
                                      {point.edge_of_flight_line, 1}}));
        store_little(to + 16, point.extended_classification);
        store_little(to + 17, point.user_data);
        store_little(to + 18, point.extended_scan_angle);
        store_little(to + 20, point.point_source_ID);
        store_little(to + 22, point.gps_time);
        std::byte* next = to + 30;
        if (format_ == 7 || format_ == 8 || format_ == 10) {
            next = write_channels(point, format_ == 7 ? 3 : 4, next);
        }
        std::fill(next, to + base_, std::byte{0});
    }

    static std::byte* write_channels(const laszip_point_struct& point, int channels,
                                     std::byte* to) {
        for (int i = 0; i < channels; ++i, to += sizeof(laszip_U16)) {
            store_little(to, point.rgb[i]);
        }
        return to;
    }

    int format_;
    std::size_t length_;
    std::size_t base_;  // bytes before extra ones
};

}  // namespace

struct LazChunkDecoder::State {
    State(const InputFile& input, const LasHeader& header, const LazLayout& layout,
          const LazChunk& of, const LasLayers& layers)
        : file(input),
          chunk(of),
          left(of.points),
          selection(selection_of(layers)),
          writer(header),
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
        if (laszip_decompress_selective(reader, selection) != 0 ||
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

    /// Reads the next points and says so after each.
    template <typename Take>
    void read(std::size_t points, Take&& take) {
        for (std::size_t i = 0; i < points; ++i) {
            if (laszip_read_point(reader) != 0) {
                fail(message());
            }
            take(i);
            --left;
        }
        // A coder that is still in step ends exactly where its chunk does.
        if (left == 0 && buffer.remaining() > 0) {
            fail(fmt::format("{} bytes are left over", buffer.remaining()));
        }
    }

    LasIndex index() const { return {point->X, point->Y, point->Z}; }

    const InputFile& file;
    LazChunk chunk;
    std::uint64_t left;
    laszip_U32 selection;
    RecordWriter writer;
    LazStreamBuffer buffer;
    std::istream stream;
    laszip_POINTER reader = nullptr;
    laszip_point_struct* point = nullptr;
};

bool has_laszip() {
    return true;
}

LazChunkDecoder::LazChunkDecoder(const InputFile& file, const LasHeader& header,
                                 const LazLayout& layout, const LazChunk& chunk,
                                 const LasLayers& layers)
    : state_(std::make_unique<State>(file, header, layout, chunk, layers)) {}

LazChunkDecoder::~LazChunkDecoder() = default;

const LazChunk& LazChunkDecoder::chunk() const {
    return state_->chunk;
}

std::uint64_t LazChunkDecoder::remaining() const {
    return state_->left;
}

void LazChunkDecoder::read(std::span<LasIndex> points) {
    state_->read(points.size(), [&](std::size_t i) { points[i] = state_->index(); });
}

void LazChunkDecoder::read(std::span<LasIndex> points, std::span<std::byte> records) {
    const RecordWriter& writer = state_->writer;
    state_->read(points.size(), [&](std::size_t i) {
        points[i] = state_->index();
        writer.write(*state_->point, records.data() + i * writer.length());
    });
}

#else

struct LazChunkDecoder::State {
    LazChunk chunk;
};

bool has_laszip() {
    return false;
}

LazChunkDecoder::LazChunkDecoder(const InputFile& file, const LasHeader&, const LazLayout&,
                                 const LazChunk&, const LasLayers&) {
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

void LazChunkDecoder::read(std::span<LasIndex>, std::span<std::byte>) {}

#endif

}  // namespace knap
