#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace knap {

/// Admits work while the sum of what it declared stays under a budget.
class MemoryGate {
  public:
    explicit MemoryGate(std::uint64_t budget_bytes) : budget_(budget_bytes) {}

    /// A share of the budget, given back on destruction.
    class Ticket {
      public:
        Ticket(MemoryGate& gate, std::uint64_t bytes) : gate_(gate), bytes_(bytes) {}
        ~Ticket() { gate_.release(bytes_); }
        Ticket(const Ticket&) = delete;
        Ticket& operator=(const Ticket&) = delete;

      private:
        MemoryGate& gate_;
        std::uint64_t bytes_;
    };

    /// Waits until `bytes` fit. A request larger than the whole budget is admitted alone.
    [[nodiscard]] Ticket admit(std::uint64_t bytes);

  private:
    void release(std::uint64_t bytes);

    std::mutex mutex_;
    std::condition_variable changed_;
    std::uint64_t budget_;
    std::uint64_t used_ = 0;
};

/// Gives memory that was freed, but that the allocator still holds, back to the system, where the
/// allocator can.
void release_free_memory();

}  // namespace knap
