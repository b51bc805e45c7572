#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "base/file.hpp"
#include "knap/params.hpp"
#include "store/selection.hpp"

namespace knap {

/// What an output path asks for.
enum class OutputKind {
    kArchive,
    kDraco,
    kCloud,  ///< an ordinary file: PLY, LAS, LAZ, XYZ
};

/// The kind by the ending, in any case: .drc; .ply, .las, .laz, .xyz; otherwise an archive folder.
/// @throws ConfigError for endings of clouds that knap does not write
OutputKind output_kind(const std::string& path);

/// The path as files are named by it: without a slash at the end.
std::filesystem::path output_path(const std::string& path);

/// Where the report of an output goes: into an archive, or beside a file.
std::filesystem::path report_path(const std::string& path);

/// Refuses, before any work is done, outputs that could not be written in the end: existing ones
/// without `overwrite`, folders that are not archives of knap (with or without), outputs that are
/// an input, folders that do not exist or cannot be written to. Leaves nothing behind.
///
/// @param inputs  the sources
/// @throws ConfigError naming key and path
void check_output(const OutputParams& output, std::span<const std::filesystem::path> inputs = {});

/// True if a folder holds nothing but what an archive holds: knap may replace or remove it.
bool holds_only_archive(const std::filesystem::path& folder);

/// The same of a folder of 3D Tiles within an archive.
bool holds_only_tileset(const std::filesystem::path& folder);

/// Writes the kept ids, one decimal number a line, ascending.
/// @return  the whole file, still to be committed
/// @throws StorageError
[[nodiscard]] std::unique_ptr<AtomicFile> write_ids(const std::filesystem::path& path,
                                                    const Selection& selection);

}  // namespace knap
