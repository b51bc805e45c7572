#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "app/commands.hpp"
#include "app/interrupt.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "view/site.hpp"
#include "view/view_server.hpp"

namespace knap::app {

namespace {

constexpr int kMaxPort = 65535;

struct ViewOptions {
    std::string archive;
    std::string before;
    int port = 0;
};

void view(const ViewOptions& options) {
    if (options.port < 0 || options.port > kMaxPort) {
        throw ConfigError(
            fmt::format("--port: expected 0 to {}, found {}", kMaxPort, options.port));
    }
    Site site;
    add_archive(site, "/archive/", Archive(options.archive));
    if (!options.before.empty()) {
        add_archive(site, "/before/", Archive(options.before));
    }
    add_page(site, find_page(std::filesystem::read_symlink("/proc/self/exe")));
    ViewServer server(std::move(site), options.port);
    catch_interrupts();
    fmt::print("http://127.0.0.1:{}/{}\n", server.port(),
               options.before.empty() ? "" : "?before=before/");
    std::fflush(stdout);
    fmt::print(stderr, "knap: open this address in a browser; Ctrl-C ends\n");
    server.serve_until(interrupted);
}

}  // namespace

Command add_view(CLI::App& root) {
    CLI::App* const command =
        root.add_subcommand("view", "show an archive in a browser, from this machine only");
    const auto options = std::make_shared<ViewOptions>();
    command->add_option("ARCHIVE", options->archive, "an archive folder")
        ->type_name("")
        ->required();
    command
        ->add_option("--before", options->before,
                     "another archive, shown beside it: as of all points, by --alpha 1e-9")
        ->type_name("ARCHIVE");
    command->add_option("--port", options->port, "port on 127.0.0.1; 0: any that is free [0]")
        ->type_name("N");
    command->footer(
        "Examples:\n"
        "  knap view scan_archive\n"
        "  knap view scan_archive --before all_points --port 8000");
    return {command, [options] { view(*options); }};
}

}  // namespace knap::app
