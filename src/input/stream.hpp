#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "knap/source.hpp"

namespace knap {

/// Consecutive points of one source.
struct SourceRange {
    static constexpr std::uint64_t kToTheEnd = std::numeric_limits<std::uint64_t>::max();

    std::size_t source = 0;
    std::uint64_t first = 0;
    std::uint64_t count = kToTheEnd;  ///< kToTheEnd where the source does not know
    friend bool operator==(const SourceRange&, const SourceRange&) = default;
};

/// Cuts sources into ranges of about `points` points at places that are cheap to seek to; a source
/// that cannot seek is one range. The ranges of a source are in order and cover it.
/// @param points  > 0
std::vector<SourceRange> cut_into_ranges(std::span<const SourceInfo> sources, std::uint64_t points);

/// Takes a chunk of range number `range` on the thread of slot `worker` in [0, workers).
using ConsumeChunk = std::function<void(std::size_t worker, std::size_t range, const Chunk& chunk)>;

/// Reads ranges with `workers` threads. The chunks of one range come in order from one thread, at
/// most one chunk at a time for each worker slot; ranges come in any order.
///
/// @param chunk_points  most points in a chunk, > 0
/// @param columns       of each source those that its chunks are to have, as PointSource::select()
///                      takes them; empty: none of any
/// @throws InputError if a source changed since `sources` was taken, or does not hold a range's
///         count; whatever `consume` throws
void stream_ranges(std::span<const SourceInfo> sources, std::span<const SourceRange> ranges,
                   int workers, std::size_t chunk_points, const ConsumeChunk& consume,
                   std::span<const std::vector<std::size_t>> columns = {});

}  // namespace knap
