#pragma once

#include "knap/source.hpp"
#include "store/json_node.hpp"

namespace knap {

/// What a LAS header said, as the manifest has it: see docs/formats.md.
Json las_json(const LasHeaderInfo& las);

/// Reads it back.
/// @throws InputError as JsonNode
LasHeaderInfo las_from(const JsonNode& node);

}  // namespace knap
