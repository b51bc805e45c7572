#include "scatter/scatter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <span>

#include "base/file.hpp"
#include "knap/error.hpp"
#include "plan/plan.hpp"
#include "store/brick_file.hpp"
#include "support/brick_points.hpp"
#include "support/clouds.hpp"
#include "support/cut_cloud.hpp"
#include "support/damage.hpp"
#include "support/scan_files.hpp"
#include "survey/survey.hpp"

namespace knap {
namespace {

namespace fs = std::filesystem;
using PointsById = std::map<PointId, std::array<double, 3>>;

// An archive on disk, surveyed and planned.
struct Archive {
    Survey survey;
    BrickPlan plan;
    BrickMap map;
};

Archive make_archive(const std::vector<fs::path>& files, std::uint64_t brick_points) {
    Survey found =
        survey({.files = files, .budget_bytes = std::uint64_t{64} << 20, .digests = false},
               [](std::uint64_t) {});
    BrickPlan plan = plan_bricks(
        found.occupancy, found.table.box(),
        {.neighbours = 30, .target_points = brick_points, .most_points = 20 * brick_points});
    BrickMap map(found.occupancy, plan);
    return {std::move(found), std::move(plan), std::move(map)};
}

std::vector<fs::path> write_two(const test::TemporaryFolder& folder,
                                const std::vector<Vec3>& cloud) {
    const auto middle = cloud.begin() + std::ssize(cloud) / 3;
    test::write_ply(folder / "a.ply", {cloud.begin(), middle});
    test::write_ply(folder / "b.ply", {middle, cloud.end()});
    return {folder / "a.ply", folder / "b.ply"};
}

VoxelCoord voxel_at(const Vec3& p, double size) {
    return {static_cast<std::int32_t>(voxel_index(p.x, size)),
            static_cast<std::int32_t>(voxel_index(p.y, size)),
            static_cast<std::int32_t>(voxel_index(p.z, size))};
}

// Points of a brick by looking at each point of the cloud.
struct Expected {
    PointsById core;
    PointsById halo;
    Box core_box;
};

Expected by_force(const std::vector<Vec3>& cloud, const Brick& brick, double voxel_size) {
    Expected expected;
    for (PointId id = 0; id < cloud.size(); ++id) {
        const Vec3& p = cloud[id];
        if (!is_finite(p)) {
            continue;
        }
        if (brick.core.contains(voxel_at(p, voxel_size))) {
            expected.core[id] = {p.x, p.y, p.z};
            expected.core_box.extend(p);
        } else if (brick.halo.contains(p)) {
            expected.halo[id] = {p.x, p.y, p.z};
        }
    }
    return expected;
}

PointsById points_between(const BrickPoints& brick, std::size_t begin, std::size_t end) {
    PointsById points;
    for (std::size_t i = begin; i < end; ++i) {
        const Vec3& p = brick.positions[i];
        EXPECT_TRUE(points.emplace(brick.ids[i], std::array{p.x, p.y, p.z}).second) << "each once";
    }
    return points;
}

void expect_bricks(const std::vector<Vec3>& cloud, const Archive& archive,
                   const std::vector<BrickFile>& files) {
    ASSERT_EQ(files.size(), archive.plan.bricks.size());
    std::uint64_t cores = 0;
    for (std::size_t i = 0; i < files.size(); ++i) {
        const Expected expected = by_force(cloud, archive.plan.bricks[i], archive.plan.voxel_size);
        const BrickPoints brick = test::read_brick_file(files[i].path, archive.survey.table);
        ASSERT_EQ(points_between(brick, 0, brick.core_count), expected.core);
        ASSERT_EQ(points_between(brick, brick.core_count, brick.ids.size()), expected.halo);
        ASSERT_EQ(files[i].core_points, expected.core.size());
        ASSERT_EQ(files[i].core_points, archive.plan.bricks[i].core_points);
        ASSERT_EQ(files[i].halo_points, expected.halo.size());
        ASSERT_EQ(files[i].core_box, expected.core_box);
        ASSERT_EQ(files[i].bytes, fs::file_size(files[i].path));
        cores += files[i].core_points;
    }
    ASSERT_EQ(cores, archive.survey.table.points() - archive.survey.table.rejected());
}

TEST(Scatter, GivesEveryBrickItsCoreAndExactlyThePointsOfItsHalo) {
    std::mt19937_64 random(1);
    const test::TemporaryFolder folder;
    for (int round = 0; round < 60; ++round) {
        const std::vector<Vec3> cloud = test::random_cloud(random);
        const Archive archive = make_archive(write_two(folder, cloud), 1 + random() % 200);
        const fs::path scratch = folder / std::to_string(round);
        fs::create_directory(scratch);
        const auto files =
            scatter(archive.survey.table, archive.plan, archive.map,
                    {.folder = scratch, .threads = static_cast<int>(1 + random() % 3)},
                    [](std::uint64_t) {});
        ASSERT_NO_FATAL_FAILURE(expect_bricks(cloud, archive, files)) << "round " << round;
        fs::remove_all(scratch);
    }
}

TEST(Scatter, ConservesCountsForAnyBufferSizeAndThreadCount) {
    const test::TemporaryFolder folder;
    const std::vector<Vec3> cloud = test::sphere_cloud(20000, 2);
    const Archive archive = make_archive(write_two(folder, cloud), 1500);
    ASSERT_GT(archive.plan.bricks.size(), 10U);
    for (const int threads : {1, 2, 4}) {
        for (const std::uint64_t budget : {std::uint64_t{0}, std::uint64_t{1} << 30}) {
            const fs::path scratch = folder / "scratch";
            fs::create_directory(scratch);
            std::atomic<std::uint64_t> told{0};
            const auto files =
                scatter(archive.survey.table, archive.plan, archive.map,
                        {.folder = scratch, .threads = threads, .budget_bytes = budget},
                        [&](std::uint64_t points) { told += points; });
            ASSERT_NO_FATAL_FAILURE(expect_bricks(cloud, archive, files)) << threads << " threads";
            EXPECT_EQ(told, cloud.size());
            fs::remove_all(scratch);
        }
    }
}

TEST(Scatter, GoesOnWhereItsLastCommitWasWhateverWasAppendedSince) {
    const std::vector<Vec3> cloud = test::sphere_cloud(9000, 4);
    // Each file is a range: many more than between two commits.
    constexpr std::size_t kFiles = 150;
    const test::TemporaryFolder folder;
    std::vector<fs::path> sources;
    for (std::size_t i = 0; i < kFiles; ++i) {
        const auto begin = cloud.begin() + static_cast<std::ptrdiff_t>(i * 60);
        sources.push_back(folder / (std::to_string(1000 + i) + ".ply"));
        test::write_ply(sources.back(), {begin, begin + 60});
    }
    const Archive archive = make_archive(sources, 300);
    const fs::path scratch = folder / "scratch";
    fs::create_directory(scratch);
    std::vector<ScatterState> commits;
    ScatterRequest request{.folder = scratch, .threads = 2, .budget_bytes = 1 << 20};
    std::atomic<std::size_t> committed{0};
    request.commit = [&](const ScatterState& state) {
        commits.push_back(state);
        ++committed;
    };
    // Stopped between the second and the third commit, with blocks appended after the second.
    const auto stop = [&](std::uint64_t) {
        if (committed == 2) {
            throw Interrupted("stopped");
        }
    };
    EXPECT_THROW(scatter(archive.survey.table, archive.plan, archive.map, request, stop),
                 Interrupted);
    ASSERT_EQ(commits.size(), 2U);
    for (std::size_t i = 0; i < archive.plan.bricks.size(); i += 2) {
        append_to_file(brick_path(scratch, i), std::vector<std::byte>(10 + i));
    }
    request.state = commits.back();
    std::atomic<std::uint64_t> told{0};
    const auto files = scatter(archive.survey.table, archive.plan, archive.map, request,
                               [&](std::uint64_t points) { told += points; });
    EXPECT_EQ(told, cloud.size()) << "what was done before counts";
    EXPECT_GT(commits.size(), 4U);
    expect_bricks(cloud, archive, files);

    fs::resize_file(brick_path(scratch, 3), 20);
    EXPECT_TRUE(test::refuses(brick_path(scratch, 3), [&] {
        scatter(archive.survey.table, archive.plan, archive.map, request, [](std::uint64_t) {});
    })) << "a file shorter than it was";
}

// A cloud of which the middle file is text, whose positions lie in many small files.
struct Staged {
    explicit Staged(const std::vector<Vec3>& cloud) {
        const std::vector<fs::path> files{folder / "a.ply", folder / "b.ply", folder / "c.ply"};
        test::write_ply(files[0], {cloud.begin(), cloud.begin() + 1000}, true);
        test::write_ascii_ply(files[1], {cloud.begin() + 1000, cloud.begin() + 8000});
        test::write_ply(files[2], {cloud.begin() + 8000, cloud.end()}, true);
        archive.emplace(make_archive(files, 500));
        fs::create_directory(folder / "scratch");
        request = {.folder = folder / "scratch", .threads = 2, .budget_bytes = 1 << 20};
        const std::vector<Vec3> text = test::read_cloud(files[1]);
        const PositionCodec codec(archive->survey.table.infos()[1].coordinates);
        for (std::size_t first = 0; first < text.size(); first += 70) {
            const fs::path path = folder / (std::to_string(first) + ".positions");
            PositionWriter writer(path, codec);
            writer.add(std::span(text).subspan(first, 30));
            writer.add(std::span(text).subspan(first + 30, 40));
            const std::uint64_t bytes = writer.finish();
            request.staged.files.push_back({path, 1, first, 70, bytes});
        }
        request.note = [this](const std::string& note) {
            const std::scoped_lock lock(mutex);
            notes.push_back(note);
        };
        for (const fs::path& file : files) {
            const std::vector<Vec3> part = test::read_cloud(file);
            expected.insert(expected.end(), part.begin(), part.end());
        }
    }

    void scatter_and_check() {
        const auto files = scatter(archive->survey.table, archive->plan, archive->map, request,
                                   [](std::uint64_t) {});
        ASSERT_NO_FATAL_FAILURE(expect_bricks(expected, *archive, files));
        for (const PositionFile& file : request.staged.files) {
            EXPECT_FALSE(fs::exists(file.path)) << "no longer needed";
        }
    }

    test::TemporaryFolder folder;
    std::optional<Archive> archive;
    ScatterRequest request;
    std::mutex mutex;
    std::vector<std::string> notes;
    std::vector<Vec3> expected;
};

TEST(Scatter, ReadsPositionsInPlaceOfTheirSource) {
    Staged staged(test::sphere_cloud(9000, 5));
    fs::remove(staged.folder / "b.ply");
    staged.scatter_and_check();
    EXPECT_TRUE(staged.notes.empty());
}

TEST(Scatter, ReadsTheSourceWherePositionsAreDamaged) {
    Staged staged(test::sphere_cloud(9000, 5));
    const auto path = [&](std::size_t i) { return staged.request.staged.files[i].path; };
    std::string bytes = test::read_bytes(path(10));
    bytes[bytes.size() - 100] ^= 2;  // in the second block: the first is taken
    test::write_bytes(path(10), bytes);
    fs::remove(path(20));
    // Whole, but short.
    PositionWriter writer(path(30),
                          PositionCodec(staged.archive->survey.table.infos()[1].coordinates));
    writer.add(std::span(staged.expected).subspan(1000 + 30 * 70, 20));
    writer.finish();
    staged.scatter_and_check();
    ASSERT_EQ(staged.notes.size(), 3U);
    for (const std::size_t i : {10, 20, 30}) {
        EXPECT_THAT(staged.notes, testing::Contains(testing::HasSubstr(path(i).string())));
    }
}

TEST(Scatter, GoesOnWithThePositionsThatAreLeft) {
    for (std::size_t stop_after = 1; stop_after < 8; ++stop_after) {
        Staged staged(test::sphere_cloud(9000, 5));
        const Archive& archive = *staged.archive;
        std::vector<ScatterState> commits;
        staged.request.commit = [&](const ScatterState& state) {
            commits.push_back(state);
            if (commits.size() == stop_after) {
                throw Interrupted("stopped");
            }
        };
        EXPECT_THROW(scatter(archive.survey.table, archive.plan, archive.map, staged.request,
                             [](std::uint64_t) {}),
                     Interrupted);
        staged.request.state = commits.back();
        staged.request.commit = [](const ScatterState&) {};
        staged.scatter_and_check();
        EXPECT_TRUE(staged.notes.empty());
    }
}

TEST(Scatter, KeepsPointsOfSourcesApartWhoseCoordinatesPackDifferently) {
#ifndef KNAP_HAVE_LASZIP
    GTEST_SKIP() << "needs LASzip";
#endif
    std::mt19937_64 random(3);
    const test::TemporaryFolder folder;
    test::LasFile coarse;
    test::LasFile fine{.scale = {0.001, 0.002, 0.0005}, .offset = {99, 201, 300.25}};
    for (test::LasFile* las : {&coarse, &fine}) {
        for (int i = 0; i < 3000; ++i) {
            const auto any = [&] { return static_cast<std::int32_t>(random() % 2000) - 1000; };
            las->points.push_back({any(), any(), any() / 100});
        }
    }
    test::write_bytes(folder / "coarse.las", coarse.bytes());
    test::write_bytes(folder / "fine.las", fine.bytes());
    std::vector<Vec3> cloud = test::read_cloud(folder / "coarse.las");
    const std::vector<Vec3> rest = test::read_cloud(folder / "fine.las");
    cloud.insert(cloud.end(), rest.begin(), rest.end());
    const Archive archive = make_archive({folder / "coarse.las", folder / "fine.las"}, 500);
    ASSERT_FALSE(archive.survey.table.wide());
    const auto files = scatter(archive.survey.table, archive.plan, archive.map,
                               {.folder = folder.path()}, [](std::uint64_t) {});
    ASSERT_NO_FATAL_FAILURE(expect_bricks(cloud, archive, files));
}

TEST(Scatter, OfASourceThatHasChangedSinceTheSurveyIsAnErrorNamingIt) {
    const test::TemporaryFolder folder;
    std::vector<Vec3> cloud = test::sphere_cloud(3000, 2);
    const Archive archive = make_archive(write_two(folder, cloud), 500);
    cloud[2000] = {0, 0, 0};
    write_two(folder, cloud);
    try {
        scatter(archive.survey.table, archive.plan, archive.map, {.folder = folder.path()},
                [](std::uint64_t) {});
        FAIL() << "expected an InputError";
    } catch (const InputError& error) {
        const std::string text = error.what();
        EXPECT_NE(text.find((folder / "b.ply").string()), std::string::npos) << text;
        EXPECT_NE(text.find("changed"), std::string::npos) << text;
        EXPECT_NE(text.find("point 1000"), std::string::npos) << text;
    }
}

TEST(Scatter, WhereItCannotWriteIsAStorageErrorNamingTheFile) {
    const test::TemporaryFolder folder;
    const Archive archive = make_archive(write_two(folder, test::sphere_cloud(3000, 2)), 500);
    try {
        scatter(archive.survey.table, archive.plan, archive.map, {.folder = folder / "none"},
                [](std::uint64_t) {});
        FAIL() << "expected a StorageError";
    } catch (const StorageError& error) {
        EXPECT_NE(std::string(error.what()).find((folder / "none").string()), std::string::npos);
    }
}

}  // namespace
}  // namespace knap
