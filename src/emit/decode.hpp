#pragma once

#include <cstdint>
#include <filesystem>

namespace knap {

struct DecodeResult {
    std::uint64_t points = 0;
    std::uint64_t bytes = 0;  ///< of the file written
};

/// Turns an archive, or a single Draco file, into an ordinary file by its ending: .ply (binary
/// doubles) or .xyz (text; numbers that read back as the same doubles). Positions lie exactly on
/// the lattice; those of a Draco file that is not knap's are as it stores them. One tile is in
/// memory at a time.
///
/// @param input      an archive folder or a Draco file
/// @param output     appears whole or not at all
/// @param overwrite  replace a file that exists
/// @throws ConfigError   if the ending is another, or the file exists and is not to be replaced
/// @throws InputError    if the input is missing or damaged
/// @throws StorageError  if the disk is full or fails
DecodeResult decode(const std::filesystem::path& input, const std::filesystem::path& output,
                    bool overwrite);

}  // namespace knap
