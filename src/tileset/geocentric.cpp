#include "tileset/geocentric.hpp"

#include <fmt/format.h>
#include <proj.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "knap/error.hpp"

namespace knap {

namespace {

// Geographic, with heights above the ellipsoid of WGS 84.
constexpr const char* kTarget = "EPSG:4979";
constexpr double kEquator = 6378137;  // WGS 84, metres
constexpr double kFlattening = 1 / 298.257223563;
// Deeper or higher than anything that is scanned.
constexpr double kFarthestHeight = 100e3;

struct FreeContext {
    void operator()(PJ_CONTEXT* context) const { proj_context_destroy(context); }
};
struct FreeObject {
    void operator()(PJ* object) const { proj_destroy(object); }
};
using Object = std::unique_ptr<PJ, FreeObject>;

/// Metres of a unit of height that a position has: 1 where the operation knows the vertical axis.
double height_unit(PJ_CONTEXT* context, const PJ* crs) {
    const PJ_TYPE type = proj_get_type(crs);
    if (type == PJ_TYPE_BOUND_CRS) {
        const Object inner(proj_get_source_crs(context, crs));
        return height_unit(context, inner.get());
    }
    if (type != PJ_TYPE_PROJECTED_CRS) {
        return 1;
    }
    const Object axes(proj_crs_get_coordinate_system(context, crs));
    double unit = 1;
    const bool flat = axes && proj_cs_get_axis_count(context, axes.get()) == 2 &&
                      proj_cs_get_axis_info(context, axes.get(), 0, nullptr, nullptr, nullptr,
                                            &unit, nullptr, nullptr, nullptr) != 0;
    return flat ? unit : 1;
}

Vec3 geocentric(double longitude, double latitude, double height) {
    const double squared = kFlattening * (2 - kFlattening);
    const double radius =
        kEquator / std::sqrt(1 - squared * std::sin(latitude) * std::sin(latitude));
    const double out = (radius + height) * std::cos(latitude);
    return {out * std::cos(longitude), out * std::sin(longitude),
            (radius * (1 - squared) + height) * std::sin(latitude)};
}

}  // namespace

struct Geocentric::Work {
    std::unique_ptr<PJ_CONTEXT, FreeContext> context;
    Object candidates;
    Object operation;
    double unit = 1;
    std::string name;

    /// Longitude and latitude in degrees, height in metres.
    PJ_COORD trans(PJ* by, const Vec3& position) const {
        return proj_trans(by, PJ_FWD,
                          proj_coord(position.x, position.y, position.z * unit, HUGE_VAL));
    }
};

Geocentric::Geocentric(const std::string& crs, const Vec3& centre)
    : work_(std::make_unique<Work>()) {
    work_->context.reset(proj_context_create());
    PJ_CONTEXT* const context = work_->context.get();
    proj_log_level(context, PJ_LOG_NONE);
    proj_context_set_enable_network(context, 0);
    const Object source(proj_create(context, crs.c_str()));
    if (!source || proj_is_crs(source.get()) == 0) {
        throw InputError("PROJ does not know its coordinate system");
    }
    const Object target(proj_create(context, kTarget));
    if (!target) {
        throw InputError("PROJ finds no data of its own (proj.db)");
    }
    const Object raw(
        proj_create_crs_to_crs_from_pj(context, source.get(), target.get(), nullptr, nullptr));
    if (raw) {
        work_->candidates.reset(proj_normalize_for_visualization(context, raw.get()));
    }
    if (!work_->candidates) {
        throw InputError("PROJ knows no way from its coordinate system to the Earth");
    }
    work_->unit = height_unit(context, source.get());
    const PJ_COORD place = work_->trans(work_->candidates.get(), centre);
    work_->operation.reset(proj_trans_get_last_used_operation(work_->candidates.get()));
    const bool on_earth = work_->operation && std::isfinite(place.xyz.x) &&
                          std::abs(place.xyz.x) <= 360 && std::abs(place.xyz.y) <= 90 &&
                          std::abs(place.xyz.z) <= kFarthestHeight;
    if (!on_earth) {
        throw InputError(
            fmt::format("({}, {}, {}) is no place on the Earth in its coordinate system", centre.x,
                        centre.y, centre.z));
    }
    const char* const name = proj_pj_info(work_->operation.get()).description;
    work_->name = name == nullptr ? "" : name;
}

Geocentric::~Geocentric() = default;
Geocentric::Geocentric(Geocentric&& other) noexcept = default;

Vec3 Geocentric::at(const Vec3& position) const {
    constexpr double kRadians = std::numbers::pi / 180;
    const PJ_COORD place = work_->trans(work_->operation.get(), position);
    return geocentric(place.xyz.x * kRadians, place.xyz.y * kRadians, place.xyz.z);
}

const std::string& Geocentric::operation() const {
    return work_->name;
}

}  // namespace knap
