#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "knap/geometry.hpp"

namespace knap {

/// Where a cloud is looked at from: a parallel projection.
struct View {
    std::string name;  ///< as people read it
    Vec3 right;        ///< unit vectors, orthogonal, right-handed
    Vec3 up;
    Vec3 toward;  ///< from the cloud to the eye
};

/// An oblique view of the broad side of a cloud, and one from the opposite side.
///
/// They follow from the extents of the box alone. A cloud whose shortest side is y or z and far
/// below the others is flat and is seen obliquely from above; if it is terrain, both times.
/// Otherwise it stands: y or z is up.
/// @param box         of all points
/// @param is_terrain  z is up, and there is nothing to be seen from below
std::array<View, 2> choose_views(const Box& box, bool is_terrain);

/// A place in a picture: pixels right and down of its corner, pixels away from the eye.
struct Place {
    double x = 0;
    double y = 0;
    double depth = 0;
};

/// A view with a size: what part of it a picture shows.
struct Frame {
    View view;
    Vec3 centre;       ///< cloud units; the middle of the box
    double left = 0;   ///< of the picture's edge, cloud units right of the centre
    double top = 0;    ///< cloud units above the centre
    double near = 0;   ///< of what is nearest, cloud units toward the eye
    double depth = 0;  ///< from the nearest to the farthest, cloud units, > 0
    double pixel = 1;  ///< edge of a pixel, cloud units, > 0
    int width = 0;     ///< pixels
    int height = 0;

    Place place_of(const Vec3& p) const;
};

/// Finds the part of a view that has the points: all of them, but for a few far outliers.
/// Counts only, so that the order of points makes no difference.
class FrameFinder {
  public:
    FrameFinder(View view, const Box& box);

    void add(const Vec3& p);
    void add(const FrameFinder& other);

    /// A frame of at most `width` by `height` pixels.
    Frame frame(int width, int height) const;

  private:
    static constexpr std::size_t kBins = 4096;

    std::size_t bin_of(double along) const;
    /// From and to, of the coordinates that were counted.
    std::array<double, 2> span_of(const std::vector<std::uint64_t>& bins) const;

    View view_;
    Vec3 centre_;
    double radius_;  // of the sphere round the box
    std::uint64_t points_ = 0;
    std::vector<std::uint64_t> across_;
    std::vector<std::uint64_t> upward_;
};

}  // namespace knap
