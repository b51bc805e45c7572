#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "knap/export.hpp"
#include "knap/geometry.hpp"

namespace knap {

/// How a value is stored in a source.
enum class ScalarType {
    kInt8,
    kUint8,
    kInt16,
    kUint16,
    kInt32,
    kUint32,
    kInt64,
    kUint64,
    kFloat32,
    kFloat64
};

/// Name of a scalar type as the manifest and `knap info` write it: "int8" .. "float64".
KNAP_API const char* to_string(ScalarType type);

/// One column of a source's schema.
struct Attribute {
    std::string name;  ///< as the source names it
    ScalarType type = ScalarType::kFloat32;
    int components = 1;  ///< values a point, >= 1
    friend bool operator==(const Attribute&, const Attribute&) = default;
};

/// How a source stores coordinates, so that they can be kept without loss in 32 bits an axis.
enum class CoordinateKind {
    kFloat32,  ///< every coordinate is exactly a float
    kInt32,    ///< every coordinate is an int32 on a GridAxis
    kFloat64,  ///< anything else
};

/// One axis of a LAS file's coordinates: i * scale + offset.
///
/// Where the offset is a whole number of scales, as it nearly always is, the coordinate is
/// evaluated as (i + offset / scale) * scale. That is the same number but for the last bit, and the
/// same for every file whatever its offset, so that one place in two files is one place.
class GridAxis {
  public:
    GridAxis() = default;
    GridAxis(double scale, double offset) : scale_(scale), offset_(offset) {
        const double steps = std::round(offset / scale);
        // The quotient of two decimals is off by its rounding, no more.
        const double rounding = 4 * std::numeric_limits<double>::epsilon() * std::abs(steps);
        if (std::abs(offset / scale - steps) <= rounding && std::abs(steps) < 0x1p51) {
            steps_ = steps;
            whole_ = true;
        }
    }

    double at(std::int32_t i) const {
        return whole_ ? (i + steps_) * scale_ : i * scale_ + offset_;
    }
    /// True if the offset is a whole number of scales.
    bool whole() const { return whole_; }

  private:
    double scale_ = 1;
    double offset_ = 0;
    double steps_ = 0;
    bool whole_ = false;
};

struct CoordinateFormat {
    CoordinateKind kind = CoordinateKind::kFloat64;
    Vec3 scale{1, 1, 1};   ///< kInt32 only, > 0
    Vec3 offset{0, 0, 0};  ///< kInt32 only, cloud units

    GridAxis axis(int which) const { return {scale[which], offset[which]}; }
    friend bool operator==(const CoordinateFormat&, const CoordinateFormat&) = default;
};

/// What a source says of itself before any point is read.
struct SourceInfo {
    std::filesystem::path path;
    std::string
        format;  ///< as shown to people: "PLY (binary little-endian)", "LAZ 1.2, point format 2"
    std::vector<Attribute> schema;  ///< in file order; coordinates included
    CoordinateFormat coordinates;
    std::optional<std::uint64_t>
        declared_count;  ///< points by the header; none for text without one
    /// Points between places to which seek() is cheap (LAZ chunk size; 1 for fixed records);
    /// 0 where the source can only be read from its start.
    std::uint64_t seek_granularity = 0;
    std::string crs;  ///< WKT or "EPSG:n"; empty if the source has none
    std::uint64_t size_bytes = 0;
};

/// Consecutive points of one source.
struct Chunk {
    std::uint64_t first = 0;      ///< index in the source of positions[0]
    std::vector<Vec3> positions;  ///< cloud units; may be non-finite: the reader does not judge
};

/// A pull stream of points. Not thread-safe; open one per thread, as many as wanted on one file.
class KNAP_API PointSource {
  public:
    virtual ~PointSource() = default;

    virtual const SourceInfo& info() const = 0;

    /// Reads the next points into `chunk`, replacing what it held.
    /// @param max_points  most points wanted, > 0
    /// @return            false, with an empty chunk, at the end of the source
    /// @throws InputError if the data does not hold what the header says, naming file and place
    virtual bool read(Chunk& chunk, std::size_t max_points) = 0;

    /// The next read() starts at point `index`, in [0, declared_count]. After seek() the end of the
    /// source is checked only by the reader that reaches it.
    /// @throws InputError if the source cannot seek (info().seek_granularity == 0)
    virtual void seek(std::uint64_t index) = 0;
};

/// Opens a point cloud; the format is told by content first, by ending second.
/// PLY, LAS, LAZ (COPC as LAZ), XYZ, CSV, TXT, PTS.
/// @throws InputError if the file is missing, unreadable, empty or of no known format
KNAP_API std::unique_ptr<PointSource> open_source(const std::filesystem::path& path);

/// Files, folders and globs as one list of files: entries in the order given; inside a folder
/// (recursively) or glob sorted by path. Files of a folder that are no point clouds, or of formats
/// that open_source() does not read, are left out.
/// @param left_out  gets the visible files of folders that are not taken, sorted; may be null
/// @throws InputError if an entry matches nothing, or a folder has no point cloud
KNAP_API std::vector<std::filesystem::path> expand_sources(
    const std::vector<std::string>& patterns,
    std::vector<std::filesystem::path>* left_out = nullptr);

}  // namespace knap
