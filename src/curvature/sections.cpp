#include "curvature/sections.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

// Highway compiles this file once for every set of instructions and picks one at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "curvature/sections.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace knap::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

const hn::ScalableTag<double> kDoubles;

const hn::ScalableTag<std::int64_t> kIndices;

using Doubles = hn::Vec<hn::ScalableTag<double>>;
using Indices = hn::Vec<hn::ScalableTag<std::int64_t>>;
using Mask = hn::Mask<hn::ScalableTag<double>>;

using Values = std::array<double, kMostNeighbourhood + Neighbourhoods::kPadding>;

// The places of the bits that are set in a byte, lowest first, a byte each.
constexpr std::array<std::uint64_t, 256> kSetBits = [] {
    std::array<std::uint64_t, 256> table{};
    for (std::uint64_t bits = 0; bits < table.size(); ++bits) {
        int count = 0;
        for (std::uint64_t place = 0; place < 8; ++place) {
            if ((bits >> place & 1) != 0) {
                table[bits] |= place << (8 * count++);
            }
        }
    }
    return table;
}();

/// Some points of a neighbourhood.
struct Side {
    std::size_t size = 0;
    std::array<std::uint8_t, kMostNeighbourhood + 8> points;

    /// Eight places are written, whatever the bits; those behind the last one are written over.
    void add(std::size_t first, std::uint8_t bits) {
        constexpr std::uint64_t kEach = 0x0101010101010101U;
        const std::uint64_t places = kSetBits[bits] + first * kEach;
        std::memcpy(&points[size], &places, sizeof places);
        size += static_cast<std::size_t>(std::popcount(bits));
    }
};
static_assert(kMostNeighbourhood <= 256, "places fit a byte");
static_assert(std::endian::native == std::endian::little, "the lowest place comes first");

/// A neighbourhood in its frame: coordinates along one axis, squared distances from that axis, and
/// the points on either side of it.
struct Section {
    HWY_ALIGN Values along;
    HWY_ALIGN Values off_squared;
    Side left;
    Side right;
};

struct Local {
    HWY_ALIGN Values z;
    Section x;
    Section y;
};

HWY_ATTR void to_local(const Neighbourhoods& of, std::size_t i, const PrincipalAxes& frames,
                       Local& local) {
    const std::size_t lanes = hn::Lanes(kDoubles);
    const auto turned = [&](PrincipalAxes::Axis axis, Doubles x, Doubles y, Doubles z) HWY_ATTR {
        const auto& rows = frames.axes[axis];
        return hn::Add(hn::Add(hn::Mul(x, hn::Set(kDoubles, rows[0][i])),
                               hn::Mul(y, hn::Set(kDoubles, rows[1][i]))),
                       hn::Mul(z, hn::Set(kDoubles, rows[2][i])));
    };
    const auto add_sides = [](Section& section, std::size_t at, Mask is_left, Mask is_right)
                               HWY_ATTR {
                                   std::array<std::uint8_t, 8> bits{};
                                   hn::StoreMaskBits(kDoubles, is_left, bits.data());
                                   section.left.add(at, bits[0]);
                                   hn::StoreMaskBits(kDoubles, is_right, bits.data());
                                   section.right.add(at, bits[0]);
                               };
    local.x.left.size = local.x.right.size = local.y.left.size = local.y.right.size = 0;
    const std::size_t begin = i * of.stride;
    for (std::size_t at = 0; at < of.size; at += lanes) {
        const Doubles px = hn::LoadU(kDoubles, &of.x[begin + at]);
        const Doubles py = hn::LoadU(kDoubles, &of.y[begin + at]);
        const Doubles pz = hn::LoadU(kDoubles, &of.z[begin + at]);
        const Doubles x = turned(PrincipalAxes::kFirst, px, py, pz);
        const Doubles y = turned(PrincipalAxes::kSecond, px, py, pz);
        const Doubles z = turned(PrincipalAxes::kNormal, px, py, pz);
        const Doubles zz = hn::Mul(z, z);
        hn::StoreU(z, kDoubles, &local.z[at]);
        hn::StoreU(x, kDoubles, &local.x.along[at]);
        hn::StoreU(y, kDoubles, &local.y.along[at]);
        hn::StoreU(hn::Add(hn::Mul(y, y), zz), kDoubles, &local.x.off_squared[at]);
        hn::StoreU(hn::Add(hn::Mul(x, x), zz), kDoubles, &local.y.off_squared[at]);
        const Mask valid = hn::FirstN(kDoubles, of.size - at);
        const Mask left_of_x = hn::Ge(y, hn::Zero(kDoubles));
        const Mask left_of_y = hn::Ge(x, hn::Zero(kDoubles));
        add_sides(local.x, at, hn::And(valid, left_of_x), hn::AndNot(left_of_x, valid));
        add_sides(local.y, at, hn::And(valid, left_of_y), hn::AndNot(left_of_y, valid));
    }
}

/// The nearest point to some samples, one a lane, in the two quadrants on one side of the axis. A
/// quadrant without a point stays infinitely far with z = 0.
struct HalfPlane {
    Doubles ahead;
    Doubles ahead_z;
    Doubles behind;
    Doubles behind_z;
};

HWY_INLINE HalfPlane nearest_on_side(const Section& section, const Values& heights,
                                     const Side& side, Doubles u) {
    const Doubles infinity = hn::Set(kDoubles, std::numeric_limits<double>::infinity());
    const Doubles zero = hn::Zero(kDoubles);
    // First the distances alone, those behind with a minus sign; then who is that near. Minima
    // have no order, and depend on each other far less than comparing point by point.
    HWY_ALIGN std::array<double, kMostNeighbourhood * Neighbourhoods::kPadding> signed_squares;
    HalfPlane best{infinity, infinity, infinity, infinity};
    for (std::size_t at = 0; at < side.size; ++at) {
        const std::size_t i = side.points[at];
        const Doubles d = hn::Sub(hn::Set(kDoubles, section.along[i]), u);
        const Doubles squared = hn::Add(hn::Mul(d, d), hn::Set(kDoubles, section.off_squared[i]));
        const Mask is_ahead = hn::Ge(d, zero);
        best.ahead = hn::Min(best.ahead, hn::IfThenElse(is_ahead, squared, infinity));
        best.behind = hn::Min(best.behind, hn::IfThenElse(is_ahead, infinity, squared));
        hn::Store(hn::IfThenElse(is_ahead, squared, hn::Neg(squared)), kDoubles,
                  &signed_squares[at * hn::Lanes(kDoubles)]);
    }
    const Doubles behind = hn::Neg(best.behind);
    for (std::size_t at = 0; at < side.size; ++at) {
        const Doubles z = hn::Set(kDoubles, heights[side.points[at]]);
        const Doubles squared = hn::Load(kDoubles, &signed_squares[at * hn::Lanes(kDoubles)]);
        best.ahead_z =
            hn::IfThenElse(hn::Eq(squared, best.ahead), hn::Min(best.ahead_z, z), best.ahead_z);
        best.behind_z =
            hn::IfThenElse(hn::Eq(squared, behind), hn::Min(best.behind_z, z), best.behind_z);
    }
    best.ahead_z = hn::IfThenElse(hn::Eq(best.ahead, infinity), zero, best.ahead_z);
    best.behind_z = hn::IfThenElse(hn::Eq(best.behind, infinity), zero, best.behind_z);
    return best;
}

// g_l for some samples: heights of the nearest points, weighted by their inverse distances.
HWY_INLINE Doubles heights_at(const HalfPlane& left, const HalfPlane& right) {
    const Doubles one = hn::Set(kDoubles, 1.0);
    const Doubles zero = hn::Zero(kDoubles);
    Doubles weighted = zero;
    Doubles total = zero;
    const auto add = [&](Doubles squared, Doubles z) HWY_ATTR {
        const Doubles inverse = hn::Div(one, hn::Sqrt(squared));
        weighted = hn::Add(weighted, hn::Mul(z, inverse));
        total = hn::Add(total, inverse);
    };
    add(left.ahead, left.ahead_z);
    add(left.behind, left.behind_z);
    add(right.ahead, right.ahead_z);
    add(right.behind, right.behind_z);
    // A point at distance 0 gives its z.
    return hn::IfThenElse(
        hn::Eq(left.ahead, zero), left.ahead_z,
        hn::IfThenElse(hn::Eq(right.ahead, zero), right.ahead_z, hn::Div(weighted, total)));
}

// The surface's heights at the samples along one axis.
HWY_INLINE void find_heights(const FourierSeries& series, const Local& local,
                             const Section& section, double* g) {
    for (std::size_t l = 0; l < series.samples; l += hn::Lanes(kDoubles)) {
        const Doubles u = hn::LoadU(kDoubles, &series.u[l]);
        const HalfPlane left = nearest_on_side(section, local.z, section.left, u);
        const HalfPlane right = nearest_on_side(section, local.z, section.right, u);
        hn::StoreU(heights_at(left, right), kDoubles, &g[l]);
    }
}

// kappa = f'' / (1 + f'^2)^(3/2) at the origins of some neighbourhoods, one a lane.
HWY_INLINE Doubles curvature_of(const FourierSeries& series, const double* g, Indices rows) {
    const Doubles one = hn::Set(kDoubles, 1.0);
    Doubles slope = hn::Zero(kDoubles);
    Doubles bend = hn::Zero(kDoubles);
    for (std::size_t l = 0; l < series.samples; ++l) {
        const Doubles height = hn::GatherIndex(kDoubles, g + l, rows);
        slope = hn::Add(slope, hn::Mul(hn::Set(kDoubles, series.first[l]), height));
        bend = hn::Add(bend, hn::Mul(hn::Set(kDoubles, series.second[l]), height));
    }
    const Doubles steepness = hn::Add(one, hn::Mul(slope, slope));
    return hn::Div(bend, hn::Mul(steepness, hn::Sqrt(steepness)));
}

}  // namespace

HWY_ATTR void mean_curvatures(const FourierSeries& series, const Neighbourhoods& of,
                              const PrincipalAxes& frames, SectionHeights& heights,
                              double* result) {
    const std::size_t lanes = hn::Lanes(kDoubles);
    heights.resize(of.count, series.samples);
    Local local;
    for (std::size_t i = 0; i < of.count; ++i) {
        double* along_x = &heights.x[i * heights.stride];
        double* along_y = &heights.y[i * heights.stride];
        if (frames.largest[i] > 0) {
            to_local(of, i, frames, local);
            find_heights(series, local, local.x, along_x);
            find_heights(series, local, local.y, along_y);
        } else {
            std::fill_n(along_x, series.samples, 0.0);
            std::fill_n(along_y, series.samples, 0.0);
        }
    }
    const Doubles zero = hn::Zero(kDoubles);
    for (std::size_t i = 0; i < of.count; i += lanes) {
        const Indices rows = hn::Mul(hn::Iota(kIndices, static_cast<std::int64_t>(i)),
                                     hn::Set(kIndices, static_cast<std::int64_t>(heights.stride)));
        const Doubles sum = hn::Add(curvature_of(series, heights.x.data(), rows),
                                    curvature_of(series, heights.y.data(), rows));
        const Doubles h = hn::Div(sum, hn::Set(kDoubles, 2.0));
        HWY_ALIGN std::array<double, Neighbourhoods::kPadding> found;
        hn::Store(hn::IfThenElse(hn::IsFinite(h), h, zero), kDoubles, found.data());
        std::copy_n(found.begin(), std::min(lanes, of.count - i), result + i);
    }
}

}  // namespace knap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace knap {

HWY_EXPORT(mean_curvatures);

void SectionHeights::resize(std::size_t count, std::size_t samples) {
    constexpr std::size_t kPadding = Neighbourhoods::kPadding;
    stride = (samples + kPadding - 1) / kPadding * kPadding;
    const std::size_t values = (count + kPadding) * stride;
    if (x.size() < values) {
        x.resize(values);
        y.resize(values);
    }
}

void find_mean_curvatures(const FourierSeries& series, const Neighbourhoods& neighbourhoods,
                          const PrincipalAxes& axes, SectionHeights& heights,
                          std::span<double> result) {
    HWY_DYNAMIC_DISPATCH(mean_curvatures)(series, neighbourhoods, axes, heights, result.data());
}

}  // namespace knap
#endif
