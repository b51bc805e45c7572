#include "emit/output_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>
#include <system_error>

#include "base/file.hpp"
#include "knap/error.hpp"
#include "output/cloud_writer.hpp"
#include "store/manifest.hpp"
#include "store/tileset_file.hpp"

namespace knap {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kOutputKey = "output.path (--output)";
constexpr std::string_view kIdsKey = "output.ids (--ids)";
constexpr std::string_view kTilesetKey = "output.tileset (--tileset)";
constexpr std::string_view kReportKey = "output.report (--report)";

// A folder of such a name is never what was meant.
constexpr std::array<std::string_view, 10> kUnwritable{".txt", ".csv", ".pts", ".ptx", ".pcd",
                                                       ".obj", ".stl", ".e57", ".off", ".toml"};

std::string ending_of(const fs::path& path) {
    std::string ending = path.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return ending;
}

[[noreturn]] void refuse(std::string_view key, const fs::path& path, std::string_view why) {
    throw ConfigError(fmt::format("{}: {}: {}", key, path.string(), why));
}

bool is_there(const fs::path& path) {
    std::error_code ignored;
    return fs::exists(fs::symlink_status(path, ignored));
}

fs::path folder_of(const fs::path& path) {
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

// Permissions, read-only disks and quotas show only when something is written.
void check_writable(std::string_view key, const fs::path& path) {
    std::error_code error;
    if (!fs::is_directory(folder_of(path), error)) {
        refuse(key, path,
               fmt::format("expected a folder {}, found none", folder_of(path).string()));
    }
    try {
        const AtomicFile probe(path.string() + ".probe");
    } catch (const StorageError& failure) {
        refuse(key, path,
               fmt::format("expected a folder that can be written to ({})", failure.what()));
    }
}

void check_no_input(std::string_view key, const fs::path& path, std::span<const fs::path> inputs) {
    for (const fs::path& input : inputs) {
        std::error_code ignored;
        // An archive is read by its manifest; another must not take its folder.
        if (fs::equivalent(path, input, ignored) ||
            fs::equivalent(path, input.parent_path(), ignored)) {
            refuse(key, path, "expected an output that is no input");
        }
    }
}

void check_file(std::string_view key, const fs::path& path, bool overwrite) {
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) {
        refuse(key, path, "expected a file, found a folder");
    }
    if (is_there(path) && !overwrite) {
        refuse(key, path, "exists (needs --overwrite)");
    }
}

void check_folder(const fs::path& path, bool overwrite) {
    std::error_code ignored;
    if (is_there(path)) {
        if (!overwrite) {
            refuse(kOutputKey, path, "exists (needs --overwrite)");
        }
        const bool replaceable =
            holds_only_archive(path) &&
            (fs::exists(path / kManifestName, ignored) || fs::is_empty(path, ignored));
        if (!replaceable) {
            refuse(kOutputKey, path,
                   "expected an archive of knap to overwrite, found something else, which is left "
                   "alone");
        }
    }
    const fs::path partial = path.string() + ".partial";
    if (is_there(partial) && !holds_only_archive(partial)) {
        refuse(kOutputKey, partial, "is in the way: expected none, or what an earlier job left");
    }
}

bool is_file_or_partial(std::string_view name, std::string_view file) {
    return name == file || name == fmt::format("{}.partial", file);
}

bool is_numbered(const std::string& name, std::string_view ending) {
    const std::size_t digits = name.find_first_not_of("0123456789");
    return digits != 0 && digits != std::string::npos &&
           is_file_or_partial(std::string_view(name).substr(digits), ending);
}

// While one is replaced there are two.
bool is_tileset_folder(std::string_view name) {
    return is_file_or_partial(name, kTilesetFolder) ||
           name == fmt::format("{}.old", kTilesetFolder);
}

// "000012.pnts", or "000012-3.pnts"
bool is_tileset_file(const std::string& name) {
    const std::size_t dash = name.find('-');
    return is_file_or_partial(name, kTilesetName) || is_numbered(name, ".pnts") ||
           (dash > 0 && dash < name.size() && name.find_first_not_of("0123456789") == dash &&
            is_numbered(name.substr(dash + 1), ".pnts"));
}

}  // namespace

OutputKind output_kind(const std::string& path) {
    const std::string ending = ending_of(output_path(path));
    if (ending == ".drc") {
        return OutputKind::kDraco;
    }
    if (cloud_format_of(output_path(path))) {
        return OutputKind::kCloud;
    }
    if (std::find(kUnwritable.begin(), kUnwritable.end(), ending) != kUnwritable.end()) {
        refuse(kOutputKey, path,
               fmt::format("expected a folder, or a file ending in .drc, .ply, .las, .laz or .xyz, "
                           "found {}",
                           ending));
    }
    return OutputKind::kArchive;
}

fs::path output_path(const std::string& path) {
    const fs::path normal = fs::path(path).lexically_normal();
    return normal.has_filename() || !normal.has_relative_path() ? normal : normal.parent_path();
}

fs::path report_path(const std::string& path) {
    const fs::path output = output_path(path);
    return output_kind(path) == OutputKind::kArchive
               ? output / kReportName
               : fs::path(fmt::format("{}.{}", output.string(), kReportName));
}

void check_output(const OutputParams& output, std::span<const fs::path> inputs) {
    const OutputKind kind = output_kind(output.path);
    const fs::path path = output_path(output.path);
    if (output.flag && kind != OutputKind::kCloud) {
        refuse("output.flag (--flag)", path,
               "expected a file ending in .ply, .las, .laz or .xyz, found Draco");
    }
    if (output.flag && output.measures) {
        refuse("output.measures (--measures)", path,
               "expected kept points only, found output.flag (--flag)");
    }
    if (output.tileset && kind != OutputKind::kArchive) {
        refuse(kTilesetKey, path, "expected an archive folder, found a file");
    }
    check_no_input(kOutputKey, path, inputs);
    if (kind == OutputKind::kArchive) {
        check_folder(path, output.overwrite);
    } else {
        check_file(kOutputKey, path, output.overwrite);
    }
    check_writable(kOutputKey, path);
    const fs::path report = report_path(output.path);
    if (output.report && kind != OutputKind::kArchive) {
        check_no_input(kReportKey, report, inputs);
        check_file(kReportKey, report, output.overwrite);
        check_writable(kReportKey, report);
    }
    if (!output.ids.empty()) {
        const fs::path ids = output.ids;
        check_no_input(kIdsKey, ids, inputs);
        if (ids.lexically_normal() == path) {
            refuse(kIdsKey, ids, "expected another file than the output");
        }
        if (output.report && ids.lexically_normal() == report) {
            refuse(kIdsKey, ids, "expected another file than the report");
        }
        check_file(kIdsKey, ids, output.overwrite);
        check_writable(kIdsKey, ids);
    }
}

bool holds_only_archive(const fs::path& folder) {
    std::error_code error;
    if (!fs::is_directory(folder, error)) {
        return false;
    }
    for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        const bool folder_entry = entry->is_directory(error) && !entry->is_symlink(error);
        bool known = false;
        if (entry.depth() == 0) {
            known = folder_entry ? name == "tiles" || is_tileset_folder(name)
                                 : is_file_or_partial(name, kManifestName) ||
                                       is_file_or_partial(name, kReportName);
        } else if (entry.depth() == 1 && !folder_entry) {
            known = entry->path().parent_path().filename() == "tiles" ? is_numbered(name, ".drc")
                                                                      : is_tileset_file(name);
        }
        if (!known) {
            return false;
        }
    }
    return !error;
}

bool holds_only_tileset(const fs::path& folder) {
    std::error_code error;
    if (!fs::is_directory(folder, error)) {
        return false;
    }
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        if (entry->is_directory(error) || !is_tileset_file(entry->path().filename().string())) {
            return false;
        }
    }
    return !error;
}

std::unique_ptr<AtomicFile> write_ids(const fs::path& path, const Selection& selection) {
    auto file = std::make_unique<AtomicFile>(path);
    fmt::memory_buffer text;
    for (PointId id = 0; id < selection.size(); ++id) {
        if (selection.test(id)) {
            fmt::format_to(std::back_inserter(text), "{}\n", id);
        }
        if (text.size() >= (std::size_t{1} << 20) || id + 1 == selection.size()) {
            file->write(std::string_view(text.data(), text.size()));
            text.clear();
        }
    }
    return file;
}

}  // namespace knap
