#pragma once

#include <cstdint>
#include <string_view>

#include "knap/params.hpp"

namespace knap::app {

/// Numbers as people type them, independent of the locale. The whole text must be the number.
/// @param where  the flag or key that gave the text, for the message
/// @throws ConfigError naming `where`, what was expected and the text
double parse_number(std::string_view text, std::string_view where);
std::uint64_t parse_count(std::string_view text, std::string_view where);

/// A size: "4GiB", "1.5GiB", or bytes.
std::uint64_t parse_size(std::string_view text, std::string_view where);

/// Takes the name that a text is.
void choose(const Choice& choice, std::string_view text, std::string_view where);

/// Sets one parameter of a job from text and checks its range. A list becomes this one entry.
/// @throws ConfigError naming `where`, what was expected and the text
void set_parameter(Job& job, const Parameter& parameter, std::string_view text,
                   std::string_view where);

/// What a parameter takes, for messages and help: "a number", "a size".
std::string_view kind_of(const Parameter& parameter);

}  // namespace knap::app
