#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "knap/archive.hpp"

namespace knap {

/// Newest version of the archive format that this code writes and reads.
inline constexpr int kArchiveFormatVersion = 1;

/// Name of the manifest in an archive folder.
inline constexpr std::string_view kManifestName = "manifest.json";

/// Name of the report in an archive folder, where there is one.
inline constexpr std::string_view kReportName = "report.html";

/// The manifest as JSON text: the same bytes for the same manifest. Numbers read back as the
/// doubles they were; infinite ones are the strings "inf" and "-inf". The last key is a checksum
/// of all others.
std::string format_manifest(const Manifest& manifest);

/// The manifest that a text holds.
/// @param file  named in errors
/// @throws InputError naming file and key if the text is not a manifest, is of a newer version or
///         does not match its checksum
Manifest parse_manifest(std::string_view text, const std::filesystem::path& file);

/// Reads `folder`/manifest.json.
/// @throws InputError as parse_manifest(), or if there is none
Manifest read_manifest(const std::filesystem::path& folder);

/// Writes `folder`/manifest.json; it appears whole or not at all.
/// @throws StorageError
void write_manifest(const std::filesystem::path& folder, const Manifest& manifest);

}  // namespace knap
