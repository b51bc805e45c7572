#pragma once

#include <string>

#include "knap/archive.hpp"
#include "knap/source.hpp"

namespace knap::app {

/// What `knap info --json` writes of a point cloud: see docs/formats.md.
std::string info_json(const SourceInfo& info);

/// The same of an archive.
std::string info_json(const Archive& archive);

/// The same of a Draco file.
/// @throws InputError if it cannot be read
std::string info_json_of_draco(const std::string& path);

}  // namespace knap::app
