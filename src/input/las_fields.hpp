#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/file.hpp"
#include "input/columns.hpp"
#include "input/las_header.hpp"
#include "knap/source.hpp"

namespace knap {

/// The parts of a point that LAZ of point formats 6 to 10 can decode apart; coordinates, returns
/// and the scanner channel are always decoded.
enum class LasLayer : std::uint8_t {
    kCoordinates,
    kIntensity,
    kClassification,
    kFlags,
    kScanAngle,
    kUserData,
    kPointSource,
    kGpsTime,
    kColour,
    kInfrared,
    kExtraBytes
};

/// An attribute and where it lies in the record of a point.
struct LasField {
    Attribute attribute;
    std::size_t offset = 0;  ///< of its first byte
    int shift = 0;           ///< of a bit field: its lowest bit
    std::uint8_t mask = 0;   ///< of a bit field: of its bits, shifted; 0: it is whole bytes
    LasLayer layer = LasLayer::kCoordinates;
};

/// The fields of a point in file order, extra bytes included, waveforms left out.
std::vector<LasField> las_fields(const InputFile& file, const LasHeader& header,
                                 std::span<const LasRecord> records);

/// Takes the selected columns out of point records that follow one another.
///
/// @param fields   as las_fields() gave them
/// @param records  of `n` points, `record_length` bytes each
/// @param done     points that are in the chunk's columns already
void take_las_columns(std::span<const LasField> fields, const ColumnSelection& selection,
                      const std::byte* records, std::size_t n, std::size_t record_length,
                      Chunk& chunk, std::size_t done);

}  // namespace knap
