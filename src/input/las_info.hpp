#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "input/las_header.hpp"
#include "knap/source.hpp"

namespace knap {

/// What a LAS or LAZ file says of itself, all but the seek granularity.
SourceInfo describe_las(const InputFile& file, const LasHeader& header,
                        std::span<const LasRecord> records);

/// The fields of a point, extra bytes included, in file order.
std::vector<Attribute> las_schema(const InputFile& file, const LasHeader& header,
                                  std::span<const LasRecord> records);

/// The coordinate reference system: WKT, else "EPSG:n" from the GeoTIFF keys, else empty.
std::string las_crs(const InputFile& file, std::span<const LasRecord> records);

}  // namespace knap
