#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

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

/// One member of a gzip file.
std::string gzip(std::string bytes) {
    z_stream stream{};
    deflateInit2(&stream, 6, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY);
    std::string out(deflateBound(&stream, bytes.size()) + 100, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(bytes.data());
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    deflate(&stream, Z_FINISH);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    return out;
}

std::string binary_ply(std::size_t points, std::size_t faces) {
    std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                        std::to_string(points) +
                        "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar "
                        "red\nelement face " +
                        std::to_string(faces) + "\nproperty int a\nend_header\n";
    std::mt19937 random(5);
    for (std::size_t i = 0; i < points; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            bytes += raw(static_cast<float>(random()));
        }
        bytes += static_cast<char>(random());
    }
    return bytes + std::string(4 * faces, 'f');
}

TEST(Gzip, WhatItHoldsIsReadAsItWouldBeWithoutIt) {
    const ScanFolder folder;
    std::string text = "x,y,z,name,quality\n";
    std::string ascii =
        "ply\nformat ascii 1.0\nelement vertex 50000\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nend_header\n";
    for (int i = 0; i < 50000; ++i) {
        text += std::to_string(i) + ",2,3,n," + std::to_string(-i) + "\n";
        ascii += std::to_string(i) + " 2 3 " + std::to_string(i % 256) + "\n";
    }
    const std::vector<std::pair<std::string, std::string>> files{
        {"a.csv", text}, {"b.ply", ascii}, {"c.ply", binary_ply(200000, 1000)}};
    for (const auto& [name, bytes] : files) {
        const auto plain = open_source(folder.write(name, bytes));
        const auto path = folder.write(name + ".gz", gzip(bytes));
        const auto packed = open_source(path);
        EXPECT_EQ(packed->info().format, plain->info().format + ", gzip");
        EXPECT_EQ(packed->info().schema, plain->info().schema);
        EXPECT_EQ(packed->info().coordinates, plain->info().coordinates);
        EXPECT_EQ(packed->info().declared_count, plain->info().declared_count);
        EXPECT_EQ(packed->info().size_bytes, std::filesystem::file_size(path));
        EXPECT_EQ(packed->info().seek_granularity, 0U);
        EXPECT_THROW(packed->seek(1), InputError);
        EXPECT_EQ(read_all(path), read_all(folder.path() / name)) << name;
        const std::vector<std::size_t> all = attributes_of(plain->info());
        EXPECT_TRUE(read_columns(*packed, all, 777) == read_columns(*plain, all)) << name;
    }
    // By content, whatever the name says.
    EXPECT_EQ(read_all(folder.write("d.ply", gzip(binary_ply(9, 2)))).size(), 9U);
}

TEST(Gzip, MembersFollowOneAnotherAndZerosMayFillTheEnd) {
    const ScanFolder folder;
    const std::string bytes = binary_ply(1000, 0);
    const auto expected = read_all(folder.write("a.ply", bytes));
    const std::string members = gzip(bytes.substr(0, 5000)) + gzip("") + gzip(bytes.substr(5000));
    EXPECT_EQ(read_all(folder.write("a.ply.gz", members)), expected);
    EXPECT_EQ(read_all(folder.write("a.ply.gz", members + std::string(999, '\0'))), expected);
    EXPECT_THAT(input_error_of(folder.write("a.ply.gz", members + "more")),
                HasSubstr("expected gzip data"));
}

TEST(Gzip, CutAtAnyLengthItIsAnError) {
    const ScanFolder folder;
    for (const std::string& whole : {gzip("1 2 3\n4 5 6\n7 8 9\n"), gzip(binary_ply(20, 3))}) {
        for (std::size_t n = 2; n < whole.size(); ++n) {
            EXPECT_NE(input_error_of(folder.write("a.gz", whole.substr(0, n))), "") << n;
        }
    }
}

TEST(Gzip, AnyFlippedByteIsAnErrorOrHarmless) {
    const ScanFolder folder;
    const std::string bytes = binary_ply(20, 3);
    const std::string whole = gzip(bytes);
    const auto expected = read_all(folder.write("a.ply", bytes));
    for (std::size_t i = 2; i < whole.size(); ++i) {
        std::string changed = whole;
        changed[i] = static_cast<char>(~changed[i]);
        const auto path = folder.write("b.ply.gz", changed);
        // The head holds a time and a system, which no one checks.
        if (const std::string error = input_error_of(path); error.empty()) {
            EXPECT_LT(i, 10U);
            EXPECT_EQ(read_all(path), expected);
        } else {
            EXPECT_TRUE(error.starts_with(path.string() + ": ")) << error;
        }
    }
}

TEST(Gzip, MissingOrSurplusDataOfABinaryPlyIsAnError) {
    const ScanFolder folder;
    const std::string bytes = binary_ply(50, 7);
    EXPECT_THAT(input_error_of(folder.write("a.gz", gzip(bytes.substr(0, bytes.size() - 1)))),
                HasSubstr("the data ends early"));
    EXPECT_THAT(input_error_of(folder.write("b.gz", gzip(bytes.substr(0, bytes.size() - 40)))),
                HasSubstr("the data ends early"));
    EXPECT_THAT(input_error_of(folder.write("c.gz", gzip(bytes + "x"))),
                HasSubstr("found some bytes more"));
}

TEST(Gzip, OtherFormatsInItAreRefusedByName) {
    const ScanFolder folder;
    EXPECT_THAT(input_error_of(folder.write("a.las.gz", gzip(test::LasFile().bytes()))),
                HasSubstr("a gzip file that holds neither PLY nor text"));
    EXPECT_THAT(input_error_of(folder.write("a.gz", gzip(std::string("\0\1\2", 3)))),
                HasSubstr("a gzip file of an unknown format"));
}

TEST(Gzip, TheSharedScansHoldTheirPoints) {
    if (!std::filesystem::exists(shared_data("scans"))) {
        GTEST_SKIP() << "no shared data";
    }
    EXPECT_EQ(read_all(shared_data("scans/dragon_vrip.ply.gz"), 10000).size(), 437645U);
    EXPECT_EQ(read_all(shared_data("scans/happy_layers.ply.gz"), 10000).size(), 1099005U);
}

}  // namespace
}  // namespace knap
