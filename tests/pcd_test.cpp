#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <random>

#include "support/scan_files.hpp"

namespace knap {
namespace {

using test::file_bytes;
using test::input_error_of;
using test::raw;
using test::read_all;
using test::read_columns;
using test::ScanFolder;
using test::shared_data;
using testing::HasSubstr;

/// LZF: matches of 3 to 264 bytes where the last 8 KiB have them, literals elsewhere.
std::string lzf(const std::string& bytes) {
    std::string out;
    std::string literals;
    const auto flush = [&] {
        for (std::size_t at = 0; at < literals.size(); at += 32) {
            const std::string run = literals.substr(at, 32);
            out += static_cast<char>(run.size() - 1);
            out += run;
        }
        literals.clear();
    };
    for (std::size_t at = 0; at < bytes.size();) {
        std::size_t best = 0;
        std::size_t distance = 0;
        for (const std::size_t back : {1, 2, 4, 8, 12, 40, 8192}) {
            std::size_t n = 0;
            while (back <= at && at + n < bytes.size() && n < 264 &&
                   bytes[at + n] == bytes[at + n - back]) {
                ++n;
            }
            if (n > best) {
                best = n;
                distance = back;
            }
        }
        if (best < 3) {
            literals += bytes[at++];
            continue;
        }
        flush();
        const std::size_t length = best - 2;
        const std::size_t high = (distance - 1) >> 8;
        if (length < 7) {
            out += static_cast<char>(length << 5 | high);
        } else {
            out += static_cast<char>(7 << 5 | high);
            out += static_cast<char>(length - 7);
        }
        out += static_cast<char>((distance - 1) & 255);
        at += best;
    }
    flush();
    return out;
}

/// The inverse, of all at once.
std::string unlzf(const std::string& in) {
    std::string out;
    for (std::size_t at = 0; at < in.size();) {
        const auto control = static_cast<unsigned char>(in[at++]);
        if (control < 32) {
            out += in.substr(at, control + 1U);
            at += control + 1U;
            continue;
        }
        std::size_t length = control >> 5;
        length += length == 7 ? static_cast<unsigned char>(in[at++]) : 0U;
        const std::size_t back = (control % 32U) * 256U + static_cast<unsigned char>(in[at++]) + 1U;
        for (std::size_t i = 0; i < length + 2; ++i) {
            out += out[out.size() - back];
        }
    }
    return out;
}

struct Field {
    std::string name;
    char type;
    std::size_t size;
    std::size_t count = 1;
    std::string values{};  // of all points
};

std::string text_of(const Field& field, const std::string& value) {
    const auto as = [&]<typename T>(T number) {
        std::memcpy(&number, value.data(), sizeof number);
        if constexpr (std::is_floating_point_v<T>) {
            char text[64];
            std::snprintf(text, sizeof text, "%.17g", static_cast<double>(number));
            return std::string(text);
        } else {
            return std::to_string(number);
        }
    };
    switch (field.type) {
        case 'F':
            return field.size == 4 ? as(0.0F) : as(0.0);
        case 'U':
            return field.size == 1   ? as(std::uint8_t{})
                   : field.size == 2 ? as(std::uint16_t{})
                   : field.size == 4 ? as(std::uint32_t{})
                                     : as(std::uint64_t{});
        default:
            return field.size == 1   ? as(std::int8_t{})
                   : field.size == 2 ? as(std::int16_t{})
                   : field.size == 4 ? as(std::int32_t{})
                                     : as(std::int64_t{});
    }
}

std::string pcd(const std::vector<Field>& fields, std::size_t points, const std::string& encoding) {
    const auto line = [&](const std::string& key, auto&& value) {
        std::string text = key;
        for (const Field& field : fields) {
            text += ' ';
            text += value(field);
        }
        return text + "\n";
    };
    std::string head = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n" +
                       line("FIELDS", [](const Field& f) { return f.name; }) +
                       line("SIZE", [](const Field& f) { return std::to_string(f.size); }) +
                       line("TYPE", [](const Field& f) { return std::string(1, f.type); }) +
                       line("COUNT", [](const Field& f) { return std::to_string(f.count); }) +
                       "WIDTH " + std::to_string(points) +
                       "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + std::to_string(points) +
                       "\nDATA " + encoding + "\n";
    if (encoding == "binary_compressed") {
        std::string data;
        for (const Field& field : fields) {
            data += field.name == "_" ? "" : field.values;
        }
        const std::string packed = lzf(data);
        return head + raw(static_cast<std::uint32_t>(packed.size())) +
               raw(static_cast<std::uint32_t>(data.size())) + packed;
    }
    for (std::size_t i = 0; i < points; ++i) {
        for (const Field& field : fields) {
            for (std::size_t k = 0; k < field.count; ++k) {
                const std::string value =
                    field.values.substr((i * field.count + k) * field.size, field.size);
                head += encoding == "ascii" ? text_of(field, value) + " " : value;
            }
        }
        head += encoding == "ascii" ? "\n" : "";
    }
    return head;
}

const std::vector<std::string> kEncodings{"ascii", "binary", "binary_compressed"};

/// Every type, counts above 1, padding, colours and normals; numbers that print exactly.
std::vector<Field> every_field(std::size_t points) {
    std::vector<Field> fields{{"label", 'U', 2},
                              {"z", 'F', 4},
                              {"_", 'U', 1, 3},
                              {"i1", 'I', 1},
                              {"u1", 'U', 1},
                              {"i2", 'I', 2},
                              {"i4", 'I', 4, 2},
                              {"u4", 'U', 4},
                              {"x", 'F', 4},
                              {"i8", 'I', 8},
                              {"u8", 'U', 8},
                              {"f8", 'F', 8, 3},
                              {"rgb", 'F', 4},
                              {"normal_x", 'F', 4},
                              {"_", 'F', 4, 1},
                              {"y", 'F', 4},
                              {"histogram", 'F', 4, 33}};
    std::mt19937_64 random(11);
    for (Field& field : fields) {
        for (std::size_t i = 0; i < points * field.count; ++i) {
            if (field.type == 'F') {
                const auto value = static_cast<float>(static_cast<int>(random() % 4001) - 2000) / 8;
                field.values += field.size == 4 ? raw(value) : raw(static_cast<double>(value));
            } else {
                field.values += raw(i % 3 == 0 ? random() : i).substr(0, field.size);
            }
        }
    }
    return fields;
}

TEST(Pcd, EveryFieldOfEveryEncodingIsReadBitForBit) {
    const ScanFolder folder;
    constexpr std::size_t kPoints = 2000;
    const std::vector<Field> fields = every_field(kPoints);
    std::string red;
    std::string blue;
    for (std::size_t i = 0; i < kPoints; ++i) {
        blue += fields[12].values[4 * i];
        red += fields[12].values[4 * i + 2];
    }
    for (const std::string& encoding : kEncodings) {
        const auto path = folder.write("a.pcd", pcd(fields, kPoints, encoding));
        const auto source = open_source(path);
        const std::vector<Attribute>& schema = source->info().schema;
        ASSERT_EQ(schema.size(), 17U);
        EXPECT_EQ(source->info().axes, (std::array<std::size_t, 3>{7, 15, 1}));
        EXPECT_EQ(source->info().coordinates.kind, CoordinateKind::kFloat32);
        EXPECT_EQ(source->info().seek_granularity, encoding == "binary" ? 1U : 0U);
        EXPECT_EQ(schema[5], (Attribute{"i4", ScalarType::kInt32, 2}));
        EXPECT_EQ(schema[11], (Attribute{"red", ScalarType::kUint8, 1}));
        EXPECT_EQ(schema[14], (Attribute{"nx", ScalarType::kFloat32, 1}));
        const std::vector<Vec3> points = read_all(path, 77);
        ASSERT_EQ(points.size(), kPoints);
        std::string z;
        for (const Vec3& point : points) {
            z += raw(static_cast<float>(point.z));
        }
        EXPECT_TRUE(z == fields[1].values) << encoding;
        const std::vector<std::size_t> all = attributes_of(source->info());
        const std::vector<std::string> columns = read_columns(*source, all, 300);
        const std::vector<std::size_t> field_of{0, 3, 4, 5, 6, 7, 9, 10, 11, 0, 0, 0, 13, 16};
        for (std::size_t i = 0; i < all.size(); ++i) {
            const std::string& name = schema[all[i]].name;
            const std::string& expected = name == "red"    ? red
                                          : name == "blue" ? blue
                                                           : fields[field_of[i]].values;
            EXPECT_TRUE(name == "green" || columns[i] == expected) << encoding << " " << name;
        }
    }
}

TEST(Pcd, ColumnsCanBeSelectedInTheMiddleAndSoughtInBinary) {
    const ScanFolder folder;
    const std::vector<Field> fields = every_field(900);
    for (const std::string& encoding : kEncodings) {
        const auto source = open_source(folder.write("a.pcd", pcd(fields, 900, encoding)));
        Chunk chunk;
        ASSERT_TRUE(source->read(chunk, 250));
        const std::vector<std::string> columns = read_columns(*source, {16, 0}, 100);
        EXPECT_TRUE(columns[0] == fields[16].values.substr(250 * 33 * 4)) << encoding;
        EXPECT_TRUE(columns[1] == fields[0].values.substr(250 * 2)) << encoding;
        if (encoding == "binary") {
            source->seek(899);
            EXPECT_TRUE(read_columns(*source, {0})[0] == fields[0].values.substr(899 * 2));
        } else {
            EXPECT_THROW(source->seek(1), InputError);
        }
    }
}

TEST(Pcd, CompressedDataMayHoldItsPadding) {
    const ScanFolder folder;
    std::vector<Field> fields = every_field(300);
    const std::string plain = pcd(fields, 300, "binary_compressed");
    // Named otherwise, padding is written; then it gets its name back.
    fields[2].name = "?";
    fields[14].name = "?";
    std::string padded = pcd(fields, 300, "binary_compressed");
    std::replace(padded.begin(), padded.begin() + 400, '?', '_');
    EXPECT_GT(padded.size(), plain.size());
    const auto path = folder.write("a.pcd", padded);
    EXPECT_EQ(read_all(path), read_all(folder.write("b.pcd", plain)));
    EXPECT_TRUE(read_columns(*open_source(path), {16})[0] == fields[16].values);
}

TEST(Pcd, WhatHasNoColumnIsToldAsUnsupported) {
    const ScanFolder folder;
    const auto source = open_source(folder.write(
        "a.pcd",
        "# .PCD v.6\r\nVERSION .6\r\nFIELDS x y z rgba\r\nSIZE 8 4 4 4\r\nTYPE F F F U\r\n"
        "WIDTH 2\r\nHEIGHT 2\r\nVIEWPOINT 1 0 0 1 0 0 0\r\nDATA ascii\r\n"
        "1 2 3 4278848257\r\nnan nan nan 0\r\n1 2 3 4\r\n5 6 7 8"));
    EXPECT_THAT(source->info().unsupported,
                testing::ElementsAre("the order in 2 rows of 2 points", "the viewpoint"));
    EXPECT_EQ(source->info().coordinates.kind, CoordinateKind::kFloat64);
    EXPECT_EQ(source->info().declared_count, 4U);
    EXPECT_THAT(read_columns(*source, {3, 4, 5, 6}),
                testing::ElementsAre(std::string("\x0a\0\0\0", 4), std::string("\x0b\0\0\0", 4),
                                     std::string("\1\0\4\10", 4), std::string("\xff\0\0\0", 4)));
}

TEST(Pcd, AMalformedFileIsAnErrorThatSaysWhereAndWhat) {
    const ScanFolder folder;
    const std::string fields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
    const std::string head = fields + "WIDTH 2\nHEIGHT 1\nDATA ";
    const std::vector<std::pair<std::string, std::string>> cases{
        {fields + "DATA ascii\n1 2 3\n", "line 4: expected a line 'WIDTH' or 'POINTS'"},
        {fields + "WIDTH 2\nHEIGHT 3\nPOINTS 5\nDATA ascii\n", "points as 2 x 3, found 5"},
        {fields + "WIDTH two\n", "line 4: expected 'WIDTH' and a number, found 'WIDTH two'"},
        {fields + "WIDTH 9999999999999999\nHEIGHT 9999999999\nDATA ascii\n", "more than a file"},
        {"FIELDS x y z\nSIZE 4 4\nTYPE F F F\nWIDTH 1\nDATA ascii\n", "a SIZE for each of 3"},
        {"FIELDS x y z\nSIZE 4 4 3\nTYPE F F F\nWIDTH 1\nDATA ascii\n", "found 'F of 3'"},
        {"FIELDS x y\nSIZE 4 4\nTYPE F F\nWIDTH 1\nDATA ascii\n", "one field 'z'"},
        {"SIZE 4 4\nDATA ascii\n", "a line 'FIELDS'"},
        {fields + "COUNT 1 1 0\nWIDTH 1\nDATA ascii\n", "a COUNT of field 'z'"},
        {head + "zipped\n", "line 6: expected 'DATA' with ascii, binary"},
        {head + "ascii\n1 2 3.00000\n4 5\n", "line 8: expected a value for each of 3 fields"},
        {head + "ascii\n1 2 3\n4 5 six\n", "line 8: expected a value of type float32 for 'z'"},
        {head + "ascii\n1 2 3\n4 5 6 7\n", "line 8: expected the end of the line, found '7'"},
        {head + "ascii\n1 2 3                 \n\n\n", "expected 2 points, found 1"},
        {head + "ascii\n1\n", "room for at most 0"},
        {head + "ascii\n1 2 3\n4 5 6\n7 8 9\n", "line 9: expected the end of the file"},
        {head + "binary\n" + std::string(23, 'x'), "expected 2 points of 12 bytes"},
        {head + "binary\n" + std::string(25, 'x'), "found 25 bytes"},
        {head + "binary_compressed\nshort", "compressed data"},
        {head + "binary_compressed\n" + raw(4U) + raw(24U) + "abc", "expected 4 bytes"},
        {head + "binary_compressed\n" + raw(2U) + raw(24U) + "abc", "expected 2 bytes"},
        {head + "binary_compressed\n" + raw(3U) + raw(25U) + "abc", "found 25 bytes"},
        {head + "binary_compressed\n" + raw(3U) + raw(24U) + "\1ab", "found its end"},
        {head + "binary_compressed\n" + raw(2U) + raw(24U) + std::string("\x20\0", 2),
         "a match from before the start"},
    };
    for (const auto& [content, says] : cases) {
        const std::string error = input_error_of(folder.write("a.pcd", content));
        EXPECT_THAT(error, HasSubstr("a.pcd: ")) << content;
        EXPECT_THAT(error, HasSubstr(says)) << content;
    }
}

TEST(Pcd, CutAtAnyLengthItIsAnError) {
    const ScanFolder folder;
    const std::vector<Field> fields = every_field(2);
    for (const std::string& encoding : kEncodings) {
        const std::string whole = pcd(fields, 2, encoding);
        // The last line may lack its end, and the blank before it.
        for (std::size_t n = 1; n + (encoding == "ascii" ? 2 : 0) < whole.size(); ++n) {
            const std::string part = whole.substr(0, n);
            const std::string error = input_error_of(folder.write("a.pcd", part));
            const bool number_cut = encoding == "ascii" && n + 8 > whole.size();
            EXPECT_TRUE(!error.empty() || number_cut) << encoding << " " << n;
        }
    }
}

TEST(Pcd, SharedFilesHoldTheirPoints) {
    if (!std::filesystem::exists(shared_data("pcd"))) {
        GTEST_SKIP() << "no shared data";
    }
    const auto data_of = [](const std::string& bytes) {
        return bytes.substr(bytes.find('\n', bytes.find("\nDATA ") + 1) + 1);
    };
    for (const std::string name : {"pcd/CSite1_red2-utm.pcd", "pcd/samp11-utm.pcd"}) {
        const std::vector<Vec3> points = read_all(shared_data(name), 5000);
        const std::string data = data_of(file_bytes(shared_data(name)));
        std::uint32_t packed = 0;
        std::memcpy(&packed, data.data(), sizeof packed);
        const std::string values = unlzf(data.substr(8, packed));
        ASSERT_EQ(values.size(), points.size() * 12) << name;
        std::string expected;
        for (const double Vec3::*axis : {&Vec3::x, &Vec3::y, &Vec3::z}) {
            for (const Vec3& point : points) {
                expected += raw(static_cast<float>(point.*axis));
            }
        }
        EXPECT_TRUE(values == expected) << name;
    }
    EXPECT_EQ(read_all(shared_data("pcd/samp11-utm.pcd")).size(), 38010U);
    EXPECT_EQ(read_all(shared_data("pcd/CSite1_red2-utm.pcd")).size(), 131622U);

    const std::string records = data_of(file_bytes(shared_data("pcd/ouster_binary.pcd")));
    const auto ouster = open_source(shared_data("pcd/ouster_binary.pcd"));
    const std::string intensity = read_columns(*ouster, {3})[0];
    ASSERT_EQ(intensity.size(), 115385U * 4);
    for (std::size_t i = 0; i < 115385; ++i) {
        ASSERT_EQ(intensity.substr(4 * i, 4), records.substr(16 * i + 12, 4));
    }

    const auto ascii = open_source(shared_data("pcd/simple-ascii.pcd"));
    const std::vector<std::string> colours = read_columns(*ascii, {3, 4, 5});
    ASSERT_EQ(colours[0].size(), 213U);
    // 4.2108e+06, the float's own bits: not a colour anyone meant, but what the file says.
    const std::string bits = raw(4.2108e+06F);
    EXPECT_EQ(colours[0][0], bits[2]);
    EXPECT_EQ(colours[1][0], bits[1]);
    EXPECT_EQ(colours[2][0], bits[0]);
}

}  // namespace
}  // namespace knap
