#pragma once

#include <memory>

#include "base/file.hpp"
#include "input/ply_header.hpp"
#include "knap/source.hpp"

namespace knap {

/// The vertices of a binary PLY file.
/// @throws InputError if the elements need more bytes than the file holds
std::unique_ptr<PointSource> open_binary_ply(InputFile file, PlyHeader header, SourceInfo info);

}  // namespace knap
