#include "store/position_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <limits>
#include <random>
#include <span>

#include "support/clouds.hpp"
#include "support/damage.hpp"
#include "support/random_table.hpp"

namespace knap {
namespace {

// The bits: what is not a number equals itself here.
std::vector<std::array<std::uint64_t, 3>> bits_of(const std::vector<Vec3>& points) {
    std::vector<std::array<std::uint64_t, 3>> bits;
    for (const Vec3& p : points) {
        bits.push_back({std::bit_cast<std::uint64_t>(p.x), std::bit_cast<std::uint64_t>(p.y),
                        std::bit_cast<std::uint64_t>(p.z)});
    }
    return bits;
}

std::vector<Vec3> read(const std::filesystem::path& path, const PositionCodec& codec) {
    PositionReader reader(path, codec);
    std::vector<Vec3> all;
    for (std::vector<Vec3> block; reader.next(block);) {
        EXPECT_FALSE(block.empty());
        all.insert(all.end(), block.begin(), block.end());
    }
    return all;
}

class PositionFileTest : public testing::Test {
  protected:
    // In blocks of any size, an empty one among them.
    void write(const PositionCodec& codec, const std::vector<Vec3>& points) {
        std::filesystem::remove(path_);
        PositionWriter writer(path_, codec);
        std::span<const Vec3> left(points);
        while (!left.empty()) {
            const std::size_t count = std::min<std::size_t>(left.size(), random_() % 50);
            writer.add(left.first(count));
            left = left.subspan(count);
        }
        EXPECT_FALSE(std::filesystem::exists(path_)) << "exists before it is finished";
        const std::uint64_t bytes = writer.finish();
        EXPECT_EQ(std::filesystem::file_size(path_), bytes);
    }

    test::TemporaryFolder folder_;
    std::filesystem::path path_ = folder_ / "0.positions";
    std::mt19937_64 random_{3};
};

TEST_F(PositionFileTest, GivesBackEveryPositionBitForBit) {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (int round = 0; round < 100; ++round) {
        const SourceTable table = test::random_table(random_, round % 2 == 0);
        for (std::size_t source = 0; source < table.sources().size(); ++source) {
            const CoordinateFormat& format = table.sources()[source].info.coordinates;
            std::vector<Vec3> points(random_() % 200);
            for (Vec3& p : points) {
                p = test::random_position(random_, table, source);
                if (format.kind != CoordinateKind::kInt32 && random_() % 10 == 0) {
                    p.y = random_() % 2 == 0 ? kNan : -kInfinity;
                }
            }
            const PositionCodec codec(format);
            write(codec, points);
            ASSERT_EQ(bits_of(read(path_, codec)), bits_of(points));
        }
    }
}

TEST_F(PositionFileTest, DamagedIsAnErrorNamingIt) {
    const PositionCodec codec(CoordinateFormat{.kind = CoordinateKind::kFloat32});
    write(codec, test::sphere_cloud(60, 1));
    test::with_each_bit_flipped(path_, [&](std::size_t at) {
        EXPECT_TRUE(test::refuses(path_, [&] { read(path_, codec); })) << "byte " << at;
    });
    test::with_each_cut(path_, [&](std::size_t size) {
        EXPECT_TRUE(test::refuses(path_, [&] { read(path_, codec); })) << size << " bytes";
    });
    EXPECT_TRUE(test::refuses(path_, [&] { read(path_, PositionCodec(CoordinateFormat{})); }))
        << "of another form";
    std::filesystem::remove(path_);
    EXPECT_TRUE(test::refuses(path_, [&] { read(path_, codec); })) << "missing";
    EXPECT_TRUE(test::refuses(folder_.path(), [&] { read(folder_.path(), codec); })) << "a folder";
}

}  // namespace
}  // namespace knap
