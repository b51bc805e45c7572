#pragma once

#include <algorithm>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "store/ranked_run.hpp"
#include "store/selection.hpp"

namespace knap::test {

/// The points of a selection as merge leaves them: dealt out to runs, with random keys.
inline std::vector<std::filesystem::path> write_kept_runs(const std::filesystem::path& folder,
                                                          const SourceTable& table,
                                                          const Selection& selection,
                                                          const std::vector<Vec3>& points,
                                                          std::size_t count) {
    std::mt19937_64 random(count);
    std::vector<std::vector<RankedPoint>> parts(count);
    for (PointId id = 0; id < points.size(); ++id) {
        if (selection.test(id)) {
            parts[random() % count].push_back(
                {static_cast<double>(random() % 1000), id, points[id]});
        }
    }
    std::vector<std::filesystem::path> runs;
    for (std::vector<RankedPoint>& part : parts) {
        std::sort(part.begin(), part.end(),
                  [](const RankedPoint& a, const RankedPoint& b) { return ranks_before(a, b); });
        runs.push_back(folder / (std::to_string(runs.size()) + ".kept"));
        write_run(runs.back(), table, part);
    }
    return runs;
}

}  // namespace knap::test
