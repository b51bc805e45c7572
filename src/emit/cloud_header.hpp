#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "knap/geometry.hpp"
#include "knap/source.hpp"
#include "output/cloud_writer.hpp"

namespace knap {

/// What one source says that an output file may have to say too.
struct CloudOrigin {
    std::string path;  ///< for notes
    CoordinateFormat coordinates;
    std::string crs;
    std::optional<LasHeaderInfo> las;
};

/// What the points of a file are made of.
struct CloudContent {
    std::uint64_t points = 0;
    std::vector<Attribute> attributes;
    Box box;          ///< of all positions that may be written; may be empty
    double step = 0;  ///< for LAS where the sources have no common grid, cloud units, > 0
    /// Positions are where the sources have them; else doubles of a lattice, and PLY gets doubles.
    bool as_stored = true;
};

/// The header of a file that is made of some sources, and what people should know of it.
struct HeaderWithNotes {
    CloudHeader header;
    std::vector<std::string> notes;
};

/// Puts together what the sources of a file say of themselves.
///
/// What all LAS sources agree on is kept: point format, version, system, dates, ids. Of the
/// records of all of them each is carried once, the first one where two differ; those that tell the
/// coordinate system only if all sources have the same, else the file has none.
///
/// @param origins  at least one
HeaderWithNotes make_cloud_header(CloudFormat format, std::span<const CloudOrigin> origins,
                                  const CloudContent& content);

}  // namespace knap
