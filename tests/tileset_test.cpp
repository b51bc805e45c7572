#include "tileset/tileset.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "emit/archive_writer.hpp"
#include "emit/output_check.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "knap/job.hpp"
#include "support/clouds.hpp"
#include "support/tileset_reader.hpp"
#include "tileset/geocentric.hpp"

namespace knap {
namespace {

using namespace test;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::ThrowsMessage;

namespace fs = std::filesystem;

constexpr std::uint32_t kFirstNumber = 3000000000;  // more than Draco codes

const std::vector<Attribute> kAttributes{
    {"red", ScalarType::kUint16},       {"green", ScalarType::kUint16},
    {"blue", ScalarType::kUint16},      {"number", ScalarType::kUint32},
    {"gps_time", ScalarType::kFloat64}, {"large", ScalarType::kUint64}};

template <typename T>
void put(std::vector<std::byte>& rows, T value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    rows.insert(rows.end(), bytes.begin(), bytes.end());
}

/// Archives of random points, told apart by their attribute "number".
class Tilesets : public testing::Test {
  protected:
    /// @param span  lattice steps of the longer sides
    Archive archive(std::size_t points, std::int64_t span, const Lattice& lattice,
                    const std::string& crs, std::uint64_t tile_points = 30000) {
        std::mt19937_64 random(points);
        points_.clear();
        std::vector<CarryingPoint> carrying;
        std::vector<std::byte> rows;
        for (std::size_t i = 0; i < points; ++i) {
            // Denser towards one corner.
            const double u = static_cast<double>(random() % 1000000) / 1e6;
            const double v = static_cast<double>(random() % 1000000) / 1e6;
            points_.push_back({static_cast<std::int64_t>(u * u * static_cast<double>(span)),
                               static_cast<std::int64_t>(v * static_cast<double>(span)),
                               static_cast<std::int64_t>(random() % 3000)});
            carrying.push_back({points_.back(), i});
            for (const unsigned color : {1U, 2U, 3U}) {
                put(rows, static_cast<std::uint16_t>((i * color * brightness_) & 0xffff));
            }
            put(rows, static_cast<std::uint32_t>(kFirstNumber + i));
            put(rows, 1e9 + static_cast<double>(i) / 1024);
            put(rows, std::uint64_t{i});
        }
        Manifest manifest;
        manifest.lattice = lattice;
        manifest.crs = crs;
        manifest.attributes = kAttributes;
        manifest.counts = {.in = points, .kept = points};
        manifest.sources.emplace_back();
        manifest.sources.back().path = "made.las";
        manifest.sources.back().points = points;
        const fs::path folder = folder_ / "archive";
        ArchiveWriter writer(manifest,
                             {.folder = folder, .tile_points = tile_points, .overwrite = true});
        writer.add(carrying, rows, std::uint64_t{1} << 30);
        writer.finish();
        return Archive(folder);
    }

    static TilesetResult make(const Archive& archive, int threads = 2) {
        return make_tileset(
            archive.folder(),
            {.threads = threads, .memory_bytes = std::uint64_t{1} << 28, .overwrite = true});
    }

    /// Every point is there once, and where it should be.
    template <typename Expected>
    void expect_all(const ReadTileset& found, const Lattice& lattice, double tolerance,
                    const Expected& expected) const {
        EXPECT_THAT(found.faults, IsEmpty());
        ASSERT_EQ(found.points.size(), points_.size());
        std::vector<bool> seen(points_.size());
        double farthest = 0;
        for (const TilesetPoint& point : found.points) {
            const auto i = static_cast<std::size_t>(point.value - kFirstNumber);
            ASSERT_LT(i, seen.size());
            EXPECT_FALSE(seen[i]) << i;
            seen[i] = true;
            const Vec3 place = expected(position_of(lattice, points_[i]));
            farthest = std::max(farthest, std::sqrt(squared_distance(point.place, place)));
        }
        EXPECT_LE(farthest, tolerance);
    }

    TemporaryFolder folder_;
    std::vector<LatticeIndex> points_;
    std::size_t brightness_ = 77;
};

/// Of floats: no tile spans more than all, and of a coordinate range, step and product are rounded,
/// on three axes.
double rounding(double span) {
    return 3 * std::sqrt(3) * std::ldexp(span, -24);
}

const auto kSame = [](const Vec3& p) { return p; };

TEST_F(Tilesets, WithoutACoordinateSystemEveryPointIsThereOnceAtItsPlace) {
    // One tile; several in whole steps; parents as floats.
    for (const std::int64_t span : {20000, 150000, 500000}) {
        const Lattice lattice{{637000, 4850000, -100}, 0.01};
        const Archive made = archive(200000, span, lattice, "");
        const TilesetResult result = make(made);
        EXPECT_FALSE(result.on_earth);
        EXPECT_EQ(result.points, 200000);
        const ReadTileset found = read_tileset(made.folder() / "tileset", "number");
        // And doubles of the coordinates.
        expect_all(found, lattice, rounding(static_cast<double>(span) * lattice.step) + 1e-8,
                   kSame);
        EXPECT_EQ(found.floats > 0, span == 500000) << span;
        EXPECT_EQ(found.files, result.tiles);
        EXPECT_NO_THROW(made.verify());
    }
}

TEST_F(Tilesets, OnTheEarthPointsLieWithinHalfAStepOfWhereTheCoordinateSystemHasThem) {
    struct Case {
        const char* crs;
        Lattice lattice;
        std::int64_t span;
        double metres;  // a step
    };
    for (const Case& c : {Case{"EPSG:32631", {{500000, 5800000, 50}, 0.01}, 50000, 0.01},
                          Case{"EPSG:32631", {{300000, 5800000, 50}, 0.01}, 1000000, 0.01},
                          Case{"EPSG:2994", {{637000, 851000, 400}, 0.01}, 400000, 0.003048},
                          Case{"EPSG:4326", {{7.5, 47.25, 300}, 1e-7}, 60000, 0.0112}}) {
        const Archive made = archive(150000, c.span, c.lattice, c.crs);
        const TilesetResult result = make(made);
        EXPECT_TRUE(result.on_earth) << c.crs;
        const ReadTileset found = read_tileset(made.folder() / "tileset", "number");
        const Geocentric earth(c.crs, position_of(c.lattice, points_[0]));
        const double floats = rounding(static_cast<double>(c.span) * c.metres);
        expect_all(found, c.lattice, c.metres / 2 + floats + 1e-7,
                   [&](const Vec3& p) { return earth.at(p); });
        EXPECT_LE(result.largest_error, c.metres / 2 + floats) << c.crs;
        EXPECT_EQ(found.floats > 0, c.span > 100000) << c.crs;
        EXPECT_EQ(found.json["extras"]["knap"]["frame"], "ECEF");
        EXPECT_NO_THROW(made.verify());
    }
}

TEST_F(Tilesets, ACoordinateSystemThatSaysNothingOfTheEarthGivesALocalFrameAndANote) {
    for (const char* crs : {"LOCAL_CS[\"site\"]", "nonsense", "EPSG:4326"}) {
        const Lattice lattice{{515000, 4918000, 2300}, 0.01};
        const Archive made = archive(1000, 1000, lattice, crs);
        const TilesetResult result = make(made);
        EXPECT_FALSE(result.on_earth) << crs;
        EXPECT_THAT(result.notes, Contains(HasSubstr("local frame"))) << crs;
        expect_all(read_tileset(made.folder() / "tileset", "number"), lattice, 1e-5, kSame);
    }
}

TEST_F(Tilesets, HaveTheSameBytesForAnyNumberOfThreads) {
    // Spread out; and dozens in each place, whose order nothing else tells.
    for (const std::int64_t span : {100000, 1}) {
        const Archive made =
            archive(150000, span, {{500000, 5800000, 50}, 0.01}, "EPSG:32631", 7000);
        std::map<std::string, std::string> first;
        for (const int threads : {1, 2, 5}) {
            make(made, threads);
            std::map<std::string, std::string> files;
            for (const auto& entry : fs::directory_iterator(made.folder() / "tileset")) {
                files[entry.path().filename()] = read_bytes(entry.path());
            }
            EXPECT_GT(files.size(), 3);
            if (threads == 1) {
                first = files;
            }
            EXPECT_TRUE(files == first) << threads;
        }
    }
}

TEST_F(Tilesets, AParentHasAnEvenSampleOfThePointsBelow) {
    const Archive made = archive(200000, 20000, {{0, 0, 0}, 1}, "");
    make(made);
    const ReadTileset found = read_tileset(made.folder() / "tileset", "number");
    const auto& root = found.json["root"];
    const std::size_t n = root["content"]["extras"]["points"];
    EXPECT_NEAR(static_cast<double>(n), 65536, 100);
    // As many of all points to the left of a place as of the root's.
    std::vector<std::int64_t> all;
    for (const LatticeIndex& point : points_) {
        all.push_back(point[0]);
    }
    std::sort(all.begin(), all.end());
    std::vector<double> held;  // the root's come first
    for (std::size_t i = 0; i < n; ++i) {
        held.push_back(found.points[i].place.x);
    }
    std::sort(held.begin(), held.end());
    for (const double share : {0.1, 0.3, 0.5, 0.9}) {
        const auto at = static_cast<double>(all[static_cast<std::size_t>(share * 200000)]);
        const auto below = std::lower_bound(held.begin(), held.end(), at) - held.begin();
        EXPECT_NEAR(static_cast<double>(below) / static_cast<double>(n), share, 0.002);
    }
}

TEST_F(Tilesets, CarryColoursAndWhatABatchTableHolds) {
    for (const bool narrow : {true, false}) {
        brightness_ = narrow ? 1 : 77;
        const Archive made = archive(80, 1000, {{0, 0, 0}, 1}, "");
        const TilesetResult result = make(made);
        EXPECT_THAT(result.notes, Contains(HasSubstr("attribute large")));
        const ReadTileset numbers = read_tileset(made.folder() / "tileset", "number");
        const ReadTileset times = read_tileset(made.folder() / "tileset", "gps_time");
        EXPECT_THAT(numbers.properties, ElementsAre("gps_time", "number"));
        ASSERT_EQ(numbers.points.size(), 80);
        for (std::size_t k = 0; k < 80; ++k) {
            const auto i = static_cast<std::size_t>(numbers.points[k].value - kFirstNumber);
            EXPECT_EQ(times.points[k].value, 1e9 + static_cast<double>(i) / 1024);
            for (std::size_t c = 0; c < 3; ++c) {
                const double color = static_cast<double>((i * (c + 1) * brightness_) & 0xffff);
                EXPECT_EQ(numbers.points[k].rgb[c], narrow ? color : std::round(color / 257)) << i;
            }
        }
    }
}

TEST_F(Tilesets, OfOnePointAndOfNoneAreThere) {
    for (const char* crs : {"", "EPSG:32631"}) {
        const Lattice lattice{{500000, 5800000, 50}, 0.01};
        const Archive one = archive(1, 1000, lattice, crs);
        make(one);
        const ReadTileset found = read_tileset(one.folder() / "tileset", "number");
        if (*crs == '\0') {
            expect_all(found, lattice, 1e-8, kSame);
        }
        EXPECT_EQ(found.points.size(), 1);
        EXPECT_THAT(found.faults, IsEmpty());
        const Archive none = archive(0, 1000, lattice, crs);
        EXPECT_EQ(make(none).tiles, 0);
        EXPECT_THAT(read_tileset(none.folder() / "tileset", "").faults, IsEmpty());
        EXPECT_NO_THROW(none.verify());
    }
}

TEST_F(Tilesets, ManyPointsInOnePlaceHaveTilesToo) {
    const Archive made = archive(140000, 1, {{0, 0, 0}, 1}, "");
    make(made);
    const ReadTileset found = read_tileset(made.folder() / "tileset", "number");
    expect_all(found, made.manifest().lattice, 0, kSame);
}

TEST_F(Tilesets, WhatIsThereIsReplacedOnlyWhenAskedAndOnlyIfItIsOurs) {
    const Archive made = archive(100, 1000, {{0, 0, 0}, 1}, "");
    const fs::path tileset = made.folder() / "tileset";
    make(made);
    EXPECT_THAT([&] { make_tileset(made.folder(), {}); },
                ThrowsMessage<ConfigError>(HasSubstr("exists (needs --overwrite)")));
    EXPECT_TRUE(holds_only_archive(made.folder()));
    std::ofstream(tileset / "notes.txt") << "mine";
    EXPECT_FALSE(holds_only_archive(made.folder()));
    EXPECT_THROW(make(made), StorageError);
    EXPECT_TRUE(fs::exists(tileset / "notes.txt"));
    EXPECT_FALSE(fs::exists(made.folder() / "tileset.partial"));
    EXPECT_THAT([&] { made.verify(); }, ThrowsMessage<InputError>(HasSubstr("notes.txt")));
}

TEST_F(Tilesets, VerifyFindsDamage) {
    const Archive made = archive(1000, 1000, {{0, 0, 0}, 1}, "");
    make(made);
    EXPECT_EQ(made.verify().tileset_tiles, 1);
    for (const char* name : {"tileset.json", "000000.pnts"}) {
        const fs::path file = made.folder() / "tileset" / name;
        const std::string good = read_bytes(file);
        for (std::size_t i = 0; i < good.size(); i += 1 + good.size() / 40) {
            if (good[i] == ' ' || good[i] == '\n') {
                continue;  // JSON is the same with other blanks
            }
            std::string bad = good;
            bad[i] = static_cast<char>(bad[i] ^ 1);
            std::ofstream(file, std::ios::binary) << bad;
            EXPECT_THROW(made.verify(), InputError) << name << " " << i;
        }
        fs::remove(file);
        EXPECT_THROW(made.verify(), InputError);
        std::ofstream(file, std::ios::binary) << good;
    }
    EXPECT_NO_THROW(made.verify());
    // That of another archive.
    fs::rename(made.folder() / "tileset", folder_ / "kept");
    const Archive other = archive(1001, 1000, {{0, 0, 0}, 1}, "");
    fs::rename(folder_ / "kept", other.folder() / "tileset");
    EXPECT_THAT([&] { other.verify(); },
                ThrowsMessage<InputError>(HasSubstr("the archive's XXH3")));
}

TEST_F(Tilesets, WithoutRoomNothingIsLeft) {
    const Archive made = archive(1000, 1000, {{0, 0, 0}, 1}, "");
    const auto stop = [](std::uint64_t) { throw Interrupted("stopped"); };
    EXPECT_THROW(
        make_tileset(made.folder(), {.memory_bytes = 1 << 20, .overwrite = false, .advance = stop}),
        Interrupted);
    EXPECT_FALSE(fs::exists(made.folder() / "tileset"));
    EXPECT_FALSE(fs::exists(made.folder() / "tileset.partial"));
    EXPECT_NO_THROW(made.verify());
}

Job job_of(const fs::path& input, const fs::path& output) {
    Job job;
    job.input = {input.string()};
    job.output.path = output.string();
    job.output.tileset = true;
    job.range.alpha = 3;
    job.resources.memory_bytes = std::uint64_t{512} << 20;
    return job;
}

TEST(TilesetOfAJob, OfFeetStandsOnTheEarth) {
    TemporaryFolder folder;
    const fs::path input = shared_file("lidar/autzen_trim.las", folder);
    if (input.empty()) {
        GTEST_SKIP() << "no ../shared/data/lidar/autzen_trim.las";
    }
    Progress silent;
    const Report report = run(job_of(input, folder / "trim"), silent);
    EXPECT_GT(report.tileset_tiles, 0);
    EXPECT_GT(report.tileset_bytes, 0);
    const Archive made(folder / "trim");
    EXPECT_EQ(made.verify().tileset_tiles, report.tileset_tiles);
    const ReadTileset found = read_tileset(folder / "trim" / "tileset", "intensity");
    EXPECT_THAT(found.faults, IsEmpty());
    EXPECT_EQ(found.points.size(), report.counts.kept);
    // The stadium of Autzen is in Eugene, Oregon; the points are those that decode gives.
    const Geocentric earth(made.manifest().crs, made.manifest().box.min);
    std::vector<std::array<double, 3>> expected;
    for (std::size_t i = 0; i < made.manifest().tiles.size(); ++i) {
        for (const Vec3& position : made.read_tile(i)) {
            const Vec3 p = earth.at(position);
            expected.push_back({p.x, p.y, p.z});
        }
    }
    std::vector<std::array<double, 3>> places;
    for (const TilesetPoint& point : found.points) {
        places.push_back({point.place.x, point.place.y, point.place.z});
    }
    // Sums and extremes tell, without pairing points off.
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto by_axis = [axis](const auto& a, const auto& b) { return a[axis] < b[axis]; };
        std::sort(expected.begin(), expected.end(), by_axis);
        std::sort(places.begin(), places.end(), by_axis);
        for (std::size_t i = 0; i < places.size(); ++i) {
            // The i-th of two lists that differ by at most this, differs by at most this.
            ASSERT_NEAR(places[i][axis], expected[i][axis], 0.003048 / 2 + 1e-4);
        }
    }
    EXPECT_NEAR(std::atan2(places[0][1], places[0][0]) * 180 / M_PI, -123.07, 0.01);
}

TEST(TilesetOfAJob, GoesIntoAnArchiveOnly) {
    TemporaryFolder folder;
    write_ply(folder / "a.ply", sphere_cloud(100, 1));
    Progress silent;
    EXPECT_THAT([&] { run(job_of(folder / "a.ply", folder / "a.drc"), silent); },
                ThrowsMessage<ConfigError>(HasSubstr("output.tileset (--tileset)")));
}

}  // namespace
}  // namespace knap
