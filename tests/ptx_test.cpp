#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "knap/source.hpp"
#include "support/scan_files.hpp"

namespace knap {
namespace {

using test::read_all;
using test::ScanFolder;
using test::shared_data;
using testing::HasSubstr;

const std::string kHeader = "2\n3\n5 6 7\n1 0 0\n0 1 0\n0 0 1\n";
const std::string kTurned = "0 1 0 0\n-1 0 0 0\n0 0 2 0\n100 200 300 1\n";
const std::string kCells = "1 2 3 0.5\n0 0 0 0.25\n4 5 6 1\n7 8 9 0\n0 0 0 0.5\n0 0 1e-3 0.125\n";

/// All points and columns.
Chunk read_all_columns(const std::filesystem::path& path) {
    const auto source = open_source(path);
    source->select(attributes_of(source->info()));
    Chunk all;
    all.columns.resize(attributes_of(source->info()).size());
    for (Chunk chunk; source->read(chunk, 4);) {
        EXPECT_EQ(chunk.first, all.positions.size());
        all.positions.insert(all.positions.end(), chunk.positions.begin(), chunk.positions.end());
        for (std::size_t i = 0; i < all.columns.size(); ++i) {
            all.columns[i].insert(all.columns[i].end(), chunk.columns[i].begin(),
                                  chunk.columns[i].end());
        }
    }
    return all;
}

std::vector<double> doubles(const std::vector<std::byte>& bytes) {
    std::vector<double> values(bytes.size() / sizeof(double));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
}

TEST(Ptx, EveryCellIsAPointMovedByTheMatrixAndOneWithoutReturnIsNoNumber) {
    const ScanFolder folder;
    const Chunk all = read_all_columns(folder.write("a.ptx", kHeader + kTurned + kCells));
    ASSERT_EQ(all.positions.size(), 6U);
    EXPECT_EQ(all.positions[0], (Vec3{98, 201, 306}));
    EXPECT_EQ(all.positions[2], (Vec3{95, 204, 312}));
    EXPECT_EQ(all.positions[5], (Vec3{100, 200, 300.002}));
    for (const std::size_t empty : {1U, 4U}) {
        EXPECT_FALSE(is_finite(all.positions[empty]));
    }
    ASSERT_EQ(all.columns.size(), 1U);
    EXPECT_EQ(doubles(all.columns[0]), (std::vector<double>{0.5, 0.25, 1, 0, 0.5, 0.125}));
}

TEST(Ptx, EveryScanHasAMatrixOfItsOwnAndMayBeEmpty) {
    const ScanFolder folder;
    const std::string still = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    const std::string empty = "0\n7\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n" + still;
    const std::string text =
        empty + kHeader + kTurned + kCells + "\n" + empty + kHeader + still + kCells + empty;
    for (const char* name : {"a.ptx", "a.data"}) {
        const Chunk all = read_all_columns(folder.write(name, text));
        ASSERT_EQ(all.positions.size(), 12U) << name;
        EXPECT_EQ(all.positions[3], (Vec3{92, 207, 318}));
        EXPECT_EQ(all.positions[9], (Vec3{7, 8, 9}));
        EXPECT_EQ(doubles(all.columns[0])[9], 0);
    }
}

TEST(Ptx, HoweverManyScansMayBeEmpty) {
    const ScanFolder folder;
    const std::string empty = "0\n7\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n" + kTurned;
    std::string text = kHeader + kTurned + kCells + "\n";
    for (int i = 0; i < 200'000; ++i) {
        text += empty;
    }
    EXPECT_EQ(read_all(folder.write("a.ptx", text)).size(), 6U);
}

TEST(Ptx, ColoursAreBytes) {
    const ScanFolder folder;
    const auto path = folder.write("a.ptx", "1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n" + kTurned +
                                                "1 2 3 0.5 1 2 255\n0 0 0 0.5 0 0 0\n");
    const std::unique_ptr<PointSource> source = open_source(path);
    const std::vector<Attribute>& schema = source->info().schema;
    ASSERT_EQ(schema.size(), 7U);
    EXPECT_EQ(schema[6], (Attribute{"blue", ScalarType::kUint8, 1}));
    EXPECT_EQ(read_all_columns(path).columns[3],
              (std::vector<std::byte>{std::byte{255}, std::byte{0}}));
}

TEST(Ptx, WhatIsNotIsAnErrorWithFileAndLine) {
    struct Case {
        std::string content;
        std::string says;
    };
    const std::string start = kHeader + kTurned;
    const std::vector<Case> cases{
        {"\n", "expected a number of columns, found the end of the file"},
        {"two\n3\n", "line 1: expected a number of columns, found 'two'"},
        {"2\n3 3\n", "line 2: expected a number of rows, found '3 3'"},
        {"9999999999\n9999999999\n", "line 2: expected at most"},
        {"2\n3\n0 0\n", "line 3: expected 3 numbers, found '0 0'"},
        {"2\n3\n0 0 0\n", "expected a header of ten lines, found the end of the file"},
        {kHeader + "1 0 0 7\n", "line 7: expected 0 as the fourth number"},
        {kHeader + "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 0\n", "line 10: expected 1 as the fourth"},
        {start, "expected the first cell, found the end of the file"},
        {start + "1 2 3\n", "line 11: expected 4 or 7 columns, found 3"},
        {start + "1 2 3 4\n1 2 3 4 5 6 7\n", "line 12: expected 4 columns as in the first cell"},
        {start + "1 2 x 4\n", "line 11: expected a number in column 3, found 'x'"},
        {start + "1 2 3 4 5 6 256\n", "line 11: expected a value of uint8 in column 7"},
        {start + "1 2 3 4\n5 6 7 8\n", "ends early: expected 6 cells in the scan of line 1"},
        {start + kCells + "1 2 3 4\n", "line 17: expected a number of columns, found '1 2 3 4'"},
    };
    const ScanFolder folder;
    for (const Case& test : cases) {
        const auto path = folder.write("a.ptx", test.content);
        std::string error;
        try {
            read_all_columns(path);
        } catch (const std::exception& failure) {
            error = failure.what();
        }
        EXPECT_THAT(error, HasSubstr("a.ptx: ")) << test.content;
        EXPECT_THAT(error, HasSubstr(test.says)) << test.content;
    }
}

TEST(Ptx, ReadsTheSharedFile) {
    if (!std::filesystem::exists(shared_data("text"))) {
        GTEST_SKIP() << "no shared data";
    }
    const Chunk all = read_all_columns(shared_data("text/no-color.ptx"));
    ASSERT_EQ(all.positions.size(), 15U);
    EXPECT_EQ(all.positions[0], (Vec3{637012.24, 849028.31, 431.66}));
    EXPECT_EQ(doubles(all.columns[0])[0], 0.034912);
}

}  // namespace
}  // namespace knap
