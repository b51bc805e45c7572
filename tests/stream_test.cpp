#include "input/stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mutex>
#include <random>

#include "support/scan_files.hpp"

namespace knap {
namespace {

using test::LasFile;
using test::ScanFolder;
using testing::HasSubstr;

SourceInfo info_with(std::uint64_t count, std::uint64_t granularity) {
    SourceInfo info;
    info.declared_count = count;
    info.seek_granularity = granularity;
    return info;
}

TEST(CutIntoRanges, CutsOnlyWhereSeekingIsCheap) {
    const std::vector<SourceInfo> sources{info_with(1000, 1), info_with(1000, 0),
                                          info_with(1000, 300), info_with(0, 1), SourceInfo{}};
    EXPECT_EQ(cut_into_ranges(sources, 400),
              (std::vector<SourceRange>{{0, 0, 400},
                                        {0, 400, 400},
                                        {0, 800, 200},
                                        {1, 0, 1000},
                                        {2, 0, 300},
                                        {2, 300, 300},
                                        {2, 600, 300},
                                        {2, 900, 100},
                                        {3, 0, 0},
                                        {4, 0, SourceRange::kToTheEnd}}));
}

/// Two seekable files, one of text and one of ASCII PLY, with known points.
struct Archive {
    Archive() {
        LasFile las{.points = {}};
        for (int i = 0; i < 5000; ++i) {
            las.points.push_back({i, -i, 7});
        }
        add("a.las", las.bytes());
        std::string text;
        std::string ply =
            "ply\nformat ascii 1.0\nelement vertex 900\nproperty float x\nproperty float y\n"
            "property float z\nend_header\n";
        for (int i = 0; i < 900; ++i) {
            const std::string line = std::to_string(i) + " 1 " + std::to_string(2 * i) + "\n";
            text += line;
            ply += line;
        }
        add("b.xyz", text);
        add("c.ply", ply);
        las.points.resize(1234);
        add("d.las", las.bytes());
    }

    void add(const std::string& name, const std::string& bytes) {
        files.push_back(folder.write(name, bytes));
        infos.push_back(open_source(files.back())->info());
        expected.push_back(test::read_all(files.back()));
    }

    ScanFolder folder;
    std::vector<std::filesystem::path> files;
    std::vector<SourceInfo> infos;
    std::vector<std::vector<Vec3>> expected;
};

TEST(StreamRanges, EveryPointComesOnceForAnyThreadsRangesAndChunks) {
    const Archive archive;
    std::mt19937 random(11);
    for (int round = 0; round < 30; ++round) {
        const int workers = 1 + round % 4;
        const std::uint64_t points = 1 + random() % 2000;
        const std::size_t chunk_points = 1 + random() % 700;
        const std::vector<SourceRange> ranges = cut_into_ranges(archive.infos, points);
        std::vector<std::uint64_t> next(ranges.size());
        std::vector<std::vector<Vec3>> seen;
        for (const auto& cloud : archive.expected) {
            seen.emplace_back(cloud.size(), Vec3{-1, -1, -1});
        }
        std::vector<int> busy(static_cast<std::size_t>(workers));
        std::mutex mutex;
        std::uint64_t total = 0;
        stream_ranges(archive.infos, ranges, workers, chunk_points,
                      [&](std::size_t worker, std::size_t range, const Chunk& chunk) {
                          ++busy.at(worker);
                          ASSERT_EQ(busy[worker], 1);
                          ASSERT_LE(chunk.positions.size(), chunk_points);
                          ASSERT_EQ(chunk.first, ranges[range].first + next[range]);
                          next[range] += chunk.positions.size();
                          std::ranges::copy(chunk.positions,
                                            seen[ranges[range].source].begin() +
                                                static_cast<std::ptrdiff_t>(chunk.first));
                          --busy[worker];
                          const std::scoped_lock lock(mutex);
                          total += chunk.positions.size();
                      });
        EXPECT_EQ(seen, archive.expected);
        EXPECT_EQ(total, 5000U + 900 + 900 + 1234);
    }
}

TEST(StreamRanges, ThreadsOnOneLazFileReadWhatOneReads) {
#ifndef KNAP_HAVE_LASZIP
    GTEST_SKIP() << "built without LASzip";
#endif
    for (const std::string name :
         {"lidar/extra_bytes_pf8.laz", "lidar/lone-star.copc.laz", "lidar/multi/split-1.laz"}) {
        if (!std::filesystem::exists(test::shared_data(name))) {
            GTEST_SKIP() << "no shared data";
        }
        const std::vector<Vec3> expected = test::read_all(test::shared_data(name));
        const std::vector<SourceInfo> infos{open_source(test::shared_data(name))->info()};
        const std::vector<SourceRange> ranges = cut_into_ranges(infos, 60000);
        EXPECT_GT(ranges.size(), 2U);
        std::vector<Vec3> seen(expected.size());
        stream_ranges(infos, ranges, 4, 7000, [&](std::size_t, std::size_t, const Chunk& chunk) {
            std::ranges::copy(chunk.positions,
                              seen.begin() + static_cast<std::ptrdiff_t>(chunk.first));
        });
        EXPECT_TRUE(seen == expected) << name;
    }
}

TEST(StreamRanges, AnErrorOfAnyKindReachesTheCaller) {
    Archive archive;
    const std::vector<SourceRange> ranges = cut_into_ranges(archive.infos, 500);
    const auto stream = [&] {
        stream_ranges(archive.infos, ranges, 3, 100, [](std::size_t, std::size_t, const Chunk&) {});
    };
    EXPECT_THROW(stream_ranges(archive.infos, ranges, 3, 100,
                               [](std::size_t, std::size_t range, const Chunk&) {
                                   if (range == 5) {
                                       throw Interrupted("stop");
                                   }
                               }),
                 Interrupted);
    archive.folder.write("b.xyz", "1 2 3\n4 five 6\n");
    EXPECT_THROW(stream(), InputError);
}

TEST(StreamRanges, AFileThatChangedIsAnError) {
    Archive archive;
    const std::vector<SourceRange> ranges = cut_into_ranges(archive.infos, 500);
    archive.folder.write("d.las", LasFile{.points = {{1, 2, 3}}}.bytes());
    try {
        stream_ranges(archive.infos, ranges, 2, 100, [](std::size_t, std::size_t, const Chunk&) {});
        FAIL() << "expected an InputError";
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("d.las"));
    }
}

TEST(StreamRanges, WhatFollowsTheLastPointIsChecked) {
    const ScanFolder folder;
    const auto path =
        folder.write("a.ply",
                     "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
                     "property float z\nend_header\n1 2 3\n4 5 6\n7 8 9\n");
    const std::vector<SourceInfo> infos{open_source(path)->info()};
    EXPECT_THROW(stream_ranges(infos, cut_into_ranges(infos, 100), 1, 2,
                               [](std::size_t, std::size_t, const Chunk&) {}),
                 InputError);
}

TEST(StreamRanges, ARangeLongerThanItsSourceIsAnError) {
    const Archive archive;
    const std::vector<SourceRange> ranges{{0, 4000, 1500}};
    EXPECT_THROW(
        stream_ranges(archive.infos, ranges, 1, 100, [](std::size_t, std::size_t, const Chunk&) {}),
        InputError);
}

}  // namespace
}  // namespace knap
