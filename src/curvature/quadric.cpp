#include "curvature/quadric.hpp"

#include <algorithm>
#include <cmath>

// Highway compiles this file once for every set of instructions and picks one at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "curvature/quadric.cpp"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace knap::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

const hn::ScalableTag<double> kDoubles;

using Doubles = hn::Vec<hn::ScalableTag<double>>;
using Mask = hn::Mask<hn::ScalableTag<double>>;

constexpr std::size_t kMostLanes = Neighbourhoods::kPadding;
constexpr std::size_t kUnknowns = Quadrics::kCoefficients;
using Values = std::array<double, kMostNeighbourhood + Neighbourhoods::kPadding>;
using Lanes = std::array<double, kMostLanes>;

// Terms are at most 1, and at most 256 of them are added: with this added and taken away again a
// term is rounded to 2^-44, and sums of such terms are exact.
constexpr double kRounder = 0x1.8p8;
static_assert(kMostNeighbourhood <= 256);

// An axis along which points reach no farther than this share of the whole is rounding.
constexpr double kSmallestExtent = 0x1p-40;
// A pivot that is left with less than this share of its diagonal is rounding.
constexpr double kSmallestPivot = 1e-10;
// And so is a sum of squared residuals that is left with less than this share of that of heights.
constexpr double kSmallestResidual = 1e-9;
// Where a point counts in full: so many standard deviations outside. Chords cut inside.
constexpr double kBestDeviation = 0.5;

/// A neighbourhood in its frame, each axis times a power of two that makes it at most 1.
struct Local {
    HWY_ALIGN Values x;
    HWY_ALIGN Values y;
    HWY_ALIGN Values z;
};

/// The powers of two, one neighbourhood a lane.
struct Scales {
    HWY_ALIGN Lanes x;
    HWY_ALIGN Lanes y;
    HWY_ALIGN Lanes z;
};

/// Normal equations, one neighbourhood a lane: the sums of x^i y^j, of z times the first six, and
/// of z z.
struct Moments {
    // 1; x, y; xx, xy, yy; xxx, xxy, xyy, yyy; xxxx, xxxy, xxyy, xyyy, yyyy.
    static constexpr std::size_t kSums = 15;
    HWY_ALIGN std::array<Lanes, kSums> sums;
    HWY_ALIGN std::array<Lanes, kUnknowns> heights;
    HWY_ALIGN Lanes squares;
};

// The place of x^i y^j in Moments::sums.
constexpr std::size_t place_of(std::size_t i, std::size_t j) {
    const std::size_t degree = i + j;
    return degree * (degree + 1) / 2 + j;
}

double scale_for(double largest) {
    int exponent = 0;
    std::frexp(largest, &exponent);
    // Tiny neighbourhoods have fewer bits to lose than a scale can have.
    constexpr int kLargestExponent = 1000;
    return std::ldexp(1.0, std::min(-exponent, kLargestExponent));
}

HWY_ATTR void to_local(const Neighbourhoods& of, std::size_t i, const PrincipalAxes& frames,
                       Local& local, std::size_t lane, Scales& scales) {
    const std::size_t lanes = hn::Lanes(kDoubles);
    const std::size_t begin = i * of.stride;
    const auto turn = [&](PrincipalAxes::Axis axis, Values& out) HWY_ATTR {
        const auto& rows = frames.axes[axis];
        Doubles largest = hn::Zero(kDoubles);
        for (std::size_t at = 0; at < of.size; at += lanes) {
            const Doubles value = hn::Add(
                hn::Add(
                    hn::Mul(hn::LoadU(kDoubles, &of.x[begin + at]), hn::Set(kDoubles, rows[0][i])),
                    hn::Mul(hn::LoadU(kDoubles, &of.y[begin + at]), hn::Set(kDoubles, rows[1][i]))),
                hn::Mul(hn::LoadU(kDoubles, &of.z[begin + at]), hn::Set(kDoubles, rows[2][i])));
            const Doubles valid = hn::IfThenElseZero(hn::FirstN(kDoubles, of.size - at), value);
            largest = hn::Max(largest, hn::Abs(valid));
            hn::StoreU(valid, kDoubles, &out[at]);
        }
        const double extent = hn::GetLane(hn::MaxOfLanes(kDoubles, largest));
        if (extent <= kSmallestExtent * frames.largest[i]) {
            out.fill(0);
            return 1.0;
        }
        const double scale = scale_for(extent);
        for (std::size_t at = 0; at < of.size; at += lanes) {
            hn::StoreU(hn::Mul(hn::LoadU(kDoubles, &out[at]), hn::Set(kDoubles, scale)), kDoubles,
                       &out[at]);
        }
        return scale;
    };
    scales.x[lane] = turn(PrincipalAxes::kFirst, local.x);
    scales.y[lane] = turn(PrincipalAxes::kSecond, local.y);
    scales.z[lane] = turn(PrincipalAxes::kNormal, local.z);
}

HWY_INLINE Doubles rounded(Doubles term) {
    const Doubles rounder = hn::Set(kDoubles, kRounder);
    return hn::Sub(hn::Add(term, rounder), rounder);
}

// The moments of one neighbourhood, into a lane. Points behind the last one are 0.
HWY_ATTR void add_moments(const Local& local, std::size_t size, std::size_t lane, Moments& out) {
    std::array<Doubles, Moments::kSums> sums;
    std::array<Doubles, kUnknowns> heights;
    Doubles squares = hn::Zero(kDoubles);
    sums.fill(hn::Zero(kDoubles));
    heights.fill(hn::Zero(kDoubles));
    for (std::size_t at = 0; at < size; at += hn::Lanes(kDoubles)) {
        const Doubles x = hn::LoadU(kDoubles, &local.x[at]);
        const Doubles y = hn::LoadU(kDoubles, &local.y[at]);
        const Doubles z = hn::LoadU(kDoubles, &local.z[at]);
        const Doubles xx = hn::Mul(x, x);
        const Doubles xy = hn::Mul(x, y);
        const Doubles yy = hn::Mul(y, y);
        const std::array<Doubles, Moments::kSums> terms{hn::Zero(kDoubles),
                                                        x,
                                                        y,
                                                        xx,
                                                        xy,
                                                        yy,
                                                        hn::Mul(xx, x),
                                                        hn::Mul(xx, y),
                                                        hn::Mul(x, yy),
                                                        hn::Mul(yy, y),
                                                        hn::Mul(xx, xx),
                                                        hn::Mul(xx, xy),
                                                        hn::Mul(xx, yy),
                                                        hn::Mul(xy, yy),
                                                        hn::Mul(yy, yy)};
        for (std::size_t i = 1; i < Moments::kSums; ++i) {
            sums[i] = hn::Add(sums[i], rounded(terms[i]));
        }
        heights[0] = hn::Add(heights[0], rounded(z));
        for (std::size_t i = 1; i < kUnknowns; ++i) {
            heights[i] = hn::Add(heights[i], rounded(hn::Mul(z, terms[i])));
        }
        squares = hn::Add(squares, rounded(hn::Mul(z, z)));
    }
    out.sums[0][lane] = static_cast<double>(size);
    for (std::size_t i = 1; i < Moments::kSums; ++i) {
        out.sums[i][lane] = hn::GetLane(hn::SumOfLanes(kDoubles, sums[i]));
    }
    for (std::size_t i = 0; i < kUnknowns; ++i) {
        out.heights[i][lane] = hn::GetLane(hn::SumOfLanes(kDoubles, heights[i]));
    }
    out.squares[lane] = hn::GetLane(hn::SumOfLanes(kDoubles, squares));
}

// Solves the normal equations by L D L', in the order 1, x, y, xx, xy, yy. An unknown whose pivot
// vanishes is left out.
HWY_INLINE std::array<Doubles, kUnknowns> solve(const Moments& moments) {
    constexpr std::array<std::array<std::size_t, 2>, kUnknowns> kPowers{
        {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}}};
    const Doubles zero = hn::Zero(kDoubles);
    const Doubles one = hn::Set(kDoubles, 1.0);
    std::array<std::array<Doubles, kUnknowns>, kUnknowns> l;  // below the diagonal
    std::array<Doubles, kUnknowns> d;
    std::array<Doubles, kUnknowns> inverse;
    std::array<Doubles, kUnknowns> solution;
    for (std::size_t row = 0; row < kUnknowns; ++row) {
        const auto entry = [&](std::size_t column) HWY_ATTR {
            const std::size_t place = place_of(kPowers[row][0] + kPowers[column][0],
                                               kPowers[row][1] + kPowers[column][1]);
            return hn::Load(kDoubles, moments.sums[place].data());
        };
        for (std::size_t column = 0; column < row; ++column) {
            Doubles value = entry(column);
            for (std::size_t k = 0; k < column; ++k) {
                value = hn::Sub(value, hn::Mul(hn::Mul(l[row][k], l[column][k]), d[k]));
            }
            l[row][column] = hn::Mul(value, inverse[column]);
        }
        const Doubles diagonal = entry(row);
        Doubles pivot = diagonal;
        for (std::size_t k = 0; k < row; ++k) {
            pivot = hn::Sub(pivot, hn::Mul(hn::Mul(l[row][k], l[row][k]), d[k]));
        }
        const Mask good = hn::Gt(pivot, hn::Mul(diagonal, hn::Set(kDoubles, kSmallestPivot)));
        d[row] = hn::IfThenElseZero(good, pivot);
        inverse[row] = hn::IfThenElseZero(good, hn::Div(one, hn::IfThenElse(good, pivot, one)));
        Doubles value = hn::Load(kDoubles, moments.heights[row].data());
        for (std::size_t k = 0; k < row; ++k) {
            value = hn::Sub(value, hn::Mul(l[row][k], solution[k]));
        }
        solution[row] = hn::IfThenElse(good, value, zero);
    }
    for (std::size_t row = kUnknowns; row-- > 0;) {
        Doubles value = hn::Mul(solution[row], inverse[row]);
        for (std::size_t k = row + 1; k < kUnknowns; ++k) {
            value = hn::Sub(value, hn::Mul(l[k][row], solution[k]));
        }
        solution[row] = hn::IfThenElseZero(hn::Ne(inverse[row], zero), value);
    }
    return solution;
}

// Standard deviation of the points from the quadric: what least squares leaves of the heights.
HWY_INLINE Doubles deviation(const Moments& moments, const std::array<Doubles, kUnknowns>& solution,
                             std::size_t size) {
    const Doubles squares = hn::Load(kDoubles, moments.squares.data());
    Doubles left = squares;
    for (std::size_t i = 0; i < kUnknowns; ++i) {
        left = hn::Sub(left, hn::Mul(solution[i], hn::Load(kDoubles, moments.heights[i].data())));
    }
    left = hn::Max(left, hn::Mul(squares, hn::Set(kDoubles, kSmallestResidual)));
    const std::size_t freedom = size > kUnknowns ? size - kUnknowns : 1;
    return hn::Sqrt(hn::Div(left, hn::Set(kDoubles, static_cast<double>(freedom))));
}

// Back to cloud units.
HWY_INLINE void store(const std::array<Doubles, kUnknowns>& solution, Doubles deviation,
                      const Scales& scales, std::size_t first, Quadrics& result) {
    const Doubles x = hn::Load(kDoubles, scales.x.data());
    const Doubles y = hn::Load(kDoubles, scales.y.data());
    const Doubles z = hn::Load(kDoubles, scales.z.data());
    const auto put = [&](Quadrics::Coefficient which, Doubles value) HWY_ATTR {
        hn::StoreU(hn::Div(value, z), kDoubles, &result.of[which][first]);
    };
    hn::StoreU(hn::Div(deviation, z), kDoubles, &result.deviations[first]);
    put(Quadrics::kOne, solution[0]);
    put(Quadrics::kX, hn::Mul(solution[1], x));
    put(Quadrics::kY, hn::Mul(solution[2], y));
    put(Quadrics::kXX, hn::Mul(hn::Mul(solution[3], x), x));
    put(Quadrics::kXY, hn::Mul(hn::Mul(solution[4], x), y));
    put(Quadrics::kYY, hn::Mul(hn::Mul(solution[5], y), y));
}

}  // namespace

HWY_ATTR void fit(const Neighbourhoods& of, const PrincipalAxes& frames, Quadrics& result) {
    const std::size_t lanes = hn::Lanes(kDoubles);
    Local local;
    Scales scales{};
    Moments moments{};
    for (std::size_t first = 0; first < of.count; first += lanes) {
        const std::size_t last = std::min(first + lanes, of.count);
        for (std::size_t i = first; i < last; ++i) {
            to_local(of, i, frames, local, i - first, scales);
            add_moments(local, of.size, i - first, moments);
        }
        for (std::size_t lane = last - first; lane < lanes; ++lane) {
            scales.x[lane] = scales.y[lane] = scales.z[lane] = 1;
        }
        const std::array<Doubles, kUnknowns> solution = solve(moments);
        store(solution, deviation(moments, solution, of.size), scales, first, result);
    }
}

HWY_ATTR void quadric_curvatures(const Quadrics& quadrics, std::size_t count, bool discounted,
                                 double* result) {
    const std::size_t lanes = hn::Lanes(kDoubles);
    const Doubles one = hn::Set(kDoubles, 1.0);
    const Doubles zero = hn::Zero(kDoubles);
    for (std::size_t i = 0; i < count; i += lanes) {
        const auto load = [&](Quadrics::Coefficient which)
                              HWY_ATTR { return hn::LoadU(kDoubles, &quadrics.of[which][i]); };
        const Doubles a = load(Quadrics::kXX);
        const Doubles b = load(Quadrics::kXY);
        const Doubles c = load(Quadrics::kYY);
        const Doubles d = load(Quadrics::kX);
        const Doubles e = load(Quadrics::kY);
        const Doubles dd = hn::Mul(d, d);
        const Doubles ee = hn::Mul(e, e);
        const Doubles along = hn::Add(hn::Mul(hn::Add(one, ee), a), hn::Mul(hn::Add(one, dd), c));
        const Doubles across = hn::Mul(hn::Mul(d, e), b);
        const Doubles steepness = hn::Add(hn::Add(one, dd), ee);
        Doubles h = hn::Div(hn::Sub(along, across), hn::Mul(steepness, hn::Sqrt(steepness)));
        if (discounted) {
            // Where the surface bends up, outside is below it.
            const Doubles outside = hn::IfThenElse(hn::Lt(h, zero), hn::Neg(load(Quadrics::kOne)),
                                                   load(Quadrics::kOne));
            const Doubles deviation = hn::LoadU(kDoubles, &quadrics.deviations[i]);
            const Doubles off =
                hn::Sub(hn::IfThenElseZero(hn::Gt(deviation, zero), hn::Div(outside, deviation)),
                        hn::Set(kDoubles, kBestDeviation));
            h = hn::Div(h, hn::Add(one, hn::Mul(off, off)));
        }
        HWY_ALIGN Lanes found;
        hn::Store(hn::IfThenElse(hn::IsFinite(h), h, zero), kDoubles, found.data());
        std::copy_n(found.begin(), std::min(lanes, count - i), result + i);
    }
}

}  // namespace knap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace knap {

HWY_EXPORT(fit);
HWY_EXPORT(quadric_curvatures);

void Quadrics::resize(std::size_t count) {
    for (std::vector<double>& values : of) {
        values.resize(count + Neighbourhoods::kPadding);
    }
    deviations.resize(count + Neighbourhoods::kPadding);
}

void fit_quadrics(const Neighbourhoods& neighbourhoods, const PrincipalAxes& axes,
                  Quadrics& result) {
    result.resize(neighbourhoods.count);
    HWY_DYNAMIC_DISPATCH(fit)(neighbourhoods, axes, result);
}

void mean_curvatures_of(const Quadrics& quadrics, const PrincipalAxes& axes, bool discounted,
                        std::span<double> result) {
    HWY_DYNAMIC_DISPATCH(quadric_curvatures)
    (quadrics, result.size(), discounted, result.data());
    for (std::size_t i = 0; i < result.size(); ++i) {
        result[i] = axes.largest[i] > 0 ? result[i] : 0;
    }
}

}  // namespace knap
#endif
