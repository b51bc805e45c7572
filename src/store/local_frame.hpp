#pragma once

#include <array>
#include <cstdint>

#include "knap/geometry.hpp"

namespace knap {

/// The surface at a point: its tangent plane, and how much flatter it is one way than the other.
struct LocalFrame {
    Vec3 normal;          ///< of length 1, towards the side that the surface bends to
    Vec3 flattest;        ///< of length 1, in the tangent plane; its sign means nothing
    Vec3 steepest;        ///< normal x flattest
    double flatness = 1;  ///< >= 1: square root of the ratio of the two principal curvatures
};

/// A local frame in three bytes, or none: what ranked runs carry. Whoever uses a frame uses the
/// rounded one, so that it is the same before and after it was on disk.
///
/// The normal is a point of an octahedron unfolded to a square (Meyer et al., On Floating-Point
/// Normal Vectors, 2010), 255 steps a side: off by less than one degree. The direction is one of 16
/// in the half turn, the flatness one of 16 from 1 to 4.
class PackedFrame {
  public:
    static constexpr std::size_t kBytes = 3;
    using Bytes = std::array<std::uint8_t, kBytes>;

    /// None: nothing is known of the surface.
    PackedFrame() : PackedFrame(kNone) {}
    explicit PackedFrame(const Bytes& bytes) : bytes_(bytes) {}
    /// @param frame  normal and flattest finite, of length 1, at right angles but for rounding
    explicit PackedFrame(const LocalFrame& frame);

    bool is_none() const { return bytes_[0] == kNone[0]; }
    /// Not of none.
    LocalFrame frame() const;
    const Bytes& bytes() const { return bytes_; }

    friend bool operator==(const PackedFrame&, const PackedFrame&) = default;

  private:
    static constexpr Bytes kNone{255, 255, 255};

    Bytes bytes_;
};

}  // namespace knap
