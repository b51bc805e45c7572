#include "knap/archive.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "emit/decode.hpp"
#include "emit/emit.hpp"
#include "knap/error.hpp"
#include "output/ply_writer.hpp"
#include "store/manifest.hpp"
#include "support/emit_fixture.hpp"

namespace knap {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;
using namespace test;

namespace fs = std::filesystem;

class Emit : public EmitFixture {};

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
#ifndef KNAP_HAVE_LASZIP
    GTEST_SKIP() << "built without LASzip";
#endif
    const std::vector<Vec3> points = all_points(file);
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
