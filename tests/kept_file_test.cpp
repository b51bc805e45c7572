#include "emit/kept_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "knap/error.hpp"
#include "support/clouds.hpp"
#include "support/damage.hpp"

namespace knap {
namespace {

const Lattice kLattice{{-3, 5, 0}, 0.125};

SourceTable table_of(std::size_t points) {
    SourceEntry entry;
    entry.points = points;
    Box box;
    box.extend(Vec3{-1e6, -1e6, -1e6});
    box.extend(Vec3{1e6, 1e6, 1e6});
    entry.info.coordinates.kind = CoordinateKind::kFloat64;
    return {{entry}, box};
}

// Few distinct coordinates: most points share theirs with others, and some all three.
std::vector<Vec3> kept_points(std::mt19937_64& random) {
    const int side = 1 << (random() % 20);
    std::uniform_int_distribution<int> step(-side, side);
    std::vector<Vec3> points(2 + random() % 3000);
    for (Vec3& point : points) {
        point = position_of(kLattice, {step(random), step(random) / 3, step(random) / 40});
    }
    return points;
}

KeptFile write(const std::filesystem::path& path, const SourceTable& table,
               const std::vector<Vec3>& points) {
    KeptFileWriter writer(path, table, kLattice);
    for (std::size_t i = 0; i < points.size(); ++i) {
        writer.add(i, points[i]);
    }
    return writer.finish();
}

std::vector<LatticeIndex> sorted_indices(const KeptSplitter& splitter, const KeptFile& file) {
    std::vector<LatticeIndex> indices;
    splitter.read(
        file, [&](PointId, const Vec3&, const LatticeIndex& index) { indices.push_back(index); });
    std::sort(indices.begin(), indices.end());
    return indices;
}

TEST(KeptFile, IsHalvedAsPointsInMemoryAre) {
    std::mt19937_64 random(1);
    const test::TemporaryFolder folder;
    for (int round = 0; round < 200; ++round) {
        const std::vector<Vec3> points = kept_points(random);
        const SourceTable table = table_of(points.size());
        const KeptSplitter splitter(table, kLattice, 1 + random() % 50, [] {});
        const KeptFile file = write(folder.path() / "all", table, points);
        const auto [lower, upper] =
            splitter.split(file, folder.path() / "lower", folder.path() / "upper");

        std::vector<LatticeIndex> all = sorted_indices(splitter, file);
        ASSERT_EQ(all.size(), points.size());
        const LatticeBounds bounds = bounds_of(all);
        EXPECT_EQ(file.bounds, bounds);
        const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
        std::nth_element(all.begin(), middle, all.end(), AlongAxis{longest_axis(bounds)});
        std::sort(all.begin(), middle);
        std::sort(middle, all.end());
        EXPECT_EQ(sorted_indices(splitter, lower), std::vector(all.begin(), middle)) << round;
        EXPECT_EQ(sorted_indices(splitter, upper), std::vector(middle, all.end())) << round;
        EXPECT_EQ(lower.points + upper.points, points.size());
        EXPECT_EQ(lower.bounds, bounds_of(std::vector(all.begin(), middle)));
    }
}

TEST(KeptFile, FindsThePointOfAnyRankHoweverFewItMayHold) {
    std::mt19937_64 random(2);
    const test::TemporaryFolder folder;
    for (int round = 0; round < 100; ++round) {
        const std::vector<Vec3> points = kept_points(random);
        const SourceTable table = table_of(points.size());
        const KeptFile file = write(folder.path() / "all", table, points);
        const KeptSplitter splitter(table, kLattice, 1, [] {});
        std::vector<LatticeIndex> all = sorted_indices(splitter, file);
        const AlongAxis order{random() % 3};
        std::sort(all.begin(), all.end(), order);
        const std::size_t rank = random() % all.size();
        const auto found = splitter.point_of_rank(file, order, rank);
        EXPECT_EQ(found.point, all[rank]) << round;
        const auto first = std::lower_bound(all.begin(), all.end(), all[rank], order);
        EXPECT_EQ(found.before, static_cast<std::uint64_t>(first - all.begin())) << round;
    }
}

TEST(KeptFile, ThatIsDamagedIsAnErrorNamingIt) {
    const test::TemporaryFolder folder;
    const std::vector<Vec3> points(1000, Vec3{1, 2, 3});
    const SourceTable table = table_of(points.size());
    const KeptFile file = write(folder.path() / "all", table, points);
    std::string bytes = test::read_bytes(file.path);
    bytes[bytes.size() / 2] ^= 4;
    test::write_bytes(file.path, bytes);
    const KeptSplitter splitter(table, kLattice, 100, [] {});
    EXPECT_TRUE(test::refuses(file.path, [&] {
        splitter.split(file, folder.path() / "lower", folder.path() / "upper");
    }));
}

}  // namespace
}  // namespace knap
