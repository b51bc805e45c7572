#include "emit/draco_tile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "emit/tiles.hpp"
#include "knap/error.hpp"
#include "support/clouds.hpp"

namespace knap {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

/// Points of a tile, sorted, the first of them its lowest corner.
std::vector<LatticeIndex> random_tile(std::mt19937_64& random, const LatticeIndex& origin,
                                      std::int64_t side, std::size_t count) {
    std::uniform_int_distribution<std::int64_t> coordinate(0, side - 1);
    std::vector<LatticeIndex> points(count);
    for (LatticeIndex& point : points) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            point[axis] = origin[axis] + coordinate(random);
        }
    }
    points.back() = {origin[0] + side - 1, origin[1] + side - 1, origin[2]};
    points.front() = origin;
    std::sort(points.begin(), points.end());
    return points;
}

std::vector<LatticeIndex> sorted(std::vector<LatticeIndex> points) {
    std::sort(points.begin(), points.end());
    return points;
}

TEST(DracoTile, GivesBackEveryLatticeIndex) {
    std::mt19937_64 random(1);
    for (int round = 0; round < 400; ++round) {
        const double decimal = std::pow(10, static_cast<int>(random() % 13) - 8);
        const double steps[] = {decimal, decimal / 3,
                                std::ldexp(1, -static_cast<int>(random() % 40)),
                                decimal * static_cast<double>(1 + random() % 1000)};
        const Lattice lattice{{decimal, -decimal, 1e6 / 3}, steps[random() % 4]};
        const std::int64_t side = std::int64_t{1} << (random() % (kTileBits + 1));
        const auto corner = [&] {
            return static_cast<std::int64_t>(random() % (std::uint64_t{1} << 52)) -
                   (std::int64_t{1} << 51);
        };
        const LatticeIndex origin{corner(), corner(), corner()};
        const std::vector<LatticeIndex> points =
            random_tile(random, origin, side, 1 + random() % 500);
        const DecodedTile tile =
            decode_tile(encode_tile(points, origin, lattice, "EPSG:1"), "tile");
        EXPECT_EQ(sorted(tile.points), points);
        EXPECT_EQ(tile.origin, origin);
        EXPECT_EQ(tile.lattice.origin, lattice.origin);
        EXPECT_EQ(tile.lattice.step, lattice.step);
        EXPECT_EQ(tile.crs, "EPSG:1");
    }
}

TEST(DracoTile, GivesBackTheLargestIndexForAnyStep) {
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> exponent(-30, 30);
    for (int round = 0; round < 200; ++round) {
        const Lattice lattice{{}, std::pow(10, exponent(random))};
        const std::vector<LatticeIndex> points =
            random_tile(random, {0, 0, 0}, std::int64_t{1} << kTileBits, 200);
        EXPECT_EQ(sorted(decode_tile(encode_tile(points, {}, lattice, ""), "tile").points), points);
    }
}

TEST(DracoTile, KeepsUtmCoordinatesToTheBit) {
    const Lattice lattice{{500000, 4000000, 0}, 0.00025};
    std::mt19937_64 random(3);
    const LatticeIndex origin{412345678, -1987654321, 40000};
    const std::vector<LatticeIndex> points = random_tile(random, origin, 1 << 20, 5000);
    const DecodedTile tile = decode_tile(encode_tile(points, origin, lattice, ""), "tile");
    std::multiset<double> expected;
    std::multiset<double> found;
    for (const LatticeIndex& index : points) {
        expected.insert(static_cast<double>(index[0]) * 0.00025 + 500000);
    }
    for (const LatticeIndex& index : tile.points) {
        found.insert(position_of(tile.lattice, index).x);
    }
    EXPECT_EQ(found, expected);
}

TEST(DracoTile, HoldsCoincidentPointsAndNone) {
    const Lattice lattice{{}, 0.5};
    const std::vector<LatticeIndex> points(1000, LatticeIndex{3, 4, 5});
    EXPECT_EQ(decode_tile(encode_tile(points, {3, 4, 5}, lattice, ""), "tile").points, points);
    EXPECT_TRUE(decode_tile(encode_tile({}, {}, lattice, ""), "tile").points.empty());
}

TEST(DracoTile, DamagedBytesAreAnErrorNamingTheFileOrDecode) {
    std::mt19937_64 random(4);
    const std::vector<std::byte> good =
        encode_tile(random_tile(random, {0, 0, 0}, 1000, 300), {0, 0, 0}, {{}, 0.25}, "EPSG:1");
    for (std::size_t size = 0; size < good.size(); size += 7) {
        EXPECT_THAT([&] { decode_tile(std::span(good).first(size), "some.drc"); },
                    ThrowsMessage<InputError>(HasSubstr("some.drc")));
    }
    std::size_t errors = 0;
    for (std::size_t i = 0; i < good.size(); ++i) {
        std::vector<std::byte> bad = good;
        bad[i] ^= std::byte{1} << (random() % 8);
        try {
            decode_tile(bad, "some.drc");
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), HasSubstr("some.drc"));
            ++errors;
        }
    }
    EXPECT_GT(errors, 0U);
}

TEST(DracoTile, ADracoFileOfAnotherProgramIsAnErrorNamingIt) {
    const std::filesystem::path folder = std::filesystem::path(KNAP_SHARED_DATA) / "drc";
    if (!std::filesystem::exists(folder)) {
        GTEST_SKIP() << "no test clouds at " << folder;
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        if (entry.path().extension() == ".drc") {
            const std::string text = read_text_file(entry.path());
            const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
            EXPECT_THAT([&] { decode_tile(bytes, entry.path()); },
                        ThrowsMessage<InputError>(HasSubstr(entry.path().filename().string())));
        }
    }
}

/// The positions of a binary PLY whose only properties are three floats.
std::vector<std::array<float, 3>> positions_of_ply(const std::filesystem::path& path) {
    const std::string text = read_text_file(path);
    const std::string end = "end_header\n";
    const std::size_t start = text.find(end) + end.size();
    std::vector<std::array<float, 3>> positions((text.size() - start) / 12);
    std::memcpy(positions.data(), text.data() + start, positions.size() * 12);
    return positions;
}

TEST(DracoTile, TheDecoderOfDracoFindsTheSamePositions) {
    if (std::system("command -v draco_decoder > /dev/null") != 0) {
        GTEST_SKIP() << "draco_decoder is not installed";
    }
    const test::TemporaryFolder scratch;
    std::mt19937_64 random(5);
    for (const double step : {0.01, 0.00025, 0x1p-20, 0.3}) {
        const Lattice lattice{{500000, 4000000, 0}, step};
        const LatticeIndex origin{1234567, 1 << 30, -99};
        const std::vector<LatticeIndex> points = random_tile(random, origin, 1 << 20, 2000);
        const std::vector<std::byte> bytes = encode_tile(points, origin, lattice, "EPSG:32633");
        const std::filesystem::path drc = scratch.path() / "tile.drc";
        const std::filesystem::path ply = scratch.path() / "tile.ply";
        append_to_file(drc, bytes);
        const std::string command = "draco_decoder -i " + drc.string() + " -o " + ply.string();
        ASSERT_EQ(std::system((command + " > /dev/null").c_str()), 0);

        std::vector<LatticeIndex> found;
        for (const std::array<float, 3>& local : positions_of_ply(ply)) {
            LatticeIndex index;
            for (std::size_t axis = 0; axis < 3; ++axis) {
                index[axis] = origin[axis] + std::llround(static_cast<double>(local[axis]) / step);
            }
            found.push_back(index);
        }
        EXPECT_EQ(sorted(found), points);
        std::filesystem::remove(drc);
    }
}

}  // namespace
}  // namespace knap
