#include "emit/scratch_tiles.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "emit/kept_file.hpp"
#include "emit/tiles.hpp"

namespace knap {

namespace {

constexpr const char* kKeptFile = "kept-";

/// Cuts kept points that the memory does not hold into tiles: halved on disk until a part fits.
class TilesThroughScratch {
  public:
    TilesThroughScratch(const KeptPoints& kept, const Lattice& lattice, std::uint64_t capacity,
                        const EmitRequest& request, ArchiveWriter& writer)
        : kept_(kept),
          lattice_(lattice),
          capacity_(capacity),
          request_(request),
          writer_(writer),
          splitter_(kept.sources, lattice, capacity, [&request] { request.advance(0); }) {}
    ~TilesThroughScratch() { remove_kept_files(request_.scratch); }
    TilesThroughScratch(const TilesThroughScratch&) = delete;
    TilesThroughScratch& operator=(const TilesThroughScratch&) = delete;

    void write() {
        write(told(kept_.attributes.empty() ? write_in_any_order() : write_in_order()));
    }

  private:
    KeptFile write_in_any_order() {
        std::optional<KeptFileWriter> all;
        std::mutex mutex;
        TakeKept put = [&](const KeptBlock& block) {
            const std::scoped_lock lock(mutex);
            for (std::size_t i = 0; i < block.ids.size(); ++i) {
                all->add(block.ids[i], block.positions[i]);
            }
        };
        const std::filesystem::path path = next_path();
        const auto begin = [&] {
            all.reset();
            all.emplace(path, kept_.sources, lattice_);
            return put;
        };
        read_kept(kept_, request_.threads, begin, request_.advance);
        return all->finish();
    }

    // Points in one place are told apart by their order, which splitting keeps.
    KeptFile write_in_order() {
        const std::size_t row_size = kept_.attributes.row_size;
        KeptFileWriter all(next_path(), kept_.sources, lattice_, row_size);
        const TakeKept put = [&](const KeptBlock& block) {
            for (std::size_t i = 0; i < block.ids.size(); ++i) {
                all.add(block.ids[i], block.positions[i],
                        block.rows.subspan(i * row_size, row_size));
            }
        };
        read_kept_in_order(kept_, request_.threads, put, request_.advance);
        return all.finish();
    }

    // The lower half first, as plan_tiles() has it.
    void write(const KeptFile& file) {
        if (file.points > capacity_) {
            const auto [lower, upper] = splitter_.split(file, next_path(), next_path());
            told(lower);
            told(upper);
            remove(file);
            write(lower);
            write(upper);
            return;
        }
        if (file.row_size == 0) {
            add_points(file);
        } else {
            add_rows(file);
        }
    }

    void add_points(const KeptFile& file) {
        std::vector<LatticeIndex> points;
        points.reserve(file.points);
        splitter_.read(file, [&](PointId, const Vec3&, const LatticeIndex& index) {
            points.push_back(index);
        });
        remove(file);
        writer_.add(points, request_.memory_bytes - points.size() * sizeof(LatticeIndex));
    }

    void add_rows(const KeptFile& file) {
        std::vector<CarryingPoint> points;
        std::vector<std::byte> rows;
        points.reserve(file.points);
        rows.reserve(file.points * file.row_size);
        splitter_.read_rows(file, [&](PointId, const Vec3&, const LatticeIndex& index,
                                      std::span<const std::byte> row) {
            points.push_back({index, points.size()});
            rows.insert(rows.end(), row.begin(), row.end());
        });
        remove(file);
        writer_.add(points, rows,
                    request_.memory_bytes - points.size() * sizeof(CarryingPoint) - rows.size());
    }

    std::filesystem::path next_path() {
        return request_.scratch / fmt::format("{}{}.run", kKeptFile, files_++);
    }

    KeptFile told(KeptFile file) const {
        request_.on_scratch(static_cast<std::int64_t>(file.bytes));
        return file;
    }

    void remove(const KeptFile& file) const {
        file.remove();
        request_.on_scratch(-static_cast<std::int64_t>(file.bytes));
    }

    const KeptPoints& kept_;
    const Lattice& lattice_;
    std::uint64_t capacity_;
    const EmitRequest& request_;
    ArchiveWriter& writer_;
    KeptSplitter splitter_;
    int files_ = 0;
};

}  // namespace

void remove_kept_files(const std::filesystem::path& scratch) {
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(scratch, ignored)) {
        if (entry.path().filename().string().starts_with(kKeptFile)) {
            std::filesystem::remove(entry.path(), ignored);
        }
    }
}

void write_tiles_through_scratch(const KeptPoints& kept, const Lattice& lattice,
                                 std::uint64_t capacity, const EmitRequest& request,
                                 ArchiveWriter& writer) {
    TilesThroughScratch(kept, lattice, capacity, request, writer).write();
}

}  // namespace knap
