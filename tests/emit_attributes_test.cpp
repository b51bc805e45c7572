#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "emit/emit.hpp"
#include "emit/kept_points.hpp"
#include "input/draco_reader.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "store/manifest.hpp"
#include "support/attribute_cloud.hpp"
#include "support/emit_fixture.hpp"

namespace knap {
namespace {

using namespace test;
using testing::HasSubstr;
using testing::ThrowsMessage;

namespace fs = std::filesystem;

/// Files of points with attributes, many of them in one place once they are on the lattice.
class EmitAttributes : public testing::Test {
  protected:
    EmitAttributes() {
        std::mt19937_64 random(5);
        for (int i = 0; i < 6; ++i) {
            AttributeCloud cloud = attribute_cloud(5000, static_cast<std::uint64_t>(i + 1));
            for (Vec3& position : cloud.positions) {
                for (int axis = 0; axis < 3; ++axis) {
                    position[axis] = static_cast<double>(random() % 12) +
                                     1e-6 * static_cast<double>(random() % 100);
                }
            }
            files_.push_back(folder_ / (std::to_string(i) + ".ply"));
            write_ply(files_.back(), cloud, false);
        }
        table_ = survey_of(files_);
        selection_ = Selection(table_.points());
        for (PointId id = 0; id < table_.points(); ++id) {
            if (random() % 3 == 0) {
                selection_.set(id);
                ids_.push_back(id);
            }
        }
        selection_.finish();
    }

    EmitRequest request(const std::string& name) const {
        EmitRequest request;
        request.counts = {.in = table_.points(),
                          .kept = ids_.size(),
                          .represented = table_.points() - ids_.size()};
        request.spacing = 0.5;
        request.output.path = (folder_ / name).string();
        request.output.tile_points = 1000;
        request.memory_bytes = kMemory;
        request.threads = 2;
        request.scratch = working_.path();
        return request;
    }

    AttributePlan plan() const {
        return plan_attributes(table_.infos(), std::vector<std::string>{"all"});
    }

    TemporaryFolder folder_;
    TemporaryFolder working_;
    std::vector<fs::path> files_;
    SourceTable table_;
    Selection selection_;
    std::vector<PointId> ids_;
};

TEST_F(EmitAttributes, AreCarriedByTilesAndBySingleDracoFiles) {
    emit(table_, selection_, request("archive"));
    const Archive archive(folder_ / "archive");
    archive.verify();
    const std::vector<std::string> expected = carried_by_sources(files_, ids_, archive.manifest());
    EXPECT_EQ(carried_by(archive), expected);

    emit(table_, selection_, request("one.drc"));
    const DracoCloud cloud = read_draco(folder_ / "one.drc");
    EXPECT_EQ(cloud.positions.size(), ids_.size());
    ASSERT_EQ(cloud.columns.attributes.size(), archive.manifest().attributes.size());
    for (const Attribute& attribute : archive.manifest().attributes) {
        EXPECT_THAT(cloud.columns.attributes, testing::Contains(attribute));
    }
}

TEST_F(EmitAttributes, TheBytesDoNotDependOnThreadsOrMemory) {
    for (const TileEncoding encoding : {TileEncoding::kAuto, TileEncoding::kKdTree}) {
        EmitRequest one = request("archive");
        one.output.overwrite = true;
        one.output.encoding = encoding;
        emit(table_, selection_, one);
        for (const int threads : {1, 4}) {
            EmitRequest other = one;
            other.output.path = (folder_ / "other").string();
            other.threads = threads;
            other.memory_bytes = emit_memory_bytes(ids_.size(), other.output, plan());
            std::int64_t scratch = 0;
            std::int64_t most = 0;
            other.on_scratch = [&](std::int64_t bytes) {
                scratch += bytes;
                most = std::max(most, scratch);
            };
            emit(table_, selection_, other);
            expect_same_files(folder_ / "archive", folder_ / "other");
            EXPECT_GT(most, static_cast<std::int64_t>(plan().row_size * ids_.size()))
                << "through scratch";
            EXPECT_EQ(scratch, 0);
            EXPECT_TRUE(fs::is_empty(working_.path()));
        }
    }
}

TEST_F(EmitAttributes, GoOnWithTheTilesOfAnEarlierRun) {
    emit(table_, selection_, request("archive"));
    EmitRequest stopped = request("other");
    std::map<std::size_t, ManifestTile> done;
    stopped.tiles.on_tile = [&](std::size_t number, const ManifestTile& tile) {
        done[number] = tile;
        if (done.size() == 5) {
            throw Interrupted("stopped");
        }
    };
    EXPECT_THROW(emit(table_, selection_, stopped), Interrupted);
    EmitRequest again = request("other");
    again.tiles.done = done;
    again.tiles.on_tile = [](std::size_t, const ManifestTile&) {};
    emit(table_, selection_, again);
    expect_same_files(folder_ / "archive", folder_ / "other");
}

TEST_F(EmitAttributes, PointsWhoseAttributesFollowTheSourcesAreStoredInTheirOrder) {
    for (std::size_t i = 0; i < files_.size(); ++i) {
        AttributeCloud cloud;
        cloud.positions = all_points(files_[i]);
        cloud.attributes = {{"time", ScalarType::kFloat64}};
        std::vector<double> times(cloud.positions.size());
        for (std::size_t k = 0; k < times.size(); ++k) {
            times[k] = 3e5 + 1e-5 * static_cast<double>(i * times.size() + k);
        }
        const auto bytes = std::as_bytes(std::span(times));
        cloud.columns = {{bytes.begin(), bytes.end()}};
        write_ply(files_[i], cloud, false);
    }
    table_ = survey_of(files_);
    emit(table_, selection_, request("archive"));
    const Archive archive(folder_ / "archive");
    EXPECT_EQ(carried_by(archive), carried_by_sources(files_, ids_, archive.manifest()));
    for (std::size_t i = 0; i < archive.manifest().tiles.size(); ++i) {
        const std::vector<std::byte> column = archive.read_whole_tile(i).columns[0];
        std::vector<double> times(column.size() / sizeof(double));
        std::memcpy(times.data(), column.data(), column.size());
        EXPECT_TRUE(std::is_sorted(times.begin(), times.end())) << i;
    }
}

TEST_F(EmitAttributes, TooLittleMemoryForThemIsAnError) {
    EmitRequest poor = request("archive");
    poor.memory_bytes = emit_memory_bytes(ids_.size(), poor.output, plan()) - 1;
    EXPECT_GT(poor.memory_bytes, emit_memory_bytes(ids_.size(), poor.output) + 1000 * 100);
    EXPECT_THAT([&] { emit(table_, selection_, poor); },
                ThrowsMessage<StorageError>(HasSubstr("resources.memory")));
}

TEST_F(EmitAttributes, AManifestThatDoesNotFitThemIsAnError) {
    emit(table_, selection_, request("archive"));
    const Manifest good = Archive(folder_ / "archive").manifest();
    const std::vector<std::pair<std::string, void (*)(Manifest&)>> changes{
        {"attributes: expected 21, found 22", [](Manifest& m) { m.attributes.pop_back(); }},
        {"\"rde\"", [](Manifest& m) { m.attributes[0].name = "rde"; }},
        {"\"any_double\"", [](Manifest& m) { m.attributes[20].type = ScalarType::kInt64; }},
        {"\"nx\"", [](Manifest& m) { m.attributes[3].scale = 2; }}};
    for (const auto& [named, change] : changes) {
        Manifest manifest = good;
        change(manifest);
        write_manifest(folder_ / "archive", manifest);
        EXPECT_THAT([&] { Archive(folder_ / "archive").verify(); },
                    ThrowsMessage<InputError>(HasSubstr(named)));
    }
}

TEST_F(EmitAttributes, AreReadInOrderByAnyNumberOfThreads) {
    const AttributePlan carried = plan();
    const KeptPoints kept{table_, selection_, {}, carried};
    std::vector<std::byte> expected;
    for (const int workers : {1, 2, 5}) {
        std::vector<PointId> ids;
        std::vector<std::byte> rows;
        std::uint64_t done = 0;
        std::atomic<int> inside = 0;
        read_kept_in_order(
            kept, workers,
            [&](const KeptBlock& block) {
                EXPECT_EQ(++inside, 1) << "one thread at a time";
                if (block.place == 0) {  // the others come to wait
                    std::this_thread::sleep_for(std::chrono::milliseconds(50));
                }
                EXPECT_EQ(block.place, ids.size());
                EXPECT_EQ(block.rows.size(), block.ids.size() * carried.row_size);
                ids.insert(ids.end(), block.ids.begin(), block.ids.end());
                rows.insert(rows.end(), block.rows.begin(), block.rows.end());
                --inside;
            },
            [&](std::uint64_t points) { done += points; });
        EXPECT_EQ(ids, ids_);
        EXPECT_EQ(done, table_.points());
        expected = expected.empty() ? rows : expected;
        EXPECT_EQ(rows, expected);
    }
}

TEST_F(EmitAttributes, WhatAReaderThrowsEndsAllThreads) {
    const AttributePlan carried = plan();
    const KeptPoints kept{table_, selection_, {}, carried};
    for (const std::size_t calls : {0U, 2U, 5U}) {
        std::size_t left = calls;
        const TakeKept take = [&](const KeptBlock&) {
            if (left-- == 0) {
                throw StorageError("full");
            }
        };
        EXPECT_THAT([&] { read_kept_in_order(kept, 4, take, [](std::uint64_t) {}); },
                    ThrowsMessage<StorageError>("full"));
    }
}

TEST_F(EmitAttributes, ASourceOfAnotherSchemaThanInTheSurveyIsAnErrorNamingIt) {
    AttributeCloud other = attribute_cloud(5000, 1);
    std::swap(other.attributes[0].name, other.attributes[1].name);
    write_ply(files_[3], other, false);
    EXPECT_THAT([&] { emit(table_, selection_, request("archive")); },
                ThrowsMessage<InputError>(HasSubstr("3.ply")));
}

}  // namespace
}  // namespace knap
