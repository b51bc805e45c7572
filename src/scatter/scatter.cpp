#include "scatter/scatter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <span>
#include <system_error>

#include "base/threads.hpp"
#include "input/staged_reader.hpp"
#include "input/stream.hpp"
#include "knap/error.hpp"
#include "store/brick_file.hpp"

namespace knap {

namespace {

constexpr std::size_t kChunkPoints = std::size_t{1} << 16;
constexpr std::uint64_t kRangePoints = std::uint64_t{1} << 20;
// Parts between two commits: what a job that is stopped does again at most.
constexpr std::size_t kPartsPerCommit = 32;
constexpr std::uint64_t kSmallestBuffer = std::uint64_t{2} << 10;
constexpr std::uint64_t kLargestBuffer = std::uint64_t{256} << 10;
constexpr std::size_t kLocks = 64;

// Each thread has a buffer for the core and one for the halo of each brick.
std::uint64_t buffer_count(std::uint64_t bricks, int threads) {
    return static_cast<std::uint64_t>(2 * threads) * std::max<std::uint64_t>(bricks, 1);
}

std::uint64_t buffer_size(std::uint64_t bricks, int threads, std::uint64_t budget_bytes) {
    return std::clamp(budget_bytes / buffer_count(bricks, threads), kSmallestBuffer,
                      kLargestBuffer);
}

// What one thread holds for one brick.
struct Buffers {
    Buffers() { halo.part = BrickPart::kHalo; }

    BrickBlock core;
    BrickBlock halo;
    Box core_box;
    std::uint64_t core_points = 0;
    std::uint64_t halo_points = 0;
};

struct Worker {
    BrickMap::Reader lookup;
    std::vector<Buffers> buffers;
};

class Scatterer {
  public:
    Scatterer(const SourceTable& table, const BrickPlan& plan, const ScatterRequest& request)
        : table_(table), plan_(plan), before_(request.state) {
        buffer_bytes_ = static_cast<std::size_t>(
            buffer_size(plan.bricks.size(), request.threads, request.budget_bytes));
        for (std::size_t i = 0; i < plan.bricks.size(); ++i) {
            paths_.push_back(brick_path(request.folder, i));
            if (before_.parts_done == 0) {
                create_brick_file(paths_.back(), table);
            } else {
                cut_back(paths_.back(), before_.bricks.at(i).bytes);
            }
        }
        before_.bricks.resize(plan.bricks.size());
    }

    void add(Worker& worker, std::size_t source, PointId id, const Vec3& position) {
        const std::span<const std::uint32_t> bricks = worker.lookup.bricks_at(position);
        if (bricks.empty()) {
            throw InputError(
                fmt::format("{}: the file has changed since the survey: point {} is new",
                            table_.sources()[source].info.path.string(),
                            id - table_.sources()[source].first_id));
        }
        Buffers& owner = worker.buffers[bricks.front()];
        owner.core_box.extend(position);
        ++owner.core_points;
        append(owner.core, bricks.front(), source, id, position);
        for (const std::uint32_t brick : bricks.subspan(1)) {
            if (plan_.bricks[brick].halo.contains(position)) {
                Buffers& other = worker.buffers[brick];
                ++other.halo_points;
                append(other.halo, brick, source, id, position);
            }
        }
    }

    void flush(Worker& worker) {
        for (std::size_t brick = 0; brick < worker.buffers.size(); ++brick) {
            Buffers& buffers = worker.buffers[brick];
            flush(buffers.core, brick);
            flush(buffers.halo, brick);
        }
    }

    /// What is in the files once all workers are flushed.
    ScatterState state(const std::vector<Worker>& workers, std::uint64_t parts_done) const {
        ScatterState state = before_;
        state.parts_done = parts_done;
        for (std::size_t brick = 0; brick < paths_.size(); ++brick) {
            ScatterState::Tally& tally = state.bricks[brick];
            tally.bytes = std::filesystem::file_size(paths_[brick]);
            for (const Worker& worker : workers) {
                const Buffers& part = worker.buffers[brick];
                tally.core_box.extend(part.core_box);
                tally.core_points += part.core_points;
                tally.halo_points += part.halo_points;
            }
        }
        return state;
    }

  private:
    // What was appended after the last commit is appended again.
    static void cut_back(const std::filesystem::path& path, std::uint64_t bytes) {
        std::error_code error;
        const std::uint64_t size = std::filesystem::file_size(path, error);
        if (!error && size >= bytes) {
            std::filesystem::resize_file(path, bytes, error);
        }
        if (error || size < bytes) {
            throw StorageError(
                fmt::format("{}: scratch file is damaged: expected {} bytes, {}", path.string(),
                            bytes, error ? error.message() : fmt::format("found {}", size)));
        }
    }

    void append(BrickBlock& block, std::size_t brick, std::size_t source, PointId id,
                const Vec3& position) {
        if (block.count > 0 && (block.source != source || block.size_bytes() >= buffer_bytes_)) {
            flush(block, brick);
        }
        block.source = static_cast<std::uint32_t>(source);
        block.add(table_, id, position);
    }

    void flush(BrickBlock& block, std::size_t brick) {
        if (block.count == 0) {
            return;
        }
        {
            const std::scoped_lock lock(locks_[brick % kLocks]);
            append_block(paths_[brick], block);
        }
        block.clear();
    }

    const SourceTable& table_;
    const BrickPlan& plan_;
    ScatterState before_;
    std::size_t buffer_bytes_ = 0;
    std::vector<std::filesystem::path> paths_;
    std::array<std::mutex, kLocks> locks_;
};

// Parts between two commits. Positions are held until their points are committed, so of an archive
// that has them each takes a small share.
std::size_t parts_per_commit(const std::vector<ArchivePart>& parts, int threads) {
    const bool staged = std::any_of(parts.begin(), parts.end(),
                                    [](const ArchivePart& part) { return part.staged != nullptr; });
    const auto share = static_cast<std::size_t>(static_cast<double>(parts.size()) * kPositionsLeft);
    const std::size_t fewest = 2 * static_cast<std::size_t>(threads);
    return staged ? std::clamp(share, fewest, std::max(fewest, kPartsPerCommit)) : kPartsPerCommit;
}

// An earlier run may have removed them already.
void remove_positions(std::span<const ArchivePart> parts) {
    for (const ArchivePart& part : parts) {
        if (part.staged != nullptr) {
            std::error_code ignored;
            std::filesystem::remove(part.staged->path, ignored);
        }
    }
}

}  // namespace

std::vector<BrickFile> scatter(const SourceTable& table, const BrickPlan& plan, const BrickMap& map,
                               const ScatterRequest& request,
                               const std::function<void(std::uint64_t)>& advance) {
    Scatterer scatterer(table, plan, request);
    std::vector<Worker> workers;
    workers.reserve(static_cast<std::size_t>(std::max(request.threads, 0)));
    for (int i = 0; i < request.threads; ++i) {
        workers.push_back({BrickMap::Reader(map), std::vector<Buffers>(plan.bricks.size())});
    }
    const StagedReader reader(table, &request.staged, {}, request.note);
    const std::vector<ArchivePart> parts = reader.parts(kRangePoints);
    const std::size_t step = parts_per_commit(parts, request.threads);
    ScatterState state = request.state;
    const auto done = std::span(parts).first(state.parts_done);
    const auto remove = [&](std::span<const ArchivePart> committed) {
        if (!request.staged.stays) {
            remove_positions(committed);
        }
    };
    remove(done);
    advance(points_of(table, done));
    do {
        const std::size_t first = state.parts_done;
        const std::size_t count = std::min(step, parts.size() - first);
        run_tasks(count, request.threads, [&](std::size_t i, std::size_t slot) {
            const std::size_t source = parts[first + i].range.source;
            const std::span<const ArchivePart> part = std::span(parts).subspan(first + i, 1);
            reader.stream(part, 1, kChunkPoints, [&](std::size_t, std::size_t, const Chunk& chunk) {
                PointId id = table.sources()[source].first_id + chunk.first;
                for (const Vec3& p : chunk.positions) {
                    if (is_finite(p)) {
                        scatterer.add(workers[slot], source, id, p);
                    }
                    ++id;
                }
                advance(chunk.positions.size());
            });
        });
        for (Worker& worker : workers) {
            scatterer.flush(worker);
        }
        state = scatterer.state(workers, first + count);
        request.commit(state);
        remove(std::span(parts).subspan(first, count));
    } while (state.parts_done < parts.size());

    return brick_files(request.folder, plan, state);
}

void scatter_again(const SourceTable& table, const BrickPlan& plan, std::size_t brick,
                   const std::filesystem::path& folder, int threads) {
    const Brick& wanted = plan.bricks[brick];
    const std::filesystem::path path = brick_path(folder, brick);
    create_brick_file(path, table);
    const std::vector<SourceInfo> infos = table.infos();
    const std::vector<SourceRange> ranges = cut_into_ranges(infos, kRangePoints);
    std::mutex mutex;
    stream_ranges(infos, ranges, threads, kChunkPoints,
                  [&](std::size_t, std::size_t range, const Chunk& chunk) {
                      BrickBlock core;
                      BrickBlock halo;
                      halo.part = BrickPart::kHalo;
                      const std::size_t source = ranges[range].source;
                      core.source = halo.source = static_cast<std::uint32_t>(source);
                      PointId id = table.sources()[source].first_id + chunk.first;
                      for (const Vec3& p : chunk.positions) {
                          if (is_finite(p) && wanted.core.contains(voxel_of(p, plan.voxel_size))) {
                              core.add(table, id, p);
                          } else if (is_finite(p) && wanted.halo.contains(p)) {
                              halo.add(table, id, p);
                          }
                          ++id;
                      }
                      const std::scoped_lock lock(mutex);
                      for (const BrickBlock* block : {&core, &halo}) {
                          if (block->count > 0) {
                              append_block(path, *block);
                          }
                      }
                  });
}

std::vector<BrickFile> brick_files(const std::filesystem::path& folder, const BrickPlan& plan,
                                   const ScatterState& state) {
    std::vector<BrickFile> files;
    for (std::size_t i = 0; i < plan.bricks.size(); ++i) {
        const ScatterState::Tally& tally = state.bricks.at(i);
        files.push_back({.path = brick_path(folder, i),
                         .brick = plan.bricks[i],
                         .core_box = tally.core_box,
                         .core_points = tally.core_points,
                         .halo_points = tally.halo_points,
                         .bytes = tally.bytes});
    }
    return files;
}

std::filesystem::path brick_path(const std::filesystem::path& folder, std::size_t brick) {
    return folder / fmt::format("{:06}.brick", brick);
}

std::uint64_t scatter_buffer_bytes(std::uint64_t bricks, int threads, std::uint64_t budget_bytes) {
    return buffer_count(bricks, threads) * buffer_size(bricks, threads, budget_bytes);
}

}  // namespace knap
