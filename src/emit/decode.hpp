#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace knap {

struct DecodeResult {
    std::uint64_t points = 0;
    std::uint64_t bytes = 0;         ///< of the file written
    std::vector<std::string> notes;  ///< what the file cannot say as it is, for people
};

/// Turns an archive, or a single Draco file, into an ordinary file by its ending: .ply (binary
/// doubles), .las, .laz, or .xyz (text; numbers that read back as the same doubles), with all
/// attributes. Positions lie exactly on the lattice; in LAS and LAZ on the grid of the sources, if
/// they have one. Those of a Draco file that is not knap's are as it stores them. One tile is in
/// memory at a time.
///
/// @param input      an archive folder or a Draco file
/// @param output     appears whole or not at all
/// @param overwrite  replace a file that exists
/// @throws ConfigError   if the ending is another, or the file exists and is not to be replaced
/// @throws InputError    if the input is missing or damaged, or has a value that the format does
///                       not hold
/// @throws StorageError  if the disk is full or fails
DecodeResult decode(const std::filesystem::path& input, const std::filesystem::path& output,
                    bool overwrite);

}  // namespace knap
