#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "knap/geometry.hpp"
#include "knap/params.hpp"
#include "pipeline/repair_store.hpp"

namespace knap {

struct RepairRequest {
    RangeParams range;         ///< with alpha
    std::uint64_t kept = 0;    ///< points that repair begins with
    std::uint64_t wanted = 0;  ///< points to end with; not used with a tolerance
    std::uint64_t points = 0;  ///< counted points of the archive
    std::uint64_t ids = 0;     ///< ids are below this
    Box box;                   ///< of all points
    std::uint64_t budget_bytes = 0;
    std::function<void(const std::string&)> note;
};

/// Whether a job has points added where the surface is far off.
bool repairs(const RangeParams& range);

/// Points that the walk has to keep, so that with those that are added as many are kept as wanted.
/// @param wanted  0 for none
std::uint64_t wanted_before_repair(const RangeParams& range, std::uint64_t wanted);

/// Points to end with, where the walk has kept some.
std::uint64_t wanted_after_repair(const RangeParams& range, std::uint64_t kept);

/// Adds points where the surface through the kept ones is farthest from the others: in rounds, each
/// of which measures the distances, and walks the points that are too far away in the order of
/// their distance (docs/method.md). With a tolerance, until nothing is farther or a round adds
/// nothing; else as many points as are wanted.
/// @param advance  told the points that were measured
RepairState repair(RepairStore& store, const RepairRequest& request,
                   const std::function<void(std::uint64_t)>& advance);

}  // namespace knap
