#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "knap/source.hpp"

namespace knap {

/// Which columns a reader fills: what PointSource::select() was given, checked.
class ColumnSelection {
  public:
    /// @throws ConfigError as PointSource::select() says
    void select(const SourceInfo& info, std::span<const std::size_t> attributes);

    bool empty() const { return attributes_.empty(); }
    std::size_t size() const { return attributes_.size(); }

    /// Index in the schema of column number `column`.
    std::size_t attribute(std::size_t column) const { return attributes_[column]; }

    /// Bytes of a point in it.
    std::size_t value_size(std::size_t column) const { return value_sizes_[column]; }

    /// Gives the chunk columns for `points` points; their values are undefined.
    void resize(Chunk& chunk, std::size_t points) const;

    /// Place of point number `point` in a column of the chunk.
    std::byte* at(Chunk& chunk, std::size_t column, std::size_t point) const {
        return chunk.columns[column].data() + point * value_sizes_[column];
    }

  private:
    std::vector<std::size_t> attributes_;
    std::vector<std::size_t> value_sizes_;
};

/// Bytes of a point in each of some columns.
/// @param columns  indices in the source's schema
std::vector<std::size_t> value_sizes(const SourceInfo& info, std::span<const std::size_t> columns);

/// Takes values of `size` bytes that lie `stride` bytes apart together.
/// @param swap  the bytes of each value are reversed
void copy_values(const std::byte* from, std::size_t stride, std::size_t n, std::byte* to,
                 std::size_t size, bool swap);

/// Gives columns of the same name names of their own: "quality", "quality (2)".
void make_names_unique(std::vector<Attribute>& schema);

}  // namespace knap
