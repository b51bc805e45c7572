#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/file.hpp"
#include "input/pcd_header.hpp"

namespace knap {

/// The points of a PCD file as records of header.stride bytes, whatever its encoding.
class PcdRows {
  public:
    virtual ~PcdRows() = default;

    /// From the next read() on, records hold these fields; the others are undefined.
    /// @param wanted  one for each field of the header
    virtual void want(const std::vector<bool>& wanted) = 0;

    /// The next `points` records, valid until the next call.
    /// @throws InputError if the data ends before or is malformed
    virtual const std::byte* read(std::size_t points) = 0;

    /// Checks what is behind the last point.
    /// @throws InputError if there is more
    virtual void finish() = 0;

    /// The next read() starts at a point. Binary files only.
    virtual void seek(std::uint64_t index) = 0;
};

/// @param file, header  outlive the rows
/// @throws InputError if the file cannot hold the points
std::unique_ptr<PcdRows> open_pcd_rows(const InputFile& file, const PcdHeader& header);

}  // namespace knap
