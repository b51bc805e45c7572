#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "knap/geometry.hpp"
#include "store/source_table.hpp"

/// The scratch file of one brick: positions and ids of its core and its halo.
///
///     file    header block*
///     header  "KNAPBRCK" version:u32 packed_size:u32
///     block   part:u32 source:u32 count:u32 payload_size:u32 first_id:u64 checksum:u64 payload
///     payload count packed positions, then count - 1 differences of ids as varints
///
/// A block holds points of one source with ascending ids. Blocks stand in any order. The checksum
/// is XXH3-64 of the block with the checksum field left out. Prose: docs/formats.md.
namespace knap {

enum class BrickPart : std::uint32_t { kCore = 1, kHalo = 2 };

/// Points of one source, ids ascending, on their way into a brick file.
struct BrickBlock {
    BrickPart part = BrickPart::kCore;
    std::uint32_t source = 0;
    std::uint32_t count = 0;
    PointId first_id = 0;
    PointId last_id = 0;
    std::vector<std::byte> positions;
    std::vector<std::byte> id_steps;

    std::size_t size_bytes() const { return positions.size() + id_steps.size(); }
    /// @param id  above all ids added before; the source is that of the block
    void add(const SourceTable& table, PointId id, const Vec3& position);
    /// Empties the block, keeping its memory.
    void clear();
};

/// Creates a brick file without points, in the place of one that is there.
/// @throws StorageError
void create_brick_file(const std::filesystem::path& path, const SourceTable& table);

/// Appends a block. Two threads must not append to one file at the same time.
/// @return bytes written
/// @throws StorageError
std::uint64_t append_block(const std::filesystem::path& path, const BrickBlock& block);

/// A brick in memory: core points first, then halo; the order within each part is that of the file.
struct BrickPoints {
    std::vector<Vec3> positions;
    std::vector<PointId> ids;
    std::size_t core_count = 0;
};

/// Streams a brick file's points, in the order of the file.
/// @param with_halo  false: the core only
/// @throws StorageError if the file is missing, torn or fails a checksum, naming it and the byte
void stream_brick_file(const std::filesystem::path& path, const SourceTable& table, bool with_halo,
                       const std::function<void(PointId, const Vec3&, BrickPart)>& take);

}  // namespace knap
