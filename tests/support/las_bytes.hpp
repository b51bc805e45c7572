#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

/// A reader of LAS files that shares nothing with the library's: for tests of what it writes.
namespace knap::test {

/// The little-endian number at a place.
template <typename T>
T get(const std::string& bytes, std::size_t at) {
    T value{};
    bytes.copy(reinterpret_cast<char*>(&value), sizeof value, at);
    return value;
}

class LasBytes {
  public:
    /// Of a LAZ file only what stands before the points, and behind.
    explicit LasBytes(const std::filesystem::path& path);

    const std::string& bytes() const { return bytes_; }
    int point_format() const { return bytes_.at(104) & 0x3f; }
    std::size_t record_length() const { return get<std::uint16_t>(bytes_, 105); }
    std::uint64_t points() const;

    /// The record of a point, and all of them.
    std::string point(std::size_t i) const;
    std::string all_points() const;

    std::int32_t step(std::size_t point, int axis) const;

    /// The value of a field, as the reader of the library would give it: bits as one byte.
    std::string field(std::size_t point, const std::string& name) const;

    /// Content of a variable-length record; throws std::out_of_range if there is none.
    std::string record(const std::string& user_id, std::uint16_t id, bool extended = false) const;

  private:
    std::string bytes_;
};

/// The points of a LAZ file as they would be in a LAS file, by LASzip alone.
std::string laz_records(const std::filesystem::path& path);

}  // namespace knap::test
