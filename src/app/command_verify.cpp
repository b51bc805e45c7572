#include <fmt/format.h>

#include <memory>
#include <string>

#include "app/commands.hpp"
#include "app/format.hpp"
#include "base/file.hpp"
#include "knap/archive.hpp"

namespace knap::app {

Command add_verify(CLI::App& root) {
    CLI::App* const command =
        root.add_subcommand("verify", "checksums, counts, and every tile decodes");
    const auto path = std::make_shared<std::string>();
    command->add_option("ARCHIVE", *path, "an archive folder")->type_name("")->required();
    command->footer("Example:\n  knap verify scan_archive");
    return {command, [path] {
                const Verification found = Archive(*path).verify();
                fmt::print("{}: good: {} {}, {} points, {}\n", *path, format_count(found.tiles),
                           found.tiles == 1 ? "tile" : "tiles", format_count(found.points),
                           format_bytes(found.bytes));
                if (found.tileset_tiles > 0) {
                    fmt::print("{}: 3D Tiles: good: {} {}, {}\n", *path,
                               format_count(found.tileset_tiles),
                               found.tileset_tiles == 1 ? "tile" : "tiles",
                               format_bytes(found.tileset_bytes));
                }
            }};
}

}  // namespace knap::app
