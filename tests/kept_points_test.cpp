#include "emit/kept_points.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "emit/emit.hpp"
#include "support/damage.hpp"
#include "support/emit_fixture.hpp"
#include "support/kept_runs.hpp"

namespace knap {
namespace {

using namespace test;
using testing::HasSubstr;

class KeptPointsTest : public EmitFixture {
  protected:
    void SetUp() override {
        EmitFixture::SetUp();
        runs_ = write_kept_runs(working_.path(), table_, selection_, points_, 7);
    }

    /// All kept points by place, of the last attempt; checks that each place is filled once.
    std::vector<std::pair<PointId, Vec3>> read(int workers) {
        std::vector<std::pair<PointId, Vec3>> found;
        std::vector<int> filled;
        std::mutex mutex;
        attempts_ = 0;
        advanced_ = 0;
        const TakeKept take = [&](const KeptBlock& block) {
            const std::scoped_lock lock(mutex);
            for (std::size_t i = 0; i < block.ids.size(); ++i) {
                found.at(block.place + i) = {block.ids[i], block.positions[i]};
                ++filled.at(block.place + i);
            }
        };
        const AttributePlan none =
            plan_attributes(table_.infos(), std::vector<std::string>{"none"});
        const KeptPoints kept{table_, selection_, runs_, none,
                              [&](const std::string& note) { notes_.push_back(note); }};
        const auto begin = [&] {
            ++attempts_;
            found.assign(kept_.size(), {});
            filled.assign(kept_.size(), 0);
            return take;
        };
        read_kept(kept, workers, begin, [&](std::uint64_t points) { advanced_ += points; });
        EXPECT_EQ(filled, std::vector<int>(kept_.size(), 1));
        return found;
    }

    void expect_all(std::vector<std::pair<PointId, Vec3>> found) {
        std::sort(found.begin(), found.end(),
                  [](const auto& a, const auto& b) { return a.first < b.first; });
        ASSERT_EQ(found.size(), kept_.size());
        for (std::size_t i = 0; i < found.size(); ++i) {
            ASSERT_TRUE(selection_.test(found[i].first));
            ASSERT_EQ(found[i].second, kept_[i]);
        }
        EXPECT_EQ(advanced_, points_.size());
    }

    std::vector<std::filesystem::path> runs_;
    std::vector<std::string> notes_;
    int attempts_ = 0;
    std::uint64_t advanced_ = 0;
};

TEST_F(KeptPointsTest, ComeFromTheRunsWithoutTheSources) {
    for (const SourceEntry& source : table_.sources()) {
        std::filesystem::remove(source.info.path);
    }
    for (const int workers : {1, 4}) {
        expect_all(read(workers));
        EXPECT_EQ(attempts_, 1);
    }
    EXPECT_TRUE(notes_.empty());
}

TEST_F(KeptPointsTest, ComeFromRunsThatHoldOthersToo) {
    Selection all(points_.size());
    for (PointId id = 0; id < points_.size(); ++id) {
        all.set(id);
    }
    all.finish();
    runs_ = write_kept_runs(working_.path(), table_, all, points_, 4);
    expect_all(read(2));
    EXPECT_EQ(attempts_, 1);
    EXPECT_TRUE(notes_.empty());
}

TEST_F(KeptPointsTest, ComeFromTheSourcesWithoutRuns) {
    runs_.clear();
    expect_all(read(2));
    EXPECT_EQ(attempts_, 1);
}

TEST_F(KeptPointsTest, ComeFromTheSourcesWhereARunIsDamaged) {
    const std::string good = read_bytes(runs_[3]);
    std::string flipped = good;
    flipped[flipped.size() / 2] ^= 8;
    std::vector<std::string> damaged{flipped, good.substr(0, good.size() / 2), ""};
    // Whole, but of other points; or of fewer.
    Selection others(points_.size());
    for (PointId id = 0; id < points_.size(); ++id) {
        if (!selection_.test(id)) {
            others.set(id);
        }
    }
    others.finish();
    const TemporaryFolder aside;
    damaged.push_back(read_bytes(write_kept_runs(aside.path(), table_, others, points_, 7)[3]));
    damaged.push_back(read_bytes(write_kept_runs(aside.path(), table_, selection_, points_, 9)[3]));
    for (const std::string& bytes : damaged) {
        write_bytes(runs_[3], bytes);
        notes_.clear();
        expect_all(read(2));
        EXPECT_EQ(attempts_, 2);
        EXPECT_THAT(notes_, testing::ElementsAre(HasSubstr("read from the sources again")));
    }
}

}  // namespace
}  // namespace knap
