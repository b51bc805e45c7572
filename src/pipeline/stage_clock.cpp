#include "pipeline/stage_clock.hpp"

#include "base/memory_gate.hpp"

namespace knap {

void StageClock::begin(std::string name, std::uint64_t points) {
    current_ = {std::move(name)};
    progress_.begin(current_.name, points);
    started_ = std::chrono::steady_clock::now();
    cpu_started_ = std::clock();
}

void StageClock::read_clocks() {
    current_.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
    current_.cpu_seconds = static_cast<double>(std::clock() - cpu_started_) / CLOCKS_PER_SEC;
}

std::vector<StageReport> StageClock::reports_so_far() {
    const std::scoped_lock lock(mutex_);
    read_clocks();
    std::vector<StageReport> reports = reports_;
    reports.push_back(current_);
    return reports;
}

void StageClock::end() {
    read_clocks();
    progress_.end(current_);
    reports_.push_back(current_);
    // What the stage freed here and there must not count against the next one's budget.
    release_free_memory();
}

}  // namespace knap
