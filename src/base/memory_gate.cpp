#include "base/memory_gate.hpp"

namespace knap {

MemoryGate::Ticket MemoryGate::admit(std::uint64_t bytes) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return used_ == 0 || used_ + bytes <= budget_; });
    used_ += bytes;
    return {*this, bytes};
}

void MemoryGate::release(std::uint64_t bytes) {
    {
        const std::scoped_lock lock(mutex_);
        used_ -= bytes;
    }
    changed_.notify_all();
}

}  // namespace knap
