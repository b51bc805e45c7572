#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "knap/geometry.hpp"
#include "knap/source.hpp"

namespace knap {

/// Positions in the form that their source uses: the bits of floats or doubles, or the native
/// integers of a LAS file. Gives back the reader's doubles bit for bit.
class PositionCodec {
  public:
    PositionCodec() = default;
    explicit PositionCodec(const CoordinateFormat& format)
        : format_(format), axes_{format.axis(0), format.axis(1), format.axis(2)} {}

    /// Bytes of a packed position: 12 or 24.
    std::size_t size() const {
        return 3 * (format_.kind == CoordinateKind::kFloat64 ? sizeof(double) : sizeof(float));
    }

    /// Writes size() bytes.
    /// @param position  as the reader gave it; finite if the format is kInt32
    void pack(const Vec3& position, std::byte* out) const {
        if (format_.kind == CoordinateKind::kFloat64) {
            std::memcpy(out, &position, sizeof position);
            return;
        }
        for (int axis = 0; axis < 3; ++axis) {
            std::byte* at = out + static_cast<std::size_t>(axis) * 4;
            if (format_.kind == CoordinateKind::kFloat32) {
                const auto value = static_cast<float>(position[axis]);
                std::memcpy(at, &value, sizeof value);
            } else {
                const std::int32_t value =
                    nearest_int32((position[axis] - format_.offset[axis]) / format_.scale[axis]);
                std::memcpy(at, &value, sizeof value);
            }
        }
    }

    /// Reads size() bytes.
    Vec3 unpack(const std::byte* in) const {
        Vec3 position;
        if (format_.kind == CoordinateKind::kFloat64) {
            std::memcpy(&position, in, sizeof position);
            return position;
        }
        for (int axis = 0; axis < 3; ++axis) {
            const std::byte* at = in + static_cast<std::size_t>(axis) * 4;
            if (format_.kind == CoordinateKind::kFloat32) {
                float value = 0;
                std::memcpy(&value, at, sizeof value);
                position[axis] = static_cast<double>(value);
            } else {
                std::int32_t value = 0;
                std::memcpy(&value, at, sizeof value);
                position[axis] = axes_[static_cast<std::size_t>(axis)].at(value);
            }
        }
        return position;
    }

  private:
    static_assert(sizeof(Vec3) == 3 * sizeof(double));

    // The value is an integer but for the rounding of the reader's multiplication and addition, so
    // adding a half and truncating is rounding, without a call to the mathematics library.
    static std::int32_t nearest_int32(double value) {
        const double shifted = value + std::copysign(0.5, value);
        return static_cast<std::int32_t>(std::clamp(shifted, -2147483648.0, 2147483647.0));
    }

    CoordinateFormat format_;
    std::array<GridAxis, 3> axes_;
};

}  // namespace knap
