#pragma once

#include <memory>

#include "base/file.hpp"
#include "input/ply_header.hpp"
#include "knap/source.hpp"

namespace knap {

/// The vertices of an ASCII PLY file: an instance of an element a line.
std::unique_ptr<PointSource> open_ascii_ply(InputFile file, PlyHeader header, SourceInfo info);

}  // namespace knap
