#include "emit/draco_tile.hpp"

#include <draco/compression/config/compression_shared.h>
#include <draco/compression/expert_encode.h>
#include <draco/core/encoder_buffer.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/point_cloud/point_cloud.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <utility>

#include "base/checksum.hpp"
#include "emit/attribute_plan.hpp"
#include "emit/draco_parts.hpp"
#include "emit/tiles.hpp"
#include "input/draco_attributes.hpp"
#include "input/tiled_source.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr int kSpeed = 5;  // of Draco: 0 smallest .. 10 fastest

/// Bits that hold every local coordinate; Draco wants at least one.
int bits_of(std::span<const LatticeIndex> points, const LatticeIndex& origin) {
    std::int64_t largest = 1;
    for (const LatticeIndex& point : points) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            largest = std::max(largest, point[axis] - origin[axis]);
        }
    }
    return static_cast<int>(std::bit_width(static_cast<std::uint64_t>(largest)));
}

std::unique_ptr<draco::GeometryMetadata> metadata_of(const LatticeIndex& origin,
                                                     const Lattice& lattice,
                                                     const std::string& crs) {
    auto metadata = std::make_unique<draco::GeometryMetadata>();
    metadata->AddEntryInt(draco_keys::kVersion, kDracoLatticeVersion);
    metadata->AddEntryDoubleArray(draco_keys::kOrigin,
                                  {lattice.origin.x, lattice.origin.y, lattice.origin.z});
    metadata->AddEntryDouble(draco_keys::kStep, lattice.step);
    metadata->AddEntryDoubleArray(draco_keys::kTileOrigin,
                                  {static_cast<double>(origin[0]), static_cast<double>(origin[1]),
                                   static_cast<double>(origin[2])});
    if (!crs.empty()) {
        metadata->AddEntryString(draco_keys::kCrs, crs);
    }
    return metadata;
}

int add_positions(draco::PointCloud& cloud, const TilePoints& tile,
                  std::span<const std::size_t> order, double step) {
    std::vector<std::array<float, 3>> local(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::int64_t steps = tile.points[order[i]][axis] - tile.origin[axis];
            local[i][axis] = static_cast<float>(static_cast<double>(steps) * step);
        }
    }
    return add_attribute(cloud, draco::GeometryAttribute::POSITION, draco::DT_FLOAT32, 3, false,
                         std::as_bytes(std::span(local)));
}

std::vector<std::int32_t> halves_of(const std::vector<std::uint64_t>& values) {
    std::vector<std::int32_t> halves(2 * values.size());
    std::memcpy(halves.data(), values.data(), values.size() * sizeof(std::uint64_t));
    return halves;
}

std::unique_ptr<draco::AttributeMetadata> metadata_of(const TileAttribute& group,
                                                      std::span<const Attribute> attributes) {
    auto metadata = std::make_unique<draco::AttributeMetadata>();
    const Attribute& first = attributes[group.members.front()];
    const bool alone = group.kind == TileAttribute::Kind::kGeneric;
    metadata->AddEntryString(draco_keys::kAttributeName,
                             alone                                        ? first.name
                             : group.kind == TileAttribute::Kind::kNormal ? "normal"
                                                                          : "color");
    metadata->AddEntryString(draco_keys::kAttributeType, to_string(group.type));
    if (first.scale != 1) {
        metadata->AddEntryDouble(draco_keys::kAttributeScale, first.scale);
    }
    if (first.offset != 0) {
        metadata->AddEntryDouble(draco_keys::kAttributeOffset, first.offset);
    }
    if (!first.description.empty()) {
        metadata->AddEntryString(draco_keys::kDescription, first.description);
    }
    for (const auto& [key, list] : draco_keys::kLimits) {
        if (!(first.limits.*list).empty()) {
            metadata->AddEntryIntArray(key, halves_of(first.limits.*list));
        }
    }
    return metadata;
}

/// The values of an attribute, one behind the other, out of the rows.
std::vector<std::byte> values_of(const TilePoints& tile, std::span<const std::size_t> order,
                                 const TileAttribute& group, const RowLayout& layout,
                                 std::span<const Attribute> attributes) {
    std::vector<std::byte> values(order.size() * group.value_size());
    std::byte* out = values.data();
    for (const std::size_t point : order) {
        const std::byte* const row = tile.rows.data() + point * layout.row_size;
        for (const std::size_t member : group.members) {
            const std::size_t size = attributes[member].value_size();
            std::memcpy(out, row + layout.offsets[member], size);
            out += size;
        }
    }
    return values;
}

void add_attributes(draco::PointCloud& cloud, const TilePoints& tile,
                    std::span<const std::size_t> order, const TileFormat& format,
                    TileCoding coding) {
    using Kind = TileAttribute::Kind;
    const RowLayout layout = row_layout(format.attributes);
    for (const TileAttribute& group : tile_attributes(format.attributes, coding)) {
        const std::vector<std::byte> values =
            values_of(tile, order, group, layout, format.attributes);
        const ScalarType type = stored_type(group.type, coding, values);
        const auto kind = group.kind == Kind::kColor    ? draco::GeometryAttribute::COLOR
                          : group.kind == Kind::kNormal ? draco::GeometryAttribute::NORMAL
                                                        : draco::GeometryAttribute::GENERIC;
        const int id =
            add_attribute(cloud, kind, draco_type(type), group.value_size() / size_of(type),
                          group.kind == Kind::kColor, values);
        cloud.AddAttributeMetadata(id, metadata_of(group, format.attributes));
    }
}

std::vector<std::byte> encode(const TilePoints& tile, std::span<const std::size_t> order,
                              const TileFormat& format, TileCoding coding) {
    draco::PointCloud cloud;
    cloud.set_num_points(static_cast<std::uint32_t>(tile.points.size()));
    cloud.AddMetadata(metadata_of(tile.origin, format.lattice, format.crs));
    const int positions = add_positions(cloud, tile, order, format.lattice.step);
    add_attributes(cloud, tile, order, format, coding);

    draco::ExpertEncoder encoder(cloud);
    encoder.SetEncodingMethod(coding == TileCoding::kKdTree
                                  ? draco::POINT_CLOUD_KD_TREE_ENCODING
                                  : draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
    encoder.SetSpeedOptions(kSpeed, kSpeed);
    encoder.options().SetAttributeOptions(
        positions, quantisation(bits_of(tile.points, tile.origin), format.lattice.step));
    draco::EncoderBuffer buffer;
    const draco::Status status = encoder.EncodeToBuffer(&buffer);
    if (!status.ok()) {
        throw StorageError(fmt::format("Draco cannot encode a tile of {} points: {}",
                                       tile.points.size(), status.error_msg_string()));
    }
    const auto encoded = std::as_bytes(std::span(buffer.data(), buffer.size()));
    return {encoded.begin(), encoded.end()};
}

/// Is the same for the same points with the same rows: in any order, or in this one only.
class Fingerprint {
  public:
    explicit Fingerprint(bool in_order) : in_order_(in_order) {}

    void add(const LatticeIndex& point, std::span<const std::byte> row) {
        bytes_.resize(sizeof point + row.size());
        std::memcpy(bytes_.data(), point.data(), sizeof point);
        std::copy(row.begin(), row.end(), bytes_.begin() + sizeof point);
        const std::uint64_t hash = xxh3_64(bytes_);
        sum_ += in_order_ ? splitmix64(hash ^ count_) : hash;
        ++count_;
    }

    friend bool operator==(const Fingerprint& a, const Fingerprint& b) {
        return a.sum_ == b.sum_ && a.count_ == b.count_;
    }

  private:
    bool in_order_;
    std::vector<std::byte> bytes_;
    std::uint64_t sum_ = 0;
    std::uint64_t count_ = 0;
};

/// Where each attribute of the format is among the columns of a tile.
/// @throws StorageError if the tile has others
std::vector<std::size_t> match(const DracoColumns& columns, std::span<const Attribute> attributes) {
    std::vector<std::size_t> places;
    for (const Attribute& attribute : attributes) {
        const auto found =
            std::find(columns.attributes.begin(), columns.attributes.end(), attribute);
        places.push_back(static_cast<std::size_t>(found - columns.attributes.begin()));
    }
    if (columns.attributes.size() != attributes.size() ||
        std::find(places.begin(), places.end(), attributes.size()) != places.end()) {
        throw StorageError("a tile: expected Draco to give its attributes back, found others");
    }
    return places;
}

Fingerprint fingerprint(const TilePoints& tile, std::span<const std::size_t> order,
                        std::size_t row_size, bool in_order) {
    Fingerprint result(in_order);
    for (const std::size_t point : order) {
        result.add(tile.points[point], tile.rows.subspan(point * row_size, row_size));
    }
    return result;
}

Fingerprint fingerprint(const DecodedTile& tile, std::span<const Attribute> attributes,
                        bool in_order) {
    Fingerprint result(in_order);
    const std::vector<std::size_t> places = match(tile.columns, attributes);
    const RowLayout layout = row_layout(attributes);
    std::vector<std::byte> row(layout.row_size);
    for (std::size_t i = 0; i < tile.points.size(); ++i) {
        for (std::size_t k = 0; k < places.size(); ++k) {
            const std::size_t size = attributes[k].value_size();
            std::memcpy(row.data() + layout.offsets[k],
                        tile.columns.values[places[k]].data() + i * size, size);
        }
        result.add(tile.points[i], row);
    }
    return result;
}

}  // namespace

std::vector<std::byte> encode_tile(const TilePoints& tile, const TileFormat& format,
                                   TileCoding coding) {
    if (tile.points.empty()) {  // Draco cannot decode a sequential file of none
        coding = TileCoding::kKdTree;
    }
    const std::vector<std::size_t> order = coding_order(tile.points, tile.origin, coding);
    std::vector<std::byte> bytes = encode(tile, order, format, coding);
    const DecodedTile decoded = decode_tile(bytes, "tile just encoded");
    const bool in_order = coding != TileCoding::kKdTree;
    const std::size_t row_size = row_layout(format.attributes).row_size;
    if (decoded.origin != tile.origin || !(fingerprint(tile, order, row_size, in_order) ==
                                           fingerprint(decoded, format.attributes, in_order))) {
        throw StorageError(fmt::format(
            "a tile of {} points at lattice index ({}, {}, {}): expected Draco to give them back, "
            "found others",
            tile.points.size(), tile.origin[0], tile.origin[1], tile.origin[2]));
    }
    return bytes;
}

std::size_t encoded_size(const TilePoints& tile, const TileFormat& format, TileCoding coding) {
    return encode(tile, coding_order(tile.points, tile.origin, coding), format, coding).size();
}

std::vector<std::byte> encode_smallest(const TilePoints& tile, const TileFormat& format,
                                       TileEncoding encoding) {
    std::vector<std::byte> smallest;
    for (const TileCoding coding : codings(encoding, format.attributes)) {
        std::vector<std::byte> bytes = encode_tile(tile, format, coding);
        if (smallest.empty() || bytes.size() < smallest.size()) {
            smallest = std::move(bytes);
        }
    }
    return smallest;
}

std::vector<std::byte> encode_tile(std::span<const LatticeIndex> points, const LatticeIndex& origin,
                                   const Lattice& lattice, const std::string& crs) {
    return encode_tile({points, {}, origin}, {lattice, crs, {}}, TileCoding::kKdTree);
}

DecodedTile decode_tile(std::span<const std::byte> bytes, const std::filesystem::path& file) {
    DracoCloud cloud = decode_draco(bytes, file);
    if (!cloud.lattice) {
        throw InputError(fmt::format(
            "{}: expected a Draco file of knap, found one without its metadata", file.string()));
    }
    return on_lattice(std::move(cloud), file);
}

DecodedTile on_lattice(DracoCloud cloud, const std::filesystem::path& file) {
    DecodedTile tile{{cloud.lattice->origin, cloud.lattice->step},
                     cloud.lattice->tile_origin,
                     lattice_indices(cloud, file),
                     std::move(cloud.columns),
                     cloud.lattice->crs};
    return tile;
}

std::uint64_t encode_memory_bytes(std::uint64_t points, std::span<const Attribute> attributes) {
    // Floats, quantised integers and Draco's working copy both ways, the decoded points; where
    // there are attributes, the points and rows put in order; of each attribute its bytes there, in
    // Draco's cloud, in what is decoded, and in columns, and four integers of 32 bits for each
    // number that Draco codes.
    std::uint64_t point = attributes.empty() ? 160 : 160 + 48;
    for (const Attribute& attribute : attributes) {
        const std::size_t size = attribute.value_size();
        const std::size_t numbers =
            std::max(size / 2, static_cast<std::size_t>(attribute.components));
        point += 5 * size + 4 * sizeof(std::uint32_t) * numbers;
    }
    return points * point + (std::uint64_t{1} << 16);
}

}  // namespace knap
