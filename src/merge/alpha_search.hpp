#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "knap/geometry.hpp"
#include "knap/params.hpp"
#include "store/ranked_run.hpp"

namespace knap {

/// Some of an archive's points, enough to foretell how many of all are kept: those in some cells of
/// a lattice, chosen by a hash, so that which they are does not depend on how the archive is cut.
/// Of a small archive all points.
class SampleCells {
  public:
    /// @param points   counted points of the archive
    /// @param spacing  mean distance to the nearest other point, cloud units
    SampleCells(std::uint64_t points, double spacing);

    bool contains(const Vec3& p) const;

  private:
    double cells_per_unit_ = 0;    // 0: all points
    std::uint64_t most_hash_ = 0;  // of a cell in the sample
};

/// How many points a job wants to keep; 0 if it does not say.
/// @param points  of the input
std::uint64_t wanted_points(const RangeParams& range, std::uint64_t points);

/// What the search for alpha is given.
struct AlphaGoal {
    RangeParams range;          ///< all but alpha
    double mean_curvature = 0;  ///< of the archive, 1 / cloud unit
    double spacing = 0;         ///< mean distance to the nearest other point, cloud units
    std::uint64_t points = 0;   ///< counted points of the archive
    std::uint64_t wanted = 0;   ///< points to keep, >= 1
};

/// Looks for the alpha for which a wanted number of points is kept. A sample foretells the number;
/// one merge of all points or two show how far the sample is off. Which alphas are tried depends on
/// nothing but the points and the parameters.
class AlphaSearch {
  public:
    /// As near as this share of what is wanted is near enough.
    static constexpr double kTolerance = 0.009;

    /// @param sample  the points in SampleCells, in the method's order
    AlphaSearch(const AlphaGoal& goal, std::vector<RankedPoint> sample);

    /// The next alpha to try, cloud units, > 0.
    double next();

    /// Takes how many points of the archive were kept with it.
    /// @return true if that is near enough, or no better is to be had
    bool told(std::uint64_t kept);

  private:
    double count(double log_alpha);
    double solve(double wanted);

    AlphaGoal goal_;
    std::vector<RankedPoint> sample_;
    std::map<double, double> counts_;  // of the sample, by log alpha
    double bias_ = 1;                  // kept of all over kept of the sample, beside its share
    double last_ = 0;
    int tries_ = 0;
};

}  // namespace knap
