#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

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

/// Calls task(i) for i = 0 .. n-1, each once, on `workers` threads of its own, lowest first: for
/// tasks that block (on files or on a MemoryGate). The first exception stops the rest and is
/// rethrown here.
void run_tasks(std::size_t n, int workers, const std::function<void(std::size_t)>& task);

/// The same for task(i, worker): `worker` in [0, workers) is the slot of the calling thread, so
/// that callers can keep state a slot.
void run_tasks(std::size_t n, int workers,
               const std::function<void(std::size_t, std::size_t)>& task);

/// Calls body(begin, end) for parts of [0, n) of about `grain` items, in parallel. A thread that
/// waits for the loop to end takes only work of this loop, so loops may nest.
template <typename Body>
void parallel_for(std::size_t n, std::size_t grain, const Body& body);

/// Calls both at the same time.
template <typename First, typename Second>
void parallel_both(const First& first, const Second& second);

/// Sorts values without equal ones.
template <typename Value>
void parallel_sort(std::vector<Value>& values);

/// Calls task(i) for i = 0 .. n-1, each once, lowest first, in parallel: for few, large tasks that
/// themselves call parallel_for().
template <typename Task>
void parallel_tasks(std::size_t n, const Task& task);

}  // namespace knap

#if defined(__SANITIZE_THREAD__)
#include "base/plain_loops.hpp"
#else
#include "base/tbb_loops.hpp"
#endif
