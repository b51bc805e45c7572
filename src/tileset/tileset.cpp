#include "tileset/tileset.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "base/checksum.hpp"
#include "base/file.hpp"
#include "base/memory_gate.hpp"
#include "base/threads.hpp"
#include "emit/attribute_plan.hpp"
#include "emit/draco_tile.hpp"
#include "emit/output_check.hpp"
#include "emit/output_folder.hpp"
#include "emit/tile_layout.hpp"
#include "knap/archive.hpp"
#include "knap/error.hpp"
#include "store/manifest.hpp"
#include "store/tileset_file.hpp"
#include "tileset/hierarchy.hpp"
#include "tileset/placement.hpp"
#include "tileset/pnts.hpp"
#include "tileset/properties.hpp"
#include "tileset/tile_points.hpp"

namespace knap {

namespace {

namespace fs = std::filesystem;

// Errors grow towards the root, so that a viewer takes parents first.
constexpr double kLeastGrowth = 1.5;

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

/// Mean distance from each point to the next along the curve: about the spacing of the points.
double spacing_of(std::span<const std::array<float, 3>> positions) {
    double sum = 0;
    for (std::size_t i = 1; i < positions.size(); ++i) {
        const auto& a = positions[i - 1];
        const auto& b = positions[i];
        sum += std::sqrt(squared_distance({a[0], a[1], a[2]}, {b[0], b[1], b[2]}));
    }
    return positions.size() > 1 ? sum / static_cast<double>(positions.size() - 1) : 0;
}

/// A node on its way into a file.
struct OpenNode {
    std::size_t pending = 0;  // tiles of the archive that are still to come
    LatticeBounds bounds;
    bool bounded = false;
    GatheredPoints points;
};

struct FinishedNode {
    Placement placement;
    double spacing = 0;
    TilesetContent content;
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
        finished_.resize(tree_.size());
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
                whole = std::move(node);
                node = {};
            }
            finish(share.node, whole, earth);
        }
    }

    /// Writes a node whose points are all there.
    void finish(std::size_t number, const OpenNode& node, const Geocentric* earth) {
        FinishedNode& done = finished_[number];
        done.placement = place_tile(node.bounds, manifest_.lattice, earth);
        const GatheredPoints points = node.points.in_order();
        const std::size_t row = row_layout(manifest_.attributes).row_size;
        std::vector<std::array<float, 3>> positions;
        std::vector<std::byte> rows;
        positions.reserve(points.points.size());
        rows.reserve(points.rows.size());
        for (const std::size_t i : curve(points.points, node.bounds)) {
            positions.push_back(coordinates_of(done.placement, points.points[i], earth));
            const auto value = std::span(points.rows).subspan(i * row, row);
            rows.insert(rows.end(), value.begin(), value.end());
        }
        std::optional<PositionSteps> steps;
        if (done.placement.whole_steps) {
            steps = PositionSteps{bits_of(points.points, node.bounds.min),
                                  manifest_.lattice.step * done.placement.unit.x};
        }
        done.spacing = spacing_of(positions);
        const std::vector<std::byte> bytes =
            encode_pnts({positions, steps, rows}, manifest_.attributes, plan_, narrow_colors_);
        done.content = {fmt::format("{:06}.pnts", number), positions.size(), bytes.size(),
                        fmt::format("{:016x}", xxh3_64(bytes))};
        AtomicFile file(folder_.path() / done.content.file);
        file.write(bytes);
        file.commit();
    }

    static int bits_of(std::span<const LatticeIndex> points, const LatticeIndex& origin) {
        std::uint64_t largest = 1;
        for (const LatticeIndex& point : points) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                largest = std::max(largest, static_cast<std::uint64_t>(point[axis] - origin[axis]));
            }
        }
        return static_cast<int>(std::bit_width(largest));
    }

    /// The order along a curve through the bounds: as fine as 20 bits are.
    static std::vector<std::size_t> curve(std::span<const LatticeIndex> points,
                                          const LatticeBounds& bounds) {
        int coarser = 0;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const auto side = static_cast<std::uint64_t>(bounds.max[axis] - bounds.min[axis]);
            coarser = std::max(coarser, static_cast<int>(std::bit_width(side)) - kTileBits);
        }
        std::vector<LatticeIndex> cells;
        cells.reserve(points.size());
        for (const LatticeIndex& point : points) {
            cells.push_back({(point[0] - bounds.min[0]) >> coarser,
                             (point[1] - bounds.min[1]) >> coarser,
                             (point[2] - bounds.min[2]) >> coarser});
        }
        return coding_order(cells, {}, TileCoding::kCurve);
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
        tileset.nodes.resize(tree_.size());
        for (std::size_t i = tree_.size(); i-- > 0;) {  // children first
            add_node(tileset, i);
        }
        if (!tree_.empty()) {
            const Placement& root = finished_.front().placement;
            tileset.geometric_error =
                std::max(root.box.diagonal(), 2 * tileset.nodes.front().geometric_error);
        }
        tileset.points = result_.points;
        tileset.largest_error = result_.largest_error;
        if (result_.points != manifest_.counts.kept) {
            throw StorageError(fmt::format("{}: expected 3D Tiles of {} points, found {}",
                                           archive_.folder().string(), manifest_.counts.kept,
                                           result_.points));
        }
        const std::string text = format_tileset(tileset);
        write_text_file(folder_.path() / kTilesetName, text);
        result_.bytes += text.size();
        for (const std::string& name : plan_.left_out) {
            result_.notes.push_back(fmt::format("3D Tiles: without the attribute {}", name));
        }
    }

    void add_node(Tileset& tileset, std::size_t i) {
        const TreeNode& planned = tree_[i];
        FinishedNode& done = finished_[i];
        TilesetNode& node = tileset.nodes[i];
        node.children = planned.children;
        node.box = done.placement.box;
        node.transform =
            planned.parent == TreeNode::kNone
                ? done.placement.matrix
                : relative_to(finished_[planned.parent].placement.matrix, done.placement.matrix);
        node.content = done.content;
        if (!planned.leaf()) {
            node.geometric_error = done.spacing;
            for (const std::size_t child : planned.children) {
                node.geometric_error = std::max(
                    node.geometric_error, kLeastGrowth * tileset.nodes[child].geometric_error);
            }
            if (node.geometric_error <= 0) {  // all points in one place
                node.geometric_error = node.box.diagonal();
            }
        }
        ++result_.tiles;
        result_.points += node.content.points;
        result_.bytes += node.content.bytes;
        result_.largest_error = std::max(result_.largest_error, done.placement.largest_error);
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
    std::vector<FinishedNode> finished_;
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
