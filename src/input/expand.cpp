#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <map>
#include <system_error>

#include "base/file.hpp"
#include "input/recognise.hpp"
#include "knap/error.hpp"
#include "knap/source.hpp"
#include "store/manifest.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;

bool is_hidden(const fs::path& path) {
    return path.filename().string().starts_with('.');
}

/// An archive that a job is at work on, or left to go on with, and its files.
bool is_unfinished(const fs::path& path) {
    return path.extension() == ".partial";
}

/// Is this folder a knap archive? Then it is one point cloud, whatever files it has.
bool is_archive(const fs::path& folder) {
    const fs::path manifest = folder / kManifestName;
    std::error_code ignored;
    return fs::is_regular_file(manifest, ignored) &&
           recognise(InputFile(manifest)).format == FileFormat::kArchive;
}

/// All point clouds below a folder, sorted by path. Hidden and unfinished ones are left out.
std::vector<fs::path> list_folder(const fs::path& folder, std::vector<fs::path>* left_out) {
    std::vector<fs::path> files;
    try {
        for (auto entry = fs::recursive_directory_iterator(folder); entry != fs::end(entry);
             ++entry) {
            if (is_hidden(entry->path()) || is_unfinished(entry->path())) {
                entry.disable_recursion_pending();
            } else if (entry->is_directory() && is_archive(entry->path())) {
                files.push_back(entry->path() / kManifestName);
                entry.disable_recursion_pending();
            } else if (entry->is_regular_file()) {
                if (recognise(InputFile(entry->path())).certain) {
                    files.push_back(entry->path());
                } else if (left_out != nullptr) {
                    left_out->push_back(entry->path());
                }
            }
        }
    } catch (const fs::filesystem_error& error) {
        throw InputError(fmt::format("{}: cannot list the folder: {}", error.path1().string(),
                                     error.code().message()));
    }
    if (files.empty()) {
        throw InputError(
            fmt::format("{}: expected point clouds in the folder, found none", folder.string()));
    }
    std::ranges::sort(files);
    return files;
}

/// What a pattern matches, sorted bytewise; empty if nothing.
std::vector<fs::path> match(const std::string& pattern) {
    glob_t matches{};
    const int status = ::glob(pattern.c_str(), GLOB_NOSORT, nullptr, &matches);
    std::vector<fs::path> paths(matches.gl_pathv, matches.gl_pathv + matches.gl_pathc);
    ::globfree(&matches);
    if (status != 0 && status != GLOB_NOMATCH) {
        throw InputError(fmt::format("{}: cannot match the pattern against files", pattern));
    }
    std::ranges::sort(paths);
    return paths;
}

void append(std::vector<fs::path>& files, const fs::path& path, std::vector<fs::path>* left_out) {
    if (is_archive(path)) {
        files.push_back(path / kManifestName);
    } else if (fs::is_directory(path)) {
        const std::vector<fs::path> inside = list_folder(path, left_out);
        files.insert(files.end(), inside.begin(), inside.end());
    } else {
        files.push_back(path);
    }
}

/// The same scan twice in one archive is a mistake, whatever names it goes by.
void reject_duplicates(const std::vector<fs::path>& files) {
    std::map<fs::path, fs::path> seen;
    for (const fs::path& file : files) {
        std::error_code error;
        const fs::path real = fs::canonical(file, error);
        const auto [other, is_new] = seen.emplace(error ? file : real, file);
        if (!is_new) {
            throw InputError(
                fmt::format("{}: expected each input once, found it twice (also as {})",
                            file.string(), other->second.string()));
        }
    }
}

}  // namespace

std::vector<fs::path> expand_sources(const std::vector<std::string>& patterns,
                                     std::vector<fs::path>* left_out) {
    std::vector<fs::path> files;
    for (const std::string& pattern : patterns) {
        std::error_code error;
        if (fs::exists(pattern, error)) {
            append(files, pattern, left_out);
            continue;
        }
        const std::vector<fs::path> matches = match(pattern);
        if (matches.empty()) {
            throw InputError(fmt::format(
                "{}: expected a file, a folder or a pattern of some, found nothing", pattern));
        }
        for (const fs::path& path : matches) {
            append(files, path, left_out);
        }
    }
    reject_duplicates(files);
    if (left_out != nullptr) {
        std::ranges::sort(*left_out);
    }
    return files;
}

}  // namespace knap
