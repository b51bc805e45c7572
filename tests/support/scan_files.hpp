#pragma once

#include <unistd.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "knap/error.hpp"
#include "knap/source.hpp"

#ifdef __SANITIZE_ADDRESS__
/// LASzip 3.5 forgets one layer of each decoder of "version 4" items: not ours to report.
extern "C" __attribute__((used, weak, visibility("default"))) const char*
__lsan_default_suppressions() {
    return "leak:liblaszip";
}
#endif

/// Input files for the tests of the readers: written byte by byte, read to their end.
namespace knap::test {

/// A folder of its own for input files; removed with all in it.
class ScanFolder {
  public:
    ScanFolder() {
        static std::atomic<int> next{0};
        path_ = std::filesystem::temp_directory_path() /
                ("knap-scans-" + std::to_string(::getpid()) + "-" + std::to_string(next++));
        std::filesystem::create_directories(path_);
    }
    ~ScanFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    ScanFolder(const ScanFolder&) = delete;
    ScanFolder& operator=(const ScanFolder&) = delete;

    const std::filesystem::path& path() const { return path_; }

    /// Writes a file, and the folders on its way.
    std::filesystem::path write(const std::string& name, std::string_view bytes) const {
        const std::filesystem::path file = path_ / name;
        std::filesystem::create_directories(file.parent_path());
        // Cutting a file that exists can wait for the disk.
        std::filesystem::remove(file);
        std::ofstream(file, std::ios::binary)
            .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        return file;
    }

  private:
    std::filesystem::path path_;
};

inline std::filesystem::path shared_data(const std::string& name = {}) {
    return std::filesystem::path(KNAP_SHARED_DATA) / name;
}

inline std::string file_bytes(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// All that is left of a source, checking that chunks follow one another.
inline std::vector<Vec3> read_rest(PointSource& source, std::size_t chunk_points = 1000) {
    std::vector<Vec3> points{};
    Chunk chunk;
    std::uint64_t next = 0;
    while (source.read(chunk, chunk_points)) {
        if (chunk.positions.empty() || chunk.positions.size() > chunk_points ||
            (!points.empty() && chunk.first != next)) {
            throw std::logic_error("a chunk is empty, too large or out of order");
        }
        next = chunk.first + chunk.positions.size();
        points.insert(points.end(), chunk.positions.begin(), chunk.positions.end());
    }
    if (!chunk.positions.empty()) {
        throw std::logic_error("the chunk at the end is not empty");
    }
    return points;
}

inline std::vector<Vec3> read_all(const std::filesystem::path& path,
                                  std::size_t chunk_points = 1000) {
    return read_rest(*open_source(path), chunk_points);
}

/// The selected columns of all that is left of a source.
inline std::vector<std::string> read_columns(PointSource& source,
                                             const std::vector<std::size_t>& selected,
                                             std::size_t chunk_points = 1000) {
    source.select(selected);
    std::vector<std::string> columns(selected.size());
    Chunk chunk;
    while (source.read(chunk, chunk_points)) {
        for (std::size_t i = 0; i < selected.size(); ++i) {
            const std::vector<std::byte>& column = chunk.columns.at(i);
            if (column.size() !=
                chunk.positions.size() * source.info().schema[selected[i]].value_size()) {
                throw std::logic_error("a column is not as long as its chunk");
            }
            columns[i].append(reinterpret_cast<const char*>(column.data()), column.size());
        }
    }
    return columns;
}

/// The message of the InputError that opening or reading a file ends in; empty if it can be read.
inline std::string input_error_of(const std::filesystem::path& path) {
    try {
        read_all(path);
    } catch (const InputError& error) {
        return error.what();
    }
    return {};
}

/// The bytes of a number as they lie in memory, or reversed.
template <typename T>
std::string raw(T value, bool reversed = false) {
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    return reversed ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

/// Writes a little-endian number into `bytes`.
template <typename T>
void poke(std::string& bytes, std::size_t at, T value) {
    bytes.replace(at, sizeof value, raw(value));
}

/// A LAS file with the given native coordinates and nothing else: no records, all other fields 0.
struct LasFile {
    int version_minor = 2;
    int point_format = 0;
    Vec3 scale{0.01, 0.01, 0.01};
    Vec3 offset{100, 200, 300};
    std::vector<std::array<std::int32_t, 3>> points{};
    std::string vlrs{};  ///< between header and points
    std::uint32_t vlr_count = 0;
    std::size_t extra_bytes = 0;

    static constexpr std::array<std::uint16_t, 6> kHeaderSizes{227, 227, 227, 235, 375, 375};
    static constexpr std::array<std::uint16_t, 11> kRecordLengths{20, 28, 26, 34, 57, 63,
                                                                  30, 36, 38, 59, 67};

    std::size_t header_size() const {
        return kHeaderSizes.at(static_cast<std::size_t>(version_minor));
    }
    std::size_t record_length() const {
        return kRecordLengths.at(static_cast<std::size_t>(point_format)) + extra_bytes;
    }
    std::size_t points_offset() const { return header_size() + vlrs.size(); }

    std::string bytes() const {
        std::string file(header_size(), '\0');
        file.replace(0, 4, "LASF");
        file[24] = 1;
        file[25] = static_cast<char>(version_minor);
        poke(file, 94, static_cast<std::uint16_t>(header_size()));
        poke(file, 96, static_cast<std::uint32_t>(points_offset()));
        poke(file, 100, vlr_count);
        file[104] = static_cast<char>(point_format);
        poke(file, 105, static_cast<std::uint16_t>(record_length()));
        if (version_minor < 4 || point_format <= 5) {
            poke(file, 107, static_cast<std::uint32_t>(points.size()));
        }
        if (version_minor >= 4) {
            poke(file, 247, static_cast<std::uint64_t>(points.size()));
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            poke(file, 131 + 8 * axis, scale[static_cast<int>(axis)]);
            poke(file, 155 + 8 * axis, offset[static_cast<int>(axis)]);
        }
        file += vlrs;
        for (const auto& point : points) {
            std::string record(record_length(), '\0');
            for (std::size_t axis = 0; axis < 3; ++axis) {
                poke(record, 4 * axis, point[axis]);
            }
            file += record;
        }
        return file;
    }

    /// What a reader must give for points[i].
    Vec3 position(std::size_t i) const {
        return {GridAxis(scale.x, offset.x).at(points[i][0]),
                GridAxis(scale.y, offset.y).at(points[i][1]),
                GridAxis(scale.z, offset.z).at(points[i][2])};
    }
};

/// A variable-length record; `extended` ones have a longer head.
inline std::string las_record(const std::string& user_id, std::uint16_t id,
                              const std::string& content, bool extended = false) {
    std::string record(extended ? 60 : 54, '\0');
    record.replace(2, user_id.size(), user_id);
    poke(record, 18, id);
    if (extended) {
        poke(record, 20, static_cast<std::uint64_t>(content.size()));
    } else {
        poke(record, 20, static_cast<std::uint16_t>(content.size()));
    }
    return record + content;
}

}  // namespace knap::test
