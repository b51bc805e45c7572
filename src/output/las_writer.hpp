#pragma once

#include <filesystem>
#include <memory>

#include "output/cloud_writer.hpp"

namespace knap {

/// Begins a LAS or LAZ file. Header counts, box and places are put right when it is complete.
/// @param header      coordinates are kInt32
/// @param compressed  LAZ
/// @throws ConfigError   as LasFields; or knap was built without LASzip
/// @throws StorageError  if the file cannot be created
std::unique_ptr<CloudWriter> open_las_writer(const std::filesystem::path& path,
                                             const CloudHeader& header, bool compressed);

}  // namespace knap
