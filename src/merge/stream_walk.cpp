#include "merge/stream_walk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/file.hpp"
#include "base/threads.hpp"
#include "knap/error.hpp"
#include "merge/coverage.hpp"
#include "merge/merged_stream.hpp"
#include "merge/range_law.hpp"

namespace knap {

namespace {

constexpr std::size_t kSmallestBatch = std::size_t{1} << 12;
constexpr std::size_t kLargestBatch = std::size_t{1} << 18;
constexpr std::size_t kGrain = 1024;

/// Consecutive points of the global order.
struct Batch {
    std::vector<RankedPoint> points;
    std::vector<std::uint32_t> by_place;  // indices of points, neighbours near each other
    std::vector<std::uint8_t> survives;   // 1: no point kept before the batch marks it
};

// Ten bits an axis, interleaved: near places have near codes.
std::uint32_t place_code(const Vec3& p, const Box& box) {
    constexpr double kCells = 1023;
    std::uint32_t code = 0;
    for (int axis = 0; axis < 3; ++axis) {
        const double extent = box.max[axis] - box.min[axis];
        auto cell = static_cast<std::uint32_t>(
            extent > 0 ? (p[axis] - box.min[axis]) / extent * kCells : 0);
        cell = (cell | cell << 16) & 0x030000ff;
        cell = (cell | cell << 8) & 0x0300f00f;
        cell = (cell | cell << 4) & 0x030c30c3;
        cell = (cell | cell << 2) & 0x09249249;
        code |= cell << axis;
    }
    return code;
}

// Looks points up place by place, so that what one look-up brought into the cache serves the next.
void find_survivors(Batch& batch, const Coverage& coverage, const Box& box) {
    const std::size_t n = batch.points.size();
    std::vector<std::uint64_t> codes(n);
    parallel_for(n, kGrain, [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i) {
            codes[i] = std::uint64_t{place_code(batch.points[i].position, box)} << 32 | i;
        }
    });
    parallel_sort(codes);
    batch.by_place.resize(n);
    batch.survives.assign(n, 0);
    parallel_for(n, kGrain, [&](std::size_t first, std::size_t last) {
        for (std::size_t at = first; at < last; ++at) {
            const auto i = static_cast<std::uint32_t>(codes[at]);
            batch.by_place[at] = i;
            batch.survives[i] = coverage.marks(batch.points[i].position) ? 0 : 1;
        }
    });
}

// Walks the survivors in the method's order. What was kept before does not mark them, so that only
// those of the batch itself have to be asked. Returns the kept ones place by place.
std::vector<RankedPoint> keep_of(const Batch& batch, const Box& box, const RangeLaw& range) {
    Coverage fresh(box, range.shape());
    std::vector<std::uint8_t> keeps(batch.points.size());
    for (std::size_t i = 0; i < batch.points.size(); ++i) {
        const RankedPoint& point = batch.points[i];
        if (batch.survives[i] != 0 && !fresh.marks(point.position)) {
            fresh.add(point.position, range.region(point));
            keeps[i] = 1;
        }
    }
    std::vector<RankedPoint> kept;
    kept.reserve(fresh.size());
    for (const std::uint32_t i : batch.by_place) {
        if (keeps[i] != 0) {
            kept.push_back(batch.points[i]);
        }
    }
    return kept;
}

void check_memory(const Coverage& coverage, std::uint64_t budget_bytes) {
    if (coverage.memory_bytes() > budget_bytes) {
        throw StorageError(fmt::format(
            "the kept points need more memory than there is: {} for {} of them so far, {} given; "
            "raise resources.memory or range.alpha",
            format_bytes(coverage.memory_bytes()), coverage.size(), format_bytes(budget_bytes)));
    }
}

}  // namespace

void walk_streams(std::vector<std::unique_ptr<RankedStream>> streams, const MergeRequest& request,
                  const std::function<void(std::span<const RankedPoint>)>& keep,
                  const std::function<void(std::uint64_t)>& advance) {
    MergedStream merged(std::move(streams));
    const RangeLaw range(request.range, request.mean_curvature);
    Coverage coverage(request.box, range.shape());
    Batch batch;
    Batch next;
    std::uint64_t done = 0;
    merged.next(batch.points, kSmallestBatch);
    while (!batch.points.empty()) {
        // Early batches are small: before anything is kept, everything survives.
        done += batch.points.size();
        const std::size_t size =
            std::clamp(static_cast<std::size_t>(done / 4), kSmallestBatch, kLargestBatch);
        parallel_both([&] { merged.next(next.points, size); },
                      [&] { find_survivors(batch, coverage, request.box); });
        std::vector<RankedPoint> kept = keep_of(batch, request.box, range);
        for (const RankedPoint& point : kept) {
            coverage.add(point.position, range.region(point));
        }
        check_memory(coverage, request.budget_bytes);
        std::sort(kept.begin(), kept.end(),
                  [](const RankedPoint& a, const RankedPoint& b) { return ranks_before(a, b); });
        keep(kept);
        advance(batch.points.size());
        std::swap(batch, next);
    }
}

}  // namespace knap
