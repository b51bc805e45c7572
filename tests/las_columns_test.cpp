#include <gtest/gtest.h>

#include <bit>
#include <map>
#include <random>

#include "support/scan_files.hpp"

#ifdef KNAP_HAVE_LASZIP
#include <laszip/laszip_api.h>
#endif

namespace knap {
namespace {

using test::file_bytes;
using test::las_record;
using test::LasFile;
using test::poke;
using test::raw;
using test::read_columns;
using test::ScanFolder;
using test::shared_data;

template <typename T>
T peek(const std::string& bytes, std::size_t at) {
    T value{};
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
}

using Columns = std::map<std::string, std::string>;

/// The columns of a LAS file by the tables of the LAS specification, extra bytes as one piece.
class SpecReader {
  public:
    explicit SpecReader(std::string bytes) : bytes_(std::move(bytes)) {
        format_ = static_cast<unsigned char>(bytes_[104]);
        length_ = peek<std::uint16_t>(bytes_, 105);
        count_ = peek<std::uint32_t>(bytes_, 107);
        if (count_ == 0) {
            count_ = peek<std::uint64_t>(bytes_, 247);
        }
    }

    std::uint64_t count() const { return count_; }

    Columns columns() const {
        Columns columns;
        for (std::uint64_t i = 0; i < count_; ++i) {
            const std::size_t at = peek<std::uint32_t>(bytes_, 96) + i * length_;
            add_point(bytes_.substr(at, length_), columns);
        }
        return columns;
    }

  private:
    void add_point(const std::string& p, Columns& c) const {
        const auto bits = [&](const char* name, std::size_t at, int first, int n) {
            c[name] += static_cast<char>((static_cast<unsigned char>(p[at]) >> first) % (1 << n));
        };
        const auto whole = [&](const char* name, std::size_t at, std::size_t n) {
            c[name] += p.substr(at, n);
        };
        whole("intensity", 12, 2);
        const bool is_new = format_ > 5;
        bits("return_number", 14, 0, is_new ? 4 : 3);
        bits("number_of_returns", 14, is_new ? 4 : 3, is_new ? 4 : 3);
        bits("scan_direction", is_new ? 15 : 14, 6, 1);
        bits("edge_of_flight_line", is_new ? 15 : 14, 7, 1);
        bits("synthetic", 15, is_new ? 0 : 5, 1);
        bits("key_point", 15, is_new ? 1 : 6, 1);
        bits("withheld", 15, is_new ? 2 : 7, 1);
        whole("user_data", 17, 1);
        if (is_new) {
            bits("overlap", 15, 3, 1);
            bits("scanner_channel", 15, 4, 2);
            whole("classification", 16, 1);
            whole("scan_angle", 18, 2);
            whole("point_source_id", 20, 2);
            whole("gps_time", 22, 8);
        } else {
            bits("classification", 15, 0, 5);
            whole("scan_angle_rank", 16, 1);
            whole("point_source_id", 18, 2);
            if (format_ != 0 && format_ != 2) {
                whole("gps_time", 20, 8);
            }
        }
        static const std::map<int, std::size_t> kColour{{2, 20}, {3, 28}, {5, 28},
                                                        {7, 30}, {8, 30}, {10, 30}};
        if (const auto colour = kColour.find(format_); colour != kColour.end()) {
            whole("red", colour->second, 2);
            whole("green", colour->second + 2, 2);
            whole("blue", colour->second + 4, 2);
        }
        if (format_ == 8 || format_ == 10) {
            whole("near_infrared", 36, 2);
        }
        static constexpr std::array<std::size_t, 11> kLength{20, 28, 26, 34, 57, 63,
                                                             30, 36, 38, 59, 67};
        c["extra"] += p.substr(kLength.at(static_cast<std::size_t>(format_)));
    }

    std::string bytes_;
    int format_;
    std::size_t length_;
    std::uint64_t count_;
};

/// The same of a source; its extra bytes put together as the records have them.
Columns columns_of(PointSource& source, const std::vector<std::size_t>& selected,
                   std::size_t chunk_points) {
    const std::vector<std::string> read = read_columns(source, selected, chunk_points);
    Columns columns;
    std::vector<std::pair<std::size_t, const std::string*>> extra;
    for (std::size_t i = 0; i < selected.size(); ++i) {
        const Attribute& attribute = source.info().schema[selected[i]];
        static const std::string kFields =
            " intensity return_number number_of_returns scan_direction edge_of_flight_line "
            "classification synthetic key_point withheld overlap scanner_channel scan_angle_rank "
            "scan_angle user_data point_source_id gps_time red green blue near_infrared ";
        if (kFields.find(" " + attribute.name + " ") != std::string::npos) {
            columns[attribute.name] = read[i];
        } else {
            extra.emplace_back(attribute.value_size(), &read[i]);
        }
    }
    std::string& together = columns["extra"];
    if (!extra.empty()) {
        const std::size_t points = extra[0].second->size() / extra[0].first;
        for (std::size_t p = 0; p < points; ++p) {
            for (const auto& [size, column] : extra) {
                together += column->substr(p * size, size);
            }
        }
    }
    return columns;
}

void expect_columns(const Columns& found, const Columns& expected, const std::string& of) {
    for (const auto& [name, values] : expected) {
        ASSERT_TRUE(found.contains(name)) << of << " " << name;
        EXPECT_TRUE(found.at(name) == values) << of << " " << name;
    }
    EXPECT_EQ(found.size(), expected.size()) << of;
}

/// A file whose points are random bits from end to end.
std::string random_bits(int minor, int format, std::size_t extra) {
    LasFile las{.version_minor = minor, .point_format = format};
    las.extra_bytes = extra;
    las.points.resize(700);
    std::string bytes = las.bytes();
    std::mt19937 random(static_cast<unsigned>(format));
    for (std::size_t i = las.points_offset(); i < bytes.size(); ++i) {
        bytes[i] = static_cast<char>(random());
    }
    return bytes;
}

TEST(LasColumns, EveryFieldOfEveryPointFormatIsReadAsTheSpecificationSays) {
    const ScanFolder folder;
    for (int format = 0; format <= 10; ++format) {
        const std::string bytes = random_bits(format <= 3 ? 2 : 4, format, format % 3 * 5);
        const auto path = folder.write("a.las", bytes);
        const Columns expected = SpecReader(bytes).columns();
        const auto source = open_source(path);
        const std::vector<std::size_t> all = attributes_of(source->info());
        expect_columns(columns_of(*source, all, 97), expected, "format " + std::to_string(format));
        const bool waves = format == 4 || format == 5 || format == 9 || format == 10;
        EXPECT_EQ(source->info().unsupported.size(), waves ? 1U : 0U);

        source->seek(333);
        Columns rest = columns_of(*source, all, 1000);
        for (auto& [name, values] : rest) {
            const std::string& whole = expected.at(name);
            EXPECT_EQ(values, whole.substr(whole.size() / 700 * 333)) << format << name;
        }
    }
}

TEST(LasColumns, ExtraBytesHaveTheTypesAndScalesOfTheirDescriptors) {
    const ScanFolder folder;
    const auto descriptor = [](int type, int options, const std::string& name) {
        std::string bytes(192, '\0');
        bytes[2] = static_cast<char>(type);
        bytes[3] = static_cast<char>(options);
        bytes.replace(4, name.size(), name);
        return bytes;
    };
    std::string range = descriptor(6, 8 | 16, "range");  // a long with scale and offset
    poke(range, 112, 0.001);
    poke(range, 136, 100.0);
    range.replace(160, 32, std::string(32, 'd'));
    std::string unused = descriptor(4, 0, "no scale");  // a short; its scale is not said to count
    poke(unused, 112, 0.5);
    std::string triple = descriptor(26, 8, "triple");  // three longs of different scales
    poke(triple, 112, 0.1);
    poke(triple, 120, 0.2);
    poke(triple, 128, 0.3);
    const std::string pair = descriptor(19, 0, "intensity");  // two floats
    const std::string opaque = descriptor(0, 3, "opaque");
    const std::string beyond = descriptor(10, 0, "beyond the record");
    LasFile las{.version_minor = 4, .point_format = 6};
    las.extra_bytes = 4 + 2 + 12 + 8 + 3 + 6;
    las.points.resize(3);
    las.vlrs = las_record(
        "LASF_Spec", 4,
        range + unused + triple + pair + opaque + beyond + descriptor(1, 0, "behind it"));
    las.vlr_count = 1;
    const auto source = open_source(folder.write("a.las", las.bytes()));
    using enum ScalarType;
    const std::vector<Attribute> expected{{"range", kInt32, 1, 0.001, 100, std::string(32, 'd')},
                                          {"no scale", kInt16, 1},
                                          {"triple[0]", kInt32, 1, 0.1},
                                          {"triple[1]", kInt32, 1, 0.2},
                                          {"triple[2]", kInt32, 1, 0.3},
                                          {"intensity (2)", kFloat32, 2},
                                          {"opaque", kUint8, 3},
                                          {"extra_bytes", kUint8, 6}};
    const std::vector<Attribute>& schema = source->info().schema;
    ASSERT_GE(schema.size(), expected.size());
    EXPECT_EQ(std::vector<Attribute>(schema.end() - static_cast<std::ptrdiff_t>(expected.size()),
                                     schema.end()),
              expected);
    EXPECT_TRUE(source->info().unsupported.empty());
}

TEST(LasColumns, ExtraBytesHaveTheLimitsThatTheirDescriptorsSayCount) {
    const ScanFolder folder;
    const auto descriptor = [](int type, int options, std::uint64_t first) {
        std::string bytes(192, '\0');
        bytes[2] = static_cast<char>(type);
        bytes[3] = static_cast<char>(options);
        bytes[4] = static_cast<char>('a' + type % 26);
        for (std::size_t i = 0; i < 9; ++i) {  // missing, least, greatest of three components
            poke(bytes, 40 + 8 * i, first + i);
        }
        return bytes;
    };
    std::string no_number = descriptor(10, 1, 0);
    poke(no_number, 40, 0xfff8000000000001U);
    std::string triple = descriptor(26, 4 + 8, 20);  // three longs of different scales
    poke(triple, 112, 0.1);
    LasFile las{.version_minor = 4, .point_format = 6};
    las.extra_bytes = 2 + 4 + 24 + 8 + 12;
    las.points.resize(3);
    las.vlrs = las_record(
        "LASF_Spec", 4,
        descriptor(3, 7, 10) + descriptor(9, 0, 10) + descriptor(28, 2, 1) + no_number + triple);
    las.vlr_count = 1;
    const auto schema = open_source(folder.write("a.las", las.bytes()))->info().schema;
    ASSERT_GE(schema.size(), 7U);
    std::vector<ValueLimits> limits;
    std::transform(schema.end() - 7, schema.end(), std::back_inserter(limits),
                   [](const Attribute& attribute) { return attribute.limits; });
    EXPECT_EQ(limits, (std::vector<ValueLimits>{{{10}, {13}, {16}},
                                                {},
                                                {{}, {4, 5, 6}, {}},
                                                {{0x7ff8000000000000U}, {}, {}},
                                                {{}, {}, {26}},
                                                {{}, {}, {27}},
                                                {{}, {}, {28}}}));
}

TEST(LasColumns, TheHeaderAndItsRecordsAreKeptAsTheyAre) {
    const ScanFolder folder;
    LasFile las{.version_minor = 4, .point_format = 6};
    las.points.resize(2);
    const std::string keys("\1\0\1\0\0\0\0\0\0", 9);
    std::string described = las_record("LASF_Projection", 34735, keys);
    described.replace(22, 5, "words");
    las.vlrs = described + las_record("LASF_Spec", 4, std::string(192, '\0')) +
               las_record("LASF_Spec", 100, "wave") + las_record("copc", 1, "info") +
               las_record("LASF_Spec", 3, "");
    las.vlr_count = 5;
    std::string bytes = las.bytes();
    poke<std::uint16_t>(bytes, 4, 77);
    poke<std::uint16_t>(bytes, 6, 0x11);
    bytes.replace(8, 16, "0123456789abcdef");
    bytes.replace(26, 32, std::string(32, 's'));
    bytes.replace(58, 4, "soft");
    poke<std::uint16_t>(bytes, 90, 366);
    poke<std::uint16_t>(bytes, 92, 2024);
    poke<std::uint64_t>(bytes, 235, bytes.size());
    poke<std::uint32_t>(bytes, 243, 2);
    bytes += las_record("mine", 9, "all of it", true);
    bytes += las_record("large", 10, std::string(17 << 20, 'x'), true);
    const auto source = open_source(folder.write("a.las", bytes));
    ASSERT_TRUE(source->info().las.has_value());
    const LasHeaderInfo& info = *source->info().las;
    EXPECT_EQ(info.version_minor, 4);
    EXPECT_EQ(info.point_format, 6);
    EXPECT_EQ(info.file_source_id, 77);
    EXPECT_EQ(info.global_encoding, 0x11);
    EXPECT_EQ(std::memcmp(info.project_id.data(), "0123456789abcdef", 16), 0);
    EXPECT_EQ(info.system_identifier, std::string(32, 's'));
    EXPECT_EQ(info.generating_software, "soft");
    EXPECT_EQ(info.creation_day, 366);
    EXPECT_EQ(info.creation_year, 2024);
    const auto content = [](const std::string& text) {
        const auto view = std::as_bytes(std::span(text.data(), text.size()));
        return std::vector<std::byte>(view.begin(), view.end());
    };
    EXPECT_EQ(info.records,
              (std::vector<LasVlr>{{"LASF_Projection", 34735, "words", false, content(keys)},
                                   {"LASF_Spec", 3, "", false, {}},
                                   {"mine", 9, "", true, content("all of it")}}));
    EXPECT_EQ(source->info().unsupported,
              (std::vector<std::string>{"record 'large' 10 of 17825792 bytes"}));
}

TEST(LasColumns, RealFilesOfEveryFormatEqualTheSpecification) {
    if (!std::filesystem::exists(shared_data("lidar"))) {
        GTEST_SKIP() << "no shared data";
    }
    for (const std::string name :
         {"formats/1.2-with-color", "formats/epsg_4326", "formats/extrabytes",
          "formats/lots_of_vlr", "autzen_trim", "formats/pdrf4-1.3", "formats/pdrf5-1.3",
          "formats/pdrf6-1.4", "formats/pdrf7-v4-1.4", "formats/pdrf8-1.4", "formats/pdrf9-1.4",
          "formats/pdrf9-1.5", "formats/pdrf10-1.4", "formats/pdrf10-1.5"}) {
        const auto las = shared_data("lidar/" + name + ".las");
        const Columns expected = SpecReader(file_bytes(las)).columns();
        const auto source = open_source(las);
        const std::vector<std::size_t> all = attributes_of(source->info());
        expect_columns(columns_of(*source, all, 5000), expected, name);
        const auto laz = shared_data("lidar/" + name + ".laz");
#ifdef KNAP_HAVE_LASZIP
        if (std::filesystem::exists(laz)) {
            const auto twin = open_source(laz);
            expect_columns(columns_of(*twin, all, 100), expected, name + ".laz");
            EXPECT_EQ(twin->info().las->records, source->info().las->records) << name;
            twin->seek(300);
            for (const std::size_t one : all) {
                twin->seek(300);
                for (const auto& [column, values] : columns_of(*twin, {one}, 100)) {
                    const std::string& whole = expected.at(column);
                    const std::size_t size = values.size() / (*twin->info().declared_count - 300);
                    EXPECT_TRUE(column == "extra" || values == whole.substr(300 * size))
                        << name << " " << column;
                }
            }
        }
#endif
    }
}

#ifdef KNAP_HAVE_LASZIP

TEST(LasColumns, LazEqualsWhatLaszipItselfReads) {
    const auto path = shared_data("lidar/extra_bytes_pf8.laz");
    if (!std::filesystem::exists(path)) {
        GTEST_SKIP() << "no shared data";
    }
    const auto source = open_source(path);
    Columns found = columns_of(*source, attributes_of(source->info()), 30000);
    laszip_POINTER reader = nullptr;
    laszip_BOOL compressed = 0;
    laszip_point_struct* point = nullptr;
    ASSERT_EQ(laszip_create(&reader), 0);
    ASSERT_EQ(laszip_open_reader(reader, path.c_str(), &compressed), 0);
    ASSERT_EQ(laszip_get_point_pointer(reader, &point), 0);
    Columns expected;
    for (std::uint64_t i = 0; i < *source->info().declared_count; ++i) {
        ASSERT_EQ(laszip_read_point(reader), 0);
        const auto add = [&](const char* name, auto value) { expected[name] += raw(value); };
        add("intensity", point->intensity);
        add("return_number", static_cast<std::uint8_t>(point->extended_return_number));
        add("number_of_returns", static_cast<std::uint8_t>(point->extended_number_of_returns));
        add("scan_direction", static_cast<std::uint8_t>(point->scan_direction_flag));
        add("edge_of_flight_line", static_cast<std::uint8_t>(point->edge_of_flight_line));
        add("classification", point->extended_classification);
        const unsigned flags = point->extended_classification_flags;
        add("synthetic", static_cast<std::uint8_t>(flags & 1U));
        add("key_point", static_cast<std::uint8_t>(flags >> 1U & 1U));
        add("withheld", static_cast<std::uint8_t>(flags >> 2U & 1U));
        add("overlap", static_cast<std::uint8_t>(flags >> 3U & 1U));
        add("scanner_channel", static_cast<std::uint8_t>(point->extended_scanner_channel));
        add("scan_angle", point->extended_scan_angle);
        add("user_data", point->user_data);
        add("point_source_id", point->point_source_ID);
        add("gps_time", point->gps_time);
        add("red", point->rgb[0]);
        add("green", point->rgb[1]);
        add("blue", point->rgb[2]);
        add("near_infrared", point->rgb[3]);
        expected["extra"].append(reinterpret_cast<const char*>(point->extra_bytes),
                                 static_cast<std::size_t>(point->num_extra_bytes));
    }
    laszip_close_reader(reader);
    laszip_destroy(reader);
    expect_columns(found, expected, path);
}

#endif

}  // namespace
}  // namespace knap
