#pragma once

#include <vector>

#include "curvature/point_blocks.hpp"
#include "rank/gather.hpp"
#include "store/brick_file.hpp"
#include "store/brick_plan.hpp"
#include "store/source_table.hpp"

namespace knap {

/// The points of a brick in blocks, coincident ones merged. Takes the brick, to free it on the way.
PointBlocks block_brick(BrickPoints brick);

/// The points of a brick file.
/// @param with_halo  false: the core only
/// @throws StorageError if the file cannot be read, or does not hold as many points as it says
std::vector<TaggedPoint> load_points(const BrickFile& file, const SourceTable& table,
                                     bool with_halo = true);

/// The points of a brick file in blocks, coincident ones merged.
/// @throws StorageError as load_points()
PointBlocks load_brick(const BrickFile& file, const SourceTable& table, bool with_halo = true);

/// Points of blocks, without what is for searching.
CorePoints points_of(const PointBlocks& blocks);

/// Some points, of coincident ones the one of lowest id.
/// @param points  all of them core
CorePoints distinct_points(BrickPoints points);

}  // namespace knap
