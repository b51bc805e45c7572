#pragma once

#include <array>
#include <cstdint>

namespace knap {

/// A sum of finite doubles that does not depend on the order of summation: a fixed-point
/// accumulator wide enough for every double, rounded once, when it is read.
class ExactSum {
  public:
    /// @param value  finite
    void add(double value);
    void add(const ExactSum& other);

    /// The exact sum, rounded to nearest even.
    double value() const;

    /// The sum as numbers that from_limbs() takes back; most are 0.
    static constexpr int kLimbs = 69;
    using Limbs = std::array<std::int64_t, kLimbs>;
    Limbs limbs() const;
    static ExactSum from_limbs(const Limbs& limbs);

  private:
    // Limb i holds a signed multiple of 2^(32 i - 1088); 2^31 additions fit before carries must
    // be moved up. 2^1024 needs limb 65; two more hold the carries of 2^64 additions.
    static constexpr int kLowestExponent = -1088;
    static constexpr std::uint32_t kCarryEvery = std::uint32_t{1} << 29;

    void carry();

    Limbs limbs_{};
    std::uint32_t pending_ = 0;
};

}  // namespace knap
