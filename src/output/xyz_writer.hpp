#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "output/cloud_writer.hpp"

namespace knap {

/// Writes text: a line a point, numbers separated by blanks, as few digits as read back as the same
/// number. Where there are attributes, the first line names the columns, which then have the values
/// as stored; one of several components is several columns, name_0 and so on.
class XyzWriter final : public CloudWriter {
  public:
    /// @throws StorageError if the file cannot be created
    XyzWriter(const std::filesystem::path& path, std::uint64_t points,
              std::vector<Attribute> attributes);

  protected:
    void put(std::span<const Vec3> positions, std::span<const std::byte> rows) override;
    void put_end() override;

  private:
    void put_row(std::span<const std::byte> row);
    void flush();

    std::vector<Attribute> attributes_;
    fmt::memory_buffer text_;
};

}  // namespace knap
