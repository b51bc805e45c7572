#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "knap/params.hpp"
#include "knap/source.hpp"
#include "store/source_table.hpp"

namespace knap {

/// One attribute of the output as one source has it.
struct SourceColumn {
    std::size_t column = 0;                ///< index in the schema of the source
    std::size_t attribute = 0;             ///< index in AttributePlan::attributes
    ScalarType type = ScalarType::kUint8;  ///< of the source's values
};

/// How the attributes of a point lie in a row: one behind the other.
struct RowLayout {
    std::vector<std::size_t> offsets;  ///< of each attribute, bytes
    std::size_t row_size = 0;          ///< bytes
};

RowLayout row_layout(std::span<const Attribute> attributes);

/// What the points of an output carry beside their position, and where it comes from.
///
/// Attributes of one name in several sources are one attribute: of the smallest type that holds the
/// values of all of them. A point of a source without it has 0. The attributes of a point make a
/// **row**: its values one behind the other, little endian, unaligned.
struct AttributePlan {
    std::vector<Attribute> attributes;  ///< of the output, in the order in which sources name them
    std::vector<std::size_t> offsets;   ///< of each in a row, bytes
    std::size_t row_size = 0;           ///< bytes; 0: nothing is carried
    std::vector<std::vector<SourceColumn>>
        columns;  ///< of each source, to be selected in this order
    /// The last two attributes are `curvature` and `range`, which no source gives (Measures).
    bool measures = false;

    bool empty() const { return attributes.empty(); }

    /// Indices in the schema of each source, as stream_ranges() wants them.
    std::vector<std::vector<std::size_t>> selected() const;

    /// Appends the rows of some points of a chunk.
    /// @param source  whose chunk it is, with the columns of selected()
    /// @param points  indices in the chunk
    void append_rows(std::size_t source, const Chunk& chunk, std::span<const std::uint32_t> points,
                     std::vector<std::byte>& rows) const;
};

/// Plans what to carry.
///
/// @param wanted  "all", "none", or names (output.attributes)
/// @throws ConfigError if no source has a name, or if two sources have it with other numbers of
///         components, scales or offsets, or of types that no type holds both
AttributePlan plan_attributes(std::span<const SourceInfo> sources,
                              std::span<const std::string> wanted);

/// Plans what an output carries: what output.attributes names, and with output.measures `curvature`
/// and `range`.
/// @throws ConfigError as plan_attributes(), or if sources have attributes of these names
AttributePlan plan_output(std::span<const SourceInfo> sources, const OutputParams& output);

/// What a user should know of a plan, a sentence each: which attributes are 0 in how many points,
/// which are left out by choice, and what sources have that cannot be carried.
std::vector<std::string> attribute_notes(const SourceTable& sources, const AttributePlan& plan);

}  // namespace knap
