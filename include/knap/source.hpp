#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <span>
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

/// Bytes of one value.
KNAP_API std::size_t size_of(ScalarType type);

/// What a LAS file says of the values of extra bytes: a value a component, as the bits of a uint64
/// where the type is unsigned, of an int64 where it is signed, of a double where it is floating. A
/// list is empty where nothing is said.
struct ValueLimits {
    std::vector<std::uint64_t> missing;   ///< what stands where there is no value
    std::vector<std::uint64_t> least;     ///< of all values, as stored
    std::vector<std::uint64_t> greatest;  ///< the same

    friend bool operator==(const ValueLimits&, const ValueLimits&) = default;
};

/// One column of a source's schema. A stored value v means v * scale + offset.
struct Attribute {
    std::string name;  ///< as the source names it; no other column of the source has the same
    ScalarType type = ScalarType::kFloat32;
    int components = 1;                       ///< values a point, >= 1
    double scale = 1;                         ///< of LAS extra bytes; 1 elsewhere
    double offset = 0;                        ///< of LAS extra bytes; 0 elsewhere
    std::string description = std::string();  ///< of LAS extra bytes; empty elsewhere
    ValueLimits limits = ValueLimits();       ///< of LAS extra bytes; empty elsewhere

    /// Bytes of a point in this column.
    std::size_t value_size() const { return size_of(type) * static_cast<std::size_t>(components); }

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

/// A variable-length record of a LAS file, as it is there.
struct LasVlr {
    std::string user_id;
    std::uint16_t record_id = 0;
    std::string description;
    bool extended = false;  ///< behind the points
    std::vector<std::byte> content;
    friend bool operator==(const LasVlr&, const LasVlr&) = default;
};

/// What the header of a LAS file says that is not about its points, and the records that carry the
/// georeference and whatever else its writer added.
struct LasHeaderInfo {
    int version_minor = 0;  ///< of LAS 1.n
    int point_format = 0;   ///< 0 to 10
    std::uint16_t file_source_id = 0;
    std::uint16_t global_encoding = 0;
    std::array<std::byte, 16> project_id{};
    std::string system_identifier;
    std::string generating_software;
    std::uint16_t creation_day = 0;  ///< of the year, from 1; 0: not known
    std::uint16_t creation_year = 0;

    /// In file order, extended ones last. Those that describe how this very file is stored are left
    /// out: LASzip, COPC, extra bytes (which are in the schema), waveforms, spatial indices.
    std::vector<LasVlr> records;
    friend bool operator==(const LasHeaderInfo&, const LasHeaderInfo&) = default;
};

/// What a source says of itself before any point is read.
struct SourceInfo {
    std::filesystem::path path;
    std::string
        format;  ///< as shown to people: "PLY (binary little-endian)", "LAZ 1.2, point format 2"
    std::vector<Attribute> schema;             ///< in file order; coordinates included
    std::array<std::size_t, 3> axes{0, 1, 2};  ///< indices in `schema` of x, y and z
    CoordinateFormat coordinates;
    std::optional<std::uint64_t>
        declared_count;  ///< points by the header; none for text without one
    /// Points between places to which seek() is cheap (LAZ chunk size; 1 for fixed records);
    /// 0 where the source can only be read from its start.
    std::uint64_t seek_granularity = 0;
    std::string crs;  ///< WKT or "EPSG:n"; empty if the source has none
    std::uint64_t size_bytes = 0;
    std::vector<std::string> unsupported;  ///< what is in the file but in no column, for people
    std::optional<LasHeaderInfo> las;      ///< of LAS and LAZ files
};

/// Indices in the schema of all columns that PointSource::select() takes: all but coordinates.
KNAP_API std::vector<std::size_t> attributes_of(const SourceInfo& info);

/// Consecutive points of one source.
struct Chunk {
    std::uint64_t first = 0;      ///< index in the source of positions[0]
    std::vector<Vec3> positions;  ///< cloud units; may be non-finite: the reader does not judge

    /// One for each selected attribute, in the order selected, as stored, in the byte order of this
    /// machine: the value of positions[i] is at [i * value_size, (i + 1) * value_size).
    std::vector<std::vector<std::byte>> columns;
};

/// A pull stream of points. Not thread-safe; open one per thread, as many as wanted on one file.
class KNAP_API PointSource {
  public:
    virtual ~PointSource() = default;

    virtual const SourceInfo& info() const = 0;

    /// From the next read() on, chunks have these columns. None are selected at first: then a
    /// source does no work for them.
    /// @param attributes  indices into info().schema, each at most once, no coordinates; none: no
    ///                    columns
    /// @throws ConfigError if an index is a coordinate's, out of range, or there twice
    virtual void select(std::span<const std::size_t> attributes) = 0;

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
/// PLY, LAS, LAZ (COPC as LAZ), PCD, Draco, XYZ, CSV, TXT, PTS; PLY and text behind gzip; a knap
/// archive, by its folder or its manifest.json.
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
