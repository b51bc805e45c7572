#include "store/checkpoint.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <tuple>

#include "plan/plan.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"
#include "support/damage.hpp"

namespace knap {
namespace {

class Checkpoint : public testing::Test {
  protected:
    test::TemporaryFolder folder_;
    std::filesystem::path path_ = folder_ / "file";
    std::mt19937_64 random_{7};
};

Box random_box(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    Box box;
    box.extend(Vec3{normal(random), normal(random), normal(random)});
    box.extend(Vec3{normal(random), normal(random), normal(random)});
    return box;
}

std::vector<SourceEntry> random_entries(std::mt19937_64& random, std::size_t count) {
    std::vector<SourceEntry> entries(count);
    for (std::size_t i = 0; i < count; ++i) {
        entries[i].given_path = std::string(random() % 30, 'a') + std::to_string(i);
        entries[i].points = random() % 1000000;
        entries[i].rejected = random() % (entries[i].points + 1);
        entries[i].xxh3 = std::to_string(random());
    }
    return entries;
}

std::vector<Voxel> sorted(std::vector<Voxel> voxels) {
    std::sort(voxels.begin(), voxels.end(), [](const Voxel& a, const Voxel& b) {
        return std::tie(a.at.x, a.at.y, a.at.z) < std::tie(b.at.x, b.at.y, b.at.z);
    });
    return voxels;
}

TEST_F(Checkpoint, GivesBackASurvey) {
    for (int round = 0; round < 30; ++round) {
        const auto entries = random_entries(random_, 1 + random_() % 5);
        const SourceTable table(entries, random_box(random_));
        std::vector<Voxel> voxels;
        const int reach = 1 << (random_() % 29);
        for (std::size_t i = random_() % 500; i > 0; --i) {
            const auto coordinate = [&] {
                return static_cast<std::int32_t>(random_() % (2 * reach)) - reach;
            };
            voxels.push_back({{coordinate(), coordinate(), coordinate()},
                              static_cast<std::uint32_t>(1 + random_() % 1000)});
        }
        const Occupancy occupancy(0.25, voxels);
        save_survey(path_, table, occupancy);
        const std::vector<SourceInfo> infos = table.infos();
        const SavedSurvey read = load_survey(path_, infos);
        ASSERT_EQ(read.table.points(), table.points());
        ASSERT_EQ(read.table.rejected(), table.rejected());
        ASSERT_EQ(read.table.box(), table.box());
        for (std::size_t i = 0; i < entries.size(); ++i) {
            ASSERT_EQ(read.table.sources()[i].given_path, entries[i].given_path);
            ASSERT_EQ(read.table.sources()[i].xxh3, entries[i].xxh3);
            ASSERT_EQ(read.table.sources()[i].first_id, table.sources()[i].first_id);
        }
        ASSERT_EQ(read.occupancy.voxel_size(), 0.25);
        const auto before = sorted(occupancy.voxels());
        const auto after = sorted(read.occupancy.voxels());
        ASSERT_EQ(after.size(), before.size());
        for (std::size_t i = 0; i < after.size(); ++i) {
            ASSERT_EQ(after[i].at, before[i].at);
            ASSERT_EQ(after[i].points, before[i].points);
        }
    }
}

TEST_F(Checkpoint, OfASurveyOfOtherSourcesIsAnErrorNamingIt) {
    const SourceTable table(random_entries(random_, 3), random_box(random_));
    save_survey(path_, table, Occupancy(1, std::span<const Voxel>()));
    const std::vector<SourceInfo> two(2);
    EXPECT_TRUE(test::refuses(path_, [&] { load_survey(path_, two); }));
}

TEST_F(Checkpoint, GivesBackAPlan) {
    const test::Points points = test::finite_points(test::sphere_cloud(3000, 2));
    const BrickPlan plan =
        plan_bricks(test::occupancy_of(points, 50), points.box,
                    {.neighbours = 30, .target_points = 100, .most_points = 100000});
    ASSERT_GT(plan.bricks.size(), 10U);
    save_plan(path_, plan);
    const BrickPlan read = load_plan(path_);
    EXPECT_EQ(read.voxel_size, plan.voxel_size);
    ASSERT_EQ(read.bricks.size(), plan.bricks.size());
    for (std::size_t i = 0; i < plan.bricks.size(); ++i) {
        EXPECT_EQ(read.bricks[i].core, plan.bricks[i].core);
        EXPECT_EQ(read.bricks[i].halo, plan.bricks[i].halo);
        EXPECT_EQ(read.bricks[i].core_points, plan.bricks[i].core_points);
        EXPECT_EQ(read.bricks[i].halo_points, plan.bricks[i].halo_points);
    }
}

TEST_F(Checkpoint, GivesBackHowFarTheSourcesWereScattered) {
    ScatterState state{7, {}};
    for (int i = 0; i < 20; ++i) {
        state.bricks.push_back({random_(), random_(), random_(), random_box(random_)});
    }
    save_scatter_state(path_, state);
    const ScatterState read = load_scatter_state(path_);
    EXPECT_EQ(read.parts_done, 7U);
    ASSERT_EQ(read.bricks.size(), state.bricks.size());
    for (std::size_t i = 0; i < state.bricks.size(); ++i) {
        EXPECT_EQ(read.bricks[i].bytes, state.bricks[i].bytes);
        EXPECT_EQ(read.bricks[i].core_points, state.bricks[i].core_points);
        EXPECT_EQ(read.bricks[i].halo_points, state.bricks[i].halo_points);
        EXPECT_EQ(read.bricks[i].core_box, state.bricks[i].core_box);
    }
}

TEST_F(Checkpoint, ABitFlippedOrAByteMissingIsAnErrorNamingTheFile) {
    const ScatterState state{7, {{1, 2, 3, random_box(random_)}, {4, 5, 6, random_box(random_)}}};
    save_scatter_state(path_, state);
    test::with_each_bit_flipped(path_, [&](std::size_t at) {
        // The four reserved bytes say nothing.
        const bool reserved = at >= 12 && at < 16;
        EXPECT_EQ(test::refuses(path_, [&] { load_scatter_state(path_); }), !reserved)
            << "byte " << at;
    });
    test::with_each_cut(path_, [&](std::size_t size) {
        EXPECT_TRUE(test::refuses(path_, [&] { load_scatter_state(path_); })) << size << " bytes";
    });
    const std::filesystem::path none = folder_ / "none";
    EXPECT_TRUE(test::refuses(none, [&] { load_scatter_state(none); }));
    EXPECT_TRUE(test::refuses(path_, [&] { load_plan(path_); })) << "of another kind";
}

}  // namespace
}  // namespace knap
