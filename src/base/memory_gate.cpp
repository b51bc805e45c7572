#include "base/memory_gate.hpp"

#if defined(__GLIBC__)
#include <malloc.h>
#endif

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

void release_free_memory() {
#if defined(__GLIBC__)
    ::malloc_trim(0);
#endif
}

}  // namespace knap
