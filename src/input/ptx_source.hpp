#pragma once

#include <memory>

#include "base/file.hpp"
#include "knap/source.hpp"

namespace knap {

/// Opens a PTX file: scans one behind the other, each a header of ten lines (columns, rows, where
/// the scanner stood and its axes, a 4 x 4 matrix that moves its points) and a line a cell: x y z
/// intensity, or x y z intensity red green blue. Every cell is a point; one without a return, which
/// PTX writes as 0 0 0, has no finite position.
/// @throws InputError if the first header or line is none
std::unique_ptr<PointSource> open_ptx(InputFile file);

/// Does it begin as a PTX file does?
bool looks_like_ptx(const InputFile& file);

}  // namespace knap
