#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "knap/geometry.hpp"
#include "knap/source.hpp"

namespace knap {

/// What the survey found in one source.
struct SourceEntry {
    SourceInfo info;
    std::string given_path;      ///< as the job gave it
    std::uint64_t points = 0;    ///< in the source, rejected ones included
    std::uint64_t rejected = 0;  ///< of them not finite
    PointId first_id = 0;        ///< id of its first point; set by SourceTable
    std::string xxh3;            ///< XXH3-128 of the file, 32 hex digits
};

/// All sources of a job in stream order, with the packed form of their positions.
///
/// A packed position takes 3 x 4 bytes in the form its source uses (float bits, or the native
/// integers of a LAS file) and gives back the reader's doubles bit for bit. If any source needs
/// doubles, all positions are packed as 3 x 8 bytes, so that records have one size.
class SourceTable {
  public:
    SourceTable() = default;

    /// Numbers the points of the entries in the order given.
    /// @param box  of all finite points
    SourceTable(std::vector<SourceEntry> entries, const Box& box);

    const std::vector<SourceEntry>& sources() const { return sources_; }
    const Box& box() const { return box_; }

    /// Points in all sources, rejected ones included: ids are below this.
    std::uint64_t points() const { return points_; }
    std::uint64_t rejected() const { return rejected_; }

    /// True if positions are packed as doubles.
    bool wide() const { return wide_; }

    /// The infos in order, as stream_ranges() wants them.
    std::vector<SourceInfo> infos() const;

    /// Bytes of a packed position: 12 or 24.
    std::size_t packed_size() const { return wide_ ? 3 * sizeof(double) : 3 * sizeof(float); }

    /// Source that owns a point.
    /// @param id  < points()
    std::size_t source_of(PointId id) const {
        const auto after = std::upper_bound(first_ids_.begin(), first_ids_.end(), id);
        return static_cast<std::size_t>(after - first_ids_.begin()) - 1;
    }

    /// Writes packed_size() bytes.
    /// @param position  finite, as the reader of `source` gave it
    void pack(std::size_t source, const Vec3& position, std::byte* out) const {
        if (wide_) {
            std::memcpy(out, &position, 3 * sizeof(double));
            return;
        }
        const CoordinateFormat& format = formats_[source];
        for (int axis = 0; axis < 3; ++axis) {
            std::byte* at = out + static_cast<std::size_t>(axis) * 4;
            if (format.kind == CoordinateKind::kFloat32) {
                const auto value = static_cast<float>(position[axis]);
                std::memcpy(at, &value, sizeof value);
            } else {
                const std::int32_t value =
                    nearest_int32((position[axis] - format.offset[axis]) / format.scale[axis]);
                std::memcpy(at, &value, sizeof value);
            }
        }
    }

    /// Reads packed_size() bytes.
    Vec3 unpack(std::size_t source, const std::byte* in) const {
        Vec3 position;
        if (wide_) {
            std::memcpy(&position, in, 3 * sizeof(double));
            return position;
        }
        const CoordinateFormat& format = formats_[source];
        for (int axis = 0; axis < 3; ++axis) {
            const std::byte* at = in + static_cast<std::size_t>(axis) * 4;
            if (format.kind == CoordinateKind::kFloat32) {
                float value = 0;
                std::memcpy(&value, at, sizeof value);
                position[axis] = static_cast<double>(value);
            } else {
                std::int32_t value = 0;
                std::memcpy(&value, at, sizeof value);
                position[axis] = axes_[source][static_cast<std::size_t>(axis)].at(value);
            }
        }
        return position;
    }

  private:
    static_assert(sizeof(Vec3) == 3 * sizeof(double));

    // The value is an integer but for the rounding of the reader's multiplication and addition, so
    // adding a half and truncating is rounding, without a call to the mathematics library.
    static std::int32_t nearest_int32(double value) {
        const double shifted = value + std::copysign(0.5, value);
        return static_cast<std::int32_t>(std::clamp(shifted, -2147483648.0, 2147483647.0));
    }

    std::vector<SourceEntry> sources_;
    Box box_;
    std::uint64_t points_ = 0;
    std::uint64_t rejected_ = 0;
    bool wide_ = false;
    std::vector<CoordinateFormat> formats_;  // of sources_, close together: pack() runs per point
    std::vector<std::array<GridAxis, 3>> axes_;
    std::vector<PointId> first_ids_;  // of sources_, for the same reason
};

}  // namespace knap
