#pragma once

#include "emit/emit.hpp"
#include "emit/kept_points.hpp"

namespace knap {

/// Writes the kept points to an ordinary file (PLY, LAS, LAZ, XYZ) in the order of ids, with their
/// exact positions, or the nearest of a LAS file's grid where the sources have none in common.
/// The sources are streamed a last time.
/// @throws as emit()
EmitResult emit_single_file(const KeptPoints& kept, const EmitRequest& request);

}  // namespace knap
