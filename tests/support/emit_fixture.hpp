#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "base/file.hpp"
#include "emit/emit.hpp"
#include "knap/archive.hpp"
#include "output/ply_writer.hpp"
#include "support/clouds.hpp"

/// What tests of the output share.
namespace knap::test {

inline constexpr std::uint64_t kMemory = std::uint64_t{1} << 30;

inline bool less(const Vec3& a, const Vec3& b) {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
}

inline std::vector<Vec3> sorted(std::vector<Vec3> points) {
    std::sort(points.begin(), points.end(), less);
    return points;
}

inline std::vector<Vec3> all_points(const std::filesystem::path& file) {
    const auto source = open_source(file);
    std::vector<Vec3> points;
    for (Chunk chunk; source->read(chunk, 1000);) {
        points.insert(points.end(), chunk.positions.begin(), chunk.positions.end());
    }
    return points;
}

inline SourceTable survey_of(const std::vector<std::filesystem::path>& files) {
    std::vector<SourceEntry> entries;
    Box box;
    for (const std::filesystem::path& file : files) {
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
class EmitFixture : public testing::Test {
  protected:
    void SetUp() override {
        std::mt19937_64 random(1);
        std::uniform_real_distribution<float> unit(0, 1);
        std::vector<std::filesystem::path> files;
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

    std::filesystem::path make_archive() {
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

    TemporaryFolder working_;
    TemporaryFolder scratch_;
    std::filesystem::path folder_ = scratch_.path();
    std::vector<Vec3> points_;
    std::vector<Vec3> kept_;
    SourceTable table_;
    Selection selection_;
};

/// What is left of a failed attempt: nothing beside the two inputs.
inline std::size_t entries_in(const std::filesystem::path& folder) {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder),
                                                  std::filesystem::directory_iterator()));
}

inline void expect_same_files(const std::filesystem::path& expected,
                              const std::filesystem::path& found) {
    std::size_t files = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(expected)) {
        if (entry.is_regular_file()) {
            const std::filesystem::path name = entry.path().lexically_relative(expected);
            EXPECT_EQ(read_text_file(found / name), read_text_file(entry.path())) << name;
            ++files;
        }
    }
    for (const auto& entry : std::filesystem::recursive_directory_iterator(found)) {
        files -= entry.is_regular_file() ? 1 : 0;
    }
    EXPECT_EQ(files, 0U) << "as many files";
}

inline std::vector<Vec3> rounded_to(const Lattice& lattice, const std::vector<Vec3>& points) {
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

}  // namespace knap::test
