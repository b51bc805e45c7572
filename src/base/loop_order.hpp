#pragma once

#if defined(__SANITIZE_THREAD__)
#include <atomic>
#endif

namespace knap {

/// Tells ThreadSanitizer what it cannot see in TBB, whose library is not instrumented: a parallel
/// loop begins after what came before it and ends before what comes after. Parts of a loop stay
/// unordered, so that races between them are found. Nothing at all in other builds.
class LoopOrder {
  public:
#if defined(__SANITIZE_THREAD__)
    LoopOrder() {
        begun_.store(1, std::memory_order_release);
    }
    ~LoopOrder() {
        (void)ended_.load(std::memory_order_acquire);
    }
    LoopOrder(const LoopOrder&) = delete;
    LoopOrder& operator=(const LoopOrder&) = delete;

    /// Lives while a thread works on a part of the loop.
    class Part {
      public:
        explicit Part(LoopOrder& order) : order_(order) {
            (void)order_.begun_.load(std::memory_order_acquire);
        }
        ~Part() { order_.ended_.fetch_add(1, std::memory_order_release); }
        Part(const Part&) = delete;
        Part& operator=(const Part&) = delete;

      private:
        LoopOrder& order_;
    };

  private:
    std::atomic<int> begun_{0};
    std::atomic<unsigned> ended_{0};
#else
    struct Part {
        explicit Part(LoopOrder& /*order*/) {}
    };
#endif
};

}  // namespace knap
