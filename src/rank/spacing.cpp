#include "rank/spacing.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <span>

#include "base/checksum.hpp"
#include "base/threads.hpp"
#include "curvature/block_search.hpp"

namespace knap {

namespace {

constexpr std::uint64_t kAllBelow = 1'000'000;
constexpr double kSampled = 1'250'000;

}  // namespace

SpacingSample::SpacingSample(std::uint64_t points)
    : threshold_(points <= kAllBelow
                     ? std::numeric_limits<std::uint64_t>::max()
                     : static_cast<std::uint64_t>(
                           std::min(kSampled / static_cast<double>(points), 1 - 1e-9) * 0x1p64)) {}

bool SpacingSample::contains(PointId id) const {
    // Another hash than the one that breaks ties in the order.
    constexpr std::uint64_t kSalt = 0x5bd1e995'9e3779b9U;
    return splitmix64(id ^ kSalt) <= threshold_;
}

BrickSpacing brick_spacing(const PointBlocks& brick, const SpacingSample& sample, const Box& halo,
                           const Box& archive) {
    std::vector<std::uint8_t> sampled(brick.size());
    for (std::size_t i = 0; i < brick.size(); ++i) {
        sampled[i] = brick.is_core[i] != 0 && sample.contains(brick.ids[i]) ? 1 : 0;
    }
    BrickSpacing result;
    std::mutex mutex;
    constexpr std::size_t kGrainBlocks = 256;
    parallel_for(brick.blocks.size(), kGrainBlocks, [&](std::size_t first, std::size_t last) {
        BlockSearch search(brick, sampled, 1);
        BrickSpacing part;
        for (std::size_t block = first; block < last; ++block) {
            const Neighbourhoods& found = search.around(block);
            for (std::size_t i = 0; i < found.count; ++i) {
                const std::uint32_t place = found.centres[i];
                const Vec3 p = brick.position(place);
                const double squared = found.squared_reaches[i];
                if (squared < certain_squared_distance(p, halo, archive)) {
                    part.sum.add(std::sqrt(squared));
                    ++part.count;
                } else {
                    part.stragglers.push_back({p, brick.ids[place], squared});
                }
            }
        }
        const std::scoped_lock lock(mutex);
        result.sum.add(part.sum);
        result.count += part.count;
        result.stragglers.insert(result.stragglers.end(), part.stragglers.begin(),
                                 part.stragglers.end());
    });
    return result;
}

}  // namespace knap
