#pragma once

#include <filesystem>
#include <string>

namespace knap::test {

/// All files of a folder, names and bytes, in order of their names.
std::string archive_bytes(const std::filesystem::path& folder);

}  // namespace knap::test
