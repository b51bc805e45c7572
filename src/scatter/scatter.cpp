#include "scatter/scatter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <mutex>

#include "input/stream.hpp"
#include "knap/error.hpp"
#include "store/brick_file.hpp"

namespace knap {

namespace {

constexpr std::size_t kChunkPoints = std::size_t{1} << 16;
constexpr std::uint64_t kRangePoints = std::uint64_t{1} << 20;
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
        : table_(table), plan_(plan) {
        buffer_bytes_ = static_cast<std::size_t>(
            buffer_size(plan.bricks.size(), request.threads, request.budget_bytes));
        for (std::size_t i = 0; i < plan.bricks.size(); ++i) {
            paths_.push_back(request.folder / fmt::format("{:06}.brick", i));
            create_brick_file(paths_.back(), table);
        }
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

    std::vector<BrickFile> files(const std::vector<Worker>& workers) const {
        std::vector<BrickFile> files;
        for (std::size_t brick = 0; brick < paths_.size(); ++brick) {
            BrickFile file{.path = paths_[brick], .brick = plan_.bricks[brick], .core_box = {}};
            file.bytes = std::filesystem::file_size(paths_[brick]);
            for (const Worker& worker : workers) {
                const Buffers& part = worker.buffers[brick];
                file.core_box.extend(part.core_box);
                file.core_points += part.core_points;
                file.halo_points += part.halo_points;
            }
            files.push_back(std::move(file));
        }
        return files;
    }

  private:
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
    std::size_t buffer_bytes_ = 0;
    std::vector<std::filesystem::path> paths_;
    std::array<std::mutex, kLocks> locks_;
};

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
    const std::vector<SourceInfo> infos = table.infos();
    const std::vector<SourceRange> ranges = cut_into_ranges(infos, kRangePoints);
    stream_ranges(infos, ranges, request.threads, kChunkPoints,
                  [&](std::size_t slot, std::size_t range, const Chunk& chunk) {
                      const std::size_t source = ranges[range].source;
                      PointId id = table.sources()[source].first_id + chunk.first;
                      for (const Vec3& p : chunk.positions) {
                          if (is_finite(p)) {
                              scatterer.add(workers[slot], source, id, p);
                          }
                          ++id;
                      }
                      advance(chunk.positions.size());
                  });
    for (Worker& worker : workers) {
        scatterer.flush(worker);
    }
    return scatterer.files(workers);
}

std::uint64_t scatter_buffer_bytes(std::uint64_t bricks, int threads, std::uint64_t budget_bytes) {
    return buffer_count(bricks, threads) * buffer_size(bricks, threads, budget_bytes);
}

}  // namespace knap
