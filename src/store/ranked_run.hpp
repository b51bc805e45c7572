#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "knap/geometry.hpp"
#include "store/local_frame.hpp"
#include "store/source_table.hpp"

/// Points with a key each, highest key first: the core of one brick by its curvature.
///
///     file    header block*
///     header  "KNAPRUN1" version:u32 packed_size:u32 id_size:u32 block_points:u32 frame_size:u32
///     block   count:u32 payload_size:u32 checksum:u64 payload
///     payload bits of the first key:u64, then count - 1 drops of the bits as varints,
///             count packed positions, count ids of id_size bytes, count frames of frame_size
///             bytes (0, or 3: PackedFrame)
///
/// Keys are non-negative doubles, whose bits order as they do. The last block is empty (count 0):
/// a run without it is torn. The checksum is XXH3-64 of the payload, xor splitmix64(count). Prose:
/// docs/formats.md.
namespace knap {

/// One point of a run.
struct RankedPoint {
    double key = 0;  ///< >= 0; in a ranked run |H|, 1 / cloud unit
    PointId id = 0;
    Vec3 position;
    PackedFrame frame{};  ///< of the surface, where the job asks for it
};

/// The method's order (section 3): key descending, ties by splitmix64(id), then id. Total.
inline bool ranks_before(double key_a, PointId id_a, double key_b, PointId id_b) {
    if (key_a != key_b) {
        return key_a > key_b;
    }
    const std::uint64_t a = splitmix64(id_a);
    const std::uint64_t b = splitmix64(id_b);
    return a != b ? a < b : id_a < id_b;
}
inline bool ranks_before(const RankedPoint& a, const RankedPoint& b) {
    return ranks_before(a.key, a.id, b.key, b.id);
}

/// A pull stream of ranked points, best first.
class RankedStream {
  public:
    virtual ~RankedStream() = default;
    /// Replaces `points` by the next ones; false, with none, at the end.
    virtual bool next(std::vector<RankedPoint>& points) = 0;
};

/// A run that never went to disk.
class RunInMemory final : public RankedStream {
  public:
    explicit RunInMemory(std::vector<RankedPoint> points) : points_(std::move(points)) {}
    bool next(std::vector<RankedPoint>& points) override {
        points = std::exchange(points_, {});
        return !points.empty();
    }

  private:
    std::vector<RankedPoint> points_;
};

/// Points of a block where memory is no matter.
constexpr std::size_t kMostBlockPoints = 4096;

/// How a run is written; readers find out.
struct RunLayout {
    std::size_t block_points = kMostBlockPoints;  ///< that a reader must hold at a time, > 0
    bool frames = false;                          ///< the points' frames too
};

/// Writes a run; it exists only once finish() has returned.
class RunWriter {
  public:
    /// @throws StorageError
    RunWriter(const std::filesystem::path& path, const SourceTable& table,
              const RunLayout& layout = {});

    /// @param point  key finite, not above the key of the point before
    void add(const RankedPoint& point);

    /// @return size of the file
    /// @throws StorageError
    std::uint64_t finish();

  private:
    void flush();

    AtomicFile file_;
    const SourceTable& table_;
    std::size_t id_size_;
    RunLayout layout_;
    std::uint32_t count_ = 0;
    std::uint64_t last_bits_ = 0;
    std::vector<std::byte> keys_;
    std::vector<std::byte> positions_;
    std::vector<std::byte> ids_;
    std::vector<std::byte> frames_;
};

/// Writes a whole run.
/// @param points  in the method's order
/// @return size of the file
/// @throws StorageError
std::uint64_t write_run(const std::filesystem::path& path, const SourceTable& table,
                        std::span<const RankedPoint> points, const RunLayout& layout = {});

/// Reads a run block by block. Holds no open file between blocks.
class RunReader final : public RankedStream {
  public:
    /// Does not touch the file yet.
    RunReader(std::filesystem::path path, const SourceTable& table);

    /// @throws StorageError if it is no run of this table, is torn or fails a checksum, naming it
    ///                      and the byte
    bool next(std::vector<RankedPoint>& points) override;

  private:
    void read_header(const InputFile& file);
    [[noreturn]] void throw_damaged(const char* what) const;

    std::filesystem::path path_;
    const SourceTable* table_;
    std::uint64_t at_ = 0;
    std::size_t id_size_ = 0;
    bool has_frames_ = false;
    bool ended_ = false;
};

}  // namespace knap
