#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <random>
#include <tuple>

#include "support/scan_files.hpp"

namespace knap {
namespace {

using test::file_bytes;
using test::input_error_of;
using test::las_record;
using test::LasFile;
using test::poke;
using test::raw;
using test::read_all;
using test::read_rest;
using test::ScanFolder;
using test::shared_data;
using testing::AllOf;
using testing::HasSubstr;

LasFile random_las(int version_minor, int point_format, std::size_t n) {
    LasFile las{.version_minor = version_minor, .point_format = point_format};
    std::mt19937 random(static_cast<unsigned>(point_format));
    for (std::size_t i = 0; i < n; ++i) {
        const auto draw = [&] { return static_cast<std::int32_t>(random()); };
        las.points.push_back({draw(), draw(), draw()});
    }
    return las;
}

std::vector<Vec3> positions(const LasFile& las) {
    std::vector<Vec3> expected;
    for (std::size_t i = 0; i < las.points.size(); ++i) {
        expected.push_back(las.position(i));
    }
    return expected;
}

void sort_points(std::vector<Vec3>& points) {
    std::ranges::sort(points, [](const Vec3& a, const Vec3& b) {
        return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
    });
}

#ifdef KNAP_HAVE_LASZIP
constexpr bool kHasLaszip = true;
#else
constexpr bool kHasLaszip = false;
#endif

#define SKIP_WITHOUT(name, needs_laszip)               \
    if (!std::filesystem::exists(shared_data(name))) { \
        GTEST_SKIP() << "no shared data";              \
    }                                                  \
    if ((needs_laszip) && !kHasLaszip) {               \
        GTEST_SKIP() << "built without LASzip";        \
    }

TEST(Las, ReadsEveryPointFormatAndVersionExactly) {
    const ScanFolder folder;
    for (int minor = 0; minor <= 5; ++minor) {
        for (int format = 0; format <= 10; ++format) {
            LasFile las = random_las(minor, format, 700);
            las.extra_bytes = static_cast<std::size_t>(format);
            const auto path = folder.write("a.las", las.bytes());
            EXPECT_EQ(read_all(path), positions(las)) << minor << " " << format;
            const auto source = open_source(path);
            EXPECT_EQ(source->info().coordinates,
                      (CoordinateFormat{CoordinateKind::kInt32, las.scale, las.offset}));
            EXPECT_EQ(source->info().declared_count, 700U);
            EXPECT_EQ(source->info().seek_granularity, 1U);
            source->seek(650);
            EXPECT_EQ(read_rest(*source).front(), las.position(650));
        }
    }
}

TEST(Las, AMirroredAxisIsReadButNotClaimedAsIntegers) {
    const ScanFolder folder;
    LasFile las = random_las(2, 0, 3);
    las.scale.y = -0.5;
    const auto path = folder.write("a.las", las.bytes());
    EXPECT_EQ(read_all(path), positions(las));
    EXPECT_EQ(open_source(path)->info().coordinates.kind, CoordinateKind::kFloat64);
}

TEST(Las, TheBoxOfTheHeaderIsNotUsed) {
    const ScanFolder folder;
    const LasFile las = random_las(2, 3, 10);
    std::string bytes = las.bytes();
    for (std::size_t at = 179; at < 227; at += 8) {
        poke(bytes, at, std::numeric_limits<double>::quiet_NaN());
    }
    EXPECT_EQ(read_all(folder.write("a.las", bytes)), positions(las));
}

TEST(Las, AHeaderThatCannotBeIsAnErrorThatSaysWhatAndWhere) {
    struct Case {
        std::string what;
        std::function<void(std::string&)> damage;
        std::vector<std::string> says;
    };
    const std::vector<Case> cases{
        {"cut header", [](std::string& b) { b.resize(100); }, {"227 bytes", "100 bytes"}},
        {"version", [](std::string& b) { b[24] = 2; }, {"version 1.0 to 1.5", "2.2"}},
        {"header size", [](std::string& b) { poke<std::uint16_t>(b, 94, 200); }, {"227", "200"}},
        {"points in header",
         [](std::string& b) { poke<std::uint32_t>(b, 96, 100); },
         {"offset 100"}},
        {"points past end",
         [](std::string& b) { poke<std::uint32_t>(b, 96, 99999); },
         {"offset 99999"}},
        {"point format", [](std::string& b) { b[104] = 11; }, {"point format 0 to 10", "found 11"}},
        {"record length",
         [](std::string& b) { poke<std::uint16_t>(b, 105, 19); },
         {"at least 20", "19"}},
        {"scale 0", [](std::string& b) { poke(b, 139, 0.0); }, {"scale of y", "found 0"}},
        {"scale nan",
         [](std::string& b) { poke(b, 131, std::numeric_limits<double>::quiet_NaN()); },
         {"scale of x", "nan"}},
        {"offset inf",
         [](std::string& b) { poke(b, 171, std::numeric_limits<double>::infinity()); },
         {"offset of z", "inf"}},
        {"count larger",
         [](std::string& b) { poke<std::uint32_t>(b, 107, 11); },
         {"11 points", "200 bytes: 10 points"}},
        {"count smaller",
         [](std::string& b) { poke<std::uint32_t>(b, 107, 9); },
         {"9 points", "10 points"}},
        {"count huge",
         [](std::string& b) { poke<std::uint32_t>(b, 107, 0xffffffff); },
         {"4294967295 points"}},
        {"cut data", [](std::string& b) { b.pop_back(); }, {"10 points", "199 bytes: 9 points"}},
        {"signature", [](std::string& b) { b[0] = 'X'; }, {"'LASF'", "'XASF'"}},
    };
    const ScanFolder folder;
    for (const Case& test : cases) {
        std::string bytes = random_las(2, 0, 10).bytes();
        test.damage(bytes);
        const std::string error = input_error_of(folder.write("bad.las", bytes));
        EXPECT_THAT(error, HasSubstr("bad.las: ")) << test.what;
        for (const std::string& part : test.says) {
            EXPECT_THAT(error, HasSubstr(part)) << test.what;
        }
    }
}

TEST(Las, TwoCountsThatDisagreeAreAnError) {
    const ScanFolder folder;
    std::string bytes = random_las(4, 1, 10).bytes();
    poke<std::uint32_t>(bytes, 107, 9);
    EXPECT_THAT(input_error_of(folder.write("a.las", bytes)),
                AllOf(HasSubstr("10"), HasSubstr("9")));
}

TEST(Las, RecordsBehindThePointsAreNotTakenForPoints) {
    const ScanFolder folder;
    const std::string record = las_record("LAStools", 30, std::string(500, 'x'), true);
    // LAS 1.2 has no field that tells of a record behind the points.
    const LasFile old = random_las(2, 0, 10);
    EXPECT_EQ(read_all(folder.write("a.las", old.bytes() + record)), positions(old));
    const LasFile las = random_las(4, 6, 10);
    std::string bytes = las.bytes();
    poke<std::uint64_t>(bytes, 235, bytes.size());
    poke<std::uint32_t>(bytes, 243, 1);
    EXPECT_EQ(read_all(folder.write("b.las", bytes + record)), positions(las));
    // A count that reaches into the record is too large, though the file is long enough.
    poke<std::uint64_t>(bytes, 247, 12);
    EXPECT_THAT(input_error_of(folder.write("c.las", bytes + record)),
                AllOf(HasSubstr("12 points"), HasSubstr("10 points")));
    // LAS 1.3 waveforms inside the file.
    LasFile waves = random_las(3, 4, 10);
    bytes = waves.bytes();
    poke<std::uint16_t>(bytes, 6, 2);
    poke<std::uint64_t>(bytes, 227, bytes.size());
    EXPECT_EQ(read_all(folder.write("d.las", bytes + std::string(1000, 'w'))), positions(waves));
}

TEST(Las, FindsTheCoordinateSystem) {
    const ScanFolder folder;
    const auto crs = [&](const std::string& records, std::uint32_t count) {
        LasFile las = random_las(4, 6, 2);
        las.vlrs = records;
        las.vlr_count = count;
        return open_source(folder.write("a.las", las.bytes()))->info().crs;
    };
    const auto keys = [](std::initializer_list<std::array<std::uint16_t, 4>> entries) {
        std::string content;
        for (const auto& entry : entries) {
            for (const std::uint16_t number : entry) {
                content += raw(number);
            }
        }
        return las_record("LASF_Projection", 34735, content);
    };
    const std::string geographic = keys({{1, 1, 0, 1}, {2048, 0, 1, 4326}});
    const std::string projected = keys({{1, 1, 0, 2}, {2048, 0, 1, 4326}, {3072, 0, 1, 32617}});
    const std::string own = keys({{1, 1, 0, 1}, {3072, 0, 1, 32767}});
    const std::string wkt =
        las_record("LASF_Projection", 2112, std::string("PROJCS[\"a\"]\0\0", 13));
    EXPECT_EQ(crs("", 0), "");
    EXPECT_EQ(crs(geographic, 1), "EPSG:4326");
    EXPECT_EQ(crs(projected, 1), "EPSG:32617");
    EXPECT_EQ(crs(own, 1), "");
    EXPECT_EQ(crs(projected + wkt, 2), "PROJCS[\"a\"]");
    EXPECT_EQ(crs(projected, 0xffffffff), "EPSG:32617");
    const LasFile las = random_las(4, 6, 2);
    std::string bytes = las.bytes();
    poke<std::uint64_t>(bytes, 235, bytes.size());
    poke<std::uint32_t>(bytes, 243, 1);
    bytes += las_record("LASF_Projection", 2112, "GEOGCS[]", true);
    EXPECT_EQ(open_source(folder.write("b.las", bytes))->info().crs, "GEOGCS[]");
}

TEST(Las, TheSchemaNamesEveryFieldAndExtraByte) {
    const ScanFolder folder;
    LasFile las = random_las(4, 7, 2);
    las.extra_bytes = 15;
    std::string descriptor(192, '\0');
    descriptor[2] = 9;  // float
    descriptor.replace(4, 9, "Amplitude");
    std::string three(192, '\0');
    three[2] = 23;  // three unsigned shorts
    three.replace(4, 6, "Normal");
    las.vlrs = las_record("LASF_Spec", 4, descriptor + three);
    las.vlr_count = 1;
    const auto source = open_source(folder.write("a.las", las.bytes()));
    const std::vector<Attribute>& schema = source->info().schema;
    ASSERT_EQ(schema.size(), 24U);
    EXPECT_EQ(schema[0], (Attribute{"x", ScalarType::kInt32, 1}));
    EXPECT_EQ(schema[17], (Attribute{"gps_time", ScalarType::kFloat64, 1}));
    EXPECT_EQ(schema[20], (Attribute{"blue", ScalarType::kUint16, 1}));
    EXPECT_EQ(schema[21], (Attribute{"Amplitude", ScalarType::kFloat32, 1}));
    EXPECT_EQ(schema[22], (Attribute{"Normal", ScalarType::kUint16, 3}));
    EXPECT_EQ(schema[23], (Attribute{"extra_bytes", ScalarType::kUint8, 5}));
}

TEST(Laz, EqualsItsUncompressedTwin) {
    SKIP_WITHOUT("lidar/formats", true);
    for (const std::string name :
         {"pdrf4-1.3", "pdrf5-1.3", "pdrf6-1.4", "pdrf7-v4-1.4", "pdrf8-1.4", "pdrf9-1.4",
          "pdrf9-1.5", "pdrf10-1.4", "pdrf10-1.5"}) {
        const auto las = shared_data("lidar/formats/" + name + ".las");
        const auto laz = shared_data("lidar/formats/" + name + ".laz");
        EXPECT_EQ(read_all(laz), read_all(las)) << name;
        EXPECT_EQ(open_source(laz)->info().schema, open_source(las)->info().schema) << name;
        EXPECT_EQ(open_source(laz)->info().coordinates, open_source(las)->info().coordinates)
            << name;
        EXPECT_EQ(open_source(laz)->info().seek_granularity, 256U) << name;
    }
}

TEST(Laz, HoldsThePointsOfTheSharedArchives) {
    SKIP_WITHOUT("lidar/autzen.laz", true);
    const auto count = [](const std::string& name) {
        const auto source = open_source(shared_data(name));
        std::uint64_t points = 0;
        for (Chunk chunk; source->read(chunk, 100000);) {
            points += chunk.positions.size();
        }
        return points;
    };
    EXPECT_EQ(count("lidar/autzen.laz"), 10653336U);
    EXPECT_EQ(count("lidar/extra_bytes_pf8.laz"), 697721U);
    EXPECT_EQ(count("lidar/lone-star.copc.laz"), 518862U);
    EXPECT_EQ(open_source(shared_data("lidar/lone-star.copc.laz"))->info().format,
              "LAZ 1.4, point format 6 (COPC)");
}

TEST(Laz, TheSplitFilesAreTheWholeOne) {
    SKIP_WITHOUT("lidar/multi", true);
    std::vector<Vec3> whole = read_all(shared_data("lidar/lone-star.copc.laz"));
    std::vector<Vec3> parts;
    for (int i = 1; i <= 4; ++i) {
        const auto part = read_all(shared_data("lidar/multi/split-" + std::to_string(i) + ".laz"));
        parts.insert(parts.end(), part.begin(), part.end());
    }
    ASSERT_EQ(whole.size(), 518862U);
    ASSERT_EQ(parts.size(), whole.size());
    sort_points(whole);
    sort_points(parts);
    // One scale, 0.00025, about other offsets: the same positions but for the rounding of one
    // multiplication and one addition at a magnitude below 2^23.
    constexpr double kTolerance = 2 * 0x1p-30;
    for (std::size_t i = 0; i < whole.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            ASSERT_NEAR(parts[i][axis], whole[i][axis], kTolerance) << i;
        }
    }
}

TEST(Laz, SeekEqualsReadingFromTheStart) {
    SKIP_WITHOUT("lidar", true);
    std::mt19937 random(3);
    for (const auto& entry : std::filesystem::recursive_directory_iterator(shared_data())) {
        const std::string ending = entry.path().extension().string();
        if (entry.path().filename() == "autzen.laz" ||
            (ending != ".laz" && ending != ".las" && ending != ".ply") ||
            input_error_of(entry.path()) != "") {
            continue;
        }
        const auto source = open_source(entry.path());
        const std::uint64_t unit = source->info().seek_granularity;
        const std::vector<Vec3> all = read_all(entry.path());
        if (unit == 0 || all.empty()) {
            continue;
        }
        for (const std::uint64_t raw_index : {std::uint64_t{0}, unit, 2 * unit, all.size() - 1,
                                              std::uint64_t{random()} % all.size(), all.size()}) {
            const std::uint64_t index = std::min<std::uint64_t>(raw_index, all.size());
            source->seek(index);
            Chunk chunk;
            const bool has_points = source->read(chunk, 500);
            ASSERT_EQ(has_points, index < all.size()) << entry.path() << " " << index;
            ASSERT_TRUE(std::equal(chunk.positions.begin(), chunk.positions.end(),
                                   all.begin() + static_cast<std::ptrdiff_t>(index)))
                << entry.path() << " " << index;
            ASSERT_EQ(chunk.first, index);
            ASSERT_EQ(chunk.positions.size(), std::min<std::size_t>(500, all.size() - index));
        }
    }
}

TEST(Laz, SeekIntoTheMiddleOfABigFileEqualsReadingFromTheStart) {
    SKIP_WITHOUT("lidar/autzen.laz", true);
    const auto whole = open_source(shared_data("lidar/autzen.laz"));
    Chunk there;
    while (whole->read(there, 125000) && there.first != 250000) {
    }
    const auto source = open_source(shared_data("lidar/autzen.laz"));
    source->seek(250000);
    Chunk here;
    source->read(here, 125000);
    EXPECT_EQ(here.positions, there.positions);
    source->seek(10653335);
    EXPECT_EQ(read_rest(*source).size(), 1U);
}

TEST(Laz, ACountOfOneMoreOrLessThanTheDataIsAnError) {
    SKIP_WITHOUT("lidar/formats", true);
    const ScanFolder folder;
    for (const std::string name :
         {"lidar/formats/pdrf5-1.3.laz", "lidar/formats/pdrf7-v4-1.4.laz",
          "lidar/multi/split-1.laz", "lidar/lone-star.copc.laz",
          "malformed/pdal/ept/bad-pointcount/laszip/ept-data/0-0-0-0.laz"}) {
        const std::string bytes = file_bytes(shared_data(name));
        const bool extended = bytes[25] >= 4;
        const std::uint64_t count = *open_source(shared_data(name))->info().declared_count;
        for (const std::uint64_t wrong :
             {count - 1, count + 1, std::uint64_t{0}, count / 2, 2 * count}) {
            std::string damaged = bytes;
            poke(damaged, 107, static_cast<std::uint32_t>(extended ? 0 : wrong));
            if (extended) {
                poke(damaged, 247, wrong);
            }
            EXPECT_NE(input_error_of(folder.write("a.laz", damaged)), "") << name << " " << wrong;
        }
    }
}

TEST(Laz, TruncatedDataIsAnErrorWhereverItEnds) {
    SKIP_WITHOUT("lidar/formats", true);
    const ScanFolder folder;
    for (const std::string name : {"pdrf5-1.3.laz", "pdrf7-v4-1.4.laz", "pdrf10-1.4.laz"}) {
        const std::string bytes = file_bytes(shared_data("lidar/formats/" + name));
        for (std::size_t size = 1; size < bytes.size(); size += 97) {
            EXPECT_THAT(input_error_of(folder.write("a.laz", bytes.substr(0, size))),
                        HasSubstr("a.laz: "))
                << name << " " << size;
        }
    }
}

TEST(Laz, WithoutLaszipTheErrorSaysWhatIsMissing) {
    SKIP_WITHOUT("lidar/formats", false);
    if (kHasLaszip) {
        GTEST_SKIP() << "built with LASzip";
    }
    EXPECT_THAT(input_error_of(shared_data("lidar/formats/pdrf5-1.3.laz")),
                AllOf(HasSubstr("LAZ 1.3"), HasSubstr("liblaszip-dev")));
}

}  // namespace
}  // namespace knap
