#include "emit/single_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "emit/emit.hpp"
#include "output/cloud_writer.hpp"
#include "support/las_bytes.hpp"
#include "support/scan_files.hpp"

namespace knap {
namespace {

namespace fs = std::filesystem;

using test::get;
using test::LasBytes;

/// Files as a job has them, and every third point of them kept.
struct Kept {
    SourceTable table;
    Selection selection;

    explicit Kept(const std::vector<fs::path>& files) {
        std::vector<SourceEntry> entries;
        Box box;
        std::vector<bool> finite;
        for (const fs::path& file : files) {
            SourceEntry entry;
            entry.info = open_source(file)->info();
            entry.given_path = file.string();
            entry.xxh3 = std::string(32, '0');
            for (const Vec3& point : test::read_all(file)) {
                ++entry.points;
                finite.push_back(is_finite(point));
                if (finite.back()) {
                    box.extend(point);
                }
            }
            entries.push_back(entry);
        }
        table = SourceTable(entries, box);
        selection = Selection(table.points());
        for (PointId id = 0; id < table.points(); ++id) {
            if (id % 3 == 1 && finite[id]) {
                selection.set(id);
            }
        }
        selection.finish();
    }

    std::vector<std::string> write(const fs::path& path, int threads = 2,
                                   std::vector<std::string> attributes = {"all"}) const {
        std::vector<std::string> notes;
        EmitRequest request;
        request.spacing = 0.1;
        request.output.path = path.string();
        request.output.attributes = std::move(attributes);
        request.threads = threads;
        request.note = [&](const std::string& note) { notes.push_back(note); };
        const EmitResult result = emit(table, selection, request);
        EXPECT_EQ(result.bytes, fs::file_size(path));
        return notes;
    }
};

/// The kept points of one source, and their values column by column.
struct Values {
    std::vector<Vec3> positions;
    std::vector<Attribute> attributes;
    std::vector<std::string> columns;
};

Values read(const fs::path& path, const std::function<bool(std::size_t)>& wanted) {
    Values values;
    const auto source = open_source(path);
    const std::vector<std::size_t> selected = attributes_of(source->info());
    for (const std::size_t i : selected) {
        values.attributes.push_back(source->info().schema[i]);
    }
    values.columns.resize(selected.size());
    source->select(selected);
    for (Chunk chunk; source->read(chunk, 1000);) {
        for (std::size_t i = 0; i < chunk.positions.size(); ++i) {
            if (!wanted(chunk.first + i)) {
                continue;
            }
            values.positions.push_back(chunk.positions[i]);
            for (std::size_t c = 0; c < selected.size(); ++c) {
                const std::size_t size = values.attributes[c].value_size();
                values.columns[c].append(
                    reinterpret_cast<const char*>(chunk.columns[c].data()) + i * size, size);
            }
        }
    }
    return values;
}

class SingleFile : public testing::Test {
  protected:
    test::ScanFolder folder_;
};

// Acceptance: kept coordinates bit for bit, the record of the coordinate system byte for byte.
TEST_F(SingleFile, ACopcFileBecomesALazWithTheSameIntegersAndTheSameCrsRecord) {
    const fs::path in = test::shared_data("lidar/lone-star.copc.laz");
    if (!fs::exists(in)) {
        GTEST_SKIP() << "no " << in;
    }
    const Kept kept({in});
    const fs::path out = folder_.path() / "out.laz";
    EXPECT_THAT(kept.write(out), testing::IsEmpty());
    const LasBytes before(in);
    const LasBytes after(out);
    EXPECT_EQ(after.record("LASF_Projection", 2112), before.record("LASF_Projection", 2112));
    EXPECT_EQ(after.bytes().substr(131, 48), before.bytes().substr(131, 48)) << "scale and offset";
    const std::string all = test::laz_records(in);
    const std::string some = test::laz_records(out);
    const std::size_t length = before.record_length();
    ASSERT_EQ(after.record_length(), length);
    ASSERT_EQ(some.size(), kept.selection.count() * length);
    for (std::size_t id = 0, i = 0; id < before.points(); ++id) {
        if (kept.selection.test(id)) {
            ASSERT_EQ(some.compare(i * length, length, all, id * length, length), 0) << id;
            ++i;
        }
    }
}

TEST_F(SingleFile, EveryLasFileKeepsItsRecordsBitForBit) {
    const fs::path data = test::shared_data("lidar");
    if (!fs::exists(data)) {
        GTEST_SKIP() << "no " << data;
    }
    std::size_t files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(data)) {
        const fs::path in = entry.path();
        if (in.filename() == "autzen.laz" || !cloud_format_of(in) ||
            !test::input_error_of(in).empty()) {
            continue;
        }
        const Kept kept({in});
        const Values before = read(in, [&](std::size_t i) { return kept.selection.test(i); });
        for (const char* name : {"out.las", "out.laz"}) {
            const fs::path out = folder_.path() / name;
            kept.write(out);
            const Values after = read(out, [](std::size_t) { return true; });
            EXPECT_EQ(after.positions, before.positions) << in;
            EXPECT_EQ(after.attributes, before.attributes) << in;
            EXPECT_EQ(after.columns, before.columns) << in;
            EXPECT_EQ(open_source(out)->info().coordinates, open_source(in)->info().coordinates);
            EXPECT_EQ(open_source(out)->info().crs, open_source(in)->info().crs) << in;
            fs::remove(out);
        }
        ++files;
    }
    EXPECT_GE(files, 10U);
}

TEST_F(SingleFile, EveryPlyKeepsItsPropertiesAsPlyAndAsLas) {
    const fs::path data = test::shared_data("ply");
    if (!fs::exists(data)) {
        GTEST_SKIP() << "no " << data;
    }
    for (const auto& entry : fs::directory_iterator(data)) {
        const fs::path in = entry.path();
        if (!test::input_error_of(in).empty()) {
            continue;
        }
        const Kept kept({in});
        const Values before = read(in, [&](std::size_t i) { return kept.selection.test(i); });
        const fs::path ply = folder_.path() / "out.ply";
        kept.write(ply);
        const Values after = read(ply, [](std::size_t) { return true; });
        EXPECT_EQ(after.positions, before.positions) << in;
        EXPECT_EQ(after.attributes, before.attributes) << in;
        EXPECT_EQ(after.columns, before.columns) << in;
        fs::remove(ply);
    }
}

TEST_F(SingleFile, TextReadsBackAsTheSameNumbers) {
    const fs::path in = test::shared_data("lidar/autzen_trim.las");
    if (!fs::exists(in)) {
        GTEST_SKIP() << "no " << in;
    }
    const Kept kept({in});
    const fs::path out = folder_.path() / "out.xyz";
    kept.write(out);
    const auto source = open_source(out);
    const Values before = read(in, [&](std::size_t i) { return kept.selection.test(i); });
    const Values after = read(out, [](std::size_t) { return true; });
    EXPECT_EQ(after.positions, before.positions);
    ASSERT_EQ(after.attributes.size(), before.attributes.size());
    for (std::size_t c = 0; c < after.attributes.size(); ++c) {
        EXPECT_EQ(after.attributes[c].name, before.attributes[c].name);
        if (before.attributes[c].type == ScalarType::kUint16) {
            for (std::size_t i = 0; i < after.positions.size(); ++i) {
                ASSERT_EQ(get<double>(after.columns[c], 8 * i),
                          get<std::uint16_t>(before.columns[c], 2 * i));
            }
        }
    }
}

TEST_F(SingleFile, TheBytesDoNotDependOnThreads) {
    const fs::path in = test::shared_data("lidar/extra_bytes_pf8.laz");
    if (!fs::exists(in)) {
        GTEST_SKIP() << "no " << in;
    }
    const Kept kept({in});
    for (const char* ending : {".ply", ".laz", ".las", ".xyz"}) {
        const fs::path one = folder_.path() / (std::string("one") + ending);
        const fs::path many = folder_.path() / (std::string("many") + ending);
        kept.write(one, 1);
        kept.write(many, 4);
        EXPECT_TRUE(test::file_bytes(one) == test::file_bytes(many)) << ending;
    }
}

/// A little LAS file of its own place, coordinate system and records.
fs::path write_las(const test::ScanFolder& folder, const std::string& name, const Vec3& scale,
                   const Vec3& offset, const std::string& wkt) {
    test::LasFile las;
    las.version_minor = 4;
    las.point_format = 6;
    las.scale = scale;
    las.offset = offset;
    las.points = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {-10, 11, 12}};
    las.vlrs = test::las_record("LASF_Projection", 2112, wkt) + test::las_record("own", 1, name);
    las.vlr_count = 2;
    return folder.write(name, las.bytes());
}

TEST_F(SingleFile, SeveralGridsThatFitIntoEachOtherLeaveEveryPositionWhereItIs) {
    const Kept kept({write_las(folder_, "a.las", {0.01, 0.01, 0.01}, {100, 0, 0}, "WKT"),
                     write_las(folder_, "b.las", {0.02, 0.01, 0.01}, {-3e7, 0.5, 0}, "WKT")});
    const fs::path out = folder_.path() / "out.las";
    const std::vector<std::string> notes = kept.write(out);
    EXPECT_THAT(notes, testing::ElementsAre(testing::HasSubstr("1 records of the sources'")));
    const LasBytes file(out);
    EXPECT_EQ(file.record("own", 1), "a.las");
    EXPECT_EQ(file.record("LASF_Projection", 2112), "WKT");
    EXPECT_EQ(get<double>(file.bytes(), 131), 0.01);
    const Vec3 first = test::read_all(out).front();
    EXPECT_EQ(first, test::read_all(folder_.path() / "a.las")[1]);
    EXPECT_EQ(test::read_all(out).back(), test::read_all(folder_.path() / "b.las")[3]);
}

TEST_F(SingleFile, DifferentCoordinateSystemsGiveNone) {
    const Kept kept({write_las(folder_, "a.las", {0.01, 0.01, 0.01}, {}, "one"),
                     write_las(folder_, "b.las", {0.01, 0.01, 0.01}, {}, "another")});
    const fs::path out = folder_.path() / "out.laz";
    EXPECT_THAT(kept.write(out),
                testing::Contains(testing::HasSubstr("different coordinate systems")));
    EXPECT_EQ(open_source(out)->info().crs, "");
}

TEST_F(SingleFile, FloatsBecomeLasWithinHalfAStep) {
    std::string ply =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar classification\nproperty float quality\nend_header\n";
    ply += "0 0 0 1 0.5\n0.1 0.2 0.3 7 1e-9\n3 3 3 2 1\n9.7 -8.1 1e3 255 -2\n";
    const Kept kept({folder_.write("in.ply", ply)});
    const fs::path out = folder_.path() / "out.las";
    EXPECT_THAT(kept.write(out), testing::ElementsAre(testing::HasSubstr("steps of 0.0009765625")));
    const std::vector<Vec3> points = test::read_all(out);
    ASSERT_EQ(points.size(), 1U);
    EXPECT_NEAR(points[0].x, static_cast<double>(0.1F), 1.0 / 2048);
    EXPECT_NEAR(points[0].z, static_cast<double>(0.3F), 1.0 / 2048);
    const LasBytes file(out);
    EXPECT_EQ(file.field(0, "classification"), "\7");
    EXPECT_EQ(file.point(0).substr(30), test::raw(1e-9F));
}

}  // namespace
}  // namespace knap
