#pragma once

#include <draco/compression/config/compression_shared.h>
#include <draco/core/options.h>
#include <draco/point_cloud/point_cloud.h>

#include <cstddef>
#include <span>

#include "knap/source.hpp"

/// What every Draco cloud of knap is put together from. For the files that may know Draco.
namespace knap {

/// Explicit quantisation from 0 on, whose unit is one step. Coordinates are floats: they move by
/// less than 2^bits steps * 2^-22 before they are rounded to the integer.
/// @param bits  >= 1
draco::Options quantisation(int bits, double step);

/// Draco's name of a type; none of 64 bits.
draco::DataType draco_type(ScalarType type);

/// Adds an attribute with values for all points, one behind the other.
/// @return  its number
int add_attribute(draco::PointCloud& cloud, draco::GeometryAttribute::Type kind,
                  draco::DataType type, std::size_t components, bool normalized,
                  std::span<const std::byte> values);

}  // namespace knap
