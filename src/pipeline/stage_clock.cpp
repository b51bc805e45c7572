#include "pipeline/stage_clock.hpp"

#include "base/memory_gate.hpp"

namespace knap {

void StageClock::begin(std::string name, std::uint64_t points) {
    current_ = {std::move(name), 0, 0};
    progress_.begin(current_.name, points);
    started_ = std::chrono::steady_clock::now();
}

void StageClock::end() {
    current_.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
    progress_.end(current_);
    reports_.push_back(current_);
    // What the stage freed here and there must not count against the next one's budget.
    release_free_memory();
}

}  // namespace knap
