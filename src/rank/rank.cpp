#include "rank/rank.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <span>
#include <utility>

#include "base/memory_gate.hpp"
#include "base/threads.hpp"
#include "knap/error.hpp"
#include "rank/brick_blocks.hpp"
#include "rank/curvature_pass.hpp"
#include "rank/spacing.hpp"
#include "store/ranked_run.hpp"

namespace knap {

namespace {

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

class Ranker {
  public:
    Ranker(const SourceTable& table, const std::vector<BrickFile>& bricks,
           const RankRequest& request, const std::function<void(std::uint64_t)>& advance)
        : table_(table),
          bricks_(bricks),
          request_(request),
          advance_(advance),
          gate_(request.budget_bytes) {}

    RankResult rank() {
        result_.spacing = measure_spacing();
        const FourierEstimator estimator(request_.curvature, result_.spacing);
        rank_bricks(estimator);
        settle_stragglers(estimator);
        result_.mean_curvature =
            result_.points == 0 ? 0 : curvature_sum_.value() / static_cast<double>(result_.points);
        return std::move(result_);
    }

  private:
    double measure_spacing() {
        const SpacingSample sample(table_.points() - table_.rejected());
        BrickSpacing total;
        parallel_tasks(bricks_.size(), [&](std::size_t i) {
            const BrickFile& file = bricks_[i];
            const auto ticket = admit(file);
            const BrickSpacing part =
                brick_spacing(block_brick(read_whole(file)), sample, file.brick.halo, table_.box());
            const std::scoped_lock lock(mutex_);
            total.sum.add(part.sum);
            total.count += part.count;
            total.stragglers.insert(total.stragglers.end(), part.stragglers.begin(),
                                    part.stragglers.end());
        });
        const CoreAccess cores = core_access([&](std::size_t i) {
            const PointBlocks core = block_brick(read_core(bricks_[i]));
            CorePoints points{{}, core.ids};
            points.positions.reserve(core.size());
            for (std::size_t place = 0; place < core.size(); ++place) {
                points.positions.push_back(core.position(place));
            }
            return points;
        });
        for (const auto& neighbours : gather(total.stragglers, 1, cores)) {
            if (!neighbours.empty()) {
                total.sum.add(std::sqrt(neighbours.front().squared_distance));
                ++total.count;
            }
        }
        return total.count == 0 ? 0 : total.sum.value() / static_cast<double>(total.count);
    }

    void rank_bricks(const FourierEstimator& estimator) {
        result_.bricks.resize(bricks_.size());
        straggler_runs_.resize(bricks_.size());
        parallel_tasks(bricks_.size(), [&](std::size_t i) {
            const BrickFile& file = bricks_[i];
            const auto ticket = admit(file);
            const PointBlocks brick = block_brick(read_whole(file));
            const RankedBrick ranked = rank_brick(brick, request_.curvature.neighbours, estimator,
                                                  file.brick.halo, table_.box());
            result_.bricks[i] = {{write_run(fmt::format("{:06}.run", i), ranked.points)},
                                 file.core_box,
                                 ranked.points.size()};
            if (!ranked.stragglers.empty()) {
                straggler_runs_[i] = write_stragglers(i, ranked.stragglers);
            }
            const std::scoped_lock lock(mutex_);
            remove(file.path);
            curvature_sum_.add(ranked.curvature_sum);
            result_.points += ranked.points.size();
            result_.merged += brick.merged;
            result_.stragglers += ranked.stragglers.size();
            advance_(file.core_points);
        });
    }

    // In groups that fit the budget; what a brick has in a group becomes one more run of it.
    void settle_stragglers(const FourierEstimator& estimator) {
        const auto k = static_cast<std::size_t>(request_.curvature.neighbours);
        const std::uint64_t each =
            2 * k * sizeof(FoundNeighbour) + sizeof(Straggler) + sizeof(RankedPoint);
        const auto most =
            static_cast<std::size_t>(std::max<std::uint64_t>(request_.budget_bytes / 4 / each, 1));
        StragglerGroup group;
        for (std::size_t brick = 0; brick < bricks_.size(); ++brick) {
            if (straggler_runs_[brick].empty()) {
                continue;
            }
            RunReader reader(straggler_runs_[brick], table_);
            for (std::vector<RankedPoint> block; reader.next(block);) {
                for (const RankedPoint& point : block) {
                    group.add(brick, {point.position, point.id, point.key});
                    if (group.points.size() == most) {
                        settle_group(group, k, estimator);
                        group = {};
                    }
                }
            }
        }
        settle_group(group, k, estimator);
        for (const auto& path : straggler_runs_) {
            if (!path.empty()) {
                remove(path);
            }
        }
    }

    void settle_group(const StragglerGroup& group, std::size_t k,
                      const FourierEstimator& estimator) {
        const CoreAccess cores = core_access([&](std::size_t i) { return load_ranked_core(i); });
        const auto found = gather(group.points, k, cores);
        for (std::size_t i = 0; i < group.bricks.size(); ++i) {
            const std::size_t begin = group.begins[i];
            const std::size_t end =
                i + 1 < group.begins.size() ? group.begins[i + 1] : group.points.size();
            const std::vector<RankedPoint> ranked =
                rank_stragglers(std::span(group.points).subspan(begin, end - begin),
                                std::span(found).subspan(begin, end - begin), estimator);
            for (const RankedPoint& point : ranked) {
                curvature_sum_.add(point.key);
            }
            RankedFiles& brick = result_.bricks[group.bricks[i]];
            brick.runs.push_back(
                write_run(fmt::format("{:06}-{}.run", group.bricks[i], brick.runs.size()), ranked));
            brick.points += ranked.size();
            result_.points += ranked.size();
        }
    }

    BrickPoints read_whole(const BrickFile& file) const {
        BrickPoints brick = read_brick_file(file.path, table_);
        check_count(file, "core", file.core_points, brick.core_count);
        check_count(file, "halo", file.halo_points, brick.ids.size() - brick.core_count);
        return brick;
    }

    BrickPoints read_core(const BrickFile& file) const {
        BrickPoints brick = read_brick_file(file.path, table_, false);
        check_count(file, "core", file.core_points, brick.core_count);
        return brick;
    }

    // A file that lost whole blocks has no checksum that fails.
    static void check_count(const BrickFile& file, const char* part, std::uint64_t expected,
                            std::uint64_t found) {
        if (found != expected) {
            throw StorageError(
                fmt::format("{}: scratch file is damaged: expected {} {} points, found {}",
                            file.path.string(), expected, part, found));
        }
    }

    // The core of a brick whose file is gone: its run and its stragglers.
    CorePoints load_ranked_core(std::size_t i) const {
        CorePoints core;
        core.positions.reserve(bricks_[i].core_points);
        core.ids.reserve(bricks_[i].core_points);
        for (const auto& path : {result_.bricks[i].runs.front(), straggler_runs_[i]}) {
            if (path.empty()) {
                continue;
            }
            RunReader reader(path, table_);
            for (std::vector<RankedPoint> block; reader.next(block);) {
                for (const RankedPoint& point : block) {
                    core.positions.push_back(point.position);
                    core.ids.push_back(point.id);
                }
            }
        }
        return core;
    }

    std::filesystem::path write_run(const std::string& name,
                                    const std::vector<RankedPoint>& points) const {
        std::filesystem::path path = request_.folder / name;
        request_.on_scratch(static_cast<std::int64_t>(knap::write_run(path, table_, points)));
        return path;
    }

    void remove(const std::filesystem::path& path) const {
        const auto bytes = static_cast<std::int64_t>(std::filesystem::file_size(path));
        std::filesystem::remove(path);
        request_.on_scratch(-bytes);
    }

    std::filesystem::path write_stragglers(std::size_t i,
                                           const std::vector<Straggler>& stragglers) const {
        std::vector<RankedPoint> by_bound;
        by_bound.reserve(stragglers.size());
        for (const Straggler& straggler : stragglers) {
            by_bound.push_back({straggler.bound_squared, straggler.id, straggler.position});
        }
        return write_run(fmt::format("{:06}.stragglers", i), by_bound);
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
    const RankRequest& request_;
    const std::function<void(std::uint64_t)>& advance_;
    MemoryGate gate_;
    std::mutex mutex_;
    std::vector<std::filesystem::path> straggler_runs_;
    ExactSum curvature_sum_;
    RankResult result_;
};

}  // namespace

std::uint64_t rank_bytes_per_point() {
    // The blocks, a curvature, a place in the order and a ranked point each; before that, making
    // the blocks.
    return std::max<std::uint64_t>(
        PointBlocks::kBytesPerPoint + 2 * sizeof(double) + sizeof(double) + sizeof(RankedPoint),
        PointBlocks::kMakingBytesPerPoint);
}

RankResult rank(const SourceTable& table, const std::vector<BrickFile>& bricks,
                const RankRequest& request, const std::function<void(std::uint64_t)>& advance) {
    return Ranker(table, bricks, request, advance).rank();
}

}  // namespace knap
