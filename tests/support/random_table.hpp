#pragma once

#include <random>

#include "store/source_table.hpp"

namespace knap::test {

/// One to four sources with up to `most_points` points each: floats and native integers, or, in a
/// wide table, doubles among them.
SourceTable random_table(std::mt19937_64& random, bool wide, std::uint64_t most_points = 1000);

/// A position that a source of the table can hold: it packs without loss.
Vec3 random_position(std::mt19937_64& random, const SourceTable& table, std::size_t source);

}  // namespace knap::test
