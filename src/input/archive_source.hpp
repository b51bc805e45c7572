#pragma once

#include <memory>

#include "base/file.hpp"
#include "knap/source.hpp"

namespace knap {

/// Opens a knap archive: its points in the order of its tiles, on its lattice.
/// @param manifest  its manifest.json
/// @throws InputError if it is malformed or of a newer version
std::unique_ptr<PointSource> open_archive(const InputFile& manifest);

}  // namespace knap
