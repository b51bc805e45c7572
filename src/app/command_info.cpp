#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "app/commands.hpp"
#include "app/format.hpp"
#include "app/info_json.hpp"
#include "base/file.hpp"
#include "knap/archive.hpp"
#include "knap/source.hpp"
#include "store/tileset_file.hpp"

namespace knap::app {

namespace {

std::string row(std::string_view name, const std::string& value) {
    return fmt::format("{:<14} {}\n", name, value);
}

std::string format_vec(const Vec3& v) {
    return fmt::format("({}, {}, {})", v.x, v.y, v.z);
}

std::string format_coordinates(const CoordinateFormat& format) {
    switch (format.kind) {
        case CoordinateKind::kFloat32:
            return "float32";
        case CoordinateKind::kInt32:
            return fmt::format("int32, scale {}, offset {}", format_vec(format.scale),
                               format_vec(format.offset));
        case CoordinateKind::kFloat64:
            break;
    }
    return "float64";
}

std::string format_schema(const std::vector<Attribute>& schema) {
    std::string text;
    for (const Attribute& attribute : schema) {
        text += text.empty() ? "" : ", ";
        text += fmt::format("{} {}", attribute.name, to_string(attribute.type));
        text += attribute.components > 1 ? fmt::format("[{}]", attribute.components) : "";
        text += attribute.scale != 1 || attribute.offset != 0
                    ? fmt::format(" * {} + {}", attribute.scale, attribute.offset)
                    : "";
    }
    return text;
}

std::string format_crs(const std::string& crs) {
    return crs.empty() ? "none" : one_line(crs);
}

/// What a LAS file says beside its points.
std::string describe(const LasHeaderInfo& las) {
    std::string text;
    const auto named = [&](std::string_view name, const std::string& value) {
        text += value.empty() ? "" : row(name, one_line(value));
    };
    named("system", las.system_identifier);
    named("software", las.generating_software);
    if (las.creation_year != 0) {
        text += row("created", fmt::format("day {} of {}", las.creation_day, las.creation_year));
    }
    for (const LasVlr& record : las.records) {
        text += row("record",
                    one_line(fmt::format("{} {}, {} bytes {}", record.user_id, record.record_id,
                                         record.content.size(), record.description)));
    }
    return text;
}

std::string describe(const SourceInfo& info) {
    std::string text = row("file", info.path.string());
    text += row("format", info.format);
    text += row("size", format_bytes(info.size_bytes));
    text +=
        row("points", info.declared_count ? format_count(*info.declared_count) + " by the header"
                                          : "not declared");
    text += row("coordinates", format_coordinates(info.coordinates));
    text += row("attributes", format_schema(info.schema));
    if (!info.unsupported.empty()) {
        text += row("not read", fmt::format("{}", fmt::join(info.unsupported, ", ")));
    }
    text += row("crs", format_crs(info.crs));
    return info.las ? text + describe(*info.las) : text;
}

std::string describe(const ManifestSource& source) {
    std::string text = row("source", source.path);
    text += row("  format", source.format);
    text += row("  points", fmt::format("{} ({} rejected)", format_count(source.points),
                                        format_count(source.rejected)));
    text += row("  size", format_bytes(source.bytes));
    text += row("  coordinates", format_coordinates(source.coordinates));
    text += row("  attributes", format_schema(source.schema));
    return text + row("  xxh3", source.xxh3);
}

std::string describe(const Archive& archive) {
    const Manifest& manifest = archive.manifest();
    const Counts& counts = manifest.counts;
    std::uint64_t bytes = 0;
    for (const ManifestTile& tile : manifest.tiles) {
        bytes += tile.bytes;
    }
    std::string text = row("archive", archive.folder().string());
    text += row("format", fmt::format("knap archive {}, written by knap {}",
                                      manifest.format_version, manifest.knap_version));
    text += row("points in", format_count(counts.in));
    text += row("  kept", fmt::format("{} ({})", format_count(counts.kept),
                                      format_share(counts.kept, counts.in)));
    text += row("  represented", format_count(counts.represented));
    text += row("  merged", format_count(counts.merged));
    text += row("  rejected", format_count(counts.rejected));
    text += row("mean spacing", fmt::format("{:.6g} cloud units", manifest.spacing));
    text += row("mean |H|", fmt::format("{:.6g} / cloud unit", manifest.mean_curvature));
    text += row("lattice", fmt::format("step {}, origin {}", manifest.lattice.step,
                                       format_vec(manifest.lattice.origin)));
    text += row("box", manifest.box.empty() ? "empty"
                                            : fmt::format("{} to {}", format_vec(manifest.box.min),
                                                          format_vec(manifest.box.max)));
    text += row("crs", format_crs(manifest.crs));
    text += row("tiles",
                fmt::format("{}, {}", format_count(manifest.tiles.size()), format_bytes(bytes)));
    if (const std::optional<TilesetIndex> tileset = find_tileset(archive.folder())) {
        text += row("3D Tiles", fmt::format("{}, {}, {}", format_count(tileset->contents.size()),
                                            format_bytes(tileset->bytes()), tileset->frame));
    }
    for (const auto& [key, value] : manifest.parameters) {
        text += row("parameter", fmt::format("{} = {}", key, value));
    }
    for (const ManifestSource& source : manifest.sources) {
        text += describe(source);
    }
    return text;
}

std::string describe_path(const std::string& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) {
        return describe(Archive(path));
    }
    return describe(open_source(path)->info());
}

std::string json_of_path(const std::string& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) {
        return info_json(Archive(path));
    }
    return path.ends_with(".drc") ? info_json_of_draco(path) : info_json(open_source(path)->info());
}

}  // namespace

Command add_info(CLI::App& root) {
    CLI::App* const command =
        root.add_subcommand("info", "header, attributes and counts of a file or an archive");
    const auto path = std::make_shared<std::string>();
    const auto json = std::make_shared<bool>(false);
    command->add_option("FILE|ARCHIVE", *path, "a point cloud, a .drc file, or an archive folder")
        ->type_name("")
        ->required();
    command->add_flag("--json", *json, "as JSON, for programs");
    command->footer(
        "Examples:\n"
        "  knap info scan.laz\n"
        "  knap info scan_archive\n"
        "  knap info scan.laz --json");
    return {command,
            [path, json] { fmt::print("{}", *json ? json_of_path(*path) : describe_path(*path)); }};
}

}  // namespace knap::app
