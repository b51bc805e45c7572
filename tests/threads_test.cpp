#include "base/threads.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace knap {
namespace {

TEST(Threads, ZeroMeansOneACore) {
    EXPECT_EQ(thread_count(3), 3);
    EXPECT_GE(thread_count(0), 1);
}

TEST(ParallelFor, CoversEveryItemOnceForAnyGrain) {
    for (const std::size_t n : {0U, 1U, 2U, 999U, 4096U}) {
        for (const std::size_t grain : {0U, 1U, 7U, 1000U, 100000U}) {
            std::vector<std::atomic<int>> seen(n);
            parallel_for(n, grain, [&](std::size_t begin, std::size_t end) {
                ASSERT_LE(begin, end);
                for (std::size_t i = begin; i < end; ++i) {
                    ++seen[i];
                }
            });
            for (const auto& count : seen) {
                ASSERT_EQ(count, 1);
            }
        }
    }
}

TEST(ParallelTasks, RunsEachTaskOnceLowestFirst) {
    std::vector<std::size_t> started;
    const ThreadLimit one(1);
    parallel_tasks(100, [&](std::size_t i) { started.push_back(i); });
    ASSERT_EQ(started.size(), 100U);
    for (std::size_t i = 0; i < started.size(); ++i) {
        EXPECT_EQ(started[i], i);
    }
}

TEST(ParallelTasks, NeverStartsATaskOnAThreadThatIsInOne) {
    const ThreadLimit four(4);
    static thread_local int depth = 0;
    std::atomic<int> deepest{0};
    std::atomic<int> done{0};
    parallel_tasks(64, [&](std::size_t) {
        ++depth;
        int seen = deepest;
        while (seen < depth && !deepest.compare_exchange_weak(seen, depth)) {
        }
        parallel_for(64, 1, [&](std::size_t begin, std::size_t end) {
            std::this_thread::yield();
            done += static_cast<int>(end - begin);
        });
        --depth;
    });
    EXPECT_EQ(deepest, 1);
    EXPECT_EQ(done, 64 * 64);
}

TEST(ParallelTasks, HandsAnExceptionOn) {
    const auto fail = [](std::size_t i) {
        if (i == 5) {
            throw std::runtime_error("five");
        }
    };
    EXPECT_THROW(parallel_tasks(10, fail), std::runtime_error);
}

TEST(ParallelTasks, ThatFailsDoesNotCutShortTheLoopsOfOthers) {
    using namespace std::chrono_literals;
    const ThreadLimit two(2);
    constexpr std::size_t kItems = 2000;
    const auto wait_for = [](const std::atomic<bool>& flag) {
        // On a single core the other task never begins: then there is nothing to see.
        for (int i = 0; i < 2000 && !flag; ++i) {
            std::this_thread::sleep_for(1ms);
        }
    };
    std::atomic<bool> looping{false};
    std::atomic<bool> failing{false};
    std::atomic<std::size_t> handled{0};
    std::atomic<int> cut_short{0};
    const auto task = [&](std::size_t i) {
        if (i == 0) {
            wait_for(looping);
            failing = true;
            throw std::runtime_error("zero");
        }
        parallel_for(kItems, 1, [&](std::size_t begin, std::size_t end) {
            looping = true;
            wait_for(failing);
            std::this_thread::sleep_for(10us);
            handled += end - begin;
        });
        cut_short += handled == kItems ? 0 : 1;
    };
    EXPECT_THROW(parallel_tasks(2, task), std::runtime_error);
    EXPECT_EQ(cut_short, 0);
}

TEST(ParallelTasks, BeginsNoTaskAfterOneHasFailed) {
    std::atomic<int> begun{0};
    const ThreadLimit two(2);
    const auto task = [&](std::size_t i) {
        ++begun;
        if (i >= 10) {
            throw std::runtime_error("ten");
        }
    };
    EXPECT_THROW(parallel_tasks(100000, task), std::runtime_error);
    EXPECT_LE(begun, 12);
}

TEST(ThreadLimit, OfOneKeepsLoopsOnTheCallingThread) {
    const ThreadLimit one(1);
    std::mutex mutex;
    std::set<std::thread::id> threads;
    parallel_for(10000, 1, [&](std::size_t, std::size_t) {
        const std::scoped_lock lock(mutex);
        threads.insert(std::this_thread::get_id());
    });
    EXPECT_EQ(threads, std::set{std::this_thread::get_id()});
}

TEST(RunTasks, RunsEachTaskOnceForAnyNumberOfWorkers) {
    for (const int workers : {0, 1, 2, 5, 50}) {
        for (const std::size_t n : {0U, 1U, 4U, 300U}) {
            std::vector<std::atomic<int>> seen(n);
            run_tasks(n, workers, [&](std::size_t i) { ++seen[i]; });
            for (const auto& count : seen) {
                ASSERT_EQ(count, 1);
            }
        }
    }
}

TEST(RunTasks, GivesEachSlotToOneThreadAtATime) {
    constexpr int kWorkers = 4;
    std::vector<std::atomic<int>> inside(kWorkers);
    std::atomic<int> wrong{0};
    run_tasks(500, kWorkers, [&](std::size_t, std::size_t worker) {
        if (worker >= kWorkers || inside[worker]++ != 0) {
            ++wrong;
            return;
        }
        std::this_thread::yield();
        --inside[worker];
    });
    EXPECT_EQ(wrong, 0);
}

TEST(RunTasks, TheFirstExceptionStopsTheRestAndIsRethrown) {
    for (const int workers : {1, 3}) {
        std::atomic<int> begun{0};
        try {
            run_tasks(1'000'000, workers, [&](std::size_t i) {
                ++begun;
                if (i >= 10) {
                    throw std::runtime_error("task " + std::to_string(i));
                }
            });
            FAIL() << "expected an exception";
        } catch (const std::runtime_error& error) {
            EXPECT_EQ(std::string(error.what()).substr(0, 6), "task 1");
        }
        EXPECT_LE(begun, 11 + workers) << "no task begins after one has failed";
    }
}

}  // namespace
}  // namespace knap
