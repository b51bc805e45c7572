#include "emit/measures.hpp"

#include <fmt/format.h>

#include <atomic>
#include <cstring>

#include "base/threads.hpp"
#include "knap/error.hpp"
#include "store/ranked_run.hpp"

namespace knap {

Measures::Measures(const SourceTable& sources, const Selection& selection,
                   std::span<const std::filesystem::path> runs,
                   const std::function<double(double)>& range_of, int workers)
    : values_(selection.count()) {
    std::atomic<std::uint64_t> found = 0;
    run_tasks(runs.size(), workers, [&](std::size_t run, std::size_t) {
        RunReader reader(runs[run], sources);
        for (std::vector<RankedPoint> block; reader.next(block);) {
            for (const RankedPoint& point : block) {
                if (point.id < selection.size() && selection.test(point.id)) {
                    values_[selection.count_before(point.id)] = {
                        static_cast<float>(point.key), static_cast<float>(range_of(point.key))};
                    ++found;
                }
            }
        }
    });
    if (found != values_.size()) {
        throw StorageError(
            fmt::format("{}: scratch files are damaged: expected the curvatures of {} kept points "
                        "in the ranked runs, found {} (output.measures)",
                        runs.empty() ? "no run" : runs.front().parent_path().string(),
                        values_.size(), found.load()));
    }
}

void Measures::put(std::uint64_t place, const AttributePlan& plan,
                   std::span<std::byte> rows) const {
    const std::size_t curvature = plan.offsets[plan.attributes.size() - 2];
    const std::size_t range = plan.offsets[plan.attributes.size() - 1];
    for (std::size_t row = 0; row < rows.size(); row += plan.row_size) {
        const Pair& values = values_[place++];
        std::memcpy(&rows[row + curvature], &values.curvature, sizeof values.curvature);
        std::memcpy(&rows[row + range], &values.range, sizeof values.range);
    }
}

}  // namespace knap
