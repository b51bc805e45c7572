#include "emit/single_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "emit/cloud_header.hpp"
#include "emit/lattice.hpp"
#include "emit/output_check.hpp"
#include "input/staged_reader.hpp"
#include "knap/error.hpp"
#include "output/cloud_writer.hpp"

namespace knap {

namespace {

constexpr const char* kFlagName = "kept";
constexpr std::uint64_t kRangePoints = 1 << 20;
constexpr std::size_t kChunkPoints = 1 << 14;

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

/// What points carry, and whether they are kept.
std::vector<Attribute> flagged_attributes(const AttributePlan& plan) {
    std::vector<Attribute> attributes = plan.attributes;
    if (std::any_of(attributes.begin(), attributes.end(),
                    [](const Attribute& attribute) { return attribute.name == kFlagName; })) {
        throw ConfigError(
            fmt::format("output.flag (--flag): expected inputs without an attribute {0}, found "
                        "one; output.attributes (--attributes) can leave it out",
                        kFlagName));
    }
    attributes.push_back({kFlagName, ScalarType::kUint8, 1, 1, 0, "1: knap keeps the point"});
    return attributes;
}

/// All points that are written if all are: those that are not rejected.
Selection finite_points(const KeptPoints& kept, int workers) {
    const SourceTable& sources = kept.sources;
    Selection all(sources.points());
    if (sources.rejected() == 0) {
        for (PointId id = 0; id < all.size(); ++id) {
            all.set(id);
        }
        all.finish();
        return all;
    }
    const StagedReader reader(sources, kept.staged, {}, kept.note);
    const std::vector<ArchivePart> parts = reader.parts(kRangePoints);
    std::mutex mutex;
    reader.stream(parts, workers, kChunkPoints,
                  [&](std::size_t, std::size_t part, const Chunk& chunk) {
                      const SourceEntry& source = sources.sources()[parts[part].range.source];
                      const std::scoped_lock lock(mutex);
                      for (std::size_t i = 0; i < chunk.positions.size(); ++i) {
                          const std::uint64_t index = chunk.first + i;
                          if (index < source.points && is_finite(chunk.positions[i])) {
                              all.set(source.first_id + index);
                          }
                      }
                  });
    all.finish();
    return all;
}

/// Rows with one byte more: whether the point is kept.
class FlaggedRows {
  public:
    FlaggedRows(const Selection& kept, std::size_t row_size) : kept_(kept), row_size_(row_size) {}

    std::span<const std::byte> of(const KeptBlock& block) {
        rows_.resize(block.ids.size() * (row_size_ + 1));
        std::byte* to = rows_.data();
        for (std::size_t i = 0; i < block.ids.size(); ++i) {
            const auto row = block.rows.subspan(i * row_size_, row_size_);
            to = std::copy(row.begin(), row.end(), to);
            *to++ = std::byte{kept_.test(block.ids[i]) ? std::uint8_t{1} : std::uint8_t{0}};
        }
        return rows_;
    }

  private:
    const Selection& kept_;
    std::size_t row_size_;
    std::vector<std::byte> rows_;
};

}  // namespace

EmitResult emit_single_file(const KeptPoints& kept, const EmitRequest& request) {
    const std::filesystem::path path = output_path(request.output.path);
    const CloudFormat format = *cloud_format_of(path);
    const bool is_las = format == CloudFormat::kLas || format == CloudFormat::kLaz;
    const bool flag = request.output.flag;
    const Selection all = flag ? finite_points(kept, request.threads) : Selection();
    const Selection& written = flag ? all : kept.selection;
    const double step =
        is_las ? choose_lattice(request.output.step, kept.sources, request.spacing).step : 1;
    const HeaderWithNotes made = make_cloud_header(
        format, origins_of(kept.sources),
        {.points = written.count(),
         .attributes = flag ? flagged_attributes(kept.attributes) : kept.attributes.attributes,
         .box = kept.sources.box(),
         .step = step});
    for (const std::string& note : made.notes) {
        request.note(note);
    }
    const std::unique_ptr<CloudWriter> writer = open_cloud_writer(path, made.header);
    FlaggedRows flagged(kept.selection, kept.attributes.row_size);
    const auto append = [&](const KeptBlock& block) {
        writer->append(block.positions, flag ? flagged.of(block) : block.rows);
    };
    const KeptPoints points{kept.sources, written,     {},           kept.attributes,
                            kept.note,    kept.staged, kept.measures};
    read_kept_in_order(points, request.threads, append, request.advance);
    EmitResult result{path, 0, writer->complete()};
    request.on_whole(result, path.parent_path());
    writer->commit();
    return result;
}

}  // namespace knap
