#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "emit/tiles.hpp"
#include "knap/archive.hpp"
#include "store/tileset_file.hpp"
#include "tileset/geocentric.hpp"
#include "tileset/placement.hpp"
#include "tileset/properties.hpp"
#include "tileset/tile_points.hpp"

namespace knap {

/// A file of points, and where they lie.
struct NodePart {
    Placement placement;
    TilesetContent content;
};

/// A node of the hierarchy as it was written.
struct WrittenNode {
    Placement placement;          ///< of all points below
    double spacing = 0;           ///< of the node's own points, metres or cloud units
    std::vector<NodePart> parts;  ///< one, with the node's placement; or two and more
};

/// What all nodes of a tileset have in common.
struct NodeFormat {
    const Manifest& manifest;
    const PropertyPlan& plan;
    bool narrow_colors = false;  ///< as encode_pnts() has it
    std::filesystem::path folder;
};

/// Writes the points of a node: into one file; or, where they span too many lattice steps for one
/// to have them as whole steps, into up to 16 that can; or, where that is not enough, into one
/// that has them as floats.
///
/// @param number  of the node; names the files
/// @param points  at least one, in any order
/// @param region  of all points below
/// @param earth   none: cloud units stay as they are
/// @throws InputError   if a point is not on the Earth
/// @throws StorageError if Draco or the disk fails
WrittenNode write_node(std::size_t number, const GatheredPoints& points,
                       const LatticeBounds& region, const NodeFormat& format,
                       const Geocentric* earth);

}  // namespace knap
