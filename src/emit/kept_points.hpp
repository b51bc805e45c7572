#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "knap/geometry.hpp"
#include "store/selection.hpp"
#include "store/source_table.hpp"

namespace knap {

/// The kept points, and where they can be read.
struct KeptPoints {
    const SourceTable& sources;
    const Selection& selection;  ///< finished, of sources.points() ids
    /// Ranked runs that together hold every kept point once, and others or not; none: only the
    /// sources.
    std::span<const std::filesystem::path> runs;
    /// Told that a run cannot be read, and why.
    std::function<void(const std::string&)> note = [](const std::string&) {};
};

/// Some kept points.
/// @param place      of the first; the points of all calls fill the places from 0 once each
/// @param ids        at least one
/// @param positions  of each, as its source gives it
using TakeKept = std::function<void(std::uint64_t place, std::span<const PointId> ids,
                                    std::span<const Vec3> positions)>;

/// Hands over the kept points in any order: from the runs, or, where there are none or one is
/// damaged, from the sources.
///
/// @param workers  >= 1 threads that take() may be called from at once
/// @param begin    gives the take() of an attempt; called again if the points of the attempt before
///                 do not count, as one of its runs is damaged
/// @param advance  told the number of input points done with; called by one thread at a time
/// @throws InputError if a source has to be read that no longer holds the points of the survey
void read_kept(const KeptPoints& kept, int workers, const std::function<TakeKept()>& begin,
               const std::function<void(std::uint64_t)>& advance);

/// Streams the sources once more and hands over the kept points by ascending id. What holds none of
/// them is not read.
/// @throws InputError as read_kept()
void read_kept_in_order(const KeptPoints& kept, const TakeKept& take,
                        const std::function<void(std::uint64_t)>& advance);

}  // namespace knap
