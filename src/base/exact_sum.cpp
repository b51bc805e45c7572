#include "base/exact_sum.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace knap {

namespace {

constexpr std::int64_t kBase = std::int64_t{1} << 32;
constexpr int kMantissaBits = 52;
constexpr int kBias = 1023;
__extension__ using Uint128 = unsigned __int128;

}  // namespace

void ExactSum::add(double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    const int biased = static_cast<int>((bits >> kMantissaBits) & 0x7ff);
    std::uint64_t mantissa = bits & ((std::uint64_t{1} << kMantissaBits) - 1);
    if (biased != 0) {
        mantissa |= std::uint64_t{1} << kMantissaBits;
    }
    // value = mantissa * 2^exponent
    const int exponent = (biased == 0 ? 1 : biased) - kBias - kMantissaBits;
    const int position = exponent - kLowestExponent;
    const auto limb = static_cast<std::size_t>(position / 32);
    const int shift = position % 32;
    const std::int64_t sign = (bits >> 63) != 0 ? -1 : 1;
    const Uint128 wide = static_cast<Uint128>(mantissa) << shift;
    limbs_[limb] += sign * static_cast<std::int64_t>(wide & 0xffffffffU);
    limbs_[limb + 1] += sign * static_cast<std::int64_t>((wide >> 32) & 0xffffffffU);
    limbs_[limb + 2] += sign * static_cast<std::int64_t>(wide >> 64);
    if (++pending_ == kCarryEvery) {
        carry();
    }
}

void ExactSum::add(const ExactSum& other) {
    ExactSum copy = other;
    copy.carry();
    carry();
    for (std::size_t i = 0; i < kLimbs; ++i) {
        limbs_[i] += copy.limbs_[i];
    }
    carry();
}

ExactSum::Limbs ExactSum::limbs() const {
    ExactSum copy = *this;
    copy.carry();
    return copy.limbs_;
}

ExactSum ExactSum::from_limbs(const Limbs& limbs) {
    ExactSum sum;
    sum.limbs_ = limbs;
    return sum;
}

// Brings every limb but the last into [0, 2^32); the last one carries the sign.
void ExactSum::carry() {
    for (std::size_t i = 0; i + 1 < kLimbs; ++i) {
        std::int64_t up = limbs_[i] / kBase;
        std::int64_t rest = limbs_[i] % kBase;
        if (rest < 0) {
            rest += kBase;
            --up;
        }
        limbs_[i] = rest;
        limbs_[i + 1] += up;
    }
    pending_ = 0;
}

double ExactSum::value() const {
    ExactSum sum = *this;
    sum.carry();
    const bool negative = sum.limbs_[kLimbs - 1] < 0;
    if (negative) {
        for (std::int64_t& limb : sum.limbs_) {
            limb = -limb;
        }
        sum.carry();
    }
    int top = kLimbs - 1;
    while (top > 0 && sum.limbs_[static_cast<std::size_t>(top)] == 0) {
        --top;
    }
    // The top three limbs hold at least 65 significant bits; what is below them can only decide a
    // tie, so it is folded into one sticky bit.
    Uint128 head = 0;
    for (int i = top; i > top - 3; --i) {
        head = (head << 32) |
               static_cast<std::uint64_t>(i >= 0 ? sum.limbs_[static_cast<std::size_t>(i)] : 0);
    }
    bool sticky = false;
    for (int i = top - 3; i >= 0; --i) {
        sticky = sticky || sum.limbs_[static_cast<std::size_t>(i)] != 0;
    }
    // Rounding happens once: to 53 bits, or fewer where the result is subnormal.
    int exponent = kLowestExponent + 32 * (top - 2);
    int width = 0;
    for (Uint128 rest = head; rest != 0; rest >>= 1) {
        ++width;
    }
    constexpr int kSmallestExponent = -1074;
    const int drop = std::max({width - 53, kSmallestExponent - exponent, 0});
    if (drop > 0) {
        const Uint128 cut = head & ((static_cast<Uint128>(1) << drop) - 1);
        const Uint128 half = static_cast<Uint128>(1) << (drop - 1);
        head >>= drop;
        exponent += drop;
        if (cut > half || (cut == half && (sticky || (head & 1) != 0))) {
            ++head;
        }
    }
    const double magnitude =
        std::ldexp(static_cast<double>(static_cast<std::uint64_t>(head)), exponent);
    return negative ? -magnitude : magnitude;
}

}  // namespace knap
