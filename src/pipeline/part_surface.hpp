#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "pipeline/repair_store.hpp"
#include "store/ranked_run.hpp"
#include "store/selection.hpp"

namespace knap {

/// A run that was put away and cannot be read back.
struct DamagedRun {
    std::string what;
};

/// @throws DamagedRun
std::vector<RankedPoint> all_of(RepairStore& store, std::size_t part, RepairStore::Kind kind);

/// The surface through the kept points of all parts, some of them at a time. Copies of the kept
/// points are put away part by part, so that those near by are read without all the others.
class PartSurface {
  public:
    /// @param selection  what is kept
    /// @param radius     how far round a part kept points are looked at first, cloud units, > 0
    /// @param farthest   kept points farther apart have no facet in common, cloud units, > 0
    /// All references must outlive the object.
    PartSurface(RepairStore& store, const Selection& selection, double radius, double farthest,
                const std::function<void(const std::string&)>& note);

    /// Puts the copies away.
    void build(const std::function<void(std::uint64_t)>& advance);

    /// Those of some points, not kept, that are farther from the surface than a limit, by their
    /// distance, the farthest first: see find_violators(). Thread-safe.
    std::vector<RankedPoint> violators(std::vector<RankedPoint> points, double limit);

    /// Takes points of a part that are kept from now on, and are in the selection already.
    /// Thread-safe for different parts.
    void add(std::size_t part, std::vector<RankedPoint> added);

    /// Bytes of memory that violators() takes for the points of a part.
    std::uint64_t bytes_for(std::size_t part) const;

  private:
    std::vector<RankedPoint> kept_near(const Box& box, double radius);
    std::vector<RankedPoint> kept_copy(std::size_t part);
    std::vector<RankedPoint> kept_of(std::size_t part);

    RepairStore& store_;
    const Selection& selection_;
    double radius_;
    double farthest_;
    const std::function<void(const std::string&)>& note_;
    std::vector<std::uint64_t> counts_;
};

}  // namespace knap
