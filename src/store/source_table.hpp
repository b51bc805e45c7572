#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "knap/geometry.hpp"
#include "knap/source.hpp"
#include "store/position_codec.hpp"

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
        codecs_[source].pack(position, out);
    }

    /// Reads packed_size() bytes.
    Vec3 unpack(std::size_t source, const std::byte* in) const {
        return codecs_[source].unpack(in);
    }

  private:
    std::vector<SourceEntry> sources_;
    Box box_;
    std::uint64_t points_ = 0;
    std::uint64_t rejected_ = 0;
    bool wide_ = false;
    std::vector<PositionCodec> codecs_;  // of sources_, close together: pack() runs per point
    std::vector<PointId> first_ids_;     // of sources_, for the same reason
};

}  // namespace knap
