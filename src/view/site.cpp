#include "view/site.hpp"

#include <fmt/format.h>

#include <array>
#include <string_view>
#include <system_error>
#include <utility>

#include "knap/error.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kIndex = "index.html";

using TypeOfEnding = std::pair<std::string_view, std::string_view>;
constexpr std::array kTypes{
    TypeOfEnding{".html", "text/html; charset=utf-8"},
    TypeOfEnding{".css", "text/css; charset=utf-8"},
    TypeOfEnding{".js", "text/javascript; charset=utf-8"},
    TypeOfEnding{".mjs", "text/javascript; charset=utf-8"},
    TypeOfEnding{".json", "application/json"},
    TypeOfEnding{".svg", "image/svg+xml"},
    TypeOfEnding{".wasm", "application/wasm"},
};

std::string type_of(const fs::path& path) {
    const std::string ending = path.extension().string();
    for (const auto& [known, type] : kTypes) {
        if (ending == known) {
            return std::string(type);
        }
    }
    return "application/octet-stream";
}

}  // namespace

fs::path find_page(const fs::path& program) {
    const fs::path folder = program.parent_path();
    const std::array places{folder / "viewer", folder.parent_path() / "share" / "knap" / "viewer"};
    for (const fs::path& place : places) {
        std::error_code ignored;
        if (fs::is_regular_file(place / kIndex, ignored)) {
            return place;
        }
    }
    throw StorageError(
        fmt::format("the viewer's page: expected {} in {} or {}, found none; it is built where npm "
                    "is (tools/setup --viewer)",
                    kIndex, places[0].string(), places[1].string()));
}

void add_page(Site& site, const fs::path& folder) {
    std::error_code error;
    fs::recursive_directory_iterator entry(folder, error);
    for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
        if (entry->is_regular_file()) {
            const fs::path& path = entry->path();
            site[fmt::format("/{}", path.lexically_relative(folder).generic_string())] = {
                path, type_of(path)};
        }
    }
    if (error) {
        throw StorageError(fmt::format("{}: cannot read: {}", folder.string(), error.message()));
    }
    site["/"] = {folder / kIndex, type_of(kIndex)};
}

void add_archive(Site& site, const std::string& address, const Archive& archive) {
    const auto add = [&](const std::string& file) {
        const fs::path path = archive.folder() / file;
        site[address + file] = {path, type_of(path)};
    };
    add("manifest.json");
    for (const ManifestTile& tile : archive.manifest().tiles) {
        add(tile.file);
    }
}

}  // namespace knap
