#include "tileset/tileset.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <mutex>
#include <string>
#include <system_error>
#include <utility>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "base/memory_gate.hpp"
#include "base/threads.hpp"
#include "emit/draco_tile.hpp"
#include "emit/output_check.hpp"
#include "emit/output_folder.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "store/manifest.hpp"
#include "store/tileset_file.hpp"
#include "tileset/hierarchy.hpp"
#include "tileset/node_writer.hpp"
#include "tileset/properties.hpp"
#include "tileset/tile_points.hpp"
#include "tileset/tileset_index.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;

/// Are all colours of 16 bits below 256? Looks no further than the first that is not.
bool colors_hold_bytes(const Archive& archive, const PropertyPlan& plan,
                       const std::function<void(std::uint64_t)>& advance) {
    if (plan.color.empty() || plan.color_type != ScalarType::kUint16) {
        return false;
    }
    for (std::size_t i = 0; i < archive.manifest().tiles.size(); ++i) {
        advance(0);
        const Tile tile = archive.read_whole_tile(i);
        for (const std::size_t member : plan.color) {
            const std::vector<std::byte>& column = tile.columns[member];
            for (std::size_t high = 1; high < column.size(); high += 2) {
                if (column[high] != std::byte{0}) {
                    return false;
                }
            }
        }
    }
    return true;
}

/// A node on its way into a file.
struct OpenNode {
    std::size_t pending = 0;  // tiles of the archive that are still to come
    LatticeBounds bounds;
    bool bounded = false;
    GatheredPoints points;
};

class TilesetMaker {
  public:
    TilesetMaker(const Archive& archive, const TilesetRequest& request)
        : archive_(archive),
          manifest_(archive.manifest()),
          request_(request),
          plan_(plan_properties(manifest_.attributes)),
          folder_(archive.folder() / kTilesetFolder, OutputFolder::Unfinished::kGoes,
                  holds_only_tileset) {
        firsts_.push_back(0);
        std::vector<std::uint64_t> tile_points;
        for (const ManifestTile& tile : manifest_.tiles) {
            tile_points.push_back(tile.points);
            firsts_.push_back(firsts_.back() + tile.points);
        }
        tree_ = plan_tree(tile_points);
        for (std::size_t i = 0; i < tree_.size(); ++i) {
            if (tree_[i].leaf()) {
                leaves_.push_back(i);
            }
        }
        open_.resize(tree_.size());
        written_.resize(tree_.size());
        for (std::size_t i = 0; i < tree_.size(); ++i) {
            open_[i].pending = tree_[i].tiles;
        }
    }

    TilesetResult make() {
        find_earth();
        narrow_colors_ = colors_hold_bytes(archive_, plan_, request_.advance);
        MemoryGate gate(request_.memory_bytes);
        run_tasks(manifest_.tiles.size(), request_.threads,
                  [&](std::size_t tile, std::size_t worker) {
                      const auto ticket = gate.admit(memory_bytes(tile));
                      take_tile(tile, earth(worker));
                      request_.advance(manifest_.tiles[tile].points);
                  });
        write_index();
        folder_.commit(request_.overwrite);
        return std::move(result_);
    }

  private:
    /// A system that PROJ does not know, or that the points do not lie in, is no error: the tileset
    /// then stands in a frame of its own.
    void find_earth() {
        earths_.resize(static_cast<std::size_t>(request_.threads));
        if (tree_.empty()) {
            return;
        }
        if (manifest_.crs.empty()) {
            result_.notes.emplace_back(
                "3D Tiles: the archive has no coordinate system, so they have a local frame");
            return;
        }
        try {
            earths_[0] = std::make_unique<Geocentric>(manifest_.crs, middle());
            fit_frame(manifest_.box, manifest_.box.min, *earths_[0]);
            operation_ = earths_[0]->operation();
            result_.on_earth = true;
        } catch (const InputError& error) {
            earths_[0].reset();
            result_.notes.push_back(
                fmt::format("3D Tiles: {}, so they have a local frame", error.what()));
        }
    }

    Vec3 middle() const {
        const Vec3 size = manifest_.box.size();
        return manifest_.box.min + Vec3{size.x / 2, size.y / 2, size.z / 2};
    }

    // One a thread, as PROJ wants it.
    const Geocentric* earth(std::size_t worker) {
        if (result_.on_earth && !earths_[worker]) {
            earths_[worker] = std::make_unique<Geocentric>(manifest_.crs, middle());
        }
        return earths_[worker].get();
    }

    std::uint64_t memory_bytes(std::size_t tile) const {
        const std::uint64_t points = std::max(manifest_.tiles[tile].points, 2 * kTilesetPoints);
        return 2 * encode_memory_bytes(points, manifest_.attributes);
    }

    void take_tile(std::size_t tile, const Geocentric* earth) {
        std::vector<NodeShare> shares =
            share_out(archive_.read_whole_tile(tile), manifest_, firsts_[tile], tree_, leaves_);
        for (NodeShare& share : shares) {
            OpenNode whole;
            {
                const std::scoped_lock lock(mutex_);
                OpenNode& node = open_[share.node];
                node.points.append(share.points);
                if (!node.bounded) {
                    node.bounds = share.bounds;
                    node.bounded = true;
                }
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    node.bounds.min[axis] = std::min(node.bounds.min[axis], share.bounds.min[axis]);
                    node.bounds.max[axis] = std::max(node.bounds.max[axis], share.bounds.max[axis]);
                }
                share.points = {};
                if (--node.pending > 0) {
                    continue;
                }
                whole = std::exchange(node, {});
            }
            const NodeFormat format{manifest_, plan_, narrow_colors_, folder_.path()};
            written_[share.node] =
                write_node(share.node, whole.points, whole.bounds, format, earth);
        }
    }

    void write_index() {
        Tileset tileset;
        tileset.knap_version = KNAP_VERSION;
        tileset.archive = xxh3_64_of_file(archive_.folder() / kManifestName);
        tileset.frame = result_.on_earth ? "ECEF" : "local";
        tileset.crs = manifest_.crs;
        tileset.operation = operation_;
        for (const PropertyPlan::Property& property : plan_.properties) {
            tileset.attributes.push_back(manifest_.attributes[property.attribute]);
            tileset.attributes.back().name = property.name;
        }
        add_nodes(tileset, tree_, written_);
        if (tileset.points != manifest_.counts.kept) {
            throw StorageError(fmt::format("{}: expected 3D Tiles of {} points, found {}",
                                           archive_.folder().string(), manifest_.counts.kept,
                                           tileset.points));
        }
        result_.points = tileset.points;
        result_.largest_error = tileset.largest_error;
        for (const WrittenNode& node : written_) {
            for (const NodePart& part : node.parts) {
                ++result_.tiles;
                result_.bytes += part.content.bytes;
            }
        }
        const std::string text = format_tileset(tileset);
        write_text_file(folder_.path() / kTilesetName, text);
        result_.bytes += text.size();
        for (const std::string& name : plan_.left_out) {
            result_.notes.push_back(fmt::format("3D Tiles: without the attribute {}", name));
        }
    }

    const Archive& archive_;
    const Manifest& manifest_;
    const TilesetRequest& request_;
    PropertyPlan plan_;
    OutputFolder folder_;
    std::vector<std::uint64_t> firsts_;  // point of the archive that each tile begins with
    std::vector<TreeNode> tree_;
    std::vector<std::size_t> leaves_;
    std::vector<std::unique_ptr<Geocentric>> earths_;
    std::string operation_;
    bool narrow_colors_ = false;
    std::mutex mutex_;
    std::vector<OpenNode> open_;
    std::vector<WrittenNode> written_;
    TilesetResult result_;
};

}  // namespace

TilesetResult make_tileset(const fs::path& archive, const TilesetRequest& request) {
    const Archive opened(archive);
    const fs::path folder = archive / kTilesetFolder;
    std::error_code ignored;
    if (fs::exists(fs::symlink_status(folder, ignored)) && !request.overwrite) {
        throw ConfigError(fmt::format("{}: exists (needs --overwrite)", folder.string()));
    }
    return TilesetMaker(opened, request).make();
}

}  // namespace knap
