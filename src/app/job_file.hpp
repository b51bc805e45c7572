#pragma once

#include <filesystem>

#include "knap/params.hpp"

namespace knap::app {

/// Reads a job from a TOML file; keys that it does not name keep their defaults. Relative paths in
/// it are relative to the current folder, as on the command line. Required keys may be missing:
/// flags can still give them.
/// @throws ConfigError naming file, line and key if the file is no TOML, or a key is unknown, of
/// the
///         wrong type or out of range; InputError if it cannot be read
Job read_job_file(const std::filesystem::path& path);

}  // namespace knap::app
