#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <utility>

#include "emit/lattice.hpp"
#include "emit/tiles.hpp"
#include "store/ranked_run.hpp"
#include "store/row_file.hpp"
#include "store/source_table.hpp"

namespace knap {

/// Kept points on disk, on their way into tiles: a run whose keys are all 0, and their rows, if
/// they carry something, in a file beside it.
struct KeptFile {
    std::filesystem::path path;
    std::uint64_t points = 0;
    std::uint64_t bytes = 0;  ///< of both files
    LatticeBounds bounds;
    std::size_t row_size = 0;  ///< bytes; 0: there is no file of rows

    std::filesystem::path rows_path() const { return path.string() + ".rows"; }
    /// Removes it from disk.
    void remove() const;
};

/// Writes a KeptFile; it exists only once finish() has returned.
class KeptFileWriter {
  public:
    /// @param table, lattice  must outlive the writer
    /// @throws StorageError
    KeptFileWriter(std::filesystem::path path, const SourceTable& table, const Lattice& lattice,
                   std::size_t row_size = 0);

    /// @param row  of row_size bytes
    void add(PointId id, const Vec3& position, std::span<const std::byte> row = {});
    /// The same for a point whose place on the lattice is known.
    void add(PointId id, const Vec3& position, const LatticeIndex& index,
             std::span<const std::byte> row);

    /// @throws StorageError
    KeptFile finish();

  private:
    const Lattice& lattice_;
    RunWriter run_;
    std::optional<RowWriter> rows_;
    KeptFile file_;
};

/// Cuts kept points on disk, where they do not fit the memory, into files as plan_tiles() would cut
/// them in memory.
class KeptSplitter {
  public:
    /// @param capacity  points that may be held in memory at a time, >= 1
    /// @param poll      called now and then; may throw to stop the work
    KeptSplitter(const SourceTable& table, const Lattice& lattice, std::uint64_t capacity,
                 std::function<void()> poll)
        : table_(table), lattice_(lattice), capacity_(capacity), poll_(std::move(poll)) {}

    /// Streams a file: take(id, position, index).
    /// @throws StorageError if it is damaged
    void read(const KeptFile& file,
              const std::function<void(PointId, const Vec3&, const LatticeIndex&)>& take) const;

    /// The same with rows: take(id, position, index, row).
    void read_rows(const KeptFile& file,
                   const std::function<void(PointId, const Vec3&, const LatticeIndex&,
                                            std::span<const std::byte>)>& take) const;

    /// The lower half, first by the coordinate along the longest axis, and the upper one.
    /// Points in one place go into the lower half first, and each half has its points in the order
    /// that they had.
    /// @param file  at least two points
    std::pair<KeptFile, KeptFile> split(const KeptFile& file, const std::filesystem::path& lower,
                                        const std::filesystem::path& upper) const;

    /// A point, and how many others are before its place.
    struct Ranked {
        LatticeIndex point{};
        std::uint64_t before = 0;
    };

    /// The point that has a rank in an order. By counting in ever narrower intervals.
    /// @param rank  < file.points
    Ranked point_of_rank(const KeptFile& file, AlongAxis order, std::uint64_t rank) const;

  private:
    const SourceTable& table_;
    const Lattice& lattice_;
    std::uint64_t capacity_;
    std::function<void()> poll_;
};

}  // namespace knap
