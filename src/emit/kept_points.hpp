#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "emit/attribute_plan.hpp"
#include "emit/measures.hpp"
#include "input/staged_reader.hpp"
#include "knap/geometry.hpp"
#include "store/selection.hpp"
#include "store/source_table.hpp"

namespace knap {

/// The kept points, and where they can be read.
struct KeptPoints {
    const SourceTable& sources;
    const Selection& selection;  ///< finished, of sources.points() ids
    /// Ranked runs that together hold every kept point once, and others or not; none: only the
    /// sources. They hold no attributes: where a plan has some, the sources are read.
    std::span<const std::filesystem::path> runs;
    const AttributePlan& attributes;  ///< what to carry
    /// Told that a file in scratch cannot be read, and why; from any thread.
    std::function<void(const std::string&)> note = [](const std::string&) {};
    const StagedPoints* staged = nullptr;  ///< stands in for sources; null: for none
    /// Of the kept points, where the plan has them.
    const Measures* measures = nullptr;
};

/// Some kept points.
struct KeptBlock {
    /// Of the first; the points of all blocks fill the places from 0 once each. Where they come
    /// from the sources, places are in the order of ids.
    std::uint64_t place = 0;
    std::span<const PointId> ids;     ///< at least one
    std::span<const Vec3> positions;  ///< of each, as its source gives it
    std::span<const std::byte> rows;  ///< of each, as AttributePlan has them
};

using TakeKept = std::function<void(const KeptBlock& block)>;

/// Hands over the kept points in any order: from the runs, or, where there are none, one is damaged
/// or attributes are to be carried, from the sources.
///
/// @param workers  >= 1 threads that take() may be called from at once
/// @param begin    gives the take() of an attempt; called again if the points of the attempt before
///                 do not count, as one of its runs is damaged
/// @param advance  told the number of input points done with; called by one thread at a time
/// @throws InputError if a source has to be read that no longer holds the points of the survey
void read_kept(const KeptPoints& kept, int workers, const std::function<TakeKept()>& begin,
               const std::function<void(std::uint64_t)>& advance);

/// Streams the sources once more and hands over the kept points by ascending id. What holds none of
/// them is not read.
/// @param workers  >= 1 threads that read; take() is called by one of them at a time
/// @throws InputError as read_kept()
void read_kept_in_order(const KeptPoints& kept, int workers, const TakeKept& take,
                        const std::function<void(std::uint64_t)>& advance);

/// Memory that read_kept_in_order() takes.
std::uint64_t read_in_order_memory_bytes(int workers, std::size_t row_size);

}  // namespace knap
