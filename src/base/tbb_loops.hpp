#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_sort.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <exception>

#include "base/threads.hpp"

// The loops of base/threads.hpp, on TBB.

namespace knap {

template <typename Body>
void parallel_for(std::size_t n, std::size_t grain, const Body& body) {
    tbb::this_task_arena::isolate([&] {
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, n, std::max<std::size_t>(grain, 1)),
            [&](const tbb::blocked_range<std::size_t>& part) { body(part.begin(), part.end()); });
    });
}

template <typename First, typename Second>
void parallel_both(const First& first, const Second& second) {
    tbb::this_task_arena::isolate([&] { tbb::parallel_invoke(first, second); });
}

template <typename Value>
void parallel_sort(std::vector<Value>& values) {
    tbb::this_task_arena::isolate([&] { tbb::parallel_sort(values.begin(), values.end()); });
}

template <typename Task>
void parallel_tasks(std::size_t n, const Task& task) {
    std::atomic<std::size_t> next{0};
    std::atomic<bool> failed{false};
    std::exception_ptr error;
    // No exception reaches TBB: it would cancel the loops inside the other tasks, OpenVDB's among
    // them, which then go on with what is half done.
    const auto attempt = [&] {
        try {
            task(next++);
        } catch (...) {
            if (!failed.exchange(true)) {
                error = std::current_exception();
            }
        }
    };
    tbb::this_task_arena::isolate([&] {
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, n, 1),
            [&](const tbb::blocked_range<std::size_t>& part) {
                for (std::size_t i = part.begin(); i < part.end() && !failed; ++i) {
                    attempt();
                }
            },
            tbb::simple_partitioner{});
    });
    if (error) {
        std::rethrow_exception(error);
    }
}

}  // namespace knap
