#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "input/stream.hpp"
#include "store/position_file.hpp"
#include "store/source_table.hpp"

namespace knap {

/// Consecutive points of one source, and the file that holds their positions, if one does.
struct ArchivePart {
    SourceRange range;
    const PositionFile* positions = nullptr;
};

/// The archive in parts of about a million points at most, in stream order.
/// @param positions  as the survey left them; must outlive the parts
std::vector<ArchivePart> cut_into_parts(const SourceTable& table,
                                        std::span<const PositionFile> positions);

/// Points of the parts.
std::uint64_t points_of(const SourceTable& table, std::span<const ArchivePart> parts);

/// Streams the points of a part in order: from its positions, or, where there are none or they
/// are damaged, from the source.
/// @param note  told that positions are damaged
/// @throws InputError if the source has changed since the survey
void stream_part(const SourceTable& table, const ArchivePart& part,
                 const std::function<void(const std::string&)>& note,
                 const std::function<void(const Chunk&)>& consume);

}  // namespace knap
