#include "emit/kept_file.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace knap {

namespace {

constexpr std::uint64_t kBins = std::uint64_t{1} << 16;

std::uint64_t distance(std::int64_t from, std::int64_t to) {
    return static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from);
}

/// Points that agree in the first coordinates, in the order that they are compared, and lie in an
/// interval of the next one.
struct Slab {
    std::array<std::size_t, 3> axes{};
    std::size_t depth = 0;  ///< coordinates before this one are fixed: low == high
    LatticeIndex low{};
    LatticeIndex high{};

    bool contains(const LatticeIndex& p) const {
        for (std::size_t i = 0; i <= depth; ++i) {
            if (p[axes[i]] < low[axes[i]] || p[axes[i]] > high[axes[i]]) {
                return false;
            }
        }
        return true;
    }
};

}  // namespace

void KeptFile::remove() const {
    std::filesystem::remove(path);
    if (row_size > 0) {
        std::filesystem::remove(rows_path());
    }
}

KeptFileWriter::KeptFileWriter(std::filesystem::path path, const SourceTable& table,
                               const Lattice& lattice, std::size_t row_size)
    : lattice_(lattice), run_(path, table) {
    file_.path = std::move(path);
    file_.row_size = row_size;
    if (row_size > 0) {
        rows_.emplace(file_.rows_path(), row_size);
    }
}

void KeptFileWriter::add(PointId id, const Vec3& position, std::span<const std::byte> row) {
    add(id, position, index_of(lattice_, position), row);
}

void KeptFileWriter::add(PointId id, const Vec3& position, const LatticeIndex& index,
                         std::span<const std::byte> row) {
    run_.add({0, id, position});
    if (rows_) {
        rows_->add(row);
    }
    if (file_.points++ == 0) {
        file_.bounds = {index, index};
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
        file_.bounds.min[axis] = std::min(file_.bounds.min[axis], index[axis]);
        file_.bounds.max[axis] = std::max(file_.bounds.max[axis], index[axis]);
    }
}

KeptFile KeptFileWriter::finish() {
    file_.bytes = run_.finish();
    if (rows_) {
        file_.bytes += rows_->finish();
    }
    return std::move(file_);
}

void KeptSplitter::read(
    const KeptFile& file,
    const std::function<void(PointId, const Vec3&, const LatticeIndex&)>& take) const {
    RunReader reader(file.path, table_);
    for (std::vector<RankedPoint> block; reader.next(block);) {
        poll_();
        for (const RankedPoint& point : block) {
            take(point.id, point.position, index_of(lattice_, point.position));
        }
    }
}

void KeptSplitter::read_rows(const KeptFile& file,
                             const std::function<void(PointId, const Vec3&, const LatticeIndex&,
                                                      std::span<const std::byte>)>& take) const {
    std::optional<RowReader> rows;
    if (file.row_size > 0) {
        rows.emplace(file.rows_path(), file.row_size);
    }
    read(file, [&](PointId id, const Vec3& position, const LatticeIndex& index) {
        take(id, position, index, rows ? rows->next() : std::span<const std::byte>());
    });
}

KeptSplitter::Ranked KeptSplitter::point_of_rank(const KeptFile& file, AlongAxis order,
                                                 std::uint64_t rank) const {
    std::uint64_t before = 0;
    Slab slab{order.axes(), 0, file.bounds.min, file.bounds.max};
    std::uint64_t inside = file.points;
    while (inside > capacity_) {
        const std::size_t axis = slab.axes[slab.depth];
        if (slab.low[axis] == slab.high[axis]) {
            if (++slab.depth == slab.axes.size()) {
                return {slab.low, before};  // all that are left are in one place
            }
            continue;
        }
        const std::uint64_t width = distance(slab.low[axis], slab.high[axis]) / kBins + 1;
        std::vector<std::uint64_t> counts(kBins);
        read(file, [&](PointId, const Vec3&, const LatticeIndex& p) {
            if (slab.contains(p)) {
                ++counts[distance(slab.low[axis], p[axis]) / width];
            }
        });
        std::size_t bin = 0;
        for (; rank >= counts[bin]; ++bin) {
            rank -= counts[bin];
            before += counts[bin];
        }
        inside = counts[bin];
        slab.low[axis] += static_cast<std::int64_t>(bin * width);
        slab.high[axis] =
            std::min(slab.high[axis], slab.low[axis] + static_cast<std::int64_t>(width - 1));
    }
    std::vector<LatticeIndex> points;
    points.reserve(inside);
    read(file, [&](PointId, const Vec3&, const LatticeIndex& p) {
        if (slab.contains(p)) {
            points.push_back(p);
        }
    });
    const auto wanted = points.begin() + static_cast<std::ptrdiff_t>(rank);
    std::nth_element(points.begin(), wanted, points.end(), order);
    before += static_cast<std::uint64_t>(std::count_if(
        points.begin(), wanted, [&](const LatticeIndex& p) { return order(p, *wanted); }));
    return {*wanted, before};
}

std::pair<KeptFile, KeptFile> KeptSplitter::split(const KeptFile& file,
                                                  const std::filesystem::path& lower,
                                                  const std::filesystem::path& upper) const {
    const AlongAxis order{longest_axis(file.bounds)};
    const std::uint64_t half = file.points / 2;
    const Ranked found = point_of_rank(file, order, half);
    const LatticeIndex middle = found.point;
    // Of those in the place of the middle one the first.
    std::uint64_t alike_below = half - found.before;
    KeptFileWriter low(lower, table_, lattice_, file.row_size);
    KeptFileWriter high(upper, table_, lattice_, file.row_size);
    read_rows(file, [&](PointId id, const Vec3& position, const LatticeIndex& p,
                        std::span<const std::byte> row) {
        bool is_low = order(p, middle);
        if (p == middle && alike_below > 0) {
            is_low = true;
            --alike_below;
        }
        (is_low ? low : high).add(id, position, p, row);
    });
    return {low.finish(), high.finish()};
}

}  // namespace knap
