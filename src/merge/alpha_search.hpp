#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "knap/geometry.hpp"
#include "knap/params.hpp"
#include "store/ranked_run.hpp"

namespace knap {

/// Some of an archive's points, which may foretell how many of all are kept: those in some cells of
/// a lattice, chosen by a hash, so that which they are does not depend on how the archive is cut.
/// Of a small archive all points.
class SampleCells {
  public:
    /// @param points   counted points of the archive
    /// @param spacing  mean distance to the nearest other point, cloud units
    SampleCells(std::uint64_t points, double spacing);

    bool contains(const Vec3& p) const;

    /// More points than this are no sample: where cells are few or uneven. What foretells nothing
    /// is thrown away by AlphaSearch.
    std::uint64_t most_points() const { return most_points_; }

  private:
    double cells_per_unit_ = 0;    // 0: all points
    std::uint64_t most_hash_ = 0;  // of a cell in the sample
    std::uint64_t most_points_ = 0;
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

/// Looks for the alpha for which a wanted number of points is kept. A sample foretells the number
/// for a first walk over all points; the walks say how far it is off, and then where to look.
/// Which alphas are tried depends on nothing but the points and the parameters.
class AlphaSearch {
  public:
    /// As near as this share of what is wanted is near enough.
    static constexpr double kTolerance = 0.009;

    /// @param sample  the points in SampleCells, in the method's order; fewer than it takes to
    ///                foretell anything, or too many: they are not used
    AlphaSearch(const AlphaGoal& goal, std::vector<RankedPoint> sample);

    /// The next alpha to try, cloud units, > 0; while not done().
    double next();

    /// Takes how many points of the archive a walk has kept.
    void told(double alpha, std::uint64_t kept);

    /// The last walk is near enough, or none was nearer and no more are worth it.
    bool done() const { return done_; }

    /// Bytes that the sample takes.
    std::uint64_t memory_bytes() const { return sample_.capacity() * sizeof(RankedPoint); }

  private:
    double count(double log_alpha);
    double solve_in_sample(double wanted, double start);
    double solve_in_walks() const;

    AlphaGoal goal_;
    std::vector<RankedPoint> sample_;
    double share_ = 1;                 // of all points that the sample has
    std::map<double, double> counts_;  // of the sample, by log alpha
    std::map<double, double> walks_;   // of all points, by log alpha
    double last_ = 0;                  // log of the alpha tried last
    std::optional<double> best_again_;
    int tries_ = 0;
    bool done_ = false;
};

}  // namespace knap
