#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "support/scan_files.hpp"

namespace knap {
namespace {

using test::file_bytes;
using test::input_error_of;
using test::LasFile;
using test::raw;
using test::read_all;
using test::ScanFolder;
using test::shared_data;
using testing::HasSubstr;

#ifdef KNAP_HAVE_LASZIP
constexpr bool kHasLaszip = true;
#else
constexpr bool kHasLaszip = false;
#endif

struct Case {
    std::string file;
    std::size_t points;  // where it can be read
    std::string error;   // where it cannot: part of the message
};

// What comes of every file of the shared malformed ones, and why.
const std::vector<Case> kCases{
    // Only the number of records is wrong; records place no points.
    {"pdal/las/bad_vlr_count.las", 10, ""},
    // A user-defined projection and odd GeoTIFF strings: no matter to positions.
    {"pdal/las/bad-geotiff-keys.las", 10, ""},
    {"pdal/las/1.2-empty-geotiff-vlrs.las", 43, ""},
    // The count needs 6 bytes more than there are (the number of records is garbage too).
    {"pdal/las/garbage_nVariableLength.las", 0, "expected 719 points of 20 bytes"},
    // A GPS time of NaN, attributes of odd values: positions are fine.
    {"pdal/las/gps-time-nan.las", 1, ""},
    {"pdal/las/hextest.las", 8, ""},
    {"pdal/las/synthetic_test.las", 1, ""},
    // Says that it has no points and has none.
    {"pdal/las/no-points.las", 0, ""},
    // Says 1065 points and ends with its header.
    {"pdal/las/permutations/1.2-no-points.las", 0, "found 0 bytes: 0 points"},
    // An odd box and spurious records: the points are whole.
    {"pdal/las/spurious.las", 1065, ""},
    // The file is whole; what its index elsewhere says of it is wrong.
    {"pdal/ept/bad-pointcount/laszip/ept-data/0-0-0-0.laz", 1065, ""},
    {"pdal/ept/lone-star-laszip/ept-data/2-2-2-2.laz", 59398, ""},
    // Noise behind the signature.
    {"pdal/ept/lone-star-invalid-tile/ept-data/2-2-2-2.laz", 0,
     "version 1.0 to 1.5, found 126.203"},
    // One point in full, though its number of decimals once overran a buffer elsewhere.
    {"pdal/ply/issue_2421.ply", 1, ""},
    {"pdal/ply/no_vertex.ply", 0, "expected one element 'vertex'"},
    {"transcribed/draco_pr1166_list_count_ffffffff.ply", 0, "expected one element 'vertex'"},
    {"transcribed/tinyply_issue19_no_end_header.ply", 0,
     "line 7: expected a line of a PLY header or 'end_header'"},
    // Twice X, no Z.
    {"pdal/text/badheader.txt", 0,
     "line 1: expected one column each named x, y and z, found 'X,Y,X'"},
    // No header is needed: three columns and one more.
    {"pdal/text/missingheader.txt", 5, ""},
    // Other formats.
    {"pdal/pcd/missingheader.pcd", 0, "line 1: expected a line of a PCD header"},
    {"pdal/obj/no_vertex.obj", 0, "found text that begins with '# nothing here'"},
    {"pdal/sbet/badfile.sbet", 0, "unknown format"},
};

TEST(Malformed, EverySharedFileEndsAsTheTableSays) {
    if (!std::filesystem::exists(shared_data("malformed"))) {
        GTEST_SKIP() << "no shared data";
    }
    for (const Case& test : kCases) {
        if (test.file.ends_with(".laz") && !kHasLaszip) {
            continue;
        }
        const auto path = shared_data("malformed/" + test.file);
        const std::string error = input_error_of(path);
        EXPECT_EQ(error.empty(), test.error.empty()) << test.file << ": " << error;
        EXPECT_THAT(error, HasSubstr(test.error)) << test.file;
        if (error.empty()) {
            EXPECT_EQ(read_all(path).size(), test.points) << test.file;
        } else {
            EXPECT_THAT(error, HasSubstr(path.string() + ": "));
        }
    }
}

TEST(Malformed, TheTableHasEverySharedFile) {
    if (!std::filesystem::exists(shared_data("malformed"))) {
        GTEST_SKIP() << "no shared data";
    }
    const auto root = shared_data("malformed");
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
        if (entry.is_regular_file()) {
            const std::string name = std::filesystem::relative(entry.path(), root).string();
            EXPECT_TRUE(std::ranges::any_of(kCases, [&](const Case& c) { return c.file == name; }))
                << name;
        }
    }
}

TEST(Malformed, AFileCutInsideItsLastPointIsAnError) {
    const auto path = shared_data("lidar/formats/1.2-with-color-clipped.las");
    if (!std::filesystem::exists(path)) {
        GTEST_SKIP() << "no shared data";
    }
    EXPECT_THAT(input_error_of(path),
                testing::AllOf(HasSubstr("1065 points"), HasSubstr("1064 points")));
}

/// Cuts or changes a few bytes, most of them near the start, where the headers are.
std::string damaged(std::string bytes, std::mt19937& random) {
    const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
    const std::size_t front = std::min<std::size_t>(bytes.size(), 700);
    switch (below(4)) {
        case 0:
            bytes.resize(below(bytes.size()));
            break;
        case 1:
            bytes[below(front)] = static_cast<char>(random());
            break;
        case 2:
            for (std::size_t i = 1 + below(8); i > 0; --i) {
                bytes[below(bytes.size())] ^= static_cast<char>(1 << below(8));
            }
            break;
        default:
            for (std::size_t i = below(front), n = 1 + below(8); n > 0 && i < bytes.size();
                 ++i, --n) {
                bytes[i] = below(2) == 0 ? '\xff' : '\0';
            }
    }
    return bytes;
}

/// Attributes may be damaged where positions are not.
void read_with_columns(const std::filesystem::path& path) {
    try {
        const auto source = open_source(path);
        test::read_columns(*source, attributes_of(source->info()));
    } catch (const InputError& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with(path.string() + ": ")) << error.what();
    }
}

/// Reads damaged twins of a file: each can be read or ends in an InputError.
void expect_no_harm(const std::string& name, const std::string& bytes, int rounds) {
    const ScanFolder folder;
    std::mt19937 random(static_cast<unsigned>(bytes.size()));
    int refused = 0;
    for (int i = 0; i < rounds; ++i) {
        const auto path = folder.write(name, damaged(bytes, random));
        const std::string error = input_error_of(path);
        EXPECT_THAT(error, testing::Not(HasSubstr("\n")));
        EXPECT_TRUE(error.empty() || error.starts_with(path.string() + ": ")) << error;
        refused += error.empty() ? 0 : 1;
        if (error.empty()) {
            read_with_columns(path);
        }
    }
    EXPECT_GT(refused, rounds / 4) << name;
}

TEST(Malformed, DamagedPlyIsReadOrRefused) {
    std::string data;
    for (int i = 0; i < 60; ++i) {
        data += raw(static_cast<float>(i)) + raw(1.0F) + raw(2.0F) + "\x02" + raw(1) + raw(2);
    }
    const std::string elements =
        "element vertex 60\nproperty float x\nproperty float y\nproperty float z\n"
        "property list uchar int near\nelement face 2\nproperty list uint float i\nend_header\n";
    const std::string faces = raw(2) + raw(1.0F) + raw(1.0F) + raw(0);
    expect_no_harm("a.ply", "ply\nformat binary_little_endian 1.0\n" + elements + data + faces,
                   500);
    std::string text;
    for (int i = 0; i < 60; ++i) {
        text += std::to_string(i) + " 1.5 -2e3 2 1 1\n";
    }
    expect_no_harm("b.ply", "ply\nformat ascii 1.0\n" + elements + text + "3 1 2 3\n0\n", 500);
}

TEST(Malformed, DamagedLasIsReadOrRefused) {
    for (const auto& [minor, format] : {std::pair{2, 3}, std::pair{4, 7}}) {
        LasFile las{.version_minor = minor, .point_format = format, .points = {}};
        las.points.resize(40, {1, 2, 3});
        las.vlrs = test::las_record("LASF_Spec", 4, std::string(192, '\3')) +
                   test::las_record("LASF_Projection", 34735, std::string(64, '\1'));
        las.vlr_count = 2;
        expect_no_harm("a.las", las.bytes(), 500);
    }
}

TEST(Malformed, DamagedPcdIsReadOrRefused) {
    const std::string head =
        "# .PCD v.7\nFIELDS x y z rgb label\nSIZE 4 4 4 4 2\nTYPE F F F U U\nCOUNT 1 1 1 1 3\n"
        "WIDTH 60\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 60\nDATA ";
    std::string text;
    std::string runs;  // LZF: a literal and a match of 20 bytes a step back, 60 times
    for (int i = 0; i < 60; ++i) {
        text += std::to_string(i) + " 1.5 -2e3 77 1 2 3\n";
        runs += std::string("\0a\xe0\x0b\0", 5) + std::string("\0b", 2);
    }
    expect_no_harm("a.pcd", head + "ascii\n" + text, 500);
    expect_no_harm("b.pcd", head + "binary\n" + std::string(60 * 22, 'x'), 500);
    const std::string packed =
        raw(static_cast<std::uint32_t>(runs.size())) + raw(std::uint32_t{60 * 22}) + runs;
    expect_no_harm("c.pcd", head + "binary_compressed\n" + packed, 500);
}

TEST(Malformed, DamagedTextIsReadOrRefused) {
    std::string text = "x,y,z,name\n";
    for (int i = 0; i < 60; ++i) {
        text += std::to_string(i) + ",1.5,-2e3,\"a,b\"\n";
    }
    expect_no_harm("a.csv", text, 500);
}

TEST(Malformed, DamagedLazIsReadOrRefused) {
    if (!kHasLaszip || !std::filesystem::exists(shared_data("lidar/formats"))) {
        GTEST_SKIP() << "no LASzip, or no shared data";
    }
    for (const std::string name :
         {"lidar/formats/pdrf4-1.3.laz", "lidar/formats/pdrf5-1.3.laz",
          "lidar/formats/pdrf6-1.4.laz", "lidar/formats/pdrf7-v4-1.4.laz",
          "lidar/formats/pdrf8-1.4.laz", "lidar/formats/pdrf9-1.5.laz",
          "lidar/formats/pdrf10-1.4.laz",
          "malformed/pdal/ept/bad-pointcount/laszip/ept-data/0-0-0-0.laz"}) {
        expect_no_harm("a.laz", file_bytes(shared_data(name)), 200);
    }
}

}  // namespace
}  // namespace knap
