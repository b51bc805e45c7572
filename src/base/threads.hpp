#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <memory>

#include "base/loop_order.hpp"

namespace knap {

/// Number of threads that `requested` means: itself, or one a core for 0.
int thread_count(int requested);

/// Limits every parallel loop of the process to a number of threads while it lives.
class ThreadLimit {
  public:
    /// @param threads  >= 1
    explicit ThreadLimit(int threads);
    ~ThreadLimit();
    ThreadLimit(const ThreadLimit&) = delete;
    ThreadLimit& operator=(const ThreadLimit&) = delete;

  private:
    struct Control;
    std::unique_ptr<Control> control_;
};

/// Calls body(begin, end) for parts of [0, n) of about `grain` items, in parallel. A thread that
/// waits for the loop to end takes only work of this loop, so loops may nest.
template <typename Body>
void parallel_for(std::size_t n, std::size_t grain, const Body& body) {
    LoopOrder order;
    tbb::this_task_arena::isolate([&] {
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, std::max<std::size_t>(grain, 1)),
                          [&](const tbb::blocked_range<std::size_t>& part) {
                              const LoopOrder::Part ordered(order);
                              body(part.begin(), part.end());
                          });
    });
}

/// Calls task(i) for i = 0 .. n-1, each once, lowest first, in parallel: for few, large tasks that
/// themselves call parallel_for().
template <typename Task>
void parallel_tasks(std::size_t n, const Task& task) {
    std::atomic<std::size_t> next{0};
    LoopOrder order;
    tbb::this_task_arena::isolate([&] {
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, n, 1),
            [&](const tbb::blocked_range<std::size_t>& part) {
                const LoopOrder::Part ordered(order);
                for (std::size_t i = part.begin(); i < part.end(); ++i) {
                    task(next++);
                }
            },
            tbb::simple_partitioner{});
    });
}

/// Calls task(i) for i = 0 .. n-1, each once, on `workers` threads of its own, lowest first: for
/// tasks that block (on files or on a MemoryGate). The first exception stops the rest and is
/// rethrown here.
void run_tasks(std::size_t n, int workers, const std::function<void(std::size_t)>& task);

/// The same for task(i, worker): `worker` in [0, workers) is the slot of the calling thread, so that
/// callers can keep state a slot.
void run_tasks(std::size_t n, int workers,
               const std::function<void(std::size_t, std::size_t)>& task);

}  // namespace knap
