#include "store/manifest.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "knap/error.hpp"
#include "support/clouds.hpp"

namespace knap {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

double any_double(std::mt19937_64& random) {
    const auto value = std::bit_cast<double>(random());
    return std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
}

Vec3 any_vec3(std::mt19937_64& random) {
    return {any_double(random), any_double(random), any_double(random)};
}

LasHeaderInfo any_las(std::mt19937_64& random) {
    LasHeaderInfo las{.version_minor = 4,
                      .point_format = 7,
                      .file_source_id = 65535,
                      .global_encoding = 17,
                      .project_id = {},
                      .system_identifier = "a scanner",
                      .generating_software = "a program",
                      .creation_day = 366,
                      .creation_year = 2024,
                      .records = {}};
    las.project_id.fill(std::byte{0xfe});
    for (std::size_t size = 0; size < 9; ++size) {
        LasVlr record{"LASF_Projection", 34735, "GeoTIFF", size % 2 == 1, {}};
        for (std::size_t i = 0; i < size; ++i) {
            record.content.push_back(static_cast<std::byte>(random()));
        }
        las.records.push_back(record);
    }
    return las;
}

Manifest any_manifest(std::mt19937_64& random) {
    Manifest manifest;
    manifest.knap_version = "0.1.0";
    manifest.parameters = {{"range.alpha", "0.4"}, {"range.max_factor", "inf"}, {"a", "\"\\\n"}};
    for (std::uint64_t i = 0; i < random() % 4; ++i) {
        manifest.sources.push_back({.path = "scans/a \"b\" \u00e9.ply",
                                    .format = "PLY",
                                    .points = random(),
                                    .rejected = random(),
                                    .bytes = random(),
                                    .xxh3 = std::string(32, 'a'),
                                    .coordinates = {static_cast<CoordinateKind>(random() % 3),
                                                    any_vec3(random), any_vec3(random)},
                                    .schema = {{"x", ScalarType::kFloat32, 1},
                                               {"rgb", ScalarType::kUint16, 3},
                                               {"range", ScalarType::kInt32, 1, any_double(random),
                                                any_double(random), "distance to the scanner"}},
                                    .crs = "EPSG:32633",
                                    .las = std::nullopt});
        if (i % 2 == 0) {
            manifest.sources.back().las = any_las(random);
        }
    }
    manifest.counts = {random(), random(), random(), random(), random()};
    manifest.spacing = any_double(random);
    manifest.mean_curvature = any_double(random);
    manifest.lattice = {any_vec3(random), std::ldexp(1.0, static_cast<int>(random() % 60) - 30)};
    manifest.box = {any_vec3(random), any_vec3(random)};
    manifest.crs = "GEOGCS[\"x\"]";
    for (std::uint64_t i = 0; i < random() % 5; ++i) {
        ManifestTile tile;
        tile.file = "tiles/00000" + std::to_string(i) + ".drc";
        tile.points = random();
        tile.box = {any_vec3(random), any_vec3(random)};
        tile.origin[0] = std::numeric_limits<std::int64_t>::min();
        tile.origin[1] = static_cast<std::int64_t>(random());
        tile.bytes = random();
        tile.xxh3 = "0123456789abcdef";
        manifest.tiles.push_back(tile);
    }
    return manifest;
}

void expect_equal(const Manifest& a, const Manifest& b) {
    EXPECT_EQ(a.format_version, b.format_version);
    EXPECT_EQ(a.knap_version, b.knap_version);
    EXPECT_EQ(a.parameters, b.parameters);
    EXPECT_EQ(a.counts, b.counts);
    EXPECT_EQ(a.spacing, b.spacing);
    EXPECT_EQ(a.mean_curvature, b.mean_curvature);
    EXPECT_EQ(a.lattice.origin, b.lattice.origin);
    EXPECT_EQ(a.lattice.step, b.lattice.step);
    EXPECT_EQ(a.box, b.box);
    EXPECT_EQ(a.crs, b.crs);
    ASSERT_EQ(a.sources.size(), b.sources.size());
    for (std::size_t i = 0; i < a.sources.size(); ++i) {
        EXPECT_EQ(a.sources[i].path, b.sources[i].path);
        EXPECT_EQ(a.sources[i].format, b.sources[i].format);
        EXPECT_EQ(a.sources[i].points, b.sources[i].points);
        EXPECT_EQ(a.sources[i].rejected, b.sources[i].rejected);
        EXPECT_EQ(a.sources[i].bytes, b.sources[i].bytes);
        EXPECT_EQ(a.sources[i].xxh3, b.sources[i].xxh3);
        EXPECT_EQ(a.sources[i].coordinates, b.sources[i].coordinates);
        EXPECT_EQ(a.sources[i].schema, b.sources[i].schema);
        EXPECT_EQ(a.sources[i].crs, b.sources[i].crs);
        EXPECT_EQ(a.sources[i].las, b.sources[i].las);
    }
    ASSERT_EQ(a.tiles.size(), b.tiles.size());
    for (std::size_t i = 0; i < a.tiles.size(); ++i) {
        EXPECT_EQ(a.tiles[i].file, b.tiles[i].file);
        EXPECT_EQ(a.tiles[i].points, b.tiles[i].points);
        EXPECT_EQ(a.tiles[i].box, b.tiles[i].box);
        EXPECT_EQ(a.tiles[i].origin, b.tiles[i].origin);
        EXPECT_EQ(a.tiles[i].bytes, b.tiles[i].bytes);
        EXPECT_EQ(a.tiles[i].xxh3, b.tiles[i].xxh3);
    }
}

Manifest usual_manifest() {
    std::mt19937_64 random(4);
    Manifest manifest = any_manifest(random);
    while (manifest.sources.empty() || manifest.tiles.empty()) {
        manifest = any_manifest(random);
    }
    return manifest;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

TEST(Manifest, ReadsBackAsItWasForAnyValues) {
    std::mt19937_64 random(1);
    for (int i = 0; i < 300; ++i) {
        const Manifest manifest = any_manifest(random);
        const std::string text = format_manifest(manifest);
        const Manifest read = parse_manifest(text, "manifest.json");
        expect_equal(read, manifest);
        EXPECT_EQ(format_manifest(read), text);
    }
}

TEST(Manifest, LimitsReadBackToTheBit) {
    Manifest manifest;
    manifest.lattice.step = 1;
    const std::uint64_t all = ~std::uint64_t{0};
    Attribute unsigned_one{"u", ScalarType::kUint64, 2};
    unsigned_one.limits = {{all, 1}, {0, 0}, {}};
    Attribute signed_one{"i", ScalarType::kInt8};
    signed_one.limits = {{}, {all}, {127}};
    Attribute real{"f", ScalarType::kFloat32};
    real.limits = {{std::bit_cast<std::uint64_t>(std::numeric_limits<double>::quiet_NaN())},
                   {std::bit_cast<std::uint64_t>(-0.0)},
                   {std::bit_cast<std::uint64_t>(0.1)}};
    manifest.attributes = {unsigned_one, signed_one, real};
    EXPECT_EQ(parse_manifest(format_manifest(manifest), "manifest.json").attributes,
              manifest.attributes);
    EXPECT_THAT(format_manifest(manifest), HasSubstr("18446744073709551615"));
}

TEST(Manifest, AnEmptyCloudReadsBack) {
    Manifest manifest;
    manifest.lattice.step = 1;
    const Manifest read = parse_manifest(format_manifest(manifest), "manifest.json");
    EXPECT_TRUE(read.box.empty());
    EXPECT_EQ(read.box, manifest.box);
}

TEST(Manifest, TextThatIsNotUtf8IsWritten) {
    Manifest manifest;
    manifest.lattice.step = 1;
    manifest.crs = "Gau\xdf-Kr\xfcger";
    const Manifest read = parse_manifest(format_manifest(manifest), "manifest.json");
    EXPECT_THAT(read.crs, HasSubstr("Gau"));
}

TEST(Manifest, AFlippedBitAnywhereIsAnErrorNamingTheFileOrChangesNothing) {
    const Manifest manifest = usual_manifest();
    const std::string good = format_manifest(manifest);
    std::mt19937_64 random(2);
    for (std::size_t i = 0; i < good.size(); ++i) {
        std::string bad = good;
        bad[i] = static_cast<char>(bad[i] ^ (1 << (random() % 8)));
        try {
            // White space may change, and the case of an exponent.
            EXPECT_EQ(format_manifest(parse_manifest(bad, "dir/manifest.json")), good)
                << "byte " << i;
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), HasSubstr("dir/manifest.json"));
        }
    }
}

TEST(Manifest, ANewerVersionIsRefused) {
    const std::string text = replaced(format_manifest(usual_manifest()), "\"format_version\": 1",
                                      "\"format_version\": 2");
    EXPECT_THAT(
        [&] { parse_manifest(text, "manifest.json"); },
        ThrowsMessage<InputError>(HasSubstr("format_version: expected at most 1, found 2")));
}

TEST(Manifest, AMissingOrChangedValueIsAnErrorNamingTheKey) {
    const std::string good = format_manifest(usual_manifest());
    std::string without_sum = good;
    without_sum.replace(good.rfind("xxh3"), 4, "sum");
    EXPECT_THAT([&] { parse_manifest(without_sum, "manifest.json"); },
                ThrowsMessage<InputError>(HasSubstr("xxh3: expected a value, found none")));
    EXPECT_THAT([&] { parse_manifest(replaced(good, "\"0.4\"", "\"0.5\""), "manifest.json"); },
                ThrowsMessage<InputError>(
                    AllOf(HasSubstr("manifest.json: xxh3: expected"), HasSubstr("found"))));
}

TEST(Manifest, ATileOutsideTheArchiveIsRefused) {
    for (const char* file :
         {"../secret", "/etc/passwd", "tiles/../../x", "tiles/..", "x.drc", "tiles/"}) {
        Manifest manifest = usual_manifest();
        manifest.tiles.front().file = file;
        EXPECT_THAT(
            [&] { parse_manifest(format_manifest(manifest), "manifest.json"); },
            ThrowsMessage<InputError>(HasSubstr("tiles[0].file: expected a file in tiles/")))
            << file;
    }
}

TEST(Manifest, OtherTextIsNoManifest) {
    for (const char* text :
         {"", "{", "[]", "3", "{}", "{\"format\": 3}", "{\"format\": \"glTF\"}"}) {
        EXPECT_THAT([&] { parse_manifest(text, "some/manifest.json"); },
                    ThrowsMessage<InputError>(HasSubstr("some/manifest.json: expected the JSON")))
            << text;
    }
}

TEST(Manifest, AFolderWithoutOneIsAnErrorNamingTheFile) {
    const test::TemporaryFolder scratch;
    EXPECT_THAT([&] { read_manifest(scratch.path()); },
                ThrowsMessage<InputError>(HasSubstr("manifest.json")));
    write_manifest(scratch.path(), usual_manifest());
    expect_equal(read_manifest(scratch.path()), usual_manifest());
}

}  // namespace
}  // namespace knap
