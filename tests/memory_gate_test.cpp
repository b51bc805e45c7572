#include "base/memory_gate.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <random>
#include <thread>

#include "base/threads.hpp"

namespace knap {
namespace {

using namespace std::chrono_literals;

TEST(MemoryGate, NeverAdmitsMoreThanTheBudgetExceptOneAlone) {
    constexpr std::uint64_t kBudget = 100;
    MemoryGate gate(kBudget);
    std::atomic<std::uint64_t> used{0};
    std::atomic<int> inside{0};
    std::atomic<int> broken{0};
    run_tasks(2000, 6, [&](std::size_t i) {
        const std::uint64_t bytes = std::mt19937_64(i)() % 130;
        const auto ticket = gate.admit(bytes);
        // What is counted here is at most what the gate has admitted.
        const std::uint64_t total = used += bytes;
        const int others = inside++;
        if (total > kBudget && others > 0) {
            const bool alone = total == bytes;
            broken += alone ? 0 : 1;
        }
        std::this_thread::yield();
        --inside;
        used -= bytes;
    });
    EXPECT_EQ(broken, 0);
}

TEST(MemoryGate, AdmitsWhatFitsSideBySide) {
    MemoryGate gate(100);
    const auto first = gate.admit(60);
    const auto second = gate.admit(40);
    const auto nothing = gate.admit(0);
}

TEST(MemoryGate, AdmitsARequestAboveTheBudgetWhenNothingElseIsInside) {
    MemoryGate gate(10);
    { const auto alone = gate.admit(1000); }
    const auto after = gate.admit(10);
}

TEST(MemoryGate, MakesWhatDoesNotFitWaitUntilATicketIsGivenBack) {
    MemoryGate gate(100);
    std::atomic<bool> given_back{false};
    std::future<bool> waiter;
    {
        const auto ticket = gate.admit(60);
        waiter = std::async(std::launch::async, [&] {
            const auto late = gate.admit(41);
            return given_back.load();
        });
        EXPECT_EQ(waiter.wait_for(50ms), std::future_status::timeout);
        given_back = true;
    }
    EXPECT_TRUE(waiter.get());
}

}  // namespace
}  // namespace knap
