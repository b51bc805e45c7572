#pragma once

#include <filesystem>

#include "store/brick_file.hpp"
#include "store/source_table.hpp"

namespace knap::test {

/// A whole brick file: core points first, then halo; the order within each part is that of the
/// file.
inline BrickPoints read_brick_file(const std::filesystem::path& path, const SourceTable& table,
                                   bool with_halo = true) {
    BrickPoints brick;
    BrickPoints halo;
    stream_brick_file(path, table, with_halo, [&](PointId id, const Vec3& p, BrickPart part) {
        BrickPoints& points = part == BrickPart::kCore ? brick : halo;
        points.positions.push_back(p);
        points.ids.push_back(id);
    });
    brick.core_count = brick.ids.size();
    brick.positions.insert(brick.positions.end(), halo.positions.begin(), halo.positions.end());
    brick.ids.insert(brick.ids.end(), halo.ids.begin(), halo.ids.end());
    return brick;
}

}  // namespace knap::test
