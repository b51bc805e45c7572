#include "input/tiled_source.hpp"

#include <draco/compression/encode.h>
#include <draco/point_cloud/point_cloud_builder.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

#include "emit/draco_tile.hpp"
#include "knap/archive.hpp"
#include "knap/job.hpp"
#include "support/clouds.hpp"
#include "support/scan_files.hpp"

namespace knap {
namespace {

using test::input_error_of;
using test::raw;
using test::read_all;
using test::read_columns;
using test::shared_data;
using test::TemporaryFolder;
using testing::HasSubstr;

class Silent final : public Progress {};

/// A PLY of a sphere with a colour, a quality and a number.
void write_sphere(const std::filesystem::path& path, std::size_t points) {
    std::string bytes =
        "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(points) +
        "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
        "property uchar green\nproperty uchar blue\nproperty double quality\nproperty int "
        "number\nend_header\n";
    int i = 0;
    for (const Vec3& p : test::sphere_cloud(points, 4)) {
        bytes += raw(static_cast<float>(p.x + 1000)) + raw(static_cast<float>(p.y)) +
                 raw(static_cast<float>(p.z)) + static_cast<char>(i) + static_cast<char>(i / 256) +
                 static_cast<char>(7) + raw(i / 3.0) + raw(-i);
        ++i;
    }
    std::ofstream(path, std::ios::binary) << bytes;
}

/// Simplifies one file into an output of small tiles.
void simplify_to(const std::string& input, const std::filesystem::path& output, double alpha) {
    Job job;
    job.input = {input};
    job.range.alpha = alpha;
    job.output.path = output.string();
    job.output.tile_points = 1000;
    job.resources.memory_bytes = std::uint64_t{512} << 20;
    Silent progress;
    run(job, progress);
}

struct Carried {
    std::vector<Vec3> positions;
    std::vector<std::string> columns;
};

Carried tiles_of(const std::filesystem::path& folder) {
    const Archive archive(folder);
    Carried all;
    all.columns.resize(archive.manifest().attributes.size());
    for (std::size_t i = 0; i < archive.manifest().tiles.size(); ++i) {
        const Tile tile = archive.read_whole_tile(i);
        all.positions.insert(all.positions.end(), tile.positions.begin(), tile.positions.end());
        for (std::size_t k = 0; k < tile.columns.size(); ++k) {
            all.columns[k].append(reinterpret_cast<const char*>(tile.columns[k].data()),
                                  tile.columns[k].size());
        }
    }
    return all;
}

TEST(ArchiveSource, GivesTheTilesPointsAndAttributesInTheirOrder) {
    const TemporaryFolder folder;
    write_sphere(folder / "in.ply", 6000);
    simplify_to(folder / "in.ply", folder / "a", 1e-6);
    const Carried expected = tiles_of(folder / "a");
    const auto source = open_source(folder / "a");
    ASSERT_GT(Archive(folder / "a").manifest().tiles.size(), 3U);
    EXPECT_EQ(source->info().format, "knap archive 1");
    EXPECT_EQ(source->info().declared_count, expected.positions.size());
    EXPECT_EQ(source->info().coordinates.kind, CoordinateKind::kInt32);
    const std::vector<std::size_t> all = attributes_of(source->info());
    ASSERT_EQ(all.size(), 5U);
    for (std::size_t i = 0; i < all.size(); ++i) {
        EXPECT_EQ(source->info().schema[all[i]], Archive(folder / "a").manifest().attributes[i]);
    }
    EXPECT_EQ(read_all(folder / "a", 77), expected.positions);
    EXPECT_EQ(read_columns(*source, all, 77), expected.columns);
    for (const std::size_t from : {std::size_t{777}, std::size_t{1}, expected.positions.size()}) {
        source->seek(from);
        EXPECT_EQ(read_columns(*source, {all[3]}, 100)[0], expected.columns[3].substr(8 * from));
    }
    EXPECT_THROW(source->seek(expected.positions.size() + 1), InputError);
}

TEST(ArchiveSource, WhatIsSimplifiedAgainKeepsItsPlacesAndAttributes) {
    const TemporaryFolder folder;
    write_sphere(folder / "in.ply", 3000);
    simplify_to(folder / "in.ply", folder / "a", 0.05);
    simplify_to(folder / "a", folder / "b", 1e-6);
    const Carried first = tiles_of(folder / "a");
    const Carried second = tiles_of(folder / "b");
    EXPECT_EQ(Archive(folder / "b").manifest().attributes,
              Archive(folder / "a").manifest().attributes);
    const auto points = [](const Carried& carried) {
        std::vector<std::string> rows;
        for (std::size_t i = 0; i < carried.positions.size(); ++i) {
            const Vec3& p = carried.positions[i];
            rows.push_back(raw(p.x) + raw(p.y) + raw(p.z) + carried.columns[3].substr(8 * i, 8));
        }
        std::sort(rows.begin(), rows.end());
        return rows;
    };
    EXPECT_EQ(points(second), points(first));
    simplify_to(folder / "a", folder / "c", 0.2);
    EXPECT_LT(tiles_of(folder / "c").positions.size(), first.positions.size());
}

TEST(ArchiveSource, AFolderOfArchivesIsOneCloudEach) {
    const TemporaryFolder folder;
    write_sphere(folder / "in.ply", 600);
    std::filesystem::create_directories(folder / "all/one");
    simplify_to(folder / "in.ply", folder / "all/a", 0.2);
    simplify_to(folder / "in.ply", folder / "all/one/b", 0.1);
    std::filesystem::copy_file(folder / "in.ply", folder / "all/c.ply");
    EXPECT_EQ(
        expand_sources({(folder / "all").string()}),
        (std::vector<std::filesystem::path>{folder / "all/a/manifest.json", folder / "all/c.ply",
                                            folder / "all/one/b/manifest.json"}));
    EXPECT_EQ(expand_sources({(folder / "all/a").string()}),
              (std::vector<std::filesystem::path>{folder / "all/a/manifest.json"}));
}

TEST(ArchiveSource, ADamagedOrMissingTileIsAnErrorThatNamesIt) {
    const TemporaryFolder folder;
    write_sphere(folder / "in.ply", 600);
    simplify_to(folder / "in.ply", folder / "a", 0.2);
    const std::filesystem::path tile = folder / "a/tiles/000000.drc";
    const std::string whole = test::file_bytes(tile);
    for (std::size_t i = 0; i < whole.size(); i += 7) {
        std::string changed = whole;
        changed[i] = static_cast<char>(~changed[i]);
        std::ofstream(tile, std::ios::binary) << changed;
        EXPECT_THAT(input_error_of(folder / "a"), HasSubstr("000000.drc: expected the XXH3"));
    }
    std::filesystem::resize_file(tile, whole.size() - 1);
    EXPECT_THAT(input_error_of(folder / "a"), HasSubstr("000000.drc: expected"));
    std::filesystem::remove(tile);
    EXPECT_THAT(input_error_of(folder / "a"), HasSubstr("000000.drc: cannot open"));
    const std::string manifest = test::file_bytes(folder / "a/manifest.json");
    for (std::size_t n = 60; n < manifest.size(); n += 13) {
        std::ofstream(folder / "a/manifest.json") << manifest.substr(0, n);
        EXPECT_NE(input_error_of(folder / "a"), "") << n;
    }
}

TEST(ArchiveSource, AnArchiveIsNotReplacedByWhatIsReadFromIt) {
    const TemporaryFolder folder;
    write_sphere(folder / "in.ply", 300);
    simplify_to(folder / "in.ply", folder / "a", 0.2);
    Job job;
    job.input = {folder / "a"};
    job.range.alpha = 0.5;
    job.output.path = (folder / "a").string();
    job.output.overwrite = true;
    Silent progress;
    EXPECT_THROW(run(job, progress), ConfigError);
}

TEST(LatticeFormat, KeepsEveryPositionBitForBitOrSaysDoubles) {
    std::mt19937_64 random(17);
    int narrow = 0;
    for (int round = 0; round < 20000; ++round) {
        const auto below = [&](std::uint64_t n) { return static_cast<std::int64_t>(random() % n); };
        const double step = round % 2 == 0 ? std::ldexp(1.0, static_cast<int>(below(40)) - 30)
                                           : 0.00025 * static_cast<double>(1 + below(9));
        const std::int64_t first = below(1ULL << (1 + below(45))) * (below(2) == 0 ? 1 : -1);
        const std::int64_t length = below(1ULL << (1 + below(33)));
        Vec3 origin;
        for (int axis = 0; axis < 3; ++axis) {
            const std::int64_t kind = below(3);
            origin[axis] = kind == 0   ? 0.0
                           : kind == 1 ? static_cast<double>(below(1000000)) * step
                                       : static_cast<double>(below(1000000)) * 0.37;
        }
        const std::array<std::int64_t, 3> low{first, -first, first / 2};
        const std::array<std::int64_t, 3> high{low[0] + length, low[1] + length, low[2] + length};
        const CoordinateFormat format = format_of_lattice(origin, step, low, high);
        if (format.kind != CoordinateKind::kInt32) {
            continue;
        }
        ++narrow;
        for (int i = 0; i < 20; ++i) {
            for (int axis = 0; axis < 3; ++axis) {
                const auto a = static_cast<std::size_t>(axis);
                const std::int64_t index =
                    i == 0   ? low[a]
                    : i == 1 ? high[a]
                             : low[a] + below(static_cast<std::uint64_t>(length + 1));
                const Vec3 position = lattice_position(origin, step, {index, index, index});
                const double stored =
                    std::round((position[axis] - format.offset[axis]) / format.scale[axis]);
                ASSERT_LE(std::abs(stored), 0x1p31);
                ASSERT_EQ(format.axis(axis).at(static_cast<std::int32_t>(stored)), position[axis])
                    << "step " << step << " origin " << origin[axis] << " index " << index;
            }
        }
    }
    EXPECT_GT(narrow, 5000);
}

TEST(DracoSource, WhatKnapWroteIsBackOnItsLattice) {
    const TemporaryFolder folder;
    write_sphere(folder / "in.ply", 2000);
    simplify_to(folder / "in.ply", folder / "a.drc", 0.05);
    const auto source = open_source(folder / "a.drc");
    EXPECT_EQ(source->info().format, "Draco, written by knap");
    EXPECT_EQ(source->info().coordinates.kind, CoordinateKind::kInt32);
    EXPECT_EQ(source->info().seek_granularity, 0U);
    EXPECT_THROW(source->seek(1), InputError);
    const std::string bytes = test::file_bytes(folder / "a.drc");
    const DecodedTile tile =
        decode_tile(std::as_bytes(std::span(bytes.data(), bytes.size())), "a.drc");
    std::vector<Vec3> expected;
    for (const LatticeIndex& index : tile.points) {
        expected.push_back(position_of(tile.lattice, index));
    }
    EXPECT_EQ(read_all(folder / "a.drc", 99), expected);
    const std::vector<std::size_t> all = attributes_of(source->info());
    const std::vector<std::string> columns = read_columns(*source, all, 99);
    ASSERT_EQ(columns.size(), tile.columns.values.size());
    for (std::size_t i = 0; i < columns.size(); ++i) {
        EXPECT_EQ(source->info().schema[all[i]], tile.columns.attributes[i]);
        EXPECT_EQ(columns[i].size(), tile.columns.values[i].size());
        EXPECT_EQ(std::memcmp(columns[i].data(), tile.columns.values[i].data(), columns[i].size()),
                  0);
    }
}

TEST(DracoSource, CutOrDamagedItIsAnErrorOrStillDraco) {
    const TemporaryFolder folder;
    write_sphere(folder / "in.ply", 300);
    simplify_to(folder / "in.ply", folder / "a.drc", 0.3);
    const std::string whole = test::file_bytes(folder / "a.drc");
    const test::ScanFolder scans;
    for (std::size_t n = 1; n < whole.size(); ++n) {
        EXPECT_NE(input_error_of(scans.write("b.drc", whole.substr(0, n))), "") << n;
    }
    for (std::size_t i = 0; i < whole.size(); ++i) {
        std::string changed = whole;
        changed[i] = static_cast<char>(~changed[i]);
        const auto path = scans.write("b.drc", changed);
        const std::string error = input_error_of(path);
        EXPECT_TRUE(error.empty() || error.starts_with(path.string() + ": ")) << error;
    }
}

/// A Draco file of another program, without loss.
template <typename T>
std::filesystem::path write_draco(const std::filesystem::path& path, draco::DataType type,
                                  const std::vector<std::array<T, 3>>& positions) {
    draco::PointCloudBuilder builder;
    builder.Start(static_cast<draco::PointIndex::ValueType>(positions.size()));
    const int id = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, type);
    for (std::uint32_t i = 0; i < positions.size(); ++i) {
        builder.SetAttributeValueForPoint(id, draco::PointIndex(i), positions[i].data());
    }
    draco::Encoder encoder;
    encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
    draco::EncoderBuffer buffer;
    const auto cloud = builder.Finalize(false);
    EXPECT_TRUE(encoder.EncodePointCloudToBuffer(*cloud, &buffer).ok());
    std::ofstream(path, std::ios::binary)
        .write(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    return path;
}

TEST(DracoSource, IntegersAndDoublesStayWhatFloatsCannotHold) {
    const TemporaryFolder folder;
    const auto integers = write_draco<std::int32_t>(folder / "i.drc", draco::DT_INT32,
                                                    {{16777217, -5, 16777219}, {0, 1, 2}});
    EXPECT_THAT(read_all(integers),
                testing::ElementsAre(Vec3{16777217, -5, 16777219}, Vec3{0, 1, 2}));
    const auto doubles = write_draco<double>(folder / "d.drc", draco::DT_FLOAT64,
                                             {{637012.24, 849028.31, 0.1}, {1e300, 0, -1}});
    EXPECT_THAT(read_all(doubles),
                testing::ElementsAre(Vec3{637012.24, 849028.31, 0.1}, Vec3{1e300, 0, -1}));
}

TEST(DracoSource, SharedFilesAreWhatTheDecoderOfDracoMakesOfThem) {
    if (!std::filesystem::exists(shared_data("drc")) ||
        std::system("draco_decoder -h > /dev/null 2>&1") < 0) {
        GTEST_SKIP() << "needs ../shared/data/drc and draco_decoder";
    }
    const TemporaryFolder folder;
    for (const std::string name :
         {"bunny_gltf", "cube_pc", "pc_color", "pc_kd_color", "point_cloud_no_qp", "redrocks"}) {
        const auto path = shared_data("drc/" + name + ".drc");
        const std::string ply = folder / (name + ".ply");
        const std::string command =
            "draco_decoder -i '" + path.string() + "' -o '" + ply + "' > /dev/null 2>&1";
        if (std::system(command.c_str()) != 0) {
            GTEST_SKIP() << "draco_decoder does not run";
        }
        const auto twin = open_source(ply);
        const auto source = open_source(path);
        EXPECT_EQ(source->info().unsupported.size(), name == "bunny_gltf" ? 1U : 0U) << name;
        if (name != "bunny_gltf") {  // of a mesh the decoder may number points otherwise
            EXPECT_EQ(read_all(path), read_all(ply)) << name;
        }
        EXPECT_EQ(source->info().declared_count, twin->info().declared_count) << name;
        for (const std::size_t i : attributes_of(twin->info())) {
            const std::vector<Attribute>& schema = source->info().schema;
            const auto found = std::find(schema.begin(), schema.end(), twin->info().schema[i]);
            ASSERT_NE(found, schema.end()) << name << " " << twin->info().schema[i].name;
            if (name != "bunny_gltf") {
                EXPECT_EQ(read_columns(*open_source(path),
                                       {static_cast<std::size_t>(found - schema.begin())}),
                          read_columns(*open_source(ply), {i}))
                    << name << " " << found->name;
            }
        }
    }
}

}  // namespace
}  // namespace knap
