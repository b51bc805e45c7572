#include <fmt/format.h>

#include <cstring>
#include <string_view>

#include "input/bytes.hpp"
#include "input/las_info.hpp"

namespace knap {

namespace {

constexpr std::uint16_t kWktRecord = 2112;
constexpr std::uint16_t kGeoKeyRecord = 34735;
constexpr std::uint16_t kGeographicType = 2048;
constexpr std::uint16_t kProjectedType = 3072;
constexpr std::uint16_t kUserDefined = 32767;
constexpr std::size_t kLongestWkt = std::size_t{1} << 20;

std::string read_wkt(const InputFile& file, const LasRecord& record) {
    const std::vector<std::byte> content = read_las_record(file, record, kLongestWkt);
    const char* text = reinterpret_cast<const char*>(content.data());
    return content.empty() ? std::string() : std::string(text, ::strnlen(text, content.size()));
}

/// The EPSG code among GeoTIFF keys; 0 if there is none. A key directory is a head and entries of
/// four numbers each: key, where its value is (0: here), count, value.
std::uint16_t find_epsg(std::span<const std::byte> directory) {
    constexpr std::size_t kEntry = 8;
    std::uint16_t geographic = 0;
    for (std::size_t at = kEntry; at + kEntry <= directory.size(); at += kEntry) {
        const auto field = [&](std::size_t i) {
            return load_little<std::uint16_t>(directory.data() + at + 2 * i);
        };
        const std::uint16_t value = field(3);
        if (field(1) != 0 || value == 0 || value == kUserDefined) {
            continue;
        }
        if (field(0) == kProjectedType) {
            return value;
        }
        if (field(0) == kGeographicType) {
            geographic = value;
        }
    }
    return geographic;
}

}  // namespace

std::string las_crs(const InputFile& file, std::span<const LasRecord> records) {
    std::string epsg;
    for (const LasRecord& record : records) {
        if (record.user_id != "LASF_Projection") {
            continue;
        }
        if (record.id == kWktRecord) {
            if (std::string wkt = read_wkt(file, record); !wkt.empty()) {
                return wkt;
            }
        }
        if (record.id == kGeoKeyRecord && epsg.empty()) {
            const std::vector<std::byte> content =
                read_las_record(file, record, static_cast<std::size_t>(record.length));
            if (const std::uint16_t code = find_epsg(content); code != 0) {
                epsg = fmt::format("EPSG:{}", code);
            }
        }
    }
    return epsg;
}

}  // namespace knap
