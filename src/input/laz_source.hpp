#pragma once

#include <memory>
#include <span>
#include <vector>

#include "base/file.hpp"
#include "input/las_fields.hpp"
#include "input/las_header.hpp"
#include "knap/source.hpp"

namespace knap {

/// Opens a LAZ file (a COPC file is one).
/// @param header, records, fields  of `file`
/// @param info                     of `file`, all but the seek granularity
/// @throws InputError if the chunk table does not agree with the header or the file, or if knap was
///         built without LASzip
std::unique_ptr<PointSource> open_laz(InputFile file, const LasHeader& header,
                                      std::span<const LasRecord> records,
                                      std::vector<LasField> fields, SourceInfo info);

}  // namespace knap
