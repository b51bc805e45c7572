#include "emit/draco_tile.hpp"

#include <draco/compression/config/compression_shared.h>
#include <draco/compression/expert_encode.h>
#include <draco/core/encoder_buffer.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/point_cloud/point_cloud_builder.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>

#include "emit/tiles.hpp"
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

/// A float without loss and without a decimal point, which some locales write as a comma.
std::string exact_text(float value) {
    int exponent = 0;
    const float mantissa = std::frexp(value, &exponent);
    return fmt::format("0x{:x}p{}", static_cast<std::uint32_t>(std::ldexp(mantissa, 24)),
                       exponent - 24);
}

/// Explicit quantisation whose unit is one lattice step: a coordinate moves by less than
/// 2^20 steps * 2^-22 = 1/4 step before it is rounded to the integer.
///
/// Set by name, because Draco's own setter passes the range through text of six decimals.
draco::Options quantisation(int bits, double step) {
    const double range = step * static_cast<double>((std::int64_t{1} << bits) - 1);
    draco::Options options;
    options.SetInt("quantization_bits", bits);
    options.SetString("quantization_origin", "0 0 0");
    options.SetString("quantization_range", exact_text(static_cast<float>(range)));
    return options;
}

std::vector<std::byte> encode(std::span<const LatticeIndex> points, const LatticeIndex& origin,
                              const Lattice& lattice, const std::string& crs) {
    draco::PointCloudBuilder builder;
    builder.Start(static_cast<std::uint32_t>(points.size()));
    const int attribute =
        builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        std::array<float, 3> local{};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const std::int64_t steps = points[i][axis] - origin[axis];
            local[axis] = static_cast<float>(static_cast<double>(steps) * lattice.step);
        }
        builder.SetAttributeValueForPoint(attribute, draco::PointIndex(i), local.data());
    }
    const std::unique_ptr<draco::PointCloud> cloud = builder.Finalize(false);
    if (cloud == nullptr) {
        throw StorageError(fmt::format("Draco cannot hold a tile of {} points", points.size()));
    }
    cloud->AddMetadata(metadata_of(origin, lattice, crs));

    draco::ExpertEncoder encoder(*cloud);
    encoder.SetEncodingMethod(draco::POINT_CLOUD_KD_TREE_ENCODING);
    encoder.SetSpeedOptions(kSpeed, kSpeed);
    encoder.options().SetAttributeOptions(attribute,
                                          quantisation(bits_of(points, origin), lattice.step));
    draco::EncoderBuffer buffer;
    const draco::Status status = encoder.EncodeToBuffer(&buffer);
    if (!status.ok()) {
        throw StorageError(fmt::format("Draco cannot encode a tile of {} points: {}", points.size(),
                                       status.error_msg_string()));
    }
    const auto encoded = std::as_bytes(std::span(buffer.data(), buffer.size()));
    return {encoded.begin(), encoded.end()};
}

}  // namespace

std::vector<std::byte> encode_tile(std::span<const LatticeIndex> points, const LatticeIndex& origin,
                                   const Lattice& lattice, const std::string& crs) {
    std::vector<std::byte> bytes = encode(points, origin, lattice, crs);
    DecodedTile decoded = decode_tile(bytes, "tile just encoded");
    std::sort(decoded.points.begin(), decoded.points.end());
    if (!std::equal(points.begin(), points.end(), decoded.points.begin(), decoded.points.end()) ||
        decoded.origin != origin) {
        throw StorageError(fmt::format(
            "a tile of {} points at lattice index ({}, {}, {}): expected Draco to give them back, "
            "found others",
            points.size(), origin[0], origin[1], origin[2]));
    }
    return bytes;
}

DecodedTile decode_tile(std::span<const std::byte> bytes, const std::filesystem::path& file) {
    const DracoCloud cloud = decode_draco(bytes, file);
    if (!cloud.lattice) {
        throw InputError(fmt::format(
            "{}: expected a Draco file of knap, found one without its metadata", file.string()));
    }
    return on_lattice(cloud, file);
}

DecodedTile on_lattice(const DracoCloud& cloud, const std::filesystem::path& file) {
    DecodedTile tile{{cloud.lattice->origin, cloud.lattice->step},
                     cloud.lattice->tile_origin,
                     {},
                     cloud.lattice->crs};
    tile.points.reserve(cloud.positions.size());
    for (const std::array<float, 3>& local : cloud.positions) {
        LatticeIndex index;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const double steps = static_cast<double>(local[axis]) / tile.lattice.step;
            if (!(std::abs(steps) < static_cast<double>(kLargestLatticeIndex))) {
                throw InputError(fmt::format("{}: expected coordinates on the lattice, found {}",
                                             file.string(), local[axis]));
            }
            index[axis] = tile.origin[axis] + std::llround(steps);
        }
        tile.points.push_back(index);
    }
    return tile;
}

std::uint64_t encode_memory_bytes(std::uint64_t points) {
    // Floats, quantised integers and Draco's working copy both ways, the decoded points.
    return points * 160 + (std::uint64_t{1} << 16);
}

}  // namespace knap
