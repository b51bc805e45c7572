#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "output/cloud_writer.hpp"
#include "output/las_fields.hpp"

namespace knap {

/// What the header of a LAS file says of its points, counted as they are written.
struct LasTally {
    std::uint64_t points = 0;
    std::array<std::uint64_t, 15> by_return{};  ///< points whose return number is 1, 2, ..
    std::array<std::int32_t, 3> low{};          ///< smallest steps; of no use without points
    std::array<std::int32_t, 3> high{};         ///< largest steps

    /// @param return_number  0 is not counted
    void add(const std::array<std::int32_t, 3>& steps, unsigned return_number);
};

/// The public header block and the variable-length records of a LAS file, and the extended ones.
class LasHead {
  public:
    /// @param laszip  content of the LASzip record of a LAZ file; empty: LAS
    LasHead(const CloudHeader& header, const LasFields& fields, std::span<const std::byte> laszip);

    /// All that stands before the points; as long for any tally and place.
    /// @param extended_at  where extended_records() stands; of no use without any
    std::vector<std::byte> before_points(const LasTally& tally, std::uint64_t extended_at) const;

    /// All that stands behind the points; may be empty.
    std::vector<std::byte> extended_records() const;

  private:
    void add_crs(const CloudHeader& header);

    LasHeaderInfo info_;
    CoordinateFormat grid_;
    int version_minor_;
    int point_format_;
    std::uint16_t record_length_;
    bool compressed_;
    std::vector<LasVlr> records_;   // those that stand before the points
    std::vector<LasVlr> extended_;  // and those behind
};

}  // namespace knap
