#pragma once

#include <memory>

#include "base/file.hpp"
#include "knap/source.hpp"

namespace knap {

/// Opens a PLY file: ASCII or binary of either byte order.
/// @throws InputError if the header is malformed, or needs more bytes than the file holds
std::unique_ptr<PointSource> open_ply(InputFile file);

}  // namespace knap
