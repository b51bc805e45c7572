#pragma once

#include <memory>

#include "base/file.hpp"
#include "knap/source.hpp"

namespace knap {

/// Opens a Draco file: a point cloud, or a mesh for the sake of its points. It is decoded as a
/// whole, there and then.
/// @throws InputError if it is damaged or has no positions
std::unique_ptr<PointSource> open_draco(const InputFile& file);

}  // namespace knap
