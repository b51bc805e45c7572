#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <set>

#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "knap/job.hpp"
#include "knap/source.hpp"
#include "support/clouds.hpp"

/// Whole jobs on the shared test data; each test skips where that is absent.
namespace knap {
namespace {

using Position = std::array<double, 3>;

class Silent final : public Progress {};

Report run_silently(const Job& job) {
    Silent progress;
    return run(job, progress);
}

Job job_for(const test::TemporaryFolder& folder, std::vector<std::string> input, double alpha) {
    Job job;
    job.input = std::move(input);
    job.range.alpha = alpha;
    job.output.path = (folder / "out").string();
    job.resources.memory_bytes = std::uint64_t{512} << 20;
    job.resources.threads = 2;
    return job;
}

std::vector<Position> positions_of(const Archive& archive) {
    std::vector<Position> all;
    for (std::size_t tile = 0; tile < archive.manifest().tiles.size(); ++tile) {
        for (const Vec3& p : archive.read_tile(tile)) {
            all.push_back({p.x, p.y, p.z});
        }
    }
    std::sort(all.begin(), all.end());
    return all;
}

void expect_counts_add_up(const Counts& counts) {
    EXPECT_EQ(counts.in, counts.kept + counts.represented + counts.merged + counts.rejected);
}

TEST(RealData, FourFilesAsOneJobKeepThePositionsOfTheSingleFile) {
    const test::TemporaryFolder folder;
    const auto whole = test::shared_file("lidar/lone-star.copc.laz", folder);
    if (whole.empty()) {
        GTEST_SKIP() << "needs ../shared/data/lidar";
    }
    Job job = job_for(folder, {whole.string()}, 0.05);
    const Report single = run_silently(job);
    const std::vector<Position> expected = positions_of(Archive(job.output.path));
    job.input = {(whole.parent_path() / "multi").string()};
    job.output.path = (folder / "multi").string();
    const Report multi = run_silently(job);
    EXPECT_EQ(multi.sources, 4U);
    EXPECT_EQ(multi.counts, single.counts);
    EXPECT_EQ(positions_of(Archive(job.output.path)), expected);
}

TEST(RealData, LasPositionsSurviveDracoExactlyAfterRoundingToTheScale) {
    const test::TemporaryFolder folder;
    for (const char* name :
         {"lidar/lone-star.copc.laz", "lidar/autzen_trim.las", "lidar/extra_bytes_pf8.laz"}) {
        const auto file = test::shared_file(name, folder);
        if (file.empty()) {
            GTEST_SKIP() << "needs ../shared/data/lidar";
        }
        SCOPED_TRACE(name);
        const CoordinateFormat format = open_source(file)->info().coordinates;
        const auto native = [&](const Vec3& p) {
            return std::array{std::llround((p.x - format.offset.x) / format.scale.x),
                              std::llround((p.y - format.offset.y) / format.scale.y),
                              std::llround((p.z - format.offset.z) / format.scale.z)};
        };
        std::set<std::array<long long, 3>> source;
        for (const Vec3& p : test::read_cloud(file)) {
            source.insert(native(p));
        }
        Job job = job_for(folder, {file.string()}, 0.5);
        job.output.overwrite = true;
        const Report report = run_silently(job);
        expect_counts_add_up(report.counts);
        std::uint64_t points = 0;
        for (const Position& p : positions_of(Archive(job.output.path))) {
            EXPECT_TRUE(source.contains(native({p[0], p[1], p[2]})));
            ++points;
        }
        EXPECT_EQ(points, report.counts.kept);
    }
}

// Debian's decoder knows nothing of knap: what it gives must lie within half a lattice step.
TEST(RealData, EveryTileDecodesWithDracoDecoder) {
    const test::TemporaryFolder folder;
    const auto dragon = test::shared_file("scans/dragon_vrip.ply.gz", folder);
    if (dragon.empty() || std::system("command -v draco_decoder >/dev/null") != 0) {
        GTEST_SKIP() << "needs ../shared/data/scans/dragon_vrip.ply.gz and draco_decoder";
    }
    Job job = job_for(folder, {dragon.string()}, 0.001);
    job.output.tile_points = 10000;
    const Report report = run_silently(job);
    EXPECT_GT(report.tiles, 5U);
    const Archive archive(job.output.path);
    EXPECT_EQ(archive.verify().points, report.counts.kept);

    const Lattice& lattice = archive.manifest().lattice;
    const auto index_of = [&](const Vec3& p) {
        return std::array{std::llround((p.x - lattice.origin.x) / lattice.step),
                          std::llround((p.y - lattice.origin.y) / lattice.step),
                          std::llround((p.z - lattice.origin.z) / lattice.step)};
    };
    // Points within half a step share the lattice index.
    std::set<std::array<long long, 3>> source;
    for (const Vec3& p : test::read_cloud(dragon)) {
        source.insert(index_of(p));
    }
    std::uint64_t points = 0;
    for (const ManifestTile& tile : archive.manifest().tiles) {
        const auto decoded = folder / "tile.ply";
        ASSERT_EQ(std::system(fmt::format("draco_decoder -i '{}' -o '{}' >/dev/null",
                                          (archive.folder() / tile.file).string(), decoded.string())
                                  .c_str()),
                  0);
        for (const Vec3& local : test::read_cloud(decoded)) {
            const Vec3 p{
                lattice.origin.x + static_cast<double>(tile.origin[0]) * lattice.step + local.x,
                lattice.origin.y + static_cast<double>(tile.origin[1]) * lattice.step + local.y,
                lattice.origin.z + static_cast<double>(tile.origin[2]) * lattice.step + local.z};
            const auto index = index_of(p);
            EXPECT_TRUE(source.contains(index));
            // The step is a power of two, so the decoder's floats are on the lattice exactly.
            EXPECT_EQ(p.x, lattice.origin.x + static_cast<double>(index[0]) * lattice.step);
            ++points;
        }
    }
    EXPECT_EQ(points, report.counts.kept);
}

TEST(RealData, EveryMalformedFileEndsCleanly) {
    const test::TemporaryFolder folder;
    const std::filesystem::path data(KNAP_SHARED_DATA);
    if (!std::filesystem::exists(data / "malformed")) {
        GTEST_SKIP() << "needs ../shared/data/malformed";
    }
    std::vector<std::filesystem::path> files{data / "lidar/formats/1.2-with-color-clipped.las"};
    for (const auto& entry : std::filesystem::recursive_directory_iterator(data / "malformed")) {
        if (entry.is_regular_file()) {
            files.push_back(entry.path());
        }
    }
    for (const auto& file : files) {
        SCOPED_TRACE(file.string());
        Job job = job_for(folder, {file.string()}, 0.5);
        try {
            const Report report = run_silently(job);
            expect_counts_add_up(report.counts);
            EXPECT_EQ(Archive(job.output.path).verify().points, report.counts.kept);
            std::filesystem::remove_all(job.output.path);
        } catch (const InputError& error) {
            const std::string message = error.what();
            EXPECT_NE(message.find(file.filename().string()), std::string::npos) << message;
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
            EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "something was left behind";
        }
    }
}

TEST(RealData, TheClippedLasFileIsAnError) {
    const test::TemporaryFolder folder;
    const auto file = test::shared_file("lidar/formats/1.2-with-color-clipped.las", folder);
    if (file.empty()) {
        GTEST_SKIP() << "needs ../shared/data/lidar/formats";
    }
    EXPECT_THROW(run_silently(job_for(folder, {file.string()}, 0.5)), InputError);
}

}  // namespace
}  // namespace knap
