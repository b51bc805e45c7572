#pragma once

#include <filesystem>

#include "app/synth.hpp"

namespace knap::app {

/// Writes a cloud of any size in constant memory, a few blocks at a time: binary little-endian PLY
/// with float coordinates, or text by the ending .xyz. The same bytes for any thread count.
/// @throws Interrupted, StorageError; the file is then not there
void write_cloud(const SynthCloud& cloud, std::uint64_t points, const std::filesystem::path& path);

}  // namespace knap::app
