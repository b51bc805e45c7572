#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "knap/geometry.hpp"
#include "store/selection.hpp"
#include "store/source_table.hpp"

namespace knap {

/// Some kept points, consecutive in id among the kept ones.
/// @param rank       of the first among all kept points
/// @param ids        ascending, at least one
/// @param positions  of each, as its source gives it
using TakeKept = std::function<void(std::uint64_t rank, std::span<const PointId> ids,
                                    std::span<const Vec3> positions)>;

/// Streams the sources once more and hands over the kept points. What holds none of them is not
/// read.
///
/// @param selection  finished, of sources.points() ids
/// @param workers    >= 1. With more than one, take() is called from several threads at once and
///                   in any order; with one, by ascending rank
/// @param advance    told the number of input points done with; called by one thread at a time
/// @throws InputError if a source no longer holds the points that the survey counted
void read_kept(const SourceTable& sources, const Selection& selection, int workers,
               const TakeKept& take, const std::function<void(std::uint64_t)>& advance);

}  // namespace knap
