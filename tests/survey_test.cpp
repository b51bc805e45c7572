#include "survey/survey.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <random>

#include "base/checksum.hpp"
#include "knap/error.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"
#include "support/damage.hpp"

namespace knap {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::uint64_t kAmple = std::uint64_t{64} << 20;

Survey survey_silently(const SurveyRequest& request) {
    return survey(request, [](std::uint64_t) {});
}

// The positions that a survey has left of one source, which must be its own.
std::vector<Vec3> positions_of(const Survey& found, std::size_t source) {
    std::vector<Vec3> positions;
    for (const PositionFile& file : found.staged.files) {
        if (file.source == source) {
            EXPECT_EQ(file.first, positions.size()) << "without a gap";
            EXPECT_EQ(file.bytes, std::filesystem::file_size(file.path));
            PositionReader reader(file.path,
                                  PositionCodec(found.table.infos()[source].coordinates));
            for (std::vector<Vec3> block; reader.next(block);) {
                positions.insert(positions.end(), block.begin(), block.end());
            }
            EXPECT_EQ(file.first + file.count, positions.size());
        }
    }
    return positions;
}

// Writes a cloud as one to four files; some may be empty.
std::vector<std::filesystem::path> write_parts(const test::TemporaryFolder& folder,
                                               std::mt19937_64& random,
                                               const std::vector<Vec3>& cloud) {
    std::vector<std::filesystem::path> files;
    const std::size_t parts = 1 + random() % 4;
    std::size_t begin = 0;
    for (std::size_t part = 0; part < parts; ++part) {
        const std::size_t end =
            part + 1 == parts ? cloud.size() : begin + random() % (cloud.size() - begin + 1);
        files.push_back(folder / (std::to_string(part) + ".ply"));
        test::write_ply(files.back(), {cloud.begin() + static_cast<std::ptrdiff_t>(begin),
                                       cloud.begin() + static_cast<std::ptrdiff_t>(end)});
        begin = end;
    }
    return files;
}

TEST(Survey, LeavesThePositionsOfSourcesThatAreSlowToRead) {
    const test::TemporaryFolder folder;
    std::vector<Vec3> cloud = test::sphere_cloud(150000, 6);
    cloud[7].x = cloud[70000].y = std::numeric_limits<double>::quiet_NaN();
    test::write_ascii_ply(folder / "a.ply", cloud);
    test::write_ply(folder / "b.ply", cloud, true);
    test::write_bytes(folder / "c.xyz", "1 2 3\n4.5 5 1e-3\n");
    const std::vector<std::filesystem::path> files{folder / "a.ply", folder / "b.ply",
                                                   folder / "c.xyz"};
    const auto bytes = position_bytes(survey_silently({.files = files}).table.infos());
    EXPECT_GE(bytes, 150000U * 12);
    for (const int threads : {1, 3}) {
        const test::TemporaryFolder scratch;
        const Survey found = survey_silently({.files = files,
                                              .threads = threads,
                                              .budget_bytes = kAmple,
                                              .positions = scratch.path()});
        const std::vector<Vec3> first = positions_of(found, 0);
        const std::vector<Vec3> expected = test::read_cloud(files[0]);
        ASSERT_EQ(first.size(), expected.size());
        for (std::size_t i = 0; i < first.size(); ++i) {
            ASSERT_EQ(is_finite(first[i]), is_finite(expected[i]));
            ASSERT_TRUE(!is_finite(first[i]) || first[i] == expected[i]);
        }
        EXPECT_TRUE(positions_of(found, 1).empty()) << "records lie ready";
        EXPECT_EQ(positions_of(found, 2), test::read_cloud(files[2]));
        EXPECT_GE(found.staged.files.size(), 4U) << "in several files";
    }
    EXPECT_TRUE(survey_silently({.files = files}).staged.files.empty()) << "nowhere to put them";
}

TEST(Survey, CountsEveryPointOfEverySourceAndBoundsTheFiniteOnes) {
    std::mt19937_64 random(1);
    const test::TemporaryFolder folder;
    for (int round = 0; round < 100; ++round) {
        const std::vector<Vec3> cloud = test::random_cloud(random);
        const test::Points finite = test::finite_points(cloud);
        const auto files = write_parts(folder, random, cloud);
        std::atomic<std::uint64_t> told{0};
        const Survey found = survey(
            {.files = files, .threads = static_cast<int>(1 + random() % 3), .budget_bytes = kAmple},
            [&](std::uint64_t points) { told += points; });
        ASSERT_EQ(found.table.points(), cloud.size());
        ASSERT_EQ(found.table.rejected(), cloud.size() - finite.ids.size());
        ASSERT_EQ(found.table.box(), finite.box);
        ASSERT_EQ(told, cloud.size());
        std::uint64_t in_voxels = 0;
        for (const Voxel& voxel : found.occupancy.voxels()) {
            in_voxels += voxel.points;
        }
        ASSERT_EQ(in_voxels, finite.ids.size());
        std::size_t at = 0;
        for (std::size_t i = 0; i < files.size(); ++i) {
            const SourceEntry& entry = found.table.sources()[i];
            ASSERT_EQ(entry.first_id, at);
            ASSERT_EQ(entry.xxh3, xxh3_128_of_file(files[i]));
            const auto begin = cloud.begin() + static_cast<std::ptrdiff_t>(at);
            const auto rejected =
                std::count_if(begin, begin + static_cast<std::ptrdiff_t>(entry.points),
                              [](const Vec3& p) { return !is_finite(p); });
            ASSERT_EQ(entry.rejected, static_cast<std::uint64_t>(rejected));
            at += entry.points;
        }
    }
}

TEST(Survey, DoesNotDependOnTheNumberOfThreadsForTheSameGrids) {
    std::mt19937_64 random(2);
    const test::TemporaryFolder folder;
    const auto files = write_parts(folder, random, test::sphere_cloud(50000, 4));
    for (const std::uint64_t grid_bytes : {std::uint64_t{2'600'000}, kAmple}) {
        std::vector<Voxel> expected;
        for (const int threads : {1, 2, 4}) {
            const auto grids = static_cast<std::uint64_t>(threads + 1);
            const Survey found = survey_silently(
                {.files = files, .threads = threads, .budget_bytes = grid_bytes * grids});
            const std::vector<Voxel> voxels = found.occupancy.voxels();
            if (expected.empty()) {
                expected = voxels;
            }
            EXPECT_TRUE(std::equal(voxels.begin(), voxels.end(), expected.begin(), expected.end(),
                                   [](const Voxel& a, const Voxel& b) {
                                       return a.at == b.at && a.points == b.points;
                                   }));
        }
    }
}

TEST(Survey, KeepsItsGridWithinTheBudget) {
    const test::TemporaryFolder folder;
    test::write_ply(folder / "in.ply", test::sphere_cloud(100000, 4));
    constexpr std::uint64_t kBudget = 9'000'000;
    const Survey found =
        survey_silently({.files = {folder / "in.ply"}, .threads = 2, .budget_bytes = kBudget});
    EXPECT_LE(found.occupancy.memory_bytes(), kBudget);
    EXPECT_EQ(found.table.points(), 100000U);
}

TEST(Survey, OfSourcesWithoutAFinitePointIsEmpty) {
    const test::TemporaryFolder folder;
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    test::write_ply(folder / "in.ply", {{kNan, 0, 0}, {0, kNan, 0}});
    const Survey found = survey_silently({.files = {folder / "in.ply"}, .budget_bytes = kAmple});
    EXPECT_EQ(found.table.points(), 2U);
    EXPECT_EQ(found.table.rejected(), 2U);
    EXPECT_TRUE(found.table.box().empty());
    EXPECT_EQ(found.occupancy.voxel_count(), 0U);
}

TEST(Survey, OfATruncatedSourceIsAnErrorNamingIt) {
    const test::TemporaryFolder folder;
    test::write_ply(folder / "good.ply", test::sphere_cloud(1000, 4));
    test::write_ply(folder / "cut.ply", test::sphere_cloud(1000, 4));
    std::filesystem::resize_file(folder / "cut.ply",
                                 std::filesystem::file_size(folder / "cut.ply") - 10);
    EXPECT_THAT(([&] {
                    survey_silently({.files = {folder / "good.ply", folder / "cut.ply"},
                                     .threads = 2,
                                     .budget_bytes = kAmple});
                }),
                ThrowsMessage<InputError>(HasSubstr((folder / "cut.ply").string())));
}

TEST(Survey, OfAMissingSourceIsAnErrorNamingIt) {
    const test::TemporaryFolder folder;
    EXPECT_THAT([&] { survey_silently({.files = {folder / "none.ply"}, .budget_bytes = kAmple}); },
                ThrowsMessage<InputError>(HasSubstr((folder / "none.ply").string())));
}

TEST(Survey, OfCoordinatesWhoseDistancesCannotBeSquaredIsAnErrorWithTheBox) {
    const test::TemporaryFolder folder;
    test::write_ply(folder / "in.ply", {{-1e308, 0, 0}, {1e308, 1, 0}, {0, 0, 2}});
    EXPECT_THAT(
        [&] { survey_silently({.files = {folder / "in.ply"}, .budget_bytes = kAmple}); },
        ThrowsMessage<InputError>(AllOf(HasSubstr("-1e+308"), HasSubstr("(1e+308, 1, 2)"))));
}

}  // namespace
}  // namespace knap
