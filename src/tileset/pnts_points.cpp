#include "tileset/pnts_points.hpp"

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/core/decoder_buffer.h>
#include <draco/core/encoder_buffer.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "emit/draco_parts.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr int kSpeed = 5;  // of Draco: 0 smallest .. 10 fastest

draco::GeometryAttribute::Type draco_kind(PointsAttribute::Kind kind) {
    switch (kind) {
        case PointsAttribute::Kind::kPosition:
            return draco::GeometryAttribute::POSITION;
        case PointsAttribute::Kind::kColor:
            return draco::GeometryAttribute::COLOR;
        case PointsAttribute::Kind::kNormal:
            return draco::GeometryAttribute::NORMAL;
        case PointsAttribute::Kind::kGeneric:
            break;
    }
    return draco::GeometryAttribute::GENERIC;
}

/// Within a quarter of a step, or the same bits.
bool is_given_back(const PointsAttribute& attribute, const draco::PointAttribute& decoded,
                   std::size_t points, const std::optional<PositionSteps>& steps) {
    const std::size_t size = attribute.values.size() / points;
    std::vector<std::byte> value(size);
    for (std::size_t i = 0; i < points; ++i) {
        const auto index = decoded.mapped_index(draco::PointIndex(static_cast<std::uint32_t>(i)));
        decoded.GetValue(index, value.data());
        const std::byte* const given = attribute.values.data() + i * size;
        if (attribute.kind == PointsAttribute::Kind::kPosition && steps) {
            std::array<float, 3> a{};
            std::array<float, 3> b{};
            std::memcpy(a.data(), given, sizeof a);
            std::memcpy(b.data(), value.data(), sizeof b);
            for (std::size_t axis = 0; axis < 3; ++axis) {
                if (!(std::abs(a[axis] - b[axis]) < steps->step / 4)) {
                    return false;
                }
            }
        } else if (std::memcmp(given, value.data(), size) != 0) {
            return false;
        }
    }
    return true;
}

void check(const CompressedPoints& compressed, std::size_t points,
           std::span<const PointsAttribute> attributes, const std::optional<PositionSteps>& steps) {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(compressed.bytes.data()), compressed.bytes.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodePointCloudFromBuffer(&buffer);
    bool good = decoded.ok() && decoded.value()->num_points() == points;
    for (std::size_t i = 0; good && i < attributes.size(); ++i) {
        const draco::PointAttribute* const attribute =
            decoded.value()->GetAttributeByUniqueId(compressed.ids[i]);
        good = attribute != nullptr && is_given_back(attributes[i], *attribute, points, steps);
    }
    if (!good) {
        throw StorageError(fmt::format(
            "a tile of {} points: expected Draco to give them back, found others", points));
    }
}

}  // namespace

CompressedPoints compress_points(std::size_t points, std::span<const PointsAttribute> attributes,
                                 const std::optional<PositionSteps>& steps) {
    draco::PointCloud cloud;
    cloud.set_num_points(static_cast<std::uint32_t>(points));
    CompressedPoints result;
    result.ids.reserve(attributes.size());
    for (const PointsAttribute& attribute : attributes) {
        const int id =
            add_attribute(cloud, draco_kind(attribute.kind), draco_type(attribute.type),
                          static_cast<std::size_t>(attribute.components),
                          attribute.kind == PointsAttribute::Kind::kColor, attribute.values);
        result.ids.push_back(cloud.attribute(id)->unique_id());
    }
    draco::ExpertEncoder encoder(cloud);
    // Viewers take whole steps as they are stored, which Draco's kd-tree does not give.
    encoder.SetEncodingMethod(draco::POINT_CLOUD_SEQUENTIAL_ENCODING);
    encoder.SetSpeedOptions(kSpeed, kSpeed);
    if (steps) {
        encoder.options().SetAttributeOptions(0, quantisation(steps->bits, steps->step));
    }
    draco::EncoderBuffer buffer;
    const draco::Status status = encoder.EncodeToBuffer(&buffer);
    if (!status.ok()) {
        throw StorageError(fmt::format("Draco cannot encode a tile of {} points: {}", points,
                                       status.error_msg_string()));
    }
    const auto encoded = std::as_bytes(std::span(buffer.data(), buffer.size()));
    result.bytes.assign(encoded.begin(), encoded.end());
    check(result, points, attributes, steps);
    return result;
}

}  // namespace knap
