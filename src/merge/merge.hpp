#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "knap/geometry.hpp"
#include "knap/params.hpp"
#include "store/ranked_run.hpp"
#include "store/selection.hpp"

namespace knap {

/// What a part says of its own points.
struct SettledPart {
    std::vector<RankedPoint> kept;       ///< in the method's order
    std::unique_ptr<RankedStream> open;  ///< in the method's order; null if nothing is open
    std::uint64_t open_points = 0;
};

/// The ranked points of one brick.
struct RankedPart {
    std::vector<std::unique_ptr<RankedStream>> runs;  ///< each in the method's order
    Box box;                                          ///< holds all its points
    std::uint64_t points = 0;                         ///< in the runs, below 2^32
    /// Set if an earlier run has settled the part: gives back what it found. No runs then.
    std::function<SettledPart()> settled = nullptr;
    /// Makes the points, in the method's order, where the runs or what was settled cannot be read;
    /// none: that is an error. From any thread.
    std::function<std::vector<RankedPoint>(const std::string& why)> remake = nullptr;
};

/// Keeps open points as they are: for clouds in memory.
std::unique_ptr<RankedStream> hold_in_memory(std::size_t part, std::span<const RankedPoint> kept,
                                             std::vector<RankedPoint> open);

struct MergeRequest {
    RangeParams range;
    double mean_curvature = 0;       ///< of the archive, 1 / cloud unit
    std::uint64_t points = 0;        ///< ids are below this
    Box box;                         ///< of all points
    std::uint64_t budget_bytes = 0;  ///< for the parts in work; then for the kept among the open
    /// Told what a part keeps and leaves open, each in the method's order. Puts the open points
    /// away until all parts are done; null for none. The runs of the part are not needed after.
    /// Called from any thread.
    std::function<std::unique_ptr<RankedStream>(std::size_t part, std::span<const RankedPoint> kept,
                                                std::vector<RankedPoint> open)>
        on_settled = hold_in_memory;
    /// Told what is kept of the open points, in the method's order, some at a time.
    std::function<void(std::span<const RankedPoint>)> on_walked = [](std::span<const RankedPoint>) {
    };
};

struct MergeResult {
    Selection selection;
    std::uint64_t kept = 0;
    std::uint64_t represented = 0;
};

/// Marks ranges over the whole archive (method section 4): the points that a walk in one global
/// order would keep.
///
/// First each part by itself, several at a time: most points are decided by points near them. Then
/// one walk in the global order over what the parts left open, near their borders. Memory grows
/// with one part and with the kept among the open points, not with the input.
/// @param parts  together every counted point once
/// @throws StorageError if the open points that are kept need more memory than the budget
MergeResult merge(std::vector<RankedPart> parts, const MergeRequest& request,
                  const std::function<void(std::uint64_t)>& advance);

/// Bytes of memory that a point of a part takes while the part is settled.
std::uint64_t merge_bytes_per_point();

}  // namespace knap
