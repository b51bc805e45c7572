#include "emit/emit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "emit/decode.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "output/ply_writer.hpp"
#include "store/manifest.hpp"
#include "support/damage.hpp"
#include "support/emit_fixture.hpp"
#include "support/kept_runs.hpp"

namespace knap {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;
using namespace test;

namespace fs = std::filesystem;

class Emit : public EmitFixture {};

TEST_F(Emit, AnArchiveHoldsTheKeptPointsOnItsLattice) {
    const EmitResult result = emit(table_, selection_, request("archive"));
    const Archive archive(result.path);
    const Verification found = archive.verify();
    EXPECT_EQ(found.points, kept_.size());
    EXPECT_EQ(found.tiles, result.tiles);
    EXPECT_EQ(found.bytes + fs::file_size(result.path / "manifest.json"), result.bytes);
    EXPECT_EQ(archive.manifest().lattice.step, 1.0 / 512);
    EXPECT_EQ(sorted(tile_points(archive)), sorted(rounded_to(archive.manifest().lattice, kept_)));
    for (const ManifestTile& tile : archive.manifest().tiles) {
        EXPECT_LE(tile.points, 1000U);
    }
}

TEST_F(Emit, TheManifestSaysWhatTheJobWas) {
    const Manifest manifest = Archive(make_archive()).manifest();
    const EmitRequest asked = request("archive");
    EXPECT_EQ(manifest.format_version, 1);
    EXPECT_EQ(manifest.parameters, asked.parameters);
    EXPECT_EQ(manifest.counts, asked.counts);
    EXPECT_EQ(manifest.spacing, asked.spacing);
    EXPECT_EQ(manifest.mean_curvature, asked.mean_curvature);
    ASSERT_EQ(manifest.sources.size(), 2U);
    EXPECT_EQ(manifest.sources[1].points, 20001U);
    EXPECT_EQ(manifest.sources[1].schema.size(), 3U);
}

TEST_F(Emit, TheBytesDoNotDependOnThreadsOrMemory) {
    const fs::path one = make_archive();
    for (const int threads : {1, 4}) {
        EmitRequest other = request("other");
        other.threads = threads;
        other.memory_bytes = emit_memory_bytes(kept_.size(), other.output);
        other.output.overwrite = true;
        std::int64_t scratch = 0;
        std::int64_t most = 0;
        other.on_scratch = [&](std::int64_t bytes) {
            scratch += bytes;
            most = std::max(most, scratch);
        };
        emit(table_, selection_, other);
        expect_same_files(one, folder_ / "other");
        EXPECT_GT(most, static_cast<std::int64_t>(12 * kept_.size())) << "through scratch";
        EXPECT_EQ(scratch, 0);
        EXPECT_TRUE(fs::is_empty(working_.path()));
    }
}

TEST_F(Emit, TheBytesAreTheSameFromWhatMergeLeftWithoutTheSources) {
    const fs::path one = make_archive();
    EmitRequest drc = request("one.drc");
    emit(table_, selection_, drc);
    const TemporaryFolder runs;
    EmitRequest other = request("other");
    other.runs = write_kept_runs(runs.path(), table_, selection_, points_, 5);
    other.output.overwrite = true;
    drc.runs = other.runs;
    drc.output.path = (folder_ / "other.drc").string();
    for (const SourceEntry& source : table_.sources()) {
        fs::remove(source.info.path);
    }
    for (const std::uint64_t memory : {kMemory, emit_memory_bytes(kept_.size(), other.output)}) {
        other.memory_bytes = memory;
        emit(table_, selection_, other);
        expect_same_files(one, folder_ / "other");
    }
    emit(table_, selection_, drc);
    EXPECT_EQ(read_bytes(folder_ / "other.drc"), read_bytes(folder_ / "one.drc"));
}

TEST_F(Emit, GoesOnWithTheTilesOfAnEarlierRun) {
    const fs::path undisturbed = make_archive();
    EmitRequest stopped = request("other");
    stopped.threads = 1;
    std::map<std::size_t, ManifestTile> done;
    stopped.tiles.on_tile = [&](std::size_t number, const ManifestTile& tile) {
        done[number] = tile;
        if (done.size() == 5) {
            throw Interrupted("stopped");
        }
    };
    EXPECT_THROW(emit(table_, selection_, stopped), Interrupted);
    const fs::path partial = folder_ / "other.partial";
    ASSERT_EQ(done.size(), 5U);
    const auto written = fs::last_write_time(partial / done[0].file);
    std::string damaged = read_text_file(partial / done[1].file);
    damaged[damaged.size() / 2] ^= 1;
    test::write_bytes(partial / done[1].file, damaged);
    fs::remove(partial / done[2].file);

    EmitRequest again = request("other");
    again.tiles.done = done;
    std::size_t told = 0;
    again.tiles.on_tile = [&](std::size_t, const ManifestTile&) { ++told; };
    const EmitResult result = emit(table_, selection_, again);
    EXPECT_EQ(told, result.tiles);
    expect_same_files(undisturbed, folder_ / "other");
    EXPECT_EQ(fs::last_write_time(folder_ / "other" / done[0].file), written);
    EXPECT_FALSE(fs::exists(partial));
}

TEST_F(Emit, APlyHoldsTheExactPositionsInSourceOrder) {
    const EmitResult result = emit(table_, selection_, request("out.ply"));
    EXPECT_EQ(all_points(result.path), kept_);
    EXPECT_EQ(open_source(result.path)->info().coordinates.kind, CoordinateKind::kFloat32);
    EXPECT_EQ(fs::file_size(result.path), result.bytes);
}

TEST_F(Emit, ASingleDracoFileDecodesToTheSamePointsAsTheArchive) {
    const fs::path archive = make_archive();
    emit(table_, selection_, request("one.drc"));
    decode(archive, folder_ / "a.ply", false);
    decode(folder_ / "one.drc", folder_ / "b.ply", false);
    const std::vector<Vec3> points = all_points(folder_ / "a.ply");
    EXPECT_EQ(points.size(), kept_.size());
    EXPECT_EQ(sorted(points), sorted(all_points(folder_ / "b.ply")));
    EXPECT_EQ(points, tile_points(Archive(archive)));
}

TEST_F(Emit, DecodedTextReadsBackAsTheSameDoubles) {
    const fs::path archive = make_archive();
    const DecodeResult result = decode(archive, folder_ / "a.xyz", false);
    EXPECT_EQ(result.points, kept_.size());
    std::ifstream text(folder_ / "a.xyz");
    std::vector<Vec3> points;
    for (Vec3 point; text >> point.x >> point.y >> point.z;) {
        points.push_back(point);
    }
    EXPECT_EQ(points, tile_points(Archive(archive)));
    EXPECT_THROW(decode(archive, folder_ / "a.xyz", false), ConfigError);
    EXPECT_THROW(decode(archive, folder_ / "a.obj", false), ConfigError);
    EXPECT_THROW(decode(folder_ / "nothing", folder_ / "b.xyz", false), InputError);
    EXPECT_FALSE(fs::exists(folder_ / "b.xyz"));
}

TEST_F(Emit, ASingleDracoFileThatIsTooWideSaysWhatToDo) {
    EmitRequest fine = request("one.drc");
    fine.output.step = 1e-5;
    EXPECT_THAT([&] { emit(table_, selection_, fine); },
                ThrowsMessage<ConfigError>(HasSubstr("archive folder")));
    EXPECT_EQ(entries_in(folder_), 2U);
}

TEST_F(Emit, WithoutKeptPointsEveryOutputIsValidAndEmpty) {
    const Selection none(points_.size());
    EmitRequest archive = request("archive");
    archive.counts = {.in = points_.size(), .represented = points_.size()};
    emit(table_, none, archive);
    EXPECT_EQ(Archive(folder_ / "archive").verify().tiles, 0U);
    for (const char* name : {"one.drc", "one.ply"}) {
        emit(table_, none, request(name));
    }
    decode(folder_ / "one.drc", folder_ / "two.ply", false);
    EXPECT_EQ(open_source(folder_ / "one.ply")->info().declared_count, 0U);
    EXPECT_TRUE(all_points(folder_ / "two.ply").empty());
}

TEST_F(Emit, TooLittleMemoryIsAnErrorThatLeavesNothing) {
    EmitRequest poor = request("archive");
    poor.memory_bytes = emit_memory_bytes(kept_.size(), poor.output) - 1;
    EXPECT_THAT([&] { emit(table_, selection_, poor); },
                ThrowsMessage<StorageError>(HasSubstr("resources.memory")));
    EXPECT_EQ(entries_in(folder_), 2U);
}

TEST_F(Emit, AnInterruptionLeavesNothingAndWhatWasThereStays) {
    const fs::path archive = make_archive();
    const std::string before = read_text_file(archive / "manifest.json");
    for (const char* name : {"archive", "one.ply", "one.drc"}) {
        EmitRequest stopped = request(name);
        stopped.output.overwrite = true;
        stopped.advance = [](std::uint64_t) { throw Interrupted("stopped"); };
        EXPECT_THROW(emit(table_, selection_, stopped), Interrupted) << name;
    }
    EXPECT_EQ(entries_in(folder_), 3U);
    EXPECT_EQ(read_text_file(archive / "manifest.json"), before);
}

TEST_F(Emit, ProgressAddsUpToAllInputPoints) {
    for (const char* name : {"archive", "one.ply"}) {
        EmitRequest watched = request(name);
        std::uint64_t done = 0;
        watched.advance = [&](std::uint64_t points) { done += points; };
        emit(table_, selection_, watched);
        EXPECT_EQ(done, points_.size());
    }
}

TEST_F(Emit, ASourceThatChangedSinceTheSurveyIsAnErrorNamingIt) {
    PlyWriter writer(folder_ / fmt_name(1), 100, PlyWriter::Precision::kFloat, {});
    writer.append(std::vector<Vec3>(100));
    writer.finish();
    for (const char* name : {"archive", "one.ply"}) {
        EXPECT_THAT([&] { emit(table_, selection_, request(name)); },
                    ThrowsMessage<InputError>(HasSubstr(fmt_name(1))))
            << name;
    }
    EXPECT_EQ(entries_in(folder_), 2U);
}

}  // namespace
}  // namespace knap
