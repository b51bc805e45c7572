#include "curvature/principal_axes.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

// Highway compiles this file once for every set of instructions and picks one at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "curvature/principal_axes.cpp"
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

/// Lower triangles of covariance matrices, one a lane.
struct Covariances {
    std::array<double, kMostLanes> xx, yx, yy, zx, zy, zz;
};

HWY_ATTR double largest_coordinate(const double* x, const double* y, const double* z,
                                   std::size_t size) {
    Doubles largest = hn::Zero(kDoubles);
    for (std::size_t i = 0; i < size; i += hn::Lanes(kDoubles)) {
        const Mask valid = hn::FirstN(kDoubles, size - i);
        for (const double* axis : {x, y, z}) {
            largest =
                hn::Max(largest, hn::IfThenElseZero(valid, hn::Abs(hn::LoadU(kDoubles, axis + i))));
        }
    }
    return hn::GetLane(hn::MaxOfLanes(kDoubles, largest));
}

// A coordinate as two whole numbers: value = (high + low / step) / scale, up to a rounding of
// half a step of low.
struct Split {
    Doubles high;
    Doubles low;
};

HWY_INLINE Split split(Doubles value, Doubles scale, Doubles step) {
    const Doubles scaled = hn::Mul(value, scale);
    const Doubles high = hn::Round(scaled);
    return {high, hn::Round(hn::Mul(hn::Sub(scaled, high), step))};
}

/// An exact sum of products of split numbers, in three parts.
struct ProductSum {
    Doubles high;
    Doubles mixed;
    Doubles low;

    // No product and no sum here is rounded, so that it makes no difference whether the machine
    // fuses them.
    HWY_INLINE void add(const Split& a, const Split& b) {
        high = hn::MulAdd(a.high, b.high, high);
        mixed = hn::MulAdd(a.high, b.low, hn::MulAdd(a.low, b.high, mixed));
        low = hn::MulAdd(a.low, b.low, low);
    }

    HWY_INLINE double total(double step) const {
        const double whole = hn::GetLane(hn::SumOfLanes(kDoubles, high));
        const double between = hn::GetLane(hn::SumOfLanes(kDoubles, mixed));
        const double below = hn::GetLane(hn::SumOfLanes(kDoubles, low));
        return whole + (between / step + below / (step * step));
    }
};

// The covariance of one neighbourhood times a power of two, into a lane.
HWY_ATTR void add_covariance(const double* x, const double* y, const double* z, std::size_t size,
                             double largest, std::size_t lane, Covariances& out) {
    // Whole numbers up to 2^bits, whose products' sums stay below 2^53.
    const int bits = (52 - static_cast<int>(std::bit_width(size))) / 2;
    int exponent = 0;
    std::frexp(largest, &exponent);
    // Tiny neighbourhoods have fewer bits to lose than a scale can have.
    constexpr int kLargestExponent = 1000;
    const double scale = std::ldexp(1.0, std::min(bits - exponent, kLargestExponent));
    const double step = std::ldexp(1.0, bits);
    const Doubles scales = hn::Set(kDoubles, scale);
    const Doubles steps = hn::Set(kDoubles, step);
    const Doubles none = hn::Zero(kDoubles);
    Doubles high_x = none, low_x = none, high_y = none, low_y = none, high_z = none, low_z = none;
    ProductSum xx{none, none, none}, yx = xx, yy = xx, zx = xx, zy = xx, zz = xx;
    for (std::size_t i = 0; i < size; i += hn::Lanes(kDoubles)) {
        const Mask valid = hn::FirstN(kDoubles, size - i);
        const auto load = [&](const double* axis) HWY_ATTR {
            return split(hn::IfThenElseZero(valid, hn::LoadU(kDoubles, axis + i)), scales, steps);
        };
        const Split px = load(x);
        const Split py = load(y);
        const Split pz = load(z);
        high_x = hn::Add(high_x, px.high);
        high_y = hn::Add(high_y, py.high);
        high_z = hn::Add(high_z, pz.high);
        low_x = hn::Add(low_x, px.low);
        low_y = hn::Add(low_y, py.low);
        low_z = hn::Add(low_z, pz.low);
        xx.add(px, px);
        yx.add(py, px);
        yy.add(py, py);
        zx.add(pz, px);
        zy.add(pz, py);
        zz.add(pz, pz);
    }
    const auto mean_of = [&](Doubles high, Doubles low) HWY_ATTR {
        return hn::GetLane(hn::SumOfLanes(kDoubles, high)) +
               hn::GetLane(hn::SumOfLanes(kDoubles, low)) / step;
    };
    const double mx = mean_of(high_x, low_x);
    const double my = mean_of(high_y, low_y);
    const double mz = mean_of(high_z, low_z);
    const auto n = static_cast<double>(size);
    out.xx[lane] = xx.total(step) - mx * mx / n;
    out.yx[lane] = yx.total(step) - my * mx / n;
    out.yy[lane] = yy.total(step) - my * my / n;
    out.zx[lane] = zx.total(step) - mz * mx / n;
    out.zy[lane] = zy.total(step) - mz * my / n;
    out.zz[lane] = zz.total(step) - mz * mz / n;
}

/// Symmetric tridiagonal matrices and the rotations that led to them, one a lane.
struct Tridiagonal {
    Doubles d0, d1, d2;                       // diagonal
    Doubles e0, e1;                           // below it
    std::array<std::array<Doubles, 3>, 3> q;  // q[column][row]
};

// One reflection makes each matrix tridiagonal.
HWY_INLINE Tridiagonal tridiagonalise(const Covariances& c) {
    const auto load = [&](const std::array<double, kMostLanes>& from)
                          HWY_ATTR { return hn::LoadU(kDoubles, from.data()); };
    Doubles xx = load(c.xx), yx = load(c.yx), yy = load(c.yy);
    Doubles zx = load(c.zx), zy = load(c.zy), zz = load(c.zz);
    const Doubles zero = hn::Zero(kDoubles);
    const Doubles one = hn::Set(kDoubles, 1.0);
    Doubles largest = zero;
    for (const Doubles value : {xx, yx, yy, zx, zy, zz}) {
        largest = hn::Max(largest, hn::Abs(value));
    }
    largest = hn::IfThenElse(hn::Gt(largest, zero), largest, one);
    for (Doubles* value : {&xx, &yx, &yy, &zx, &zy, &zz}) {
        *value = hn::Div(*value, largest);
    }
    const Doubles smallest = hn::Set(kDoubles, std::numeric_limits<double>::min());
    const Mask reflect = hn::Gt(hn::Mul(zx, zx), smallest);
    const Doubles beta =
        hn::Sqrt(hn::Add(hn::Mul(yx, yx), hn::IfThenElse(reflect, hn::Mul(zx, zx), one)));
    const Doubles inverse = hn::Div(one, beta);
    const Doubles u = hn::Mul(yx, inverse);
    const Doubles v = hn::Mul(zx, inverse);
    const Doubles w =
        hn::Add(hn::Mul(hn::Mul(hn::Set(kDoubles, 2.0), u), zy), hn::Mul(v, hn::Sub(zz, yy)));
    const auto choose = [&](Doubles reflected, Doubles as_it_is)
                            HWY_ATTR { return hn::IfThenElse(reflect, reflected, as_it_is); };
    Tridiagonal t;
    t.d0 = xx;
    t.d1 = choose(hn::Add(yy, hn::Mul(v, w)), yy);
    t.d2 = choose(hn::Sub(zz, hn::Mul(v, w)), zz);
    t.e0 = choose(beta, yx);
    t.e1 = choose(hn::Sub(zy, hn::Mul(u, w)), zy);
    t.q[0][0] = one;
    t.q[0][1] = t.q[0][2] = t.q[1][0] = t.q[2][0] = zero;
    t.q[1][1] = choose(u, one);
    t.q[1][2] = choose(v, zero);
    t.q[2][1] = choose(v, zero);
    t.q[2][2] = choose(hn::Neg(u), one);
    return t;
}

/// A rotation by (c, s) that takes (x, z) to (r, 0).
struct Rotation {
    Doubles c, s;
};

HWY_INLINE Rotation rotation_to_zero(Doubles x, Doubles z) {
    const Doubles zero = hn::Zero(kDoubles);
    const Doubles one = hn::Set(kDoubles, 1.0);
    const Mask steep = hn::Gt(hn::Abs(x), hn::Abs(z));
    const Doubles large = hn::IfThenElse(steep, x, z);
    const Doubles small = hn::IfThenElse(steep, z, x);
    const Doubles t = hn::Div(small, hn::IfThenElse(hn::Eq(large, zero), one, large));
    const Doubles length = hn::Sqrt(hn::Add(one, hn::Mul(t, t)));
    const Doubles inverse =
        hn::Div(one, hn::IfThenElse(hn::Lt(large, zero), hn::Neg(length), length));
    const Doubles other = hn::Mul(t, inverse);
    return {hn::IfThenElse(steep, inverse, other), hn::Neg(hn::IfThenElse(steep, other, inverse))};
}

// Rotates columns k and k + 1 of the vectors, in some lanes.
HWY_INLINE void rotate_columns(Tridiagonal& t, std::size_t k, const Rotation& g, Mask where) {
    for (std::size_t row = 0; row < 3; ++row) {
        Doubles& a = t.q[k][row];
        Doubles& b = t.q[k + 1][row];
        const Doubles rotated_a = hn::Sub(hn::Mul(g.c, a), hn::Mul(g.s, b));
        const Doubles rotated_b = hn::Add(hn::Mul(g.s, a), hn::Mul(g.c, b));
        a = hn::IfThenElse(where, rotated_a, a);
        b = hn::IfThenElse(where, rotated_b, b);
    }
}

// T = G' T G on a 2 x 2 block [da e; e db], in some lanes.
HWY_INLINE void rotate_block(Doubles& da, Doubles& e, Doubles& db, const Rotation& g, Mask where) {
    const auto mul = [](Doubles a, Doubles b) HWY_ATTR { return hn::Mul(a, b); };
    const Doubles se = hn::Add(mul(g.s, da), mul(g.c, e));
    const Doubles sd = hn::Add(mul(g.s, e), mul(g.c, db));
    const Doubles new_da = hn::Sub(mul(g.c, hn::Sub(mul(g.c, da), mul(g.s, e))),
                                   mul(g.s, hn::Sub(mul(g.c, e), mul(g.s, db))));
    da = hn::IfThenElse(where, new_da, da);
    db = hn::IfThenElse(where, hn::Add(mul(g.s, se), mul(g.c, sd)), db);
    e = hn::IfThenElse(where, hn::Sub(mul(g.c, se), mul(g.s, sd)), e);
}

// Sets an entry below the diagonal to zero where it is negligible beside its neighbours.
HWY_INLINE void deflate(Doubles& e, Doubles above, Doubles below) {
    const Doubles scaled =
        hn::Mul(e, hn::Set(kDoubles, 1 / std::numeric_limits<double>::epsilon()));
    const Mask negligible =
        hn::Or(hn::Lt(hn::Abs(e), hn::Set(kDoubles, std::numeric_limits<double>::min())),
               hn::Le(hn::Mul(scaled, scaled), hn::Add(hn::Abs(above), hn::Abs(below))));
    e = hn::IfThenElse(negligible, hn::Zero(kDoubles), e);
}

// Wilkinson's shift: the eigenvalue of [da e; e db] that is nearer to db.
HWY_INLINE Doubles shift_of(Doubles da, Doubles e, Doubles db) {
    const Doubles zero = hn::Zero(kDoubles);
    const Doubles half = hn::Mul(hn::Sub(da, db), hn::Set(kDoubles, 0.5));
    const Doubles square = hn::Mul(e, e);
    const Doubles root = hn::Sqrt(hn::Add(hn::Mul(half, half), square));
    const Doubles sum = hn::Add(half, hn::IfThenElse(hn::Gt(half, zero), root, hn::Neg(root)));
    const Mask even = hn::Eq(half, zero);
    const Doubles safe = hn::IfThenElse(hn::Eq(sum, zero), hn::Set(kDoubles, 1.0), sum);
    return hn::Sub(db, hn::IfThenElse(even, hn::Abs(e), hn::Div(square, safe)));
}

// Implicit QR steps until all lanes are diagonal.
HWY_INLINE void diagonalise(Tridiagonal& t) {
    constexpr int kMostSteps = 90;
    const Doubles zero = hn::Zero(kDoubles);
    for (int step = 0; step < kMostSteps; ++step) {
        deflate(t.e0, t.d0, t.d1);
        deflate(t.e1, t.d1, t.d2);
        const Mask upper = hn::Ne(t.e0, zero);
        const Mask lower = hn::Ne(t.e1, zero);
        if (hn::AllFalse(kDoubles, hn::Or(upper, lower))) {
            return;
        }
        // The last block that is not diagonal: rows 0 to 2, 1 to 2, or 0 to 1.
        const Doubles shift =
            hn::IfThenElse(lower, shift_of(t.d1, t.e1, t.d2), shift_of(t.d0, t.e0, t.d1));
        const Rotation first = rotation_to_zero(hn::Sub(t.d0, shift), t.e0);
        rotate_block(t.d0, t.e0, t.d1, first, upper);
        rotate_columns(t, 0, first, upper);
        // The bulge that the first rotation makes, chased out by a second one.
        const Mask whole = hn::And(upper, lower);
        const Doubles bulge = hn::IfThenElseZero(whole, hn::Neg(hn::Mul(first.s, t.e1)));
        t.e1 = hn::IfThenElse(whole, hn::Mul(first.c, t.e1), t.e1);
        const Mask second_where =
            hn::Or(hn::And(whole, hn::Ne(bulge, zero)), hn::AndNot(upper, lower));
        const Rotation second = rotation_to_zero(hn::IfThenElse(whole, t.e0, hn::Sub(t.d1, shift)),
                                                 hn::IfThenElse(whole, bulge, t.e1));
        rotate_block(t.d1, t.e1, t.d2, second, second_where);
        const Doubles chased = hn::Sub(hn::Mul(second.c, t.e0), hn::Mul(second.s, bulge));
        t.e0 = hn::IfThenElse(hn::And(whole, second_where), chased, t.e0);
        rotate_columns(t, 1, second, second_where);
    }
}

// Exchanges two eigenpairs, in some lanes.
HWY_INLINE void exchange(Doubles& da, std::array<Doubles, 3>& qa, Doubles& db,
                         std::array<Doubles, 3>& qb, Mask where) {
    const auto swap = [&](Doubles& a, Doubles& b) HWY_ATTR {
        const Doubles old = a;
        a = hn::IfThenElse(where, b, a);
        b = hn::IfThenElse(where, old, b);
    };
    swap(da, db);
    for (std::size_t row = 0; row < 3; ++row) {
        swap(qa[row], qb[row]);
    }
}

// By ascending eigenvalue: the smallest to the front, then the smaller of the other two.
HWY_INLINE void sort_pairs(Tridiagonal& t) {
    const Mask one_is_least = hn::And(hn::Lt(t.d1, t.d0), hn::Le(t.d1, t.d2));
    const Mask two_is_least = hn::And(hn::Lt(t.d2, t.d0), hn::Lt(t.d2, t.d1));
    exchange(t.d0, t.q[0], t.d1, t.q[1], one_is_least);
    exchange(t.d0, t.q[0], t.d2, t.q[2], two_is_least);
    exchange(t.d1, t.q[1], t.d2, t.q[2], hn::Lt(t.d2, t.d1));
}

HWY_ATTR void solve(const Covariances& covariances, std::size_t first, PrincipalAxes& result) {
    Tridiagonal t = tridiagonalise(covariances);
    diagonalise(t);
    sort_pairs(t);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t row = 0; row < 3; ++row) {
            hn::StoreU(t.q[axis][row], kDoubles, &result.axes[axis][row][first]);
        }
    }
}

}  // namespace

HWY_ATTR void principal_axes(const Neighbourhoods& of, PrincipalAxes& result) {
    const std::size_t lanes = hn::Lanes(kDoubles);
    Covariances covariances{};
    for (std::size_t first = 0; first < of.count; first += lanes) {
        const std::size_t last = std::min(first + lanes, of.count);
        for (std::size_t i = first; i < last; ++i) {
            const double* x = &of.x[i * of.stride];
            const double* y = &of.y[i * of.stride];
            const double* z = &of.z[i * of.stride];
            result.largest[i] = largest_coordinate(x, y, z, of.size);
            add_covariance(x, y, z, of.size, result.largest[i], i - first, covariances);
        }
        solve(covariances, first, result);
    }
}

}  // namespace knap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace knap {

HWY_EXPORT(principal_axes);

void find_principal_axes(const Neighbourhoods& neighbourhoods, PrincipalAxes& result) {
    result.largest.resize(neighbourhoods.count);
    for (auto& axis : result.axes) {
        for (std::vector<double>& row : axis) {
            row.resize(neighbourhoods.count + Neighbourhoods::kPadding);
        }
    }
    HWY_DYNAMIC_DISPATCH(principal_axes)(neighbourhoods, result);
}

}  // namespace knap
#endif
