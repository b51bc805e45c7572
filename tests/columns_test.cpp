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

}  // namespace
}  // namespace knap
