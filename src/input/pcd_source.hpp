#pragma once

#include <memory>

#include "base/file.hpp"
#include "knap/source.hpp"

namespace knap {

/// Opens a PCD file: ASCII, binary or compressed binary.
/// @throws InputError if its header is malformed, has no x, y and z, or promises what the file
///         cannot hold
std::unique_ptr<PointSource> open_pcd(InputFile file);

}  // namespace knap
