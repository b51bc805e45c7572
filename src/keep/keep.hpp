#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "input/staged_reader.hpp"
#include "keep/expression.hpp"
#include "knap/geometry.hpp"
#include "knap/source.hpp"
#include "store/source_table.hpp"

namespace knap {

/// Makes sure that an expression can be asked of some sources.
/// @throws ConfigError if no source has one of its attributes, or it has fewer components
void check_keep(const KeepExpression& expression, std::span<const SourceInfo> sources);

/// Of each source, the columns that an expression asks for, as stream_ranges() takes them.
std::vector<std::vector<std::size_t>> columns_of(const KeepExpression& expression,
                                                 std::span<const SourceInfo> sources);

/// Points that an expression holds for.
struct HeldPoints {
    std::span<const PointId> ids;     ///< ascending
    std::span<const Vec3> positions;  ///< of each, as its source gives it; finite
};

/// Streams the sources with the attributes that an expression wants, and hands over the points that
/// it holds for. An attribute that a source does not have is 0 there; x, y and z are coordinates;
/// values of an attribute with a scale are scaled.
///
/// @param staged   stands in for sources
/// @param note     told that a file in scratch is damaged
/// @param workers  >= 1 threads that read; take() is called by one of them at a time, in any order
/// @param advance  told the number of points done with, one call at a time
/// @throws ConfigError as check_keep()
/// @throws InputError  if a source changed since the survey
void find_held(const KeepExpression& expression, const SourceTable& sources,
               const StagedPoints& staged, const StagedReader::Note& note, int workers,
               const std::function<void(const HeldPoints&)>& take,
               const std::function<void(std::uint64_t)>& advance);

}  // namespace knap
