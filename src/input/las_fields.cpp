#include "input/las_fields.hpp"

#include <bit>
#include <cstring>
#include <initializer_list>
#include <utility>

#include "input/las_info.hpp"

namespace knap {

namespace {

using enum ScalarType;

// Columns are copied as they are stored.
static_assert(std::endian::native == std::endian::little);

/// Lists the fields of a point one after the other.
class Fields {
  public:
    void whole(const char* name, ScalarType type, LasLayer layer, double scale = 1) {
        Attribute attribute{.name = name, .type = type, .components = 1, .scale = scale};
        const std::size_t bytes = attribute.value_size();
        all_.push_back({std::move(attribute), offset_, 0, 0, layer});
        offset_ += bytes;
    }

    /// A field of `bits` bits of the next byte, from its lowest bit up.
    void bits(const char* name, int bits, LasLayer layer) {
        const auto mask = static_cast<std::uint8_t>((1U << static_cast<unsigned>(bits)) - 1U);
        all_.push_back({{.name = name, .type = kUint8}, offset_, shift_, mask, layer});
        shift_ = (shift_ + bits) % 8;
        offset_ += shift_ == 0 ? 1 : 0;
    }

    std::vector<LasField> take() { return std::move(all_); }

  private:
    std::vector<LasField> all_;
    std::size_t offset_ = 0;
    int shift_ = 0;
};

constexpr bool has(std::initializer_list<int> formats, int format) {
    for (const int candidate : formats) {
        if (candidate == format) {
            return true;
        }
    }
    return false;
}

/// What all points of formats 0 to 5 begin with.
void append_legacy_head(Fields& fields) {
    fields.bits("return_number", 3, LasLayer::kCoordinates);
    fields.bits("number_of_returns", 3, LasLayer::kCoordinates);
    fields.bits("scan_direction", 1, LasLayer::kFlags);
    fields.bits("edge_of_flight_line", 1, LasLayer::kFlags);
    fields.bits("classification", 5, LasLayer::kClassification);
    fields.bits("synthetic", 1, LasLayer::kFlags);
    fields.bits("key_point", 1, LasLayer::kFlags);
    fields.bits("withheld", 1, LasLayer::kFlags);
    fields.whole("scan_angle_rank", kInt8, LasLayer::kScanAngle);
    fields.whole("user_data", kUint8, LasLayer::kUserData);
    fields.whole("point_source_id", kUint16, LasLayer::kPointSource);
}

/// What all points of formats 6 to 10 begin with.
void append_head(Fields& fields) {
    constexpr double kAngleStep = 0.006;  // degrees
    fields.bits("return_number", 4, LasLayer::kCoordinates);
    fields.bits("number_of_returns", 4, LasLayer::kCoordinates);
    fields.bits("synthetic", 1, LasLayer::kFlags);
    fields.bits("key_point", 1, LasLayer::kFlags);
    fields.bits("withheld", 1, LasLayer::kFlags);
    fields.bits("overlap", 1, LasLayer::kFlags);
    fields.bits("scanner_channel", 2, LasLayer::kCoordinates);
    fields.bits("scan_direction", 1, LasLayer::kFlags);
    fields.bits("edge_of_flight_line", 1, LasLayer::kFlags);
    fields.whole("classification", kUint8, LasLayer::kClassification);
    fields.whole("user_data", kUint8, LasLayer::kUserData);
    fields.whole("scan_angle", kInt16, LasLayer::kScanAngle, kAngleStep);
    fields.whole("point_source_id", kUint16, LasLayer::kPointSource);
}

}  // namespace

std::vector<LasField> las_fields(const InputFile& file, const LasHeader& header,
                                 std::span<const LasRecord> records) {
    const int format = header.point_format;
    Fields fields;
    for (const char* axis : {"x", "y", "z"}) {
        fields.whole(axis, kInt32, LasLayer::kCoordinates);
    }
    fields.whole("intensity", kUint16, LasLayer::kIntensity);
    if (format <= 5) {
        append_legacy_head(fields);
    } else {
        append_head(fields);
    }
    if (has({1, 3, 4, 5}, format) || format >= 6) {
        fields.whole("gps_time", kFloat64, LasLayer::kGpsTime);
    }
    if (has({2, 3, 5, 7, 8, 10}, format)) {
        for (const char* channel : {"red", "green", "blue"}) {
            fields.whole(channel, kUint16, LasLayer::kColour);
        }
    }
    if (has({8, 10}, format)) {
        fields.whole("near_infrared", kUint16, LasLayer::kInfrared);
    }
    std::vector<LasField> all = fields.take();
    std::size_t offset = las_record_length(format);
    for (Attribute& attribute : las_extra_bytes(file, header.record_length - offset, records)) {
        const std::size_t bytes = attribute.value_size();
        all.push_back({std::move(attribute), offset, 0, 0, LasLayer::kExtraBytes});
        offset += bytes;
    }
    return all;
}

void take_las_columns(std::span<const LasField> fields, const ColumnSelection& selection,
                      const std::byte* records, std::size_t n, std::size_t record_length,
                      Chunk& chunk, std::size_t done) {
    for (std::size_t column = 0; column < selection.size(); ++column) {
        const LasField& field = fields[selection.attribute(column)];
        const std::byte* from = records + field.offset;
        std::byte* to = selection.at(chunk, column, done);
        if (field.mask != 0) {
            for (std::size_t i = 0; i < n; ++i) {
                to[i] = (from[i * record_length] >> field.shift) & std::byte{field.mask};
            }
        } else {
            copy_values(from, record_length, n, to, selection.value_size(column), false);
        }
    }
}

}  // namespace knap
