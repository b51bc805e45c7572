#include "input/staged_reader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <mutex>
#include <random>
#include <string>
#include <vector>

#include "emit/emit.hpp"
#include "store/manifest.hpp"
#include "support/attribute_cloud.hpp"
#include "support/clouds.hpp"
#include "support/damage.hpp"
#include "support/emit_fixture.hpp"
#include "survey/survey.hpp"

namespace knap {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::SizeIs;

using Columns = std::vector<std::vector<std::size_t>>;

/// Text between two files of records, surveyed with all columns.
class Staged : public testing::Test {
  protected:
    Staged() {
        files_ = {folder_ / "a.ply", folder_ / "b.xyz", folder_ / "c.ply"};
        test::write_ply(files_[0], test::attribute_cloud(500, 1), true);
        std::ofstream text(files_[1]);
        text << "x y z shade depth\n";
        for (int i = 0; i < kTextPoints; ++i) {
            text << (i == 300 ? "nan" : std::to_string(random_() % 1000)) << " " << random_() % 1000
                 << " " << random_() % 1000 << " " << random_() % 256 << " "
                 << 1e-3 * static_cast<double>(random_() % 100000) << "\n";
        }
        text.close();
        test::write_ply(files_[2], test::attribute_cloud(700, 2), true);
        fs::create_directory(scratch_);
        for (const fs::path& file : files_) {
            columns_.push_back(attributes_of(open_source(file)->info()));
        }
        survey_.emplace(survey({.files = files_,
                                .threads = 2,
                                .budget_bytes = std::uint64_t{64} << 20,
                                .positions = scratch_,
                                .columns = columns_,
                                .stays = true},
                               [](std::uint64_t) {}));
    }

    /// All points in stream order, coordinates as text: what is no number equals itself.
    std::map<PointId, std::string> read(const Columns& columns, bool staged, int workers) {
        const SourceTable& table = survey_->table;
        const StagedReader reader(table, staged ? &survey_->staged : nullptr, columns,
                                  [&](const std::string& note) {
                                      const std::scoped_lock lock(mutex_);
                                      notes_.push_back(note);
                                  });
        const std::vector<ArchivePart> parts = reader.parts(1 << 20);
        EXPECT_EQ(points_of(table, parts), table.points());
        std::map<PointId, std::string> points;
        const auto consume = [&](std::size_t, std::size_t part, const Chunk& chunk) {
            const std::scoped_lock lock(mutex_);
            const std::size_t source = parts[part].range.source;
            const SourceEntry& entry = table.sources()[source];
            for (std::size_t i = 0; i < chunk.positions.size(); ++i) {
                const Vec3& p = chunk.positions[i];
                std::string text = std::to_string(p.x) + " " + std::to_string(p.y) + " " +
                                   std::to_string(p.z) + " ";
                for (std::size_t c = 0; !columns.empty() && c < columns[source].size(); ++c) {
                    const std::size_t size = entry.info.schema[columns[source][c]].value_size();
                    text.append(
                        reinterpret_cast<const char*>(chunk.columns.at(c).data()) + i * size, size);
                }
                EXPECT_TRUE(points.emplace(entry.first_id + chunk.first + i, text).second);
            }
        };
        reader.stream(parts, workers, 100, consume);
        return points;
    }

    Columns some(std::size_t of_text) const { return {{}, {columns_[1][of_text]}, columns_[2]}; }

    static constexpr int kTextPoints = 70000;  // more than a file in scratch holds
    test::TemporaryFolder folder_;
    fs::path scratch_ = folder_ / "scratch";
    std::mt19937_64 random_{9};
    std::vector<fs::path> files_;
    Columns columns_;
    std::optional<Survey> survey_;
    std::mutex mutex_;
    std::vector<std::string> notes_;
};

TEST_F(Staged, IsWhatTheSourcesHold) {
    ASSERT_GE(survey_->staged.files.size(), 2U);
    for (const PositionFile& file : survey_->staged.files) {
        EXPECT_EQ(file.source, 1U) << "records lie ready";
        EXPECT_EQ(file.bytes, fs::file_size(file.path));
        EXPECT_EQ(file.column_bytes, fs::file_size(file.columns_path()));
    }
    std::vector<std::map<PointId, std::string>> expected;
    const std::vector<Columns> choices{{}, columns_, some(0), some(1)};
    expected.reserve(choices.size());
    for (const Columns& columns : choices) {
        expected.push_back(read(columns, false, 2));
        ASSERT_THAT(expected.back(), SizeIs(kTextPoints + 1200));
    }
    fs::remove(files_[1]);  // not read again
    for (std::size_t i = 0; i < choices.size(); ++i) {
        for (const int workers : {1, 3}) {
            EXPECT_EQ(read(choices[i], true, workers) == expected[i], true) << i;
        }
    }
    EXPECT_THAT(notes_, SizeIs(0));
}

TEST_F(Staged, ColumnsThatAreNotThereAreReadFromTheSource) {
    const auto expected = read(columns_, false, 1);
    survey_->staged.columns[1].pop_back();
    EXPECT_EQ(read(columns_, true, 1) == expected, true);
}

TEST_F(Staged, WhereItIsDamagedTheSourceStandsIn) {
    const auto expected = read(columns_, false, 1);
    const PositionFile& file = survey_->staged.files[1];
    for (const fs::path& path : {file.path, file.columns_path()}) {
        const std::string good = test::read_bytes(path);
        for (int round = 0; round < 10; ++round) {
            std::string bytes = good;
            bytes[random_() % bytes.size()] ^= 16;
            round == 0 ? static_cast<void>(fs::remove(path)) : test::write_bytes(path, bytes);
            notes_.clear();
            EXPECT_EQ(read(columns_, true, 2) == expected, true);
            EXPECT_THAT(notes_, Contains(AllOf(HasSubstr(path.string()),
                                               HasSubstr("from the source again"))));
        }
        test::write_bytes(path, good);
    }
}

TEST_F(Staged, GivesTheSameBytesInEveryOutput) {
    const SourceTable& table = survey_->table;
    Selection selection(table.points());
    for (PointId id = 0; id < table.points(); ++id) {
        if (random_() % 3 == 0 && id != 800) {  // of the text, and no number
            selection.set(id);
        }
    }
    selection.finish();
    for (const char* name : {"archive", "one.drc", "one.las", "one.ply", "flagged.las"}) {
        EmitRequest request;
        request.counts = {.in = table.points(),
                          .kept = selection.count(),
                          .represented = table.points() - selection.count()};
        request.spacing = 0.5;
        request.output.path = (folder_ / name).string();
        request.output.tile_points = 3000;
        request.output.overwrite = true;
        request.output.flag = name == std::string("flagged.las");
        request.memory_bytes = std::uint64_t{256} << 20;
        request.threads = 2;
        request.scratch = folder_.path();
        emit(table, selection, request);
        fs::rename(folder_ / name, folder_ / "from_sources");
        request.staged = survey_->staged;
        const fs::path aside = folder_ / "aside";
        fs::rename(files_[1], aside);  // not read again
        emit(table, selection, request);
        fs::rename(aside, files_[1]);
        if (fs::is_directory(folder_ / name)) {
            test::expect_same_files(folder_ / name, folder_ / "from_sources");
        } else {
            EXPECT_EQ(
                test::read_bytes(folder_ / name) == test::read_bytes(folder_ / "from_sources"),
                true)
                << name;
        }
        fs::remove_all(folder_ / "from_sources");
    }
}

}  // namespace
}  // namespace knap
