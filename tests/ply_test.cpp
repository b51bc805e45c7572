#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "support/scan_files.hpp"

namespace knap {
namespace {

using test::input_error_of;
using test::raw;
using test::read_all;
using test::read_rest;
using test::ScanFolder;
using testing::AllOf;
using testing::HasSubstr;

std::string header(const std::string& format, const std::string& elements) {
    return "ply\nformat " + format + " 1.0\n" + elements + "end_header\n";
}

std::string float_vertices(std::size_t n) {
    return "element vertex " + std::to_string(n) +
           "\nproperty float x\nproperty float y\nproperty float z\n";
}

/// A value as an element of a file in one of the three encodings.
template <typename T>
std::string encoded(T value, const std::string& format) {
    if (format == "ascii") {
        char text[64];
        std::snprintf(text, sizeof text, "%.17g ", static_cast<double>(value));
        return text;
    }
    return raw(value,
               (format == "binary_big_endian") == (std::endian::native == std::endian::little));
}

const std::vector<std::string> kFormats{"ascii", "binary_little_endian", "binary_big_endian"};

template <typename T>
void expect_type_read(const std::string& name, T low, T high) {
    const ScanFolder folder;
    std::mt19937 random(7);
    for (const std::string& format : kFormats) {
        std::string data;
        std::vector<Vec3> expected;
        for (int i = 0; i < 500; ++i) {
            const auto draw = [&] {
                std::uniform_real_distribution<double> spread(static_cast<double>(low),
                                                              static_cast<double>(high));
                return static_cast<T>(spread(random));
            };
            const T x = draw();
            const T y = draw();
            const T z = draw();
            data += encoded(z, format) + encoded<std::uint8_t>(9, format) + encoded(x, format) +
                    encoded(0.5, format) + encoded(y, format) + (format == "ascii" ? "\n" : "");
            expected.push_back(
                {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
        }
        const std::string elements = "element vertex 500\nproperty " + name +
                                     " z\nproperty uchar red\nproperty " + name +
                                     " x\nproperty double quality\nproperty " + name + " y\n";
        const auto path = folder.write(format + ".ply", header(format, elements) + data);
        EXPECT_EQ(read_all(path), expected) << format << " " << name;
        EXPECT_EQ(read_all(path, 7), expected) << format << " " << name;
    }
}

TEST(Ply, ReadsEveryTypeInEveryEncodingAndPropertyOrder) {
    expect_type_read<std::int8_t>("char", -128, 127);
    expect_type_read<std::int8_t>("int8", -128, 127);
    expect_type_read<std::uint8_t>("uchar", 0, 255);
    expect_type_read<std::uint8_t>("uint8", 0, 255);
    expect_type_read<std::int16_t>("short", -32768, 32767);
    expect_type_read<std::int16_t>("int16", -32768, 32767);
    expect_type_read<std::uint16_t>("ushort", 0, 65535);
    expect_type_read<std::uint16_t>("uint16", 0, 65535);
    expect_type_read<std::int32_t>("int", -2147483647, 2147483647);
    expect_type_read<std::int32_t>("int32", -2147483647, 2147483647);
    expect_type_read<std::uint32_t>("uint", 0, 4294967295U);
    expect_type_read<std::uint32_t>("uint32", 0, 4294967295U);
    expect_type_read<float>("float", -1e6F, 1e6F);
    expect_type_read<float>("float32", -1e-6F, 1e-6F);
    expect_type_read<double>("double", -1e7, 1e7);
    expect_type_read<double>("float64", -1e-9, 1e-9);
}

TEST(Ply, TellsTheNarrowestFormThatKeepsCoordinates) {
    const ScanFolder folder;
    const auto kind = [&](const std::string& x, const std::string& y, const std::string& z) {
        const std::string elements =
            "element vertex 0\nproperty " + x + " x\nproperty " + y + " y\nproperty " + z + " z\n";
        return open_source(folder.write("a.ply", header("ascii", elements)))->info().coordinates;
    };
    using enum CoordinateKind;
    EXPECT_EQ(kind("float", "float32", "float").kind, kFloat32);
    EXPECT_EQ(kind("float", "short", "uchar").kind, kFloat32);
    EXPECT_EQ(kind("int", "int32", "short"), (CoordinateFormat{kInt32, {1, 1, 1}, {0, 0, 0}}));
    EXPECT_EQ(kind("uint", "int", "int").kind, kFloat64);
    EXPECT_EQ(kind("float", "int", "float").kind, kFloat64);
    EXPECT_EQ(kind("float", "double", "float").kind, kFloat64);
}

TEST(Ply, RoundsAsciiFloatsOnceSoThatTheyAreFloats) {
    const ScanFolder folder;
    const auto path =
        folder.write("a.ply", header("ascii", float_vertices(2)) + "0.1 +2 -3e-2\nnan -inf 1e99\n");
    const std::vector<Vec3> points = read_all(path);
    EXPECT_EQ(points[0], (Vec3{0.1F, 2, -3e-2F}));
    EXPECT_TRUE(std::isnan(points[1].x));
    EXPECT_EQ(points[1].y, -std::numeric_limits<double>::infinity());
    EXPECT_EQ(points[1].z, std::numeric_limits<double>::infinity());
}

TEST(Ply, HeaderLinesMayEndInLfCrOrCrLf) {
    const ScanFolder folder;
    // 0x0a as first data byte: after a CR it must not be taken for the end of a CR LF.
    std::string data = raw(std::bit_cast<float>(0x3f80000aU)) + raw(2.0F) + raw(3.0F);
    const std::vector<Vec3> expected{{std::bit_cast<float>(0x3f80000aU), 2, 3}};
    for (const std::string end : {"\n", "\r", "\r\n"}) {
        std::string text;
        for (const char c :
             header("binary_little_endian", "comment a  b\nobj_info c\n" + float_vertices(1))) {
            text += c == '\n' ? end : std::string(1, c);
        }
        EXPECT_EQ(read_all(folder.write("a.ply", text + data)), expected);
        std::string lines;
        for (const char c : header("ascii", float_vertices(2)) + "1 2 3\n4 5 6") {
            lines += c == '\n' ? end : std::string(1, c);
        }
        EXPECT_EQ(read_all(folder.write("b.ply", lines)),
                  (std::vector<Vec3>{{1, 2, 3}, {4, 5, 6}}));
    }
}

TEST(Ply, TakesBlanksAndBlankLinesAnywhere) {
    const ScanFolder folder;
    const auto path =
        folder.write("a.ply",
                     "ply  \n format\tascii  1.0 \n\ncomment\n  element  vertex 2\n"
                     "property\tfloat   x \nproperty float y\n property float z\nend_header \n"
                     "\n  1\t2 3  \n\n4 5 6\n\n");
    EXPECT_EQ(read_all(path), (std::vector<Vec3>{{1, 2, 3}, {4, 5, 6}}));
}

TEST(Ply, SkipsListsAndOtherElementsBeforeInAndAfterTheVertices) {
    const ScanFolder folder;
    for (const std::string& format : kFormats) {
        const bool ascii = format == "ascii";
        const std::string end = ascii ? "\n" : "";
        const auto list = [&](std::initializer_list<int> items) {
            std::string text = encoded(static_cast<std::uint16_t>(items.size()), format);
            for (const int item : items) {
                text += encoded(item, format);
            }
            return text;
        };
        const auto vertex = [&](float x, std::initializer_list<int> items) {
            return encoded(x, format) + list(items) + encoded(x + 1, format) +
                   encoded(x + 2, format) + end;
        };
        const std::string elements =
            "element camera 2\nproperty list ushort int near\nproperty double focus\n"
            "element vertex 3\nproperty float x\nproperty list uint16 int32 faces\nproperty float "
            "y\n"
            "property float z\nelement face 2\nproperty list ushort int vertex_index\nelement none "
            "0\n"
            "property list uchar int a\n";
        const std::string data = list({1, 2, 3}) + encoded(0.5, format) + end + list({}) +
                                 encoded(0.25, format) + end + vertex(1, {7}) + vertex(4, {}) +
                                 vertex(7, {1, 2, 3, 4}) + list({0, 1, 2}) + end + list({2, 1}) +
                                 end;
        const auto path = folder.write("a.ply", header(format, elements) + data);
        const std::vector<Vec3> expected{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
        EXPECT_EQ(read_all(path), expected) << format;
        EXPECT_EQ(open_source(path)->info().seek_granularity, 0U);
        EXPECT_THROW(open_source(path)->seek(1), InputError);
        if (!ascii) {
            EXPECT_THAT(
                input_error_of(folder.write("b.ply", header(format, elements) + data + "x")),
                AllOf(HasSubstr("b.ply"), HasSubstr("1 bytes more")));
            EXPECT_NE(input_error_of(folder.write(
                          "c.ply", header(format, elements) + data.substr(0, data.size() - 1))),
                      "");
        }
    }
}

TEST(Ply, SeekEqualsReadingFromTheStart) {
    const ScanFolder folder;
    std::string data(2 * 5, 'a');  // an element of fixed size before the vertices
    std::vector<Vec3> expected;
    for (int i = 0; i < 3000; ++i) {
        expected.push_back({static_cast<float>(i), static_cast<float>(-i), 0.5});
        data += raw(static_cast<float>(i)) + raw(static_cast<float>(-i)) + raw(0.5F);
    }
    const auto path = folder.write(
        "a.ply",
        header("binary_little_endian",
               "element pose 2\nproperty uchar a\nproperty int b\n" + float_vertices(3000)) +
            data);
    const auto source = open_source(path);
    EXPECT_EQ(source->info().seek_granularity, 1U);
    for (const std::size_t index : {std::size_t{0}, std::size_t{1}, std::size_t{2999},
                                    std::size_t{1234}, std::size_t{3000}}) {
        source->seek(index);
        const std::vector<Vec3> rest(expected.begin() + static_cast<std::ptrdiff_t>(index),
                                     expected.end());
        EXPECT_EQ(read_rest(*source), rest);
    }
    EXPECT_THROW(source->seek(3001), InputError);
}

TEST(Ply, DescribesItself) {
    const ScanFolder folder;
    const auto path = folder.write(
        "a.ply", header("ascii",
                        "element vertex 0\nproperty double x\nproperty float y\nproperty float z\n"
                        "property uchar red\nproperty list uchar int near\n"));
    const auto source = open_source(path);
    EXPECT_EQ(source->info().format, "PLY (ASCII)");
    EXPECT_EQ(source->info().schema, (std::vector<Attribute>{{"x", ScalarType::kFloat64, 1},
                                                             {"y", ScalarType::kFloat32, 1},
                                                             {"z", ScalarType::kFloat32, 1},
                                                             {"red", ScalarType::kUint8, 1}}));
    EXPECT_EQ(source->info().declared_count, 0U);
    EXPECT_EQ(source->info().size_bytes, std::filesystem::file_size(path));
}

TEST(Ply, TellsOfElementsThatItDoesNotRead) {
    const ScanFolder folder;
    const std::string others =
        "element face 1\nproperty list uchar int i\nelement edge 0\nproperty int i\n";
    const auto source = open_source(
        folder.write("a.ply", header("ascii", float_vertices(1) + others) + "1 2 3\n1 0\n"));
    EXPECT_EQ(source->info().unsupported, (std::vector<std::string>{"element 'face'"}));
}

TEST(Ply, AMalformedFileIsAnErrorThatSaysWhereAndWhat) {
    struct Case {
        std::string content;
        std::vector<std::string> says;
    };
    const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
    const std::string ones = raw(1.0F) + raw(1.0F) + raw(1.0F);
    const std::string le = "binary_little_endian";
    const std::vector<Case> cases{
        {"ply\nformat ascii 1.0\n", {"line 3", "end_header", "end of the file"}},
        {"ply\nformat utf8 1.0\nend_header\n", {"line 2", "'format utf8 1.0'"}},
        {"ply\nelement vertex 0\n" + xyz + "end_header\n", {"line 6", "format"}},
        {header("ascii", "element vertex many\n"), {"line 3", "'element vertex many'"}},
        {header("ascii", "element vertex -1\n"), {"line 3", "'element vertex -1'"}},
        {header("ascii", "element vertex 1\nproperty real x\n"), {"line 4", "'real'"}},
        {header("ascii", "element vertex 1\nproperty list float int x\n"), {"line 4", "'float'"}},
        {header("ascii", "property float x\n"), {"line 3", "'property float x'"}},
        {header("ascii", "element face 0\n" + xyz), {"'vertex'", "none"}},
        {header("ascii", "element vertex 0\nproperty float x\nproperty float y\n"),
         {"'z'", "found 0"}},
        {header("ascii", "element vertex 0\n" + xyz + xyz), {"'x'", "found 2"}},
        {header("ascii", "element vertex 0\nproperty list uchar float x\n"), {"'x'", "found 0"}},
        {header("ascii", float_vertices(2)) + "1 2 3\n1 two 3\n",
         {"line 9", "float32", "'y'", "'two'"}},
        {header("ascii", float_vertices(1)) + "1 2     \n", {"line 8", "3 values", "found 2"}},
        {header("ascii", float_vertices(1)) + "1 2 3 4\n", {"line 8", "3 values", "'4'"}},
        {header("ascii", float_vertices(2)) + "1 2 3         \n", {"expected 2", "found 1"}},
        {header("ascii", float_vertices(1)) + "1 2 3\n4 5 6\n",
         {"line 9", "end of the file", "'4 5 6'"}},
        {header("ascii", float_vertices(9999999999)) + "1 2 3\n", {"9999999999", "6 bytes"}},
        {header("ascii", "element vertex 1\nproperty int x\nproperty int y\nproperty int z\n") +
             "1 2 3.5\n",
         {"line 8", "int32", "'3.5'"}},
        {header("ascii", "element vertex 1\nproperty uchar x\nproperty int y\nproperty int z\n") +
             "256 2 3\n",
         {"line 8", "uint8", "'256'"}},
        {header(le, float_vertices(2)) + ones, {"expected 2", "12 bytes"}},
        {header(le, float_vertices(1)) + ones + ones, {"12 bytes more"}},
        {header(le, float_vertices(18446744073709551615U)) + ones, {"18446744073709551615"}},
        {header(le, "element face 1\nproperty list uint double i\n" + float_vertices(1)) +
             "\xff\xff\xff\xff" + ones,
         {"'i'", "4294967295", "12 bytes"}},
        {header(le, "element face 1\nproperty list char double i\n" + float_vertices(1)) + "\xff" +
             ones,
         {"'i'", "12 bytes"}},
        {header(le, float_vertices(1) + "element face 1\nproperty list uint double i\n") + ones +
             "\xff\xff\xff\xff",
         {"'i'", "4294967295", "0 bytes", "face 0"}},
        {header(le, "element vertex 1\n" + xyz + "property list uchar int i\n") + ones + "\x07" +
             ones,
         {"'i'", "7 items", "vertex 0"}},
    };
    const ScanFolder folder;
    for (const Case& test : cases) {
        const std::string error = input_error_of(folder.write("bad.ply", test.content));
        EXPECT_THAT(error, HasSubstr("bad.ply: ")) << test.content;
        EXPECT_THAT(error, testing::Not(HasSubstr("\n")));
        for (const std::string& part : test.says) {
            EXPECT_THAT(error, HasSubstr(part)) << test.content;
        }
    }
}

TEST(Ply, ReadsTheSharedFilesOfEveryDialect) {
    if (!std::filesystem::exists(test::shared_data("ply"))) {
        GTEST_SKIP() << "no shared data";
    }
    const std::vector<std::pair<std::string, std::size_t>> counts{
        {"ply/Box.ply", 24},
        {"ply/delim_test.ply", 24},
        {"ply/cube_att.ply", 24},
        {"ply/cube_quads.ply", 8},
        {"ply/test_generic.ply", 114},
        {"ply/test_pos_color_ascii.ply", 114},
        {"ply/test_extra_whitespace.ply", 3},
        {"ply/test_more_datatypes.ply", 3},
        {"ply/int_point_cloud.ply", 16},
        {"ply/float_inf_point_cloud.ply", 16},
        {"ply/float_two_att_point_cloud.ply", 3},
        {"ply/point_cloud_test_pos.ply", 4},
        {"ply/point_cloud_test_pos_norm.ply", 4},
        {"ply/test_pos_color.ply", 114},
        {"scans/flake1.ply", 75967}};
    for (const auto& [name, count] : counts) {
        EXPECT_EQ(read_all(test::shared_data(name)).size(), count) << name;
    }
    // A twin but for the first byte of its data: a CR behind a header whose lines end in CR.
    const std::vector<Vec3> box = read_all(test::shared_data("ply/Box.ply"));
    const std::vector<Vec3> twin = read_all(test::shared_data("ply/delim_test.ply"));
    EXPECT_EQ(twin[0].x,
              std::bit_cast<float>(
                  (std::bit_cast<std::uint32_t>(static_cast<float>(box[0].x)) & ~0xffU) | 0x0dU));
    EXPECT_TRUE(std::equal(box.begin() + 1, box.end(), twin.begin() + 1));
    EXPECT_EQ(open_source(test::shared_data("scans/flake1.ply"))->info().coordinates.kind,
              CoordinateKind::kFloat64);
}

}  // namespace
}  // namespace knap
