#include "output/laz_encoder.hpp"

#include <fmt/format.h>

#include "knap/error.hpp"

#ifdef KNAP_HAVE_LASZIP
#include <laszip/laszip_api.h>

#include <array>
#include <cstring>
#include <ostream>
#include <string>

#include "output/file_buffer.hpp"
#endif

namespace knap {

#ifdef KNAP_HAVE_LASZIP

namespace {

template <typename T>
T load(const std::byte* from) {
    T value;
    std::memcpy(&value, from, sizeof value);
    return value;
}

unsigned bits(std::byte from, unsigned shift, unsigned width) {
    return (std::to_integer<unsigned>(from) >> shift) & ((1U << width) - 1);
}

void set_legacy(laszip_point_struct& point, const std::byte* record, int format) {
    point.return_number = bits(record[14], 0, 3) & 7U;
    point.number_of_returns = bits(record[14], 3, 3) & 7U;
    point.scan_direction_flag = bits(record[14], 6, 1) & 1U;
    point.edge_of_flight_line = bits(record[14], 7, 1) & 1U;
    point.classification = bits(record[15], 0, 5) & 31U;
    point.synthetic_flag = bits(record[15], 5, 1) & 1U;
    point.keypoint_flag = bits(record[15], 6, 1) & 1U;
    point.withheld_flag = bits(record[15], 7, 1) & 1U;
    point.scan_angle_rank = load<std::int8_t>(record + 16);
    point.user_data = load<std::uint8_t>(record + 17);
    point.point_source_ID = load<std::uint16_t>(record + 18);
    std::size_t at = 20;
    if (format == 1 || format == 3) {
        point.gps_time = load<double>(record + at);
        at += sizeof(double);
    }
    if (format >= 2) {
        std::memcpy(&point.rgb[0], record + at, 3 * sizeof(std::uint16_t));
    }
}

void set_extended(laszip_point_struct& point, const std::byte* record, int format) {
    point.extended_point_type = 1;
    point.extended_return_number = bits(record[14], 0, 4) & 15U;
    point.extended_number_of_returns = bits(record[14], 4, 4) & 15U;
    point.extended_classification_flags = bits(record[15], 0, 4) & 15U;
    // LASzip wants the flags twice.
    point.synthetic_flag = bits(record[15], 0, 1) & 1U;
    point.keypoint_flag = bits(record[15], 1, 1) & 1U;
    point.withheld_flag = bits(record[15], 2, 1) & 1U;
    point.extended_scanner_channel = bits(record[15], 4, 2) & 3U;
    point.scan_direction_flag = bits(record[15], 6, 1) & 1U;
    point.edge_of_flight_line = bits(record[15], 7, 1) & 1U;
    point.extended_classification = load<std::uint8_t>(record + 16);
    point.user_data = load<std::uint8_t>(record + 17);
    point.extended_scan_angle = load<std::int16_t>(record + 18);
    point.point_source_ID = load<std::uint16_t>(record + 20);
    point.gps_time = load<double>(record + 22);
    if (format >= 7) {
        std::memcpy(&point.rgb[0], record + 30, (format == 8 ? 4 : 3) * sizeof(std::uint16_t));
    }
}

std::size_t plain_length(int format) {
    constexpr std::array<std::size_t, 9> kLengths{20, 28, 26, 34, 0, 0, 30, 36, 38};
    return kLengths.at(static_cast<std::size_t>(format));
}

}  // namespace

struct LazEncoder::State {
    State(AtomicFile& file, std::filesystem::path of, int point_format, std::uint16_t length)
        : path(std::move(of)),
          format(point_format),
          plain(plain_length(point_format)),
          buffer(file),
          stream(&buffer) {
        if (laszip_create(&writer) != 0) {
            throw StorageError(fmt::format("{}: cannot start LASzip", path.string()));
        }
        laszip_header_struct* header = nullptr;
        check(laszip_get_header_pointer(writer, &header));
        header->version_major = 1;
        header->version_minor = format >= 6 ? 4 : 2;
        header->header_size = format >= 6 ? 375 : 227;
        header->offset_to_point_data = header->header_size;
        header->point_data_format = static_cast<laszip_U8>(format);
        header->point_data_record_length = length;
        header->x_scale_factor = header->y_scale_factor = header->z_scale_factor = 1;
        check(laszip_set_point_type_and_size(writer, static_cast<laszip_U8>(format), length));
        check(laszip_request_native_extension(writer, 1));
        check(laszip_get_point_pointer(writer, &point));
    }
    ~State() { laszip_destroy(writer); }
    State(const State&) = delete;
    State& operator=(const State&) = delete;

    void check(laszip_I32 result) const {
        buffer.rethrow_error();
        if (result != 0) {
            laszip_CHAR* text = nullptr;
            const bool known = laszip_get_error(writer, &text) == 0 && text != nullptr;
            throw StorageError(fmt::format("{}: LASzip cannot write: {}", path.string(),
                                           known ? text : "unknown reason"));
        }
    }

    std::filesystem::path path;
    int format;
    std::size_t plain;
    FileBuffer buffer;
    std::ostream stream;
    laszip_POINTER writer = nullptr;
    laszip_point_struct* point = nullptr;
};

LazEncoder::LazEncoder(AtomicFile& file, const std::filesystem::path& path, int point_format,
                       std::uint16_t record_length)
    : state_(std::make_unique<State>(file, path, point_format, record_length)) {}

LazEncoder::~LazEncoder() = default;

std::vector<std::byte> LazEncoder::record() const {
    laszip_U8* content = nullptr;
    laszip_U32 size = 0;
    state_->check(laszip_create_laszip_vlr(state_->writer, &content, &size));
    // With its head, as it stands in a file.
    constexpr std::size_t kHead = 54;
    const auto bytes = std::as_bytes(std::span(content, size)).subspan(kHead);
    return {bytes.begin(), bytes.end()};
}

void LazEncoder::begin() {
    state_->buffer.start();
    state_->check(laszip_open_writer_stream(state_->writer, state_->stream, 1, 1));
}

void LazEncoder::append(std::span<const std::byte> record) {
    laszip_point_struct& point = *state_->point;
    point.X = load<std::int32_t>(record.data());
    point.Y = load<std::int32_t>(record.data() + 4);
    point.Z = load<std::int32_t>(record.data() + 8);
    point.intensity = load<std::uint16_t>(record.data() + 12);
    if (state_->format >= 6) {
        set_extended(point, record.data(), state_->format);
    } else {
        set_legacy(point, record.data(), state_->format);
    }
    const std::span<const std::byte> extra = record.subspan(state_->plain);
    if (!extra.empty()) {
        std::memcpy(point.extra_bytes, extra.data(), extra.size());
    }
    state_->check(laszip_write_point(state_->writer));
}

void LazEncoder::end() {
    state_->check(laszip_close_writer(state_->writer));
    state_->buffer.pubsync();
    state_->check(0);
}

#else

struct LazEncoder::State {};

LazEncoder::LazEncoder(AtomicFile&, const std::filesystem::path& path, int, std::uint16_t) {
    throw ConfigError(fmt::format("{}: cannot write LAZ without LASzip", path.string()));
}

LazEncoder::~LazEncoder() = default;

std::vector<std::byte> LazEncoder::record() const {
    return {};
}

void LazEncoder::begin() {}

void LazEncoder::append(std::span<const std::byte>) {}

void LazEncoder::end() {}

#endif

}  // namespace knap
