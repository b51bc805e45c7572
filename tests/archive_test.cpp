#include "knap/archive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "base/file.hpp"
#include "emit/decode.hpp"
#include "emit/emit.hpp"
#include "emit/ply_writer.hpp"
#include "knap/error.hpp"
#include "store/manifest.hpp"
#include "support/clouds.hpp"
#include "support/damage.hpp"

namespace knap {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

namespace fs = std::filesystem;

constexpr std::uint64_t kMemory = std::uint64_t{1} << 30;

bool less(const Vec3& a, const Vec3& b) {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

std::vector<Vec3> sorted(std::vector<Vec3> points) {
    std::sort(points.begin(), points.end(), less);
    return points;
}

std::vector<Vec3> all_points(const fs::path& file) {
    const auto source = open_source(file);
    std::vector<Vec3> points;
    for (Chunk chunk; source->read(chunk, 1000);) {
        points.insert(points.end(), chunk.positions.begin(), chunk.positions.end());
    }
    return points;
}

SourceTable survey_of(const std::vector<fs::path>& files) {
    std::vector<SourceEntry> entries;
    Box box;
    for (const fs::path& file : files) {
        SourceEntry entry;
        entry.info = open_source(file)->info();
        entry.given_path = file.string();
        entry.xxh3 = std::string(32, '0');
        for (const Vec3& point : all_points(file)) {
            ++entry.points;
            box.extend(point);
        }
        entries.push_back(entry);
    }
    return {entries, box};
}

/// Two PLY files of floats on a bumpy sheet, and a third of their points kept.
class Emit : public testing::Test {
  protected:
    void SetUp() override {
        std::mt19937_64 random(1);
        std::uniform_real_distribution<float> unit(0, 1);
        std::vector<fs::path> files;
        for (const std::size_t count : {30000U, 20001U}) {
            std::vector<Vec3> points(count);
            for (Vec3& point : points) {
                const float x = 100 * unit(random);
                const float y = 100 * unit(random);
                point = {x, y, static_cast<double>(std::sin(x) * std::cos(y))};
            }
            files.push_back(folder_ / fmt_name(files.size()));
            PlyWriter writer(files.back(), count, PlyWriter::Precision::kFloat, {});
            writer.append(points);
            writer.finish();
        }
        table_ = survey_of(files);
        points_ = all_points(files[0]);
        const std::vector<Vec3> second = all_points(files[1]);
        points_.insert(points_.end(), second.begin(), second.end());
        selection_ = Selection(points_.size());
        for (PointId id = 0; id < points_.size(); ++id) {
            if (random() % 3 == 0) {
                selection_.set(id);
                kept_.push_back(points_[id]);
            }
        }
        selection_.finish();
    }

    static std::string fmt_name(std::size_t i) { return "in" + std::to_string(i) + ".ply"; }

    EmitRequest request(const std::string& name) const {
        EmitRequest request;
        request.counts = {.in = points_.size(),
                          .kept = selection_.count(),
                          .represented = points_.size() - selection_.count()};
        request.spacing = 0.2;
        request.mean_curvature = 1.5;
        request.parameters = {{"range.alpha", "0.4"}};
        request.output.path = (folder_ / name).string();
        request.output.tile_points = 1000;
        request.memory_bytes = kMemory;
        request.threads = 2;
        request.scratch = working_.path();
        return request;
    }

    fs::path make_archive() {
        emit(table_, selection_, request("archive"));
        return folder_ / "archive";
    }

    /// What all_points() of the archive's tiles would be.
    static std::vector<Vec3> tile_points(const Archive& archive) {
        std::vector<Vec3> points;
        for (std::size_t i = 0; i < archive.manifest().tiles.size(); ++i) {
            const std::vector<Vec3> tile = archive.read_tile(i);
            points.insert(points.end(), tile.begin(), tile.end());
        }
        return points;
    }

    test::TemporaryFolder working_;
    test::TemporaryFolder scratch_;
    fs::path folder_ = scratch_.path();
    std::vector<Vec3> points_;
    std::vector<Vec3> kept_;
    SourceTable table_;
    Selection selection_;
};

/// What is left of a failed attempt: nothing beside the two inputs.
std::size_t entries_in(const fs::path& folder) {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

void expect_same_files(const fs::path& expected, const fs::path& found) {
    std::size_t files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(expected)) {
        if (entry.is_regular_file()) {
            const fs::path name = entry.path().lexically_relative(expected);
            EXPECT_EQ(read_text_file(found / name), read_text_file(entry.path())) << name;
            ++files;
        }
    }
    for (const auto& entry : fs::recursive_directory_iterator(found)) {
        files -= entry.is_regular_file() ? 1 : 0;
    }
    EXPECT_EQ(files, 0U) << "as many files";
}

std::vector<Vec3> rounded_to(const Lattice& lattice, const std::vector<Vec3>& points) {
    std::vector<Vec3> rounded;
    for (const Vec3& point : points) {
        Vec3 moved;
        for (int axis = 0; axis < 3; ++axis) {
            const double steps = (point[axis] - lattice.origin[axis]) / lattice.step;
            moved[axis] = lattice.origin[axis] + std::round(steps) * lattice.step;
        }
        rounded.push_back(moved);
    }
    return rounded;
}

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

TEST_F(Emit, AFlippedBitInATileIsAnErrorNamingTheTile) {
    const Archive archive(make_archive());
    const fs::path tile = archive.folder() / archive.manifest().tiles[1].file;
    const std::string good = read_text_file(tile);
    std::mt19937_64 random(2);
    for (std::size_t i = 0; i < good.size(); i += 1 + good.size() / 200) {
        std::string bad = good;
        bad[i] = static_cast<char>(bad[i] ^ (1 << (random() % 8)));
        std::ofstream(tile, std::ios::binary) << bad;
        EXPECT_THAT([&] { archive.verify(); },
                    ThrowsMessage<InputError>(AllOf(HasSubstr(tile.string()), HasSubstr("XXH3"))));
        EXPECT_THROW(archive.read_tile(1), InputError);
    }
    std::ofstream(tile, std::ios::binary) << good.substr(0, good.size() - 1);
    EXPECT_THAT([&] { archive.verify(); }, ThrowsMessage<InputError>(HasSubstr(tile.string())));
    fs::remove(tile);
    EXPECT_THAT([&] { archive.verify(); }, ThrowsMessage<InputError>(HasSubstr(tile.string())));
    EXPECT_THROW(decode(archive.folder(), folder_ / "a.ply", false), InputError);
    EXPECT_FALSE(fs::exists(folder_ / "a.ply"));
}

TEST_F(Emit, AManifestThatDoesNotFitTheTilesIsAnError) {
    const fs::path folder = make_archive();
    const Manifest good = Archive(folder).manifest();
    const std::vector<std::pair<std::string, void (*)(Manifest&)>> changes{
        {"000000.drc: points", [](Manifest& m) { ++m.tiles[0].points; }},
        {"000000.drc: box", [](Manifest& m) { m.tiles[0].box.max.x += 1; }},
        {"000000.drc", [](Manifest& m) { ++m.tiles[0].origin[1]; }},
        {"000000.drc", [](Manifest& m) { m.lattice.step *= 2; }},
        {"manifest.json: box", [](Manifest& m) { m.box.min.z -= 1; }},
        {"manifest.json: counts", [](Manifest& m) { ++m.counts.merged; }},
        {"manifest.json: sources", [](Manifest& m) { --m.sources[0].points; }},
        {"manifest.json: tiles", [](Manifest& m) { m.tiles[1] = m.tiles[0]; }},
        {"000000.drc", [](Manifest& m) { m.tiles.erase(m.tiles.begin()); }},
        {"manifest.json: points of all tiles",
         [](Manifest& m) { ++m.counts.kept, --m.counts.represented; }}};
    for (const auto& [named, change] : changes) {
        Manifest manifest = good;
        change(manifest);
        write_manifest(folder, manifest);
        EXPECT_THAT([&] { Archive(folder).verify(); }, ThrowsMessage<InputError>(HasSubstr(named)))
            << named;
    }
    write_manifest(folder, good);
    EXPECT_NO_THROW(Archive(folder).verify());
}

TEST_F(Emit, AFileThatTheManifestDoesNotNameIsAnError) {
    const Archive archive(make_archive());
    for (const char* stray : {"tiles/999999.drc", "notes.txt"}) {
        write_text_file(archive.folder() / stray, "");
        EXPECT_THAT([&] { archive.verify(); }, ThrowsMessage<InputError>(HasSubstr(stray)));
        fs::remove(archive.folder() / stray);
    }
    EXPECT_THAT([&] { Archive(folder_ / "none"); }, ThrowsMessage<InputError>(HasSubstr("none")));
    EXPECT_THAT([&] { Archive{folder_}; }, ThrowsMessage<InputError>(HasSubstr("manifest.json")));
}

TEST_F(Emit, LasCoordinatesSurviveToTheBit) {
    const fs::path file = fs::path(KNAP_SHARED_DATA) / "lidar" / "lone-star.copc.laz";
    if (!fs::exists(file)) {
        GTEST_SKIP() << "no test cloud at " << file;
    }
    std::vector<Vec3> points;
    try {
        points = all_points(file);
    } catch (const InputError& error) {
        GTEST_SKIP() << error.what();
    }
    const SourceTable table = survey_of({file});
    Selection all(points.size());
    for (PointId id = 0; id < points.size(); ++id) {
        all.set(id);
    }
    all.finish();
    EmitRequest asked = request("archive");
    asked.counts = {.in = points.size(), .kept = points.size()};
    asked.output.tile_points = 100000;
    emit(table, all, asked);
    const Archive archive(folder_ / "archive");
    archive.verify();
    EXPECT_EQ(sorted(tile_points(archive)), sorted(points));
    EXPECT_EQ(archive.manifest().crs, table.sources()[0].info.crs);
}

}  // namespace
}  // namespace knap
