#pragma once

#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "knap/geometry.hpp"

/// Clouds for tests and files to put them in.
namespace knap::test {

/// A small cloud of a random kind: surface, noise, line, plane, lattice with many equal distances,
/// duplicates, clusters far apart, fewer than K points, one point, none; sometimes with
/// non-finite points, coordinates far from the origin, or floats only.
std::vector<Vec3> random_cloud(std::mt19937_64& random);

/// `n` points about evenly spread over the unit sphere, in an order without locality.
std::vector<Vec3> sphere_cloud(std::size_t n, std::uint64_t seed);

/// A folder of its own, removed with all in it.
class TemporaryFolder {
  public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

/// Writes a binary PLY of doubles, or of floats.
void write_ply(const std::filesystem::path& path, const std::vector<Vec3>& points,
               bool as_float = false);

/// Writes an ASCII PLY of floats, which is one of the forms that are slow to read.
void write_ascii_ply(const std::filesystem::path& path, const std::vector<Vec3>& points);

/// Reads a file of ids, one a line.
std::vector<PointId> read_ids(const std::filesystem::path& path);

/// The whole of a file.
std::string read_bytes(const std::filesystem::path& path);

/// A file of the shared test data; empty if it is not there. Files ending in .gz are unpacked into
/// `folder` first.
std::filesystem::path shared_file(const std::string& name, const TemporaryFolder& folder);

/// All points of a file, by the library's reader.
std::vector<Vec3> read_cloud(const std::filesystem::path& path);

}  // namespace knap::test
