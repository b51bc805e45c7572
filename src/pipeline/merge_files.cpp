#include "pipeline/merge_files.hpp"

#include <algorithm>
#include <iterator>
#include <system_error>
#include <utility>

#include "knap/error.hpp"
#include "store/ranked_run.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;

constexpr const char* kMerge = "merge";

}  // namespace

MergeFiles::MergeFiles(
    ScratchFolder& scratch, JobLog& log, const SourceTable& table, std::uint64_t budget_bytes,
    bool frames, const std::vector<RankedFiles>& bricks,
    std::function<std::vector<RankedPoint>(std::size_t, const std::string& why)> remake)
    : scratch_(scratch),
      log_(log),
      table_(table),
      budget_bytes_(budget_bytes),
      frames_(frames),
      bricks_(bricks),
      remake_(std::move(remake)) {}

std::vector<RankedPart> MergeFiles::parts() {
    std::vector<RankedPart> parts;
    for (std::size_t i = 0; i < bricks_.size(); ++i) {
        RankedPart part;
        part.box = bricks_[i].box;
        part.points = bricks_[i].points;
        part.remake = [this, i](const std::string& why) { return remake_(i, why); };
        if (const auto* settled = log_.find(kMerge, number_name(i))) {
            remove_runs(i);
            const std::uint64_t open = settled->at("open");
            part.settled = [this, i, open] { return load(i, open); };
        } else {
            for (const fs::path& path : bricks_[i].runs) {
                part.runs.push_back(std::make_unique<RunReader>(path, table_));
            }
        }
        parts.push_back(std::move(part));
    }
    return parts;
}

std::function<std::unique_ptr<RankedStream>(std::size_t, std::span<const RankedPoint>,
                                            std::vector<RankedPoint>)>
MergeFiles::keeper() {
    return [this](std::size_t brick, std::span<const RankedPoint> kept,
                  const std::vector<RankedPoint>& open) { return keep(brick, kept, open); };
}

std::unique_ptr<RankedStream> MergeFiles::keep(std::size_t brick, std::span<const RankedPoint> kept,
                                               const std::vector<RankedPoint>& open) {
    const std::uint64_t bytes = write_run(kept_path(brick), table_, kept);
    std::unique_ptr<RankedStream> left = put_away(brick, open);
    const std::scoped_lock lock(mutex_);
    scratch_.grew_by(static_cast<std::int64_t>(bytes));
    log_.record(kMerge, number_name(brick), {{"kept", kept.size()}, {"open", open.size()}});
    remove_runs(brick);
    return left;
}

std::function<std::unique_ptr<RankedStream>(std::size_t, std::span<const RankedPoint>,
                                            std::vector<RankedPoint>)>
MergeFiles::attempt_keeper() {
    return [this](std::size_t brick, std::span<const RankedPoint> /*kept*/,
                  const std::vector<RankedPoint>& open) {
        remove(open_path(brick));
        return put_away(brick, open);
    };
}

std::unique_ptr<RankedStream> MergeFiles::put_away(std::size_t brick,
                                                   const std::vector<RankedPoint>& open) {
    if (open.empty()) {
        return nullptr;
    }
    scratch_.grew_by(
        static_cast<std::int64_t>(write_run(open_path(brick), table_, open, open_layout())));
    return std::make_unique<RunReader>(open_path(brick), table_);
}

SettledPart MergeFiles::load(std::size_t brick, std::uint64_t open_points) const {
    SettledPart part;
    part.kept = read_run(kept_path(brick));
    part.open_points = open_points;
    if (open_points > 0) {
        // Read once beforehand, while the brick can still be made again: it is short.
        read_run(open_path(brick));
        part.open = std::make_unique<RunReader>(open_path(brick), table_);
    }
    return part;
}

std::vector<RankedPoint> MergeFiles::read_run(const fs::path& path) const {
    std::vector<RankedPoint> points;
    RunReader reader(path, table_);
    for (std::vector<RankedPoint> block; reader.next(block);) {
        points.insert(points.end(), block.begin(), block.end());
    }
    return points;
}

std::function<void(std::span<const RankedPoint>)> MergeFiles::walk_keeper() {
    walked_.emplace(walked_path(), table_);
    return [this](std::span<const RankedPoint> kept) {
        for (const RankedPoint& point : kept) {
            walked_->add(point);
        }
    };
}

void MergeFiles::finish_walk() {
    scratch_.grew_by(static_cast<std::int64_t>(walked_->finish()));
    walked_.reset();
}

void MergeFiles::remove_undecided() {
    for (std::size_t i = 0; i < bricks_.size(); ++i) {
        remove_runs(i);
        remove(open_path(i));
    }
}

std::vector<fs::path> MergeFiles::kept_runs() const {
    std::vector<fs::path> runs{walked_path()};
    for (std::size_t i = 0; i < bricks_.size(); ++i) {
        runs.push_back(kept_path(i));
    }
    return runs;
}

std::vector<fs::path> MergeFiles::ranked_runs() const {
    std::vector<fs::path> runs;
    for (const RankedFiles& brick : bricks_) {
        runs.insert(runs.end(), brick.runs.begin(), brick.runs.end());
    }
    return runs;
}

std::vector<RankedPoint> MergeFiles::ranked_points(
    std::size_t brick, const std::function<bool(const RankedPoint&)>& wanted) const {
    std::vector<RankedPoint> points;
    read_ranked(brick, [&] {
        points.clear();
        return [&](std::span<const RankedPoint> some) {
            std::copy_if(some.begin(), some.end(), std::back_inserter(points), wanted);
        };
    });
    return points;
}

void MergeFiles::read_ranked(std::size_t brick, const std::function<TakeRanked()>& begin) const {
    try {
        const TakeRanked take = begin();
        for (const fs::path& run : bricks_[brick].runs) {
            RunReader reader(run, table_);
            for (std::vector<RankedPoint> block; reader.next(block);) {
                take(block);
            }
        }
    } catch (const StorageError& error) {
        begin()(remake_(brick, error.what()));
    }
}

void MergeFiles::remove_open() {
    for (std::size_t i = 0; i < bricks_.size(); ++i) {
        remove(open_path(i));
    }
}

fs::path MergeFiles::kept_path(std::size_t brick) const {
    return scratch_.path() / (number_name(brick) + ".kept");
}

fs::path MergeFiles::open_path(std::size_t brick) const {
    return scratch_.path() / (number_name(brick) + ".open");
}

fs::path MergeFiles::walked_path() const {
    return scratch_.path() / "walked.kept";
}

void MergeFiles::remove_runs(std::size_t brick) {
    for (const fs::path& path : bricks_[brick].runs) {
        remove(path);
    }
}

// An earlier run may have removed it already.
void MergeFiles::remove(const fs::path& path) {
    std::error_code absent;
    const std::uint64_t bytes = fs::file_size(path, absent);
    if (!absent) {
        fs::remove(path, absent);
        scratch_.grew_by(-static_cast<std::int64_t>(bytes));
    }
}

// What bricks leave open is read together, a block of each at a time.
RunLayout MergeFiles::open_layout() const {
    constexpr std::uint64_t kSmallest = 64;
    const std::uint64_t share = budget_bytes_ / 8 / bricks_.size() / (2 * sizeof(RankedPoint));
    return {.block_points = static_cast<std::size_t>(
                std::clamp<std::uint64_t>(share, kSmallest, kMostBlockPoints)),
            .frames = frames_};
}

}  // namespace knap
