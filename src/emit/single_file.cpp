#include "emit/single_file.hpp"

#include <memory>
#include <vector>

#include "emit/cloud_header.hpp"
#include "emit/lattice.hpp"
#include "emit/output_check.hpp"
#include "output/cloud_writer.hpp"

namespace knap {

namespace {

std::vector<CloudOrigin> origins_of(const SourceTable& sources) {
    std::vector<CloudOrigin> origins;
    origins.reserve(sources.sources().size());
    for (const SourceEntry& source : sources.sources()) {
        origins.push_back({.path = source.given_path,
                           .coordinates = source.info.coordinates,
                           .crs = source.info.crs,
                           .las = source.info.las});
    }
    return origins;
}

}  // namespace

EmitResult emit_single_file(const KeptPoints& kept, const EmitRequest& request) {
    const std::filesystem::path path = output_path(request.output.path);
    const CloudFormat format = *cloud_format_of(path);
    const bool is_las = format == CloudFormat::kLas || format == CloudFormat::kLaz;
    const HeaderWithNotes made = make_cloud_header(
        format, origins_of(kept.sources),
        {.points = kept.selection.count(),
         .attributes = kept.attributes.attributes,
         .box = kept.sources.box(),
         .step =
             is_las ? choose_lattice(request.output.step, kept.sources, request.spacing).step : 1});
    for (const std::string& note : made.notes) {
        request.note(note);
    }
    const std::unique_ptr<CloudWriter> writer = open_cloud_writer(path, made.header);
    const auto append = [&](const KeptBlock& block) {
        writer->append(block.positions, block.rows);
    };
    read_kept_in_order(kept, request.threads, append, request.advance);
    const EmitResult result{path, 0, writer->complete()};
    request.on_whole(result, path.parent_path());
    writer->commit();
    return result;
}

}  // namespace knap
