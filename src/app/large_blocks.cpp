#include <sys/mman.h>

#include <cstdint>
#include <cstdlib>
#include <new>

// What the program allocates in large blocks it asks the system to back with large pages: bricks
// are hundreds of MiB that come and go, and every page of 4 KiB that is touched first is a call of
// the system (docs/performance.md). Only the program does so; who links the library keeps his own
// allocator. Sanitizers bring theirs.

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

// NOLINTBEGIN(cppcoreguidelines-no-malloc): this is what others are to use instead.

namespace {

constexpr std::size_t kLargePage = std::size_t{2} << 20;
constexpr std::size_t kLargeBlock = 2 * kLargePage;

void* allocate(std::size_t size) {
    if (size < kLargeBlock) {
        return std::malloc(size > 0 ? size : 1);
    }
    void* block = nullptr;
    if (::posix_memalign(&block, kLargePage, size) != 0) {
        return nullptr;
    }
    // Advice: where the system has no large pages, nothing changes.
    ::madvise(block, size / kLargePage * kLargePage, MADV_HUGEPAGE);
    return block;
}

}  // namespace

void* operator new(std::size_t size) {
    for (;;) {
        if (void* block = allocate(size)) {
            return block;
        }
        const std::new_handler handler = std::get_new_handler();
        if (handler == nullptr) {
            throw std::bad_alloc();
        }
        handler();
    }
}

void operator delete(void* block) noexcept {
    std::free(block);
}

void operator delete(void* block, std::size_t /*size*/) noexcept {
    std::free(block);
}

// NOLINTEND(cppcoreguidelines-no-malloc)

#endif
