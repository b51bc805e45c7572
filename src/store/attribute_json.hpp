#pragma once

#include <span>

#include "knap/source.hpp"
#include "store/json_node.hpp"

namespace knap {

/// An attribute as the manifest has it: beside name, type and components only what says something.
Json attribute_json(const Attribute& attribute);

/// A list of attributes with all that is known of each, for other programs to read.
Json attributes_json(std::span<const Attribute> attributes);

/// What attribute_json() has written.
/// @throws InputError naming file, key, what was expected and what was found
Attribute attribute_from(const JsonNode& node);

}  // namespace knap
