#pragma once

#include <chrono>
#include <cstdint>
#include <ctime>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "knap/job.hpp"

namespace knap {

/// Times the stages of a job and tells its observer, one call at a time.
class StageClock {
  public:
    explicit StageClock(Progress& progress) : progress_(progress) {}

    /// Runs one stage.
    /// @param points  that the stage will handle; 0 if not known beforehand
    /// @param stage   gets a function to be told how many points were handled; from any thread
    template <typename Stage>
    auto time(std::string name, std::uint64_t points, const Stage& stage) {
        begin(std::move(name), points);
        auto result = stage(advance_);
        end();
        return result;
    }

    /// Tells the observer something, from any thread.
    void note(std::string_view message) {
        const std::scoped_lock lock(mutex_);
        progress_.note(message);
    }

    /// The stages so far, the one that runs included.
    std::vector<StageReport> reports_so_far();

    std::vector<StageReport> take_reports() { return std::move(reports_); }

  private:
    void begin(std::string name, std::uint64_t points);
    void end();
    void read_clocks();

    Progress& progress_;
    std::mutex mutex_;
    std::chrono::steady_clock::time_point started_;
    std::clock_t cpu_started_ = 0;
    StageReport current_;
    std::vector<StageReport> reports_;
    std::function<void(std::uint64_t)> advance_ = [this](std::uint64_t points) {
        const std::scoped_lock lock(mutex_);
        current_.points += points;
        progress_.advance(points);
    };
};

}  // namespace knap
