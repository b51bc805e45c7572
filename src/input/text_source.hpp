#pragma once

#include <memory>

#include "base/file.hpp"
#include "knap/source.hpp"

namespace knap {

/// Opens a text file with a point a line: XYZ, CSV, TXT, PTS.
/// @throws InputError if its first lines are no such table
std::unique_ptr<PointSource> open_text(InputFile file);

}  // namespace knap
