#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "base/file.hpp"
#include "input/las_header.hpp"
#include "input/laz_layout.hpp"

namespace knap {

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
    /// @throws InputError if knap was built without LASzip, or LASzip refuses the chunk
    LazChunkDecoder(const InputFile& file, const LasHeader& header, const LazLayout& layout,
                    const LazChunk& chunk);
    ~LazChunkDecoder();
    LazChunkDecoder(const LazChunkDecoder&) = delete;
    LazChunkDecoder& operator=(const LazChunkDecoder&) = delete;

    const LazChunk& chunk() const;

    /// Points not yet read.
    std::uint64_t remaining() const;

    /// Reads the next points, at most remaining().
    /// @throws InputError if the chunk is corrupt: it does not hold its points, or more than them
    void read(std::span<LasIndex> points);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace knap
