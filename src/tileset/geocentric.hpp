#pragma once

#include <memory>
#include <string>

#include "knap/geometry.hpp"

namespace knap {

/// Puts positions of one coordinate system on the Earth: EPSG:4978, metres from its centre, x
/// towards longitude 0, z towards the north pole.
///
/// The operation that PROJ finds best at one place serves all, so that there is no seam. Heights of
/// a coordinate system without a vertical axis are in the unit of its plane, metres where that is
/// degrees; and heights above sea level are taken for heights above the ellipsoid where no grid
/// tells the difference. Not thread-safe: one a thread.
class Geocentric {
  public:
    /// @param crs     WKT, "EPSG:n", or whatever else PROJ reads
    /// @param centre  where the operation is chosen; of finite coordinates
    /// @throws InputError with the reason if PROJ does not know the system, or it is not of the
    ///         Earth, or the place is outside of it
    Geocentric(const std::string& crs, const Vec3& centre);
    ~Geocentric();
    Geocentric(Geocentric&& other) noexcept;
    Geocentric& operator=(Geocentric&&) = delete;

    /// @param position  in the coordinate system: easting or longitude first
    /// @return          metres; not finite where the operation fails
    Vec3 at(const Vec3& position) const;

    /// The operation in the words of PROJ.
    const std::string& operation() const;

  private:
    struct Work;
    std::unique_ptr<Work> work_;
};

}  // namespace knap
