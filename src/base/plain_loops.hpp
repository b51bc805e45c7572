#pragma once

#include <algorithm>

#include "base/threads.hpp"

// The loops of base/threads.hpp for ThreadSanitizer. It does not see what happens inside libtbb,
// which is not compiled with it, and takes every loop on TBB for a race: in its builds loops run on
// threads of our own, and TBB, which OpenVDB uses by itself, is held to one thread.

namespace knap {

/// What the ThreadLimit in force allows.
int plain_loop_threads();

template <typename Body>
void parallel_for(std::size_t n, std::size_t grain, const Body& body) {
    const std::size_t step = std::max<std::size_t>(grain, 1);
    run_tasks((n + step - 1) / step, plain_loop_threads(),
              [&](std::size_t part) { body(part * step, std::min(n, (part + 1) * step)); });
}

template <typename First, typename Second>
void parallel_both(const First& first, const Second& second) {
    run_tasks(2, plain_loop_threads(), [&](std::size_t task) {
        if (task == 0) {
            first();
        } else {
            second();
        }
    });
}

template <typename Value>
void parallel_sort(std::vector<Value>& values) {
    std::sort(values.begin(), values.end());
}

template <typename Task>
void parallel_tasks(std::size_t n, const Task& task) {
    run_tasks(n, plain_loop_threads(), task);
}

}  // namespace knap
