#include "app/progress.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "knap/error.hpp"

namespace knap::app {
namespace {

using Json = nlohmann::json;

std::vector<Json> lines_of(const std::string& text) {
    std::vector<Json> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) {
        lines.push_back(Json::parse(line));
    }
    return lines;
}

// Long enough that a line is due.
void wait_for_a_line() {
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
}

class JsonProgress : public testing::Test {
  protected:
    JsonProgress() { testing::internal::CaptureStderr(); }
    static std::vector<Json> lines() { return lines_of(testing::internal::GetCapturedStderr()); }

    std::unique_ptr<Progress> progress_ = make_progress({.mode = "json"});
};

TEST_F(JsonProgress, TimeLeftIsWhatTheRateSays) {
    progress_->begin("rank", 1000);
    wait_for_a_line();
    progress_->advance(400);
    wait_for_a_line();
    progress_->advance(100);
    progress_->end({.name = "rank", .seconds = 2, .points = 1000});
    const std::vector<Json> found = lines();
    ASSERT_EQ(found.size(), 4U);
    EXPECT_EQ(found[0].at("seconds_left"), nullptr) << "nothing is known yet";
    for (const Json& line : {found[1], found[2]}) {
        const double points = line.at("points");
        const double rate = line.at("points_per_second");
        EXPECT_GT(rate, 0);
        EXPECT_LT(rate, points / 0.2) << "no faster than it was";
        EXPECT_NEAR(line.at("seconds_left"), (1000 - points) / rate, 1e-9);
    }
    EXPECT_EQ(found[3].at("points_per_second"), 500);
    EXPECT_EQ(found[3].at("seconds_left"), 0);
    EXPECT_EQ(found[3].at("seconds"), 2);
}

TEST_F(JsonProgress, WhatAnEarlierRunDidSaysNothingOfTheRate) {
    progress_->begin("rank", 1'000'000);
    progress_->advance(900'000);
    wait_for_a_line();
    progress_->advance(10);
    const std::vector<Json> found = lines();
    ASSERT_EQ(found.size(), 2U);
    EXPECT_EQ(found[1].at("points"), 900'010);
    EXPECT_LT(found[1].at("points_per_second"), 10 / 0.1);
    EXPECT_GT(found[1].at("seconds_left"), 99'990 / (10 / 0.1));
}

TEST_F(JsonProgress, AStageOfUnknownLengthHasNoTimeLeft) {
    progress_->begin("survey", 0);
    wait_for_a_line();
    progress_->advance(1000);
    const std::vector<Json> found = lines();
    ASSERT_EQ(found.size(), 2U);
    EXPECT_GT(found[1].at("points_per_second"), 0);
    EXPECT_EQ(found[1].at("seconds_left"), nullptr);
}

TEST(Progress, OfAnUnknownKindIsRefused) {
    EXPECT_THROW(make_progress({.mode = "xml"}), ConfigError);
}

}  // namespace
}  // namespace knap::app
