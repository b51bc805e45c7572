#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/file.hpp"
#include "knap/geometry.hpp"
#include "knap/source.hpp"

namespace knap {

/// The ordinary files that knap writes, told by their ending.
enum class CloudFormat { kPly, kLas, kLaz, kXyz };

/// The format that a file's ending means, in any case of letters; none if it is another.
std::optional<CloudFormat> cloud_format_of(const std::filesystem::path& path);

/// What a file says of its points before the first of them.
struct CloudHeader {
    std::uint64_t points = 0;
    /// PLY: kFloat32 is written as float, all else as double. LAS and LAZ: kInt32, the grid that
    /// positions are put on; one that lies on it stays exactly where it is.
    CoordinateFormat coordinates;
    std::vector<Attribute> attributes;  ///< names differ; no coordinates
    std::string crs;                    ///< WKT or "EPSG:n"; empty if there is none
    std::optional<LasHeaderInfo> las;   ///< LAS and LAZ: what their sources said
};

/// Bytes of the values of one point, attribute by attribute in their order, without gaps.
std::size_t row_size(std::span<const Attribute> attributes);

/// Writes a point cloud, streamed: memory does not grow with the points. The file appears under its
/// name on commit() or not at all.
class CloudWriter {
  public:
    virtual ~CloudWriter() = default;
    CloudWriter(const CloudWriter&) = delete;
    CloudWriter& operator=(const CloudWriter&) = delete;

    /// @param rows  positions.size() rows of values, each row_size() bytes in the byte order of
    /// this
    ///              machine; empty if there are no attributes
    /// @throws InputError    if a value cannot be said in this format, naming point and attribute
    /// @throws StorageError  if the disk is full or fails
    void append(std::span<const Vec3> positions, std::span<const std::byte> rows = {});

    /// Writes what is left: the file is whole, but has no name yet.
    /// @return size of the file, bytes
    /// @throws StorageError if fewer or more points were appended than announced, or the disk fails
    std::uint64_t complete();

    /// Gives the file its name; after complete().
    /// @throws StorageError
    void commit();

    /// complete(), then commit().
    std::uint64_t finish();

  protected:
    /// @throws StorageError if the file cannot be created
    CloudWriter(std::filesystem::path path, std::uint64_t points,
                std::span<const Attribute> attributes);

    virtual void put(std::span<const Vec3> positions, std::span<const std::byte> rows) = 0;
    virtual void put_end() = 0;

    const std::filesystem::path& path() const { return path_; }
    AtomicFile& file() { return file_; }
    std::uint64_t announced() const { return announced_; }

    /// Points of the calls of put() before this one.
    std::uint64_t appended() const { return appended_; }
    std::size_t row_bytes() const { return row_bytes_; }

    /// @param point  index of the point within this call of put()
    [[noreturn]] void fail_at(std::size_t point, const std::string& attribute,
                              const std::string& expected, const std::string& found) const;

  private:
    std::filesystem::path path_;
    AtomicFile file_;
    std::uint64_t announced_;
    std::uint64_t appended_ = 0;
    std::size_t row_bytes_;
};

/// Begins a file in the format that its ending means.
/// @throws ConfigError   if the format cannot hold the attributes, or knap was built without it
/// @throws StorageError  if the file cannot be created
std::unique_ptr<CloudWriter> open_cloud_writer(const std::filesystem::path& path,
                                               const CloudHeader& header);

/// What of a header the format of a file cannot say as it is, a sentence each, for people.
std::vector<std::string> notes_on(CloudFormat format, const CloudHeader& header);

}  // namespace knap
