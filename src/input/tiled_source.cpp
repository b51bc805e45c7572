#include "input/tiled_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "input/columns.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

constexpr double kLargestIndex = 9007199254740992.0;  // 2^53: whole doubles below are exact
constexpr std::size_t kAxes = 3;

/// Is the origin whole steps of a power of two from zero? Then no sum on the axis is rounded.
bool adds_exactly(double origin, double step) {
    int exponent = 0;
    return std::frexp(step, &exponent) == 0.5 && std::fmod(origin, step) == 0 &&
           std::abs(origin / step) < kLargestIndex;
}

/// The offset of an axis about which all indices fit 32 bits and GridAxis gives index * step +
/// origin to the last bit; none if there is no such.
std::optional<double> offset_of_axis(double origin, double step, std::int64_t low,
                                     std::int64_t high) {
    const auto fits = [&](std::int64_t shift) {
        return low - shift >= std::numeric_limits<std::int32_t>::min() &&
               high - shift <= std::numeric_limits<std::int32_t>::max();
    };
    const bool exact = origin == 0 || adds_exactly(origin, step);
    if (fits(0)) {
        if (exact || !GridAxis(step, origin).whole()) {
            return origin;
        }
    } else if (fits(low)) {
        const double offset = static_cast<double>(low) * step + origin;
        if (exact && GridAxis(step, offset).whole()) {
            return offset;
        }
    }
    return std::nullopt;
}

class TiledSource final : public PointSource {
  public:
    TiledSource(SourceInfo info, const std::vector<std::uint64_t>& tile_points, LoadTile load)
        : info_(std::move(info)), load_(std::move(load)) {
        firsts_.reserve(tile_points.size() + 1);
        firsts_.push_back(0);
        for (const std::uint64_t points : tile_points) {
            firsts_.push_back(firsts_.back() + points);
        }
    }

    const SourceInfo& info() const override { return info_; }

    void select(std::span<const std::size_t> attributes) override {
        selection_.select(info_, attributes);
    }

    bool read(Chunk& chunk, std::size_t max_points) override {
        chunk.first = next_;
        const auto wanted =
            static_cast<std::size_t>(std::min<std::uint64_t>(firsts_.back() - next_, max_points));
        chunk.positions.resize(wanted);
        selection_.resize(chunk, wanted);
        for (std::size_t done = 0; done < wanted;) {
            done += take(chunk, done);
        }
        return wanted > 0;
    }

    void seek(std::uint64_t index) override {
        if (info_.seek_granularity == 0 || index > firsts_.back()) {
            throw InputError(fmt::format("{}: cannot seek to point {} of {}", info_.path.string(),
                                         index, firsts_.back()));
        }
        next_ = index;
    }

  private:
    /// Takes points of one tile, at least one.
    std::size_t take(Chunk& chunk, std::size_t done) {
        const auto behind = std::upper_bound(firsts_.begin(), firsts_.end(), next_);
        const auto tile = static_cast<std::size_t>(behind - firsts_.begin()) - 1;
        if (tile != loaded_) {
            content_ = {};
            content_ = load_(tile);
            loaded_ = tile;
        }
        const auto from = static_cast<std::size_t>(next_ - firsts_[tile]);
        const std::size_t n =
            std::min(content_.positions.size() - from, chunk.positions.size() - done);
        std::copy_n(content_.positions.begin() + static_cast<std::ptrdiff_t>(from), n,
                    chunk.positions.begin() + static_cast<std::ptrdiff_t>(done));
        for (std::size_t i = 0; i < selection_.size(); ++i) {
            const std::size_t size = selection_.value_size(i);
            const std::vector<std::byte>& column =
                content_.columns[selection_.attribute(i) - kAxes];
            std::memcpy(selection_.at(chunk, i, done), column.data() + from * size, n * size);
        }
        next_ += n;
        return n;
    }

    static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

    SourceInfo info_;
    LoadTile load_;
    std::vector<std::uint64_t> firsts_;  // point number of the first of each tile; then of the end
    TileContent content_;
    std::size_t loaded_ = kNone;
    ColumnSelection selection_;
    std::uint64_t next_ = 0;
};

}  // namespace

std::vector<std::array<std::int64_t, 3>> lattice_indices(const DracoCloud& cloud,
                                                         const std::filesystem::path& file) {
    std::vector<std::array<std::int64_t, 3>> indices;
    indices.reserve(cloud.positions.size());
    const DracoLattice& lattice = cloud.lattice.value();
    for (const Vec3& local : cloud.positions) {
        std::array<std::int64_t, 3> index{};
        for (std::size_t axis = 0; axis < kAxes; ++axis) {
            const double steps = local[static_cast<int>(axis)] / lattice.step;
            if (!(std::abs(steps) < kLargestIndex)) {
                throw InputError(fmt::format("{}: expected coordinates on the lattice, found {}",
                                             file.string(), local[static_cast<int>(axis)]));
            }
            index[axis] = lattice.tile_origin[axis] + std::llround(steps);
        }
        indices.push_back(index);
    }
    return indices;
}

Vec3 lattice_position(const Vec3& origin, double step, const std::array<std::int64_t, 3>& index) {
    return {static_cast<double>(index[0]) * step + origin.x,
            static_cast<double>(index[1]) * step + origin.y,
            static_cast<double>(index[2]) * step + origin.z};
}

CoordinateFormat format_of_lattice(const Vec3& origin, double step,
                                   const std::array<std::int64_t, 3>& low,
                                   const std::array<std::int64_t, 3>& high) {
    CoordinateFormat format{CoordinateKind::kInt32, {step, step, step}, origin};
    for (int axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::size_t>(axis);
        if (low[i] > high[i]) {
            continue;
        }
        const std::optional<double> offset = offset_of_axis(origin[axis], step, low[i], high[i]);
        if (!offset) {
            return {};
        }
        format.offset[axis] = *offset;
    }
    return format;
}

std::vector<Attribute> schema_of_tiles(ScalarType coordinates,
                                       std::span<const Attribute> attributes) {
    std::vector<Attribute> schema{
        {"x", coordinates, 1}, {"y", coordinates, 1}, {"z", coordinates, 1}};
    schema.insert(schema.end(), attributes.begin(), attributes.end());
    make_names_unique(schema);
    return schema;
}

std::unique_ptr<PointSource> open_tiles(SourceInfo info,
                                        const std::vector<std::uint64_t>& tile_points,
                                        LoadTile load) {
    return std::make_unique<TiledSource>(std::move(info), tile_points, std::move(load));
}

}  // namespace knap
