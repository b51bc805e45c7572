#include "output/las_head.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <string>
#include <string_view>

#include "base/bytes.hpp"

namespace knap {

namespace {

constexpr std::string_view kProjection = "LASF_Projection";
constexpr std::uint16_t kWktRecord = 2112;
constexpr std::uint16_t kGeoKeyRecord = 34735;
constexpr std::uint16_t kExtraBytesRecord = 4;
constexpr std::uint16_t kLaszipRecord = 22204;
constexpr std::size_t kLongestRecord = 65535;

// Bits of the global encoding.
constexpr std::uint16_t kWaveformsInside = 1 << 1, kWaveformsOutside = 1 << 2, kWkt = 1 << 4,
                        kTimeOffset = 1 << 6;

void put_text(std::vector<std::byte>& out, std::string_view text, std::size_t size) {
    const std::size_t at = out.size();
    out.resize(at + size);
    std::memcpy(out.data() + at, text.data(), std::min(size, text.size()));
}

void put_record(std::vector<std::byte>& out, const LasVlr& record) {
    put<std::uint16_t>(out, 0);  // reserved
    put_text(out, record.user_id, 16);
    put(out, record.record_id);
    if (record.extended) {
        put<std::uint64_t>(out, record.content.size());
    } else {
        put(out, static_cast<std::uint16_t>(record.content.size()));
    }
    put_text(out, record.description, 32);
    out.insert(out.end(), record.content.begin(), record.content.end());
}

std::vector<std::byte> bytes_of(std::string_view text) {
    const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
    return {bytes.begin(), bytes.end()};
}

/// The GeoTIFF keys that name a coordinate system by its number.
LasVlr geo_keys(std::uint16_t epsg) {
    constexpr std::uint16_t kModelType = 1024, kGeographicType = 2048, kProjectedType = 3072;
    // The numbers that EPSG gives to geographic systems.
    const bool geographic = epsg >= 4000 && epsg < 5000;
    LasVlr record{std::string(kProjection), kGeoKeyRecord, "GeoTIFF keys", false, {}};
    const std::array<std::uint16_t, 12> keys{1,
                                             1,
                                             0,
                                             2,
                                             kModelType,
                                             0,
                                             1,
                                             static_cast<std::uint16_t>(geographic ? 2 : 1),
                                             geographic ? kGeographicType : kProjectedType,
                                             0,
                                             1,
                                             epsg};
    const auto bytes = std::as_bytes(std::span(keys));
    record.content.assign(bytes.begin(), bytes.end());
    return record;
}

std::uint16_t epsg_of(std::string_view crs) {
    constexpr std::string_view kPrefix = "EPSG:";
    std::uint16_t code = 0;
    if (crs.starts_with(kPrefix)) {
        std::from_chars(crs.data() + kPrefix.size(), crs.data() + crs.size(), code);
    }
    return code;
}

std::uint16_t header_size(int version_minor) {
    return version_minor >= 4 ? 375 : version_minor == 3 ? 235 : 227;
}

/// A count as the fields of old have it: 0 where they must not or cannot say it.
std::uint32_t legacy(std::uint64_t count, bool allowed) {
    return allowed && count <= 0xffffffffU ? static_cast<std::uint32_t>(count) : 0;
}

}  // namespace

void LasTally::add(const std::array<std::int32_t, 3>& steps, unsigned return_number) {
    low = points == 0 ? steps : low;
    high = points == 0 ? steps : high;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], steps[axis]);
        high[axis] = std::max(high[axis], steps[axis]);
    }
    ++points;
    if (return_number >= 1 && return_number <= by_return.size()) {
        ++by_return[return_number - 1];
    }
}

LasHead::LasHead(const CloudHeader& header, const LasFields& fields,
                 std::span<const std::byte> laszip)
    : info_(header.las.value_or(LasHeaderInfo{})),
      grid_(header.coordinates),
      version_minor_(fields.version_minor()),
      point_format_(fields.point_format()),
      record_length_(fields.record_length()),
      compressed_(!laszip.empty()) {
    info_.global_encoding &=
        static_cast<std::uint16_t>(~(kWaveformsInside | kWaveformsOutside | kTimeOffset));
    for (const LasVlr& record : info_.records) {
        (record.extended ? extended_ : records_).push_back(record);
    }
    add_crs(header);
    if (const std::vector<std::byte> extra = fields.extra_bytes_record(); !extra.empty()) {
        const bool is_long = extra.size() > kLongestRecord;
        (is_long ? extended_ : records_)
            .push_back({"LASF_Spec", kExtraBytesRecord, "", is_long, extra});
        version_minor_ = is_long ? 4 : version_minor_;
    }
    if (compressed_) {
        records_.push_back(
            {"laszip encoded", kLaszipRecord, "", false, {laszip.begin(), laszip.end()}});
    }
}

void LasHead::add_crs(const CloudHeader& header) {
    const bool has_crs =
        std::any_of(info_.records.begin(), info_.records.end(),
                    [](const LasVlr& record) { return record.user_id == kProjection; });
    if (has_crs || header.crs.empty()) {
        return;
    }
    if (const std::uint16_t epsg = epsg_of(header.crs); epsg != 0) {
        records_.push_back(geo_keys(epsg));
        return;
    }
    LasVlr record{std::string(kProjection), kWktRecord, "WKT", false, bytes_of(header.crs)};
    record.content.push_back(std::byte{0});
    record.extended = record.content.size() > kLongestRecord;
    version_minor_ = record.extended ? 4 : version_minor_;
    (record.extended ? extended_ : records_).push_back(record);
    info_.global_encoding |= kWkt;
}

std::vector<std::byte> LasHead::before_points(const LasTally& tally,
                                              std::uint64_t extended_at) const {
    std::vector<std::byte> records;
    for (const LasVlr& record : records_) {
        put_record(records, record);
    }
    const std::uint16_t size = header_size(version_minor_);
    std::vector<std::byte> out;
    out.reserve(size + records.size());
    put_text(out, "LASF", 4);
    put(out, info_.file_source_id);
    put(out, info_.global_encoding);
    out.insert(out.end(), info_.project_id.begin(), info_.project_id.end());
    put<std::uint8_t>(out, 1);
    put(out, static_cast<std::uint8_t>(version_minor_));
    put_text(out, info_.system_identifier, 32);
    put_text(out, fmt::format("knap {}", KNAP_VERSION), 32);
    put(out, info_.creation_day);
    put(out, info_.creation_year);
    put(out, size);
    put(out, static_cast<std::uint32_t>(size + records.size()));
    put(out, static_cast<std::uint32_t>(records_.size()));
    put(out, static_cast<std::uint8_t>(point_format_ | (compressed_ ? 0x80 : 0)));
    put(out, record_length_);
    // From format 6 on only the long fields count.
    const bool short_fields = point_format_ < 6;
    put(out, legacy(tally.points, short_fields));
    for (std::size_t i = 0; i < 5; ++i) {
        put(out, legacy(tally.by_return[i], short_fields));
    }
    for (int axis = 0; axis < 3; ++axis) {
        put(out, grid_.scale[axis]);
    }
    for (int axis = 0; axis < 3; ++axis) {
        put(out, grid_.offset[axis]);
    }
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        const GridAxis place = grid_.axis(axis);
        put(out, tally.points == 0 ? 0.0 : place.at(tally.high[i]));
        put(out, tally.points == 0 ? 0.0 : place.at(tally.low[i]));
    }
    if (version_minor_ >= 3) {
        put<std::uint64_t>(out, 0);  // no waveforms
    }
    if (version_minor_ >= 4) {
        put<std::uint64_t>(out, extended_.empty() ? 0 : extended_at);
        put(out, static_cast<std::uint32_t>(extended_.size()));
        put(out, tally.points);
        for (const std::uint64_t count : tally.by_return) {
            put(out, count);
        }
    }
    out.insert(out.end(), records.begin(), records.end());
    return out;
}

std::vector<std::byte> LasHead::extended_records() const {
    std::vector<std::byte> out;
    for (const LasVlr& record : extended_) {
        put_record(out, record);
    }
    return out;
}

}  // namespace knap
