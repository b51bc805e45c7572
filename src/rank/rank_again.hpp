#pragma once

#include <vector>

#include "knap/params.hpp"
#include "rank/gather.hpp"
#include "store/brick_file.hpp"
#include "store/brick_plan.hpp"
#include "store/ranked_run.hpp"
#include "store/source_table.hpp"

namespace knap {

/// The ranked points of one brick, those with neighbours in other bricks among them: what all its
/// runs held.
/// @param frames   of the points too
/// @param spacing  of the archive, cloud units
/// @param archive  all points of it, in any parts
/// @return         in the method's order
/// @throws StorageError if the brick file cannot be read
std::vector<RankedPoint> rank_again(const SourceTable& table, const BrickFile& file,
                                    const CurvatureParams& params, bool frames, double spacing,
                                    const CoreAccess& archive);

}  // namespace knap
