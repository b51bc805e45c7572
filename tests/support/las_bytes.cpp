#include "support/las_bytes.hpp"

#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <vector>

#ifdef KNAP_HAVE_LASZIP
#include <laszip/laszip_api.h>
#endif

namespace knap::test {

namespace {

struct Place {
    std::size_t at;
    std::size_t size;
    unsigned shift = 0;
    unsigned width = 0;  // 0: whole bytes
};

std::map<std::string, Place> places(int format) {
    std::map<std::string, Place> places{{"intensity", {12, 2}}};
    if (format >= 6) {
        places.insert({{"return_number", {14, 1, 0, 4}},
                       {"number_of_returns", {14, 1, 4, 4}},
                       {"synthetic", {15, 1, 0, 1}},
                       {"key_point", {15, 1, 1, 1}},
                       {"withheld", {15, 1, 2, 1}},
                       {"overlap", {15, 1, 3, 1}},
                       {"scanner_channel", {15, 1, 4, 2}},
                       {"scan_direction", {15, 1, 6, 1}},
                       {"edge_of_flight_line", {15, 1, 7, 1}},
                       {"classification", {16, 1}},
                       {"user_data", {17, 1}},
                       {"scan_angle", {18, 2}},
                       {"point_source_id", {20, 2}},
                       {"gps_time", {22, 8}},
                       {"near_infrared", {36, 2}}});
    } else {
        places.insert({{"return_number", {14, 1, 0, 3}},
                       {"number_of_returns", {14, 1, 3, 3}},
                       {"scan_direction", {14, 1, 6, 1}},
                       {"edge_of_flight_line", {14, 1, 7, 1}},
                       {"classification", {15, 1, 0, 5}},
                       {"synthetic", {15, 1, 5, 1}},
                       {"key_point", {15, 1, 6, 1}},
                       {"withheld", {15, 1, 7, 1}},
                       {"scan_angle_rank", {16, 1}},
                       {"user_data", {17, 1}},
                       {"point_source_id", {18, 2}},
                       {"gps_time", {20, 8}}});
    }
    const std::size_t colours = format == 2 ? 20 : format == 3 ? 28 : 30;
    places.insert({{"red", {colours, 2}}, {"green", {colours + 2, 2}}, {"blue", {colours + 4, 2}}});
    return places;
}

}  // namespace

LasBytes::LasBytes(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    if (bytes_.substr(0, 4) != "LASF") {
        throw std::runtime_error("no LAS file");
    }
}

std::uint64_t LasBytes::points() const {
    return point_format() >= 6 ? get<std::uint64_t>(bytes_, 247) : get<std::uint32_t>(bytes_, 107);
}

std::string LasBytes::point(std::size_t i) const {
    const std::size_t begin = get<std::uint32_t>(bytes_, 96);
    return bytes_.substr(begin + i * record_length(), record_length());
}

std::string LasBytes::all_points() const {
    return bytes_.substr(get<std::uint32_t>(bytes_, 96), points() * record_length());
}

std::int32_t LasBytes::step(std::size_t point, int axis) const {
    return get<std::int32_t>(bytes_, get<std::uint32_t>(bytes_, 96) + point * record_length() +
                                         4 * static_cast<std::size_t>(axis));
}

std::string LasBytes::field(std::size_t point, const std::string& name) const {
    const Place place = places(point_format()).at(name);
    const std::string value = this->point(point).substr(place.at, place.size);
    if (place.width == 0) {
        return value;
    }
    const unsigned byte = static_cast<unsigned char>(value[0]);
    return {static_cast<char>((byte >> place.shift) & ((1U << place.width) - 1))};
}

std::string LasBytes::record(const std::string& user_id, std::uint16_t id, bool extended) const {
    std::size_t at = extended ? get<std::uint64_t>(bytes_, 235) : get<std::uint16_t>(bytes_, 94);
    const std::uint32_t count = get<std::uint32_t>(bytes_, extended ? 243 : 100);
    for (std::uint32_t i = 0; i < count; ++i) {
        const std::size_t head = extended ? 60 : 54;
        const std::size_t size =
            extended ? get<std::uint64_t>(bytes_, at + 20) : get<std::uint16_t>(bytes_, at + 20);
        const std::string name = bytes_.substr(at + 2, 16);
        if (name.c_str() == user_id && get<std::uint16_t>(bytes_, at + 18) == id) {
            return bytes_.substr(at + head, size);
        }
        at += head + size;
    }
    throw std::out_of_range("no record " + user_id);
}

#ifdef KNAP_HAVE_LASZIP

namespace {

template <typename T>
void append(std::string& to, const T& value, std::size_t size = sizeof(T)) {
    to.append(reinterpret_cast<const char*>(&value), size);
}

std::string record_of(const laszip_point_struct& p, int format) {
    std::string record;
    append(record, p.X);
    append(record, p.Y);
    append(record, p.Z);
    append(record, p.intensity);
    const auto flags = static_cast<unsigned>(p.scan_direction_flag << 6U) |
                       static_cast<unsigned>(p.edge_of_flight_line << 7U);
    if (format >= 6) {
        record +=
            static_cast<char>(p.extended_return_number | (p.extended_number_of_returns << 4U));
        record += static_cast<char>(p.extended_classification_flags |
                                    (p.extended_scanner_channel << 4U) | flags);
        append(record, p.extended_classification);
        append(record, p.user_data);
        append(record, p.extended_scan_angle);
        append(record, p.point_source_ID);
        append(record, p.gps_time);
    } else {
        record += static_cast<char>(p.return_number | (p.number_of_returns << 3U) | flags);
        record += static_cast<char>(p.classification | (p.synthetic_flag << 5U) |
                                    (p.keypoint_flag << 6U) | (p.withheld_flag << 7U));
        append(record, p.scan_angle_rank);
        append(record, p.user_data);
        append(record, p.point_source_ID);
        if (format == 1 || format == 3) {
            append(record, p.gps_time);
        }
    }
    if (format == 2 || format == 3 || format >= 7) {
        append(record, p.rgb, format == 8 ? 8 : 6);
    }
    record.append(reinterpret_cast<const char*>(p.extra_bytes),
                  static_cast<std::size_t>(p.num_extra_bytes));
    return record;
}

}  // namespace

std::string laz_records(const std::filesystem::path& path) {
    laszip_POINTER reader = nullptr;
    laszip_create(&reader);
    laszip_BOOL compressed = 0;
    if (laszip_open_reader(reader, path.c_str(), &compressed) != 0 || compressed == 0) {
        laszip_destroy(reader);
        throw std::runtime_error("no LAZ file");
    }
    laszip_header_struct* header = nullptr;
    laszip_point_struct* point = nullptr;
    laszip_I64 count = 0;
    laszip_get_header_pointer(reader, &header);
    laszip_get_point_pointer(reader, &point);
    laszip_get_point_count(reader, &count);
    const std::uint64_t points = header->number_of_point_records != 0
                                     ? header->number_of_point_records
                                     : header->extended_number_of_point_records;
    std::string records;
    for (std::uint64_t i = 0; i < points; ++i) {
        if (laszip_read_point(reader) != 0) {
            throw std::runtime_error("LASzip cannot read a point");
        }
        records += record_of(*point, header->point_data_format & 0x3f);
    }
    laszip_close_reader(reader);
    laszip_destroy(reader);
    return records;
}

#else

std::string laz_records(const std::filesystem::path&) {
    throw std::runtime_error("no LASzip");
}

#endif

}  // namespace knap::test
