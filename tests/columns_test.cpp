#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <numeric>
#include <random>

#include "support/scan_files.hpp"

namespace knap {
namespace {

using test::raw;
using test::read_columns;
using test::ScanFolder;

/// A PLY of 1000 vertices with a value of every type, and what its columns hold.
struct EveryType {
    std::string elements;
    std::string ascii;
    std::string little;
    std::string big;
    std::vector<std::string> columns;

    template <typename T>
    void add(std::size_t column, T value) {
        little += raw(value);
        big += raw(value, true);
        columns[column] += raw(value);
        if constexpr (sizeof(T) == 1) {
            ascii += std::to_string(static_cast<int>(value)) + " ";
        } else if constexpr (std::is_floating_point_v<T>) {
            char text[64];
            std::snprintf(text, sizeof text, "%.17g ", static_cast<double>(value));
            ascii += text;
        } else {
            ascii += std::to_string(value) + " ";
        }
    }

    void add_list(std::size_t items) {
        ascii += std::to_string(items);
        little += static_cast<char>(items);
        big += static_cast<char>(items);
        for (std::size_t i = 0; i < items; ++i) {
            ascii += " 7";
            little += raw(std::int16_t{7});
            big += raw(std::int16_t{7}, true);
        }
        ascii += " ";
    }
};

EveryType every_type(bool with_list) {
    EveryType file;
    const std::string list = with_list ? "property list uchar short near\n" : "";
    file.elements =
        "element vertex 1000\nproperty char a\nproperty float z\nproperty uchar b\nproperty short "
        "c\nproperty ushort d\n" +
        list +
        "property float x\nproperty int e\nproperty uint f\nproperty int64 g\nproperty uint64 h\n"
        "property float y\nproperty float i\nproperty double a\nend_header\n";
    file.columns.resize(13);
    std::mt19937_64 random(3);
    for (int i = 0; i < 1000; ++i) {
        file.add(0, static_cast<std::int8_t>(random()));
        file.add(1, static_cast<float>(i));
        file.add(2, static_cast<std::uint8_t>(random()));
        file.add(3, static_cast<std::int16_t>(random()));
        file.add(4, static_cast<std::uint16_t>(random()));
        if (with_list) {
            file.add_list(static_cast<std::size_t>(i % 4));
        }
        file.add(5, static_cast<float>(2 * i));
        file.add(6, static_cast<std::int32_t>(random()));
        file.add(7, static_cast<std::uint32_t>(random()));
        file.add(8, static_cast<std::int64_t>(random()));
        file.add(9, random());
        file.add(10, static_cast<float>(3 * i));
        file.add(11, std::ldexp(static_cast<float>(random() % 100000), -7));
        file.add(12, std::ldexp(static_cast<double>(random() % 1000000007), -20));
        file.ascii.back() = '\n';
    }
    return file;
}

std::vector<std::filesystem::path> twins(const ScanFolder& folder, const EveryType& file) {
    return {
        folder.write("little.ply",
                     "ply\nformat binary_little_endian 1.0\n" + file.elements + file.little),
        folder.write("big.ply", "ply\nformat binary_big_endian 1.0\n" + file.elements + file.big)};
}

TEST(Columns, PlyColumnsOfEveryTypeAreReadBitForBit) {
    const ScanFolder folder;
    for (const bool with_list : {false, true}) {
        const EveryType file = every_type(with_list);
        for (const auto& path : twins(folder, file)) {
            const auto source = open_source(path);
            EXPECT_EQ(source->info().axes, (std::array<std::size_t, 3>{5, 10, 1}));
            EXPECT_EQ(source->info().schema[12].name, "a (2)");
            EXPECT_EQ(source->info().unsupported.size(), with_list ? 1U : 0U);
            const std::vector<std::size_t> all = attributes_of(source->info());
            ASSERT_EQ(all.size(), 10U);
            const std::vector<std::string> columns = read_columns(*source, all, 77);
            for (std::size_t i = 0; i < all.size(); ++i) {
                EXPECT_EQ(columns[i], file.columns[all[i]]) << path << " column " << i;
            }
        }
    }
}

TEST(Columns, ComeInTheOrderSelectedAndFromWhereTheReaderStands) {
    const ScanFolder folder;
    const EveryType file = every_type(false);
    const auto source = open_source(twins(folder, file)[0]);
    source->seek(400);
    const std::vector<std::size_t> selected{12, 3};
    const std::vector<std::string> columns = read_columns(*source, selected, 100);
    EXPECT_EQ(columns[0], file.columns[12].substr(400 * 8));
    EXPECT_EQ(columns[1], file.columns[3].substr(400 * 2));
}

TEST(Columns, NoneAreReadUnlessSelected) {
    const ScanFolder folder;
    const auto source = open_source(twins(folder, every_type(false))[0]);
    Chunk chunk;
    ASSERT_TRUE(source->read(chunk, 10));
    EXPECT_TRUE(chunk.columns.empty());
    source->select(std::vector<std::size_t>{0});
    ASSERT_TRUE(source->read(chunk, 10));
    EXPECT_EQ(chunk.columns.size(), 1U);
    source->select({});
    ASSERT_TRUE(source->read(chunk, 10));
    EXPECT_TRUE(chunk.columns.empty());
}

TEST(Columns, ACoordinateOrTheSameColumnTwiceCannotBeSelected) {
    const ScanFolder folder;
    const auto source = open_source(twins(folder, every_type(false))[0]);
    for (const std::vector<std::size_t>& wrong :
         {std::vector<std::size_t>{5}, std::vector<std::size_t>{0, 1}, std::vector<std::size_t>{13},
          std::vector<std::size_t>{2, 2}}) {
        EXPECT_THROW(source->select(wrong), ConfigError);
    }
}

std::string doubles(std::initializer_list<double> values) {
    std::string bytes;
    for (const double value : values) {
        bytes += raw(value);
    }
    return bytes;
}

TEST(Columns, OfTextHaveTheNamesOfTheHeaderOrNumbers) {
    const ScanFolder folder;
    const auto csv = open_source(folder.write(
        "a.csv",
        "name,Z,quality,x,y,word,quality\nq,1,0.1,2,3,7,\nr,4,,5,6,w,-1e300\ns,7,3,8,9\n"));
    EXPECT_EQ(csv->info().axes, (std::array<std::size_t, 3>{2, 3, 0}));
    EXPECT_EQ(csv->info().unsupported,
              (std::vector<std::string>{"words in column 'name'", "words in column 'word'"}));
    const std::vector<std::size_t> all = attributes_of(csv->info());
    ASSERT_EQ(all, (std::vector<std::size_t>{1, 4}));
    EXPECT_EQ(csv->info().schema[4].name, "quality (2)");
    const double missing = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(read_columns(*csv, {4, 1}, 2),
              (std::vector<std::string>{doubles({missing, -1e300, missing}),
                                        doubles({0.1, missing, 3})}));

    const auto xyz = open_source(folder.write("a.xyz", "1 2 3 4 5\n1 2 3 0x 6\n1 2 3 7 8\n"));
    EXPECT_EQ(xyz->info().schema[3].name, "column5");
    EXPECT_EQ(xyz->info().unsupported, (std::vector<std::string>{"words in column 'column4'"}));
    EXPECT_EQ(read_columns(*xyz, {3}), (std::vector<std::string>{doubles({5, 6, 8})}));
}

TEST(Columns, AWordFarDownATextColumnIsAnErrorOnlyIfTheColumnIsWanted) {
    const ScanFolder folder;
    std::string text;
    for (int i = 0; i < 2000; ++i) {
        text += "1 2 3 4\n";
    }
    const auto path = folder.write("a.xyz", text + "1 2 3 four\n");
    EXPECT_EQ(test::read_all(path).size(), 2001U);
    try {
        read_columns(*open_source(path), {3});
        ADD_FAILURE() << "no error";
    } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()).find("line 2001: expected a number in column 4"),
                  std::string::npos)
            << error.what();
    }
}

TEST(Columns, AValueThatItsTypeCannotHoldIsAnErrorOnlyIfItIsWanted) {
    const ScanFolder folder;
    const std::string head =
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        "property float z\nproperty ";
    const auto read = [&](const std::string& type, const std::string& value) {
        const auto path =
            folder.write("a.ply", head + type + " a\nend_header\n1 2 3 " + value + "\n");
        EXPECT_EQ(test::read_all(path).size(), 1U);
        return read_columns(*open_source(path), {3})[0];
    };
    EXPECT_EQ(read("int64", "-9223372036854775808"), raw(std::numeric_limits<std::int64_t>::min()));
    EXPECT_EQ(read("uint64", "18446744073709551615"), raw(~std::uint64_t{0}));
    EXPECT_EQ(read("uchar", "+7.0"), raw(std::uint8_t{7}));
    EXPECT_EQ(read("float", "1e99"), raw(std::numeric_limits<float>::infinity()));
    for (const auto& [type, value] :
         std::vector<std::pair<std::string, std::string>>{{"uchar", "256"},
                                                          {"char", "-129"},
                                                          {"short", "1.5"},
                                                          {"uint64", "18446744073709551616"},
                                                          {"int64", "9223372036854775808"},
                                                          {"double", "one"},
                                                          {"uint", "-1"}}) {
        EXPECT_THROW(read(type, value), InputError) << type << " " << value;
    }
}

TEST(Columns, OfSharedPlysAreTheSameInAsciiAndBinary) {
    if (!std::filesystem::exists(test::shared_data("ply"))) {
        GTEST_SKIP() << "no shared data";
    }
    const auto ascii = open_source(test::shared_data("ply/test_pos_color_ascii.ply"));
    const auto binary = open_source(test::shared_data("ply/test_pos_color.ply"));
    const std::vector<std::size_t> all = attributes_of(ascii->info());
    ASSERT_EQ(all.size(), 4U);
    EXPECT_EQ(ascii->info().schema, binary->info().schema);
    EXPECT_EQ(read_columns(*ascii, all), read_columns(*binary, all));
}

}  // namespace
}  // namespace knap
