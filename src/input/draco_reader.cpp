#include "input/draco_reader.hpp"

#include <draco/compression/decode.h>
#include <draco/core/decoder_buffer.h>
#include <draco/metadata/geometry_metadata.h>
#include <draco/point_cloud/point_cloud.h>
#include <fmt/format.h>

#include <cmath>
#include <exception>
#include <memory>

#include "base/file.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr double kLargestIndex = 9007199254740992.0;  // 2^53: whole doubles below are exact

[[noreturn]] void throw_draco(const std::filesystem::path& file, std::string_view found) {
    throw InputError(
        fmt::format("{}: expected a Draco point cloud, found {}", file.string(), found));
}

std::unique_ptr<draco::PointCloud> decode(std::span<const std::byte> bytes,
                                          const std::filesystem::path& file) {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    draco::Decoder decoder;
    try {
        auto decoded = decoder.DecodePointCloudFromBuffer(&buffer);
        if (!decoded.ok()) {
            throw_draco(file, fmt::format("\"{}\"", decoded.status().error_msg_string()));
        }
        return std::move(decoded).value();
    } catch (const Error&) {
        throw;
    } catch (const std::exception& error) {  // damaged counts end in std::bad_alloc
        throw_draco(file, fmt::format("damaged data ({})", error.what()));
    }
}

std::optional<DracoLattice> lattice_of(const draco::GeometryMetadata* metadata,
                                       const std::filesystem::path& file) {
    std::int32_t version = 0;
    if (metadata == nullptr || !metadata->GetEntryInt(draco_keys::kVersion, &version)) {
        return std::nullopt;
    }
    if (version != kDracoLatticeVersion) {
        throw_draco(file, fmt::format("{} {}, which is newer than this program",
                                      draco_keys::kVersion, version));
    }
    DracoLattice lattice;
    std::vector<double> origin;
    std::vector<double> tile_origin;
    const bool complete = metadata->GetEntryDoubleArray(draco_keys::kOrigin, &origin) &&
                          metadata->GetEntryDoubleArray(draco_keys::kTileOrigin, &tile_origin) &&
                          metadata->GetEntryDouble(draco_keys::kStep, &lattice.step) &&
                          origin.size() == 3 && tile_origin.size() == 3;
    bool valid = complete && std::isfinite(lattice.step) && lattice.step > 0;
    for (std::size_t axis = 0; valid && axis < 3; ++axis) {
        valid = std::isfinite(origin[axis]) && std::abs(tile_origin[axis]) < kLargestIndex &&
                tile_origin[axis] == std::trunc(tile_origin[axis]);
        if (valid) {
            lattice.tile_origin[axis] = static_cast<std::int64_t>(tile_origin[axis]);
        }
    }
    if (!valid) {
        throw_draco(file, "metadata that names no lattice");
    }
    lattice.origin = {origin[0], origin[1], origin[2]};
    metadata->GetEntryString(draco_keys::kCrs, &lattice.crs);
    return lattice;
}

}  // namespace

DracoCloud decode_draco(std::span<const std::byte> bytes, const std::filesystem::path& file) {
    const std::unique_ptr<draco::PointCloud> cloud = decode(bytes, file);
    const draco::PointAttribute* attribute =
        cloud->GetNamedAttribute(draco::GeometryAttribute::POSITION);
    if (attribute == nullptr) {
        throw_draco(file, "no positions");
    }
    if (attribute->num_components() != 3) {
        throw_draco(file, fmt::format("positions of {} components", attribute->num_components()));
    }
    DracoCloud result;
    result.lattice = lattice_of(cloud->GetMetadata(), file);
    result.positions.resize(cloud->num_points());
    // Doubles hold what other programs store: floats, doubles, integers of 32 bits.
    result.kind = attribute->data_type() == draco::DT_FLOAT32 ? CoordinateKind::kFloat32
                                                              : CoordinateKind::kFloat64;
    for (std::uint32_t i = 0; i < cloud->num_points(); ++i) {
        const auto index = attribute->mapped_index(draco::PointIndex(i));
        std::array<double, 3> position{};
        if (!attribute->ConvertValue<double>(index, 3, position.data())) {
            throw_draco(file, fmt::format("no position for point {}", i));
        }
        result.positions[i] = {position[0], position[1], position[2]};
    }
    result.columns = draco_columns(*cloud, file);
    return result;
}

DracoCloud read_draco(const std::filesystem::path& file) {
    const InputFile input(file);
    std::vector<std::byte> bytes(input.size());
    bytes.resize(input.read_some(0, bytes));
    return decode_draco(bytes, file);
}

}  // namespace knap
