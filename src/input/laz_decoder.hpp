#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "base/file.hpp"
#include "input/las_fields.hpp"
#include "input/las_header.hpp"
#include "input/laz_layout.hpp"

namespace knap {

/// A set of LasLayer.
using LasLayers = std::bitset<11>;

/// Native coordinates of a LAS point.
struct LasIndex {
    std::int32_t x = 0;
    std::int32_t y = 0;
    std::int32_t z = 0;
};

/// Whether this knap was built with LASzip.
bool has_laszip();

/// Decodes one chunk of a LAZ file from its first point to its last.
class LazChunkDecoder {
  public:
    /// @param file    outlives the decoder
    /// @param layout  of `file`, checked
    /// @param layers  to be decoded, beside the coordinates; older point formats have no layers and
    ///                are decoded as a whole
    /// @throws InputError if knap was built without LASzip, or LASzip refuses the chunk
    LazChunkDecoder(const InputFile& file, const LasHeader& header, const LazLayout& layout,
                    const LazChunk& chunk, const LasLayers& layers);
    ~LazChunkDecoder();
    LazChunkDecoder(const LazChunkDecoder&) = delete;
    LazChunkDecoder& operator=(const LazChunkDecoder&) = delete;

    const LazChunk& chunk() const;

    /// Points not yet read.
    std::uint64_t remaining() const;

    /// Reads the next points, at most remaining().
    /// @throws InputError if the chunk is corrupt: it does not hold its points, or more than them
    void read(std::span<LasIndex> points);

    /// As read(points), with the points as an uncompressed file has them, but for waveforms, which
    /// are zeros, and layers that are not decoded, which are undefined.
    /// @param records  points.size() times the record length of the header
    void read(std::span<LasIndex> points, std::span<std::byte> records);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace knap
