#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "emit/attribute_plan.hpp"
#include "store/selection.hpp"
#include "store/source_table.hpp"

namespace knap {

/// What the simplification knows of every kept point, to be carried like what sources know of it
/// (output.measures): its curvature, and how far it stands for others.
class Measures {
  public:
    /// Reads the curvatures of all kept points.
    ///
    /// @param selection  finished
    /// @param runs       ranked runs that hold every kept point once, and others or not
    /// @param range_of   the range of a curvature, cloud units; from any thread
    /// @param workers    >= 1 threads that read
    /// @throws StorageError if a run is damaged, or a kept point is in none or in several
    Measures(const SourceTable& sources, const Selection& selection,
             std::span<const std::filesystem::path> runs,
             const std::function<double(double)>& range_of, int workers);

    /// Writes both measures into rows.
    /// @param place  of the first row's point among the kept ones, in the order of ids
    /// @param rows   whole rows of `plan`, which has measures
    void put(std::uint64_t place, const AttributePlan& plan, std::span<std::byte> rows) const;

    /// Memory that the measures of some points take.
    static std::uint64_t memory_bytes(std::uint64_t kept) { return kept * sizeof(Pair); }

  private:
    struct Pair {
        float curvature = 0;  ///< |H|, 1 / cloud unit
        float range = 0;      ///< cloud units, may be infinite
    };

    std::vector<Pair> values_;
};

}  // namespace knap
