#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "knap/archive.hpp"

namespace knap {

/// A file that is handed out.
struct SiteFile {
    std::filesystem::path path;
    std::string type;  ///< MIME type
};

/// All that a server hands out, by the address: "/archive/manifest.json". What is not named here
/// cannot be asked for, however the address is written.
using Site = std::map<std::string, SiteFile>;

/// Where the page of the viewer lies: beside the program (as it is built), or in share/knap/viewer
/// (as it is installed).
/// @param program  the running program's file
/// @throws StorageError naming both places if there is no page in them
std::filesystem::path find_page(const std::filesystem::path& program);

/// Adds every file of the page's folder; its index.html is "/" too.
/// @throws StorageError if the folder cannot be read
void add_page(Site& site, const std::filesystem::path& folder);

/// Adds an archive's manifest and the tiles that it names.
/// @param address  of the folder, as "/archive/"
void add_archive(Site& site, const std::string& address, const Archive& archive);

}  // namespace knap
