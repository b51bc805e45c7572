#include "rank/rank.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>

#include "base/memory_gate.hpp"
#include "base/threads.hpp"
#include "knap/error.hpp"
#include "rank/brick_blocks.hpp"
#include "rank/curvature_pass.hpp"
#include "rank/held_bricks.hpp"
#include "rank/spacing.hpp"
#include "store/ranked_run.hpp"

namespace knap {

namespace {

// Where less than this share of the points is sampled, most are not needed for the spacing.
constexpr double kSparse = 1.0 / 64;

/// Stragglers of some consecutive bricks.
struct StragglerGroup {
    std::vector<Straggler> points;
    std::vector<std::size_t> bricks;  // ascending
    std::vector<std::size_t> begins;  // place of the first point of each

    void add(std::size_t brick, const Straggler& point) {
        if (bricks.empty() || bricks.back() != brick) {
            bricks.push_back(brick);
            begins.push_back(points.size());
        }
        points.push_back(point);
    }
};

HeldBricks bricks_to_hold(const std::vector<BrickFile>& bricks, const RankRequest& request) {
    std::vector<std::uint64_t> points;
    points.reserve(bricks.size());
    for (const BrickFile& file : bricks) {
        points.push_back(file.core_points + file.halo_points);
    }
    return held_bricks(points, request.threads, request.budget_bytes);
}

}  // namespace

class Ranking::Passes {
  public:
    Passes(const SourceTable& table, const std::vector<BrickFile>& bricks, RankRequest request)
        : table_(table),
          bricks_(bricks),
          request_(std::move(request)),
          held_(bricks_to_hold(bricks, request_).count),
          gate_(request_.budget_bytes - bricks_to_hold(bricks, request_).bytes) {}

    double spacing(const Advance& advance) {
        if (request_.state.spacing) {
            advance(table_.points() - table_.rejected());
            return *request_.state.spacing;
        }
        const double spacing = measure_spacing(advance);
        request_.on_spacing(spacing);
        return spacing;
    }

    RankResult rank(double spacing, const Advance& advance) {
        done_ = request_.state.bricks;
        done_.resize(bricks_.size());
        result_.spacing = spacing;
        const CurvatureEstimator estimator(request_.curvature, spacing, request_.frames);
        rank_bricks(estimator, advance);
        const SettledStragglers settled = stragglers(estimator);
        remove_straggler_runs();
        collect(settled);
        return std::move(result_);
    }

  private:
    // A damaged file is made again, once.
    template <typename Read>
    auto again_if_damaged(std::size_t i, const Read& read) const {
        try {
            return read();
        } catch (const StorageError& error) {
            if (!request_.remake) {
                throw;
            }
            request_.remake(i, error.what());
        }
        return read();
    }

    double measure_spacing(const Advance& advance) {
        const SpacingSample sample(table_.points() - table_.rejected());
        BrickSpacing total;
        parallel_tasks(bricks_.size(), [&](std::size_t i) {
            const BrickFile& file = bricks_[i];
            const auto ticket = admit(file);
            const BrickSpacing part = spacing_of(i, sample);
            const std::scoped_lock lock(mutex_);
            advance(file.core_points);
            total.sum.add(part.sum);
            total.count += part.count;
            total.stragglers.insert(total.stragglers.end(), part.stragglers.begin(),
                                    part.stragglers.end());
        });
        const CoreAccess cores =
            core_access([&](std::size_t i) { return points_of(load(i, false)); });
        for (const auto& neighbours : gather(total.stragglers, 1, cores)) {
            if (!neighbours.empty()) {
                total.sum.add(std::sqrt(neighbours.front().squared_distance));
                ++total.count;
            }
        }
        return total.count == 0 ? 0 : total.sum.value() / static_cast<double>(total.count);
    }

    BrickSpacing spacing_of(std::size_t i, const SpacingSample& sample) {
        const Box& halo = bricks_[i].brick.halo;
        if (i >= held_.size() && sample.share() < kSparse) {
            return sparse_spacing(
                again_if_damaged(i, [&] { return load_points(bricks_[i], table_); }), sample, halo,
                table_.box());
        }
        PointBlocks brick = load(i);
        BrickSpacing spacing = brick_spacing(brick, sample, halo, table_.box());
        if (i < held_.size()) {
            held_[i] = std::move(brick);
        }
        return spacing;
    }

    void rank_bricks(const CurvatureEstimator& estimator, const Advance& advance) {
        parallel_tasks(bricks_.size(), [&](std::size_t i) {
            const BrickFile& file = bricks_[i];
            if (!done_[i]) {
                BrickRank ranked = rank_one(i, estimator, advance);
                const std::scoped_lock lock(mutex_);
                request_.on_brick(i, ranked);
                done_[i] = std::move(ranked);
                advance(done_[i]->merged);
            } else {
                advance(file.core_points);
            }
            const std::scoped_lock lock(mutex_);
            remove(file.path);
        });
    }

    BrickRank rank_one(std::size_t i, const CurvatureEstimator& estimator, const Advance& advance) {
        const BrickFile& file = bricks_[i];
        const auto ticket = admit(file);
        const PointBlocks brick = take_blocks(i);
        BrickRank result;
        result.run = request_.folder / fmt::format("{:06}.run", i);
        RunWriter run(result.run, table_, {.frames = request_.frames});
        const RankedBrick ranked = rank_brick(
            brick, request_.curvature.neighbours, estimator, file.brick.halo, table_.box(),
            [&](std::span<const RankedPoint> points) {
                for (const RankedPoint& point : points) {
                    run.add(point);
                }
            },
            advance);
        request_.on_scratch(static_cast<std::int64_t>(run.finish()));
        if (!ranked.stragglers.empty()) {
            result.straggler_run = write_stragglers(i, ranked.stragglers);
        }
        result.points = ranked.points;
        result.stragglers = ranked.stragglers.size();
        result.merged = brick.merged;
        result.curvature_sum = ranked.curvature_sum;
        return result;
    }

    PointBlocks take_blocks(std::size_t i) {
        if (i < held_.size() && held_[i]) {
            return *std::exchange(held_[i], std::nullopt);
        }
        return load(i);
    }

    SettledStragglers stragglers(const CurvatureEstimator& estimator) {
        if (request_.state.stragglers) {
            return *request_.state.stragglers;
        }
        SettledStragglers settled = settle_stragglers(estimator);
        request_.on_stragglers(settled);
        return settled;
    }

    // In groups that fit the budget; what a brick has in a group becomes one more run of it.
    SettledStragglers settle_stragglers(const CurvatureEstimator& estimator) {
        const auto k = static_cast<std::size_t>(request_.curvature.neighbours);
        const std::uint64_t each =
            2 * k * sizeof(FoundNeighbour) + sizeof(Straggler) + sizeof(RankedPoint);
        const auto most =
            static_cast<std::size_t>(std::max<std::uint64_t>(request_.budget_bytes / 4 / each, 1));
        SettledStragglers settled;
        StragglerGroup group;
        for (std::size_t brick = 0; brick < bricks_.size(); ++brick) {
            if (done_[brick]->straggler_run.empty()) {
                continue;
            }
            for (const RankedPoint& point :
                 read_ranked(brick, {done_[brick]->straggler_run}, estimator)) {
                group.add(brick, {point.position, point.id, point.key});
                if (group.points.size() == most) {
                    settle_group(group, k, estimator, settled);
                    group = {};
                }
            }
        }
        settle_group(group, k, estimator, settled);
        return settled;
    }

    void settle_group(const StragglerGroup& group, std::size_t k,
                      const CurvatureEstimator& estimator, SettledStragglers& settled) {
        const CoreAccess cores =
            core_access([&](std::size_t i) { return load_ranked_core(i, estimator); });
        const auto found = gather(group.points, k, cores);
        for (std::size_t i = 0; i < group.bricks.size(); ++i) {
            const std::size_t begin = group.begins[i];
            const std::size_t end =
                i + 1 < group.begins.size() ? group.begins[i + 1] : group.points.size();
            const std::vector<RankedPoint> ranked =
                rank_stragglers(std::span(group.points).subspan(begin, end - begin),
                                std::span(found).subspan(begin, end - begin), estimator);
            for (const RankedPoint& point : ranked) {
                settled.curvature_sum.add(point.key);
            }
            const std::size_t brick = group.bricks[i];
            const std::string name = fmt::format("{:06}-{}.run", brick, settled.runs.size());
            settled.runs.push_back(
                {brick, write_run(name, ranked, request_.frames), ranked.size()});
        }
    }

    void remove_straggler_runs() const {
        for (const auto& brick : done_) {
            if (!brick->straggler_run.empty()) {
                remove(brick->straggler_run);
            }
        }
    }

    void collect(const SettledStragglers& settled) {
        ExactSum sum = settled.curvature_sum;
        for (std::size_t i = 0; i < bricks_.size(); ++i) {
            const BrickRank& brick = *done_[i];
            result_.bricks.push_back({{brick.run}, bricks_[i].core_box, brick.points});
            result_.points += brick.points;
            result_.merged += brick.merged;
            result_.stragglers += brick.stragglers;
            sum.add(brick.curvature_sum);
        }
        for (const SettledStragglers::Run& run : settled.runs) {
            result_.bricks[run.brick].runs.push_back(run.path);
            result_.bricks[run.brick].points += run.points;
            result_.points += run.points;
        }
        result_.mean_curvature =
            result_.points == 0 ? 0 : sum.value() / static_cast<double>(result_.points);
    }

    PointBlocks load(std::size_t i, bool with_halo = true) const {
        return again_if_damaged(i, [&] { return load_brick(bricks_[i], table_, with_halo); });
    }

    // The core of a brick whose file is gone: its run and its stragglers.
    CorePoints load_ranked_core(std::size_t i, const CurvatureEstimator& estimator) {
        CorePoints core;
        core.positions.reserve(bricks_[i].core_points);
        core.ids.reserve(bricks_[i].core_points);
        const std::vector<std::filesystem::path> runs{done_[i]->run, done_[i]->straggler_run};
        for (const RankedPoint& point : read_ranked(i, runs, estimator)) {
            core.positions.push_back(point.position);
            core.ids.push_back(point.id);
        }
        return core;
    }

    // A brick with a damaged run is ranked once more, from its sources.
    std::vector<RankedPoint> read_ranked(std::size_t i,
                                         const std::vector<std::filesystem::path>& runs,
                                         const CurvatureEstimator& estimator) {
        try {
            return read_runs(runs);
        } catch (const StorageError& error) {
            if (!request_.remake) {
                throw;
            }
            request_.remake(i, error.what());
        }
        rank_one(i, estimator, [](std::uint64_t) {});
        remove(bricks_[i].path);
        return read_runs(runs);
    }

    std::vector<RankedPoint> read_runs(const std::vector<std::filesystem::path>& runs) const {
        std::vector<RankedPoint> points;
        for (const auto& path : runs) {
            if (!path.empty()) {
                RunReader reader(path, table_);
                for (std::vector<RankedPoint> block; reader.next(block);) {
                    points.insert(points.end(), block.begin(), block.end());
                }
            }
        }
        return points;
    }

    std::filesystem::path write_run(const std::string& name, const std::vector<RankedPoint>& points,
                                    bool frames) const {
        std::filesystem::path path = request_.folder / name;
        request_.on_scratch(
            static_cast<std::int64_t>(knap::write_run(path, table_, points, {.frames = frames})));
        return path;
    }

    // An earlier run may have removed it already.
    void remove(const std::filesystem::path& path) const {
        std::error_code absent;
        const std::uint64_t bytes = std::filesystem::file_size(path, absent);
        if (!absent) {
            std::filesystem::remove(path);
            request_.on_scratch(-static_cast<std::int64_t>(bytes));
        }
    }

    std::filesystem::path write_stragglers(std::size_t i,
                                           const std::vector<Straggler>& stragglers) const {
        std::vector<RankedPoint> by_bound;
        by_bound.reserve(stragglers.size());
        for (const Straggler& straggler : stragglers) {
            by_bound.push_back({straggler.bound_squared, straggler.id, straggler.position});
        }
        return write_run(fmt::format("{:06}.stragglers", i), by_bound, false);
    }

    CoreAccess core_access(std::function<CorePoints(std::size_t)> load) const {
        CoreAccess cores;
        for (const BrickFile& file : bricks_) {
            cores.boxes.push_back(file.core_box);
        }
        cores.load = std::move(load);
        return cores;
    }

    MemoryGate::Ticket admit(const BrickFile& file) {
        return gate_.admit((file.core_points + file.halo_points) * rank_bytes_per_point());
    }

    const SourceTable& table_;
    const std::vector<BrickFile>& bricks_;
    RankRequest request_;
    std::vector<std::optional<PointBlocks>> held_;
    MemoryGate gate_;
    std::mutex mutex_;
    std::vector<std::optional<BrickRank>> done_;
    RankResult result_;
};

Ranking::Ranking(const SourceTable& table, const std::vector<BrickFile>& bricks,
                 RankRequest request)
    : passes_(std::make_unique<Passes>(table, bricks, std::move(request))) {}

Ranking::~Ranking() = default;

double Ranking::measure_spacing(const Advance& advance) {
    return passes_->spacing(advance);
}

RankResult Ranking::rank(double spacing, const Advance& advance) {
    return passes_->rank(spacing, advance);
}

}  // namespace knap
