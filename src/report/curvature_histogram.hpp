#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace knap {

/// |H| on a logarithmic scale of whole numbers: 128 codes an octave, 16 octaves to each side of the
/// mean. Code 0 is for what is below, flat places among them.
class CurvatureScale {
  public:
    static constexpr std::uint32_t kCodes = 4096;
    static constexpr std::uint32_t kPerOctave = 128;

    /// @param mean_curvature  of the archive, 1 / cloud unit, >= 0
    explicit CurvatureScale(double mean_curvature) : mean_(mean_curvature) {}

    double mean() const { return mean_; }

    /// @param curvature  |H|, 1 / cloud unit, >= 0
    std::uint32_t code_of(double curvature) const;

    /// The |H| in the middle of a code, 1 / cloud unit; 0 of code 0.
    double curvature_of(std::uint32_t code) const;

  private:
    double mean_;
};

/// Points by the code of their curvature. Counts only: the order of points makes no difference.
class CurvatureHistogram {
  public:
    CurvatureHistogram() : counts_(CurvatureScale::kCodes) {}
    /// @param counts  one a code
    explicit CurvatureHistogram(std::vector<std::uint64_t> counts) : counts_(std::move(counts)) {}

    void add(std::uint32_t code) { ++counts_[code]; }
    void add(const CurvatureHistogram& other);

    const std::vector<std::uint64_t>& counts() const { return counts_; }
    std::uint64_t points() const;

    /// The code that a share of the points with a code above 0 does not exceed; 0 without any.
    /// @param share  [0, 1]
    std::uint32_t quantile(double share) const;

  private:
    std::vector<std::uint64_t> counts_;
};

}  // namespace knap
