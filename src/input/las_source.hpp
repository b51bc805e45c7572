#pragma once

#include <memory>

#include "base/file.hpp"
#include "knap/source.hpp"

namespace knap {

/// Opens a LAS 1.0 to 1.5 file, point formats 0 to 10, or hands a compressed one to open_laz().
/// @throws InputError if the header is malformed or does not agree with the size of the file
std::unique_ptr<PointSource> open_las(InputFile file);

}  // namespace knap
