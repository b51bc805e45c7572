#include "input/draco_source.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "input/draco_reader.hpp"
#include "input/tiled_source.hpp"

namespace knap {

namespace {

constexpr std::size_t kEncoderType = 7;  // behind the signature and the version
constexpr std::byte kMesh{1};

/// Puts what knap wrote back on its lattice, and anything else where it is.
std::vector<Vec3> positions_of(const DracoCloud& cloud, const InputFile& file,
                               CoordinateFormat& format) {
    if (!cloud.lattice) {
        format.kind = cloud.kind;
        return cloud.positions;
    }
    std::vector<Vec3> positions;
    positions.reserve(cloud.positions.size());
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
    std::array<std::int64_t, 3> low{kMost, kMost, kMost};
    std::array<std::int64_t, 3> high{-kMost, -kMost, -kMost};
    const DracoLattice& lattice = *cloud.lattice;
    for (const auto& index : lattice_indices(cloud, file.path())) {
        positions.push_back(lattice_position(lattice.origin, lattice.step, index));
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], index[axis]);
            high[axis] = std::max(high[axis], index[axis]);
        }
    }
    format = format_of_lattice(lattice.origin, lattice.step, low, high);
    return positions;
}

ScalarType scalar_of(CoordinateKind kind) {
    switch (kind) {
        case CoordinateKind::kFloat32:
            return ScalarType::kFloat32;
        case CoordinateKind::kInt32:
            return ScalarType::kInt32;
        case CoordinateKind::kFloat64:
            break;
    }
    return ScalarType::kFloat64;
}

}  // namespace

std::unique_ptr<PointSource> open_draco(const InputFile& file) {
    std::vector<std::byte> bytes(file.size());
    bytes.resize(file.read_some(0, bytes));
    DracoCloud cloud = decode_draco(bytes, file.path());
    SourceInfo info;
    info.path = file.path();
    info.format = cloud.lattice ? "Draco, written by knap" : "Draco";
    if (bytes.size() > kEncoderType && bytes[kEncoderType] == kMesh) {
        info.format = "Draco (mesh)";
        info.unsupported.emplace_back("the faces of the mesh");
    }
    const auto content = std::make_shared<TileContent>();
    content->positions = positions_of(cloud, file, info.coordinates);
    content->columns = std::move(cloud.columns.values);
    info.schema = schema_of_tiles(scalar_of(info.coordinates.kind), cloud.columns.attributes);
    info.declared_count = content->positions.size();
    info.crs = cloud.lattice ? cloud.lattice->crs : "";
    info.size_bytes = file.size();
    const std::uint64_t points = content->positions.size();
    return open_tiles(std::move(info), {points},
                      [content](std::size_t) { return std::move(*content); });
}

}  // namespace knap
