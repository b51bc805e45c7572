#include "base/threads.hpp"

#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace knap {

int thread_count(int requested) {
    if (requested > 0) {
        return requested;
    }
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

#if defined(__SANITIZE_THREAD__)

namespace {

std::atomic<int>& plain_limit() {
    static std::atomic<int> limit{thread_count(0)};
    return limit;
}

}  // namespace

struct ThreadLimit::Control {
    explicit Control(int threads)
        : tbb(tbb::global_control::max_allowed_parallelism, 1),
          before(plain_limit().exchange(threads)) {}
    ~Control() { plain_limit() = before; }
    Control(const Control&) = delete;
    Control& operator=(const Control&) = delete;

    tbb::global_control tbb;
    int before;
};

int plain_loop_threads() {
    return plain_limit();
}

#else

struct ThreadLimit::Control {
    explicit Control(int threads)
        : tbb(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)) {}

    tbb::global_control tbb;
};

#endif

ThreadLimit::ThreadLimit(int threads) : control_(std::make_unique<Control>(threads)) {}

ThreadLimit::~ThreadLimit() = default;

void run_tasks(std::size_t n, int workers, const std::function<void(std::size_t)>& task) {
    run_tasks(n, workers, [&](std::size_t i, std::size_t) { task(i); });
}

void run_tasks(std::size_t n, int workers,
               const std::function<void(std::size_t, std::size_t)>& task) {
    std::atomic<std::size_t> next{0};
    std::atomic<bool> failed{false};
    std::exception_ptr error;
    std::mutex mutex;
    const auto work = [&](std::size_t worker) {
        for (std::size_t i = next++; i < n && !failed; i = next++) {
            try {
                task(i, worker);
            } catch (...) {
                const std::scoped_lock lock(mutex);
                if (!failed.exchange(true)) {
                    error = std::current_exception();
                }
            }
        }
    };
    std::vector<std::thread> threads;
    const std::size_t extra = std::min(static_cast<std::size_t>(std::max(workers, 1)), n);
    for (std::size_t i = 1; i < extra; ++i) {
        threads.emplace_back(work, i);
    }
    work(0);
    for (std::thread& thread : threads) {
        thread.join();
    }
    if (error) {
        std::rethrow_exception(error);
    }
}

}  // namespace knap
