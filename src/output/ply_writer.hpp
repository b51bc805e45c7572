#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "output/cloud_writer.hpp"

namespace knap {

/// Writes a binary little-endian PLY, streamed: x, y, z, then a property for each attribute; one of
/// several components is several properties, name_0 and so on.
///
/// PLY has no integers of 64 bits: such values are doubles, and one that a double does not hold is
/// an error. It has no scales: comments tell those that are not 1. Blanks in names become "_".
class PlyWriter final : public CloudWriter {
  public:
    enum class Precision { kFloat, kDouble };

    /// Positions only.
    /// @param points    how many will be appended
    /// @param comments  one header line each
    /// @throws StorageError if the file cannot be created
    PlyWriter(const std::filesystem::path& path, std::uint64_t points, Precision precision,
              const std::vector<std::string>& comments);

    /// @throws StorageError if the file cannot be created
    PlyWriter(const std::filesystem::path& path, const CloudHeader& header);

  protected:
    void put(std::span<const Vec3> positions, std::span<const std::byte> rows) override;
    void put_end() override;

  private:
    PlyWriter(const std::filesystem::path& path, const CloudHeader& header,
              const std::vector<std::string>& comments);
    void put_row(std::span<const std::byte> row, std::size_t point);
    void flush();

    std::vector<Attribute> attributes_;
    Precision precision_;
    bool has_long_integers_ = false;
    std::vector<std::byte> buffer_;
};

}  // namespace knap
