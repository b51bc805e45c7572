#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "input/las_fields.hpp"
#include "input/las_header.hpp"
#include "knap/source.hpp"

namespace knap {

/// What a LAS or LAZ file says of itself, all but the seek granularity.
/// @param fields  as las_fields() gave them: the schema is theirs
SourceInfo describe_las(const InputFile& file, const LasHeader& header,
                        std::span<const LasRecord> records, std::span<const LasField> fields);

/// The columns of what lies behind the fields of the point format.
/// @param bytes  of a point; those that no record describes are one column, "extra_bytes"
std::vector<Attribute> las_extra_bytes(const InputFile& file, std::size_t bytes,
                                       std::span<const LasRecord> records);

/// The coordinate reference system: WKT, else "EPSG:n" from the GeoTIFF keys, else empty.
std::string las_crs(const InputFile& file, std::span<const LasRecord> records);

}  // namespace knap
