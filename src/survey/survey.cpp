#include "survey/survey.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <tuple>
#include <utility>

#include "base/checksum.hpp"
#include "base/extent.hpp"
#include "base/threads.hpp"
#include "input/stream.hpp"
#include "knap/source.hpp"
#include "survey/position_stager.hpp"

namespace knap {

namespace {

constexpr std::size_t kChunkPoints = std::size_t{1} << 16;
constexpr std::uint64_t kRangePoints = std::uint64_t{1} << 20;

// Voxels along the longest side of the first chunk: so many that on a surface about kVoxelPoints
// points share one. Finer voxels do not make better bricks, and cost time where there are few
// points. The grid coarsens itself where that is too fine for its budget.
constexpr double kVoxelPoints = 64;
constexpr double kMostVoxels = 512;
constexpr double kFewestVoxels = 64;
constexpr std::uint64_t kTextBytes = 32;  // of a point, about

// Not every text file says how many it has.
std::uint64_t points_about(const SourceInfo& info) {
    return info.declared_count.value_or(info.size_bytes / kTextBytes);
}

std::uint64_t points_about(const std::vector<SourceInfo>& infos) {
    std::uint64_t points = 0;
    for (const SourceInfo& info : infos) {
        points += points_about(info);
    }
    return points;
}

double first_voxels(const std::vector<SourceInfo>& infos) {
    const auto points = static_cast<double>(points_about(infos));
    return std::clamp(std::sqrt(points / kVoxelPoints), kFewestVoxels, kMostVoxels);
}

// Fixed records lie ready; what is compressed or text is decoded.
bool is_slow(const SourceInfo& info) {
    return info.seek_granularity != 1;
}

std::vector<std::vector<std::size_t>> staged_columns(const std::vector<SourceInfo>& infos,
                                                     const SurveyRequest& request) {
    std::vector<std::vector<std::size_t>> columns(infos.size());
    if (!request.positions.empty()) {
        for (std::size_t i = 0; i < request.columns.size(); ++i) {
            if (is_slow(infos[i])) {
                columns[i] = request.columns[i];
            }
        }
    }
    return columns;
}

// What one thread has seen of one source.
struct Tally {
    std::uint64_t points = 0;
    std::uint64_t rejected = 0;
};

struct Worker {
    Worker(Occupancy grid, PositionStager positions)
        : occupancy(std::move(grid)), stager(std::move(positions)) {}
    Occupancy occupancy;
    Box box;
    std::vector<Tally> tallies;
    PositionStager stager;
};

// From the first chunk that has a finite point, so that it does not depend on threads.
double first_voxel_size(const std::vector<std::filesystem::path>& files, double voxels) {
    Box box;
    for (const std::filesystem::path& file : files) {
        const std::unique_ptr<PointSource> source = open_source(file);
        Chunk chunk;
        while (box.empty() && source->read(chunk, kChunkPoints)) {
            for (const Vec3& p : chunk.positions) {
                if (is_finite(p)) {
                    box.extend(p);
                }
            }
        }
        if (!box.empty()) {
            break;
        }
    }
    const Vec3 size = box.size();
    const double longest = std::max({size.x, size.y, size.z});
    const double farthest =
        box.empty() ? 0
                    : std::max({std::abs(box.min.x), std::abs(box.min.y), std::abs(box.min.z),
                                std::abs(box.max.x), std::abs(box.max.y), std::abs(box.max.z)});
    // A first chunk in one place says nothing of size; what doubles resolve there is a start.
    constexpr double kResolution = 1e-12;
    const double smallest =
        std::max(farthest * kResolution, std::numeric_limits<double>::min() * 4);
    return std::max(longest / voxels, smallest);
}

}  // namespace

std::uint64_t survey_overhead_bytes(int threads, std::size_t columns_size) {
    constexpr std::uint64_t kReaderBytes = std::uint64_t{4} << 20;
    // A chunk, and what is written of it.
    return static_cast<std::uint64_t>(threads) *
           (kReaderBytes + 2 * kChunkPoints * (sizeof(Vec3) + columns_size));
}

std::uint64_t column_bytes(const std::vector<SourceInfo>& infos,
                           const std::vector<std::vector<std::size_t>>& columns) {
    std::uint64_t bytes = 0;
    for (std::size_t i = 0; i < columns.size(); ++i) {
        for (const std::size_t column : columns[i]) {
            bytes += is_slow(infos[i])
                         ? points_about(infos[i]) * infos[i].schema[column].value_size()
                         : 0;
        }
    }
    return bytes;
}

std::uint64_t position_bytes(const std::vector<SourceInfo>& infos) {
    std::uint64_t bytes = 0;
    for (const SourceInfo& info : infos) {
        if (is_slow(info)) {
            bytes += points_about(info) * PositionCodec(info.coordinates).size();
        }
    }
    return bytes;
}

Survey survey(const SurveyRequest& request, const std::function<void(std::uint64_t)>& advance) {
    std::vector<SourceInfo> infos;
    for (const std::filesystem::path& file : request.files) {
        infos.push_back(open_source(file)->info());
    }
    const double voxel_size = first_voxel_size(request.files, first_voxels(infos));
    const auto threads = static_cast<std::size_t>(std::max(request.threads, 1));
    const std::uint64_t budget = request.budget_bytes / (threads + 1);
    std::vector<Worker> workers;
    for (std::size_t i = 0; i < threads; ++i) {
        workers.emplace_back(Occupancy(voxel_size, budget),
                             PositionStager(request.positions, points_about(infos)));
        workers.back().tallies.resize(infos.size());
    }

    StagedPoints staged{{}, staged_columns(infos, request), request.stays};
    const std::vector<SourceRange> ranges = cut_into_ranges(infos, kRangePoints);
    stream_ranges(
        infos, ranges, static_cast<int>(threads), kChunkPoints,
        [&](std::size_t slot, std::size_t range, const Chunk& chunk) {
            Worker& worker = workers[slot];
            const std::size_t source = ranges[range].source;
            Tally& tally = worker.tallies[source];
            if (!request.positions.empty() && is_slow(infos[source])) {
                worker.stager.add(range, source, infos[source], staged.columns[source], chunk);
            }
            for (const Vec3& p : chunk.positions) {
                if (is_finite(p)) {
                    worker.box.extend(p);
                    worker.occupancy.add(p);
                } else {
                    ++tally.rejected;
                }
            }
            tally.points += chunk.positions.size();
            advance(chunk.positions.size());
        },
        staged.columns);

    std::vector<std::string> digests(infos.size());
    if (request.digests) {
        run_tasks(infos.size(), static_cast<int>(threads), [&](std::size_t i, std::size_t) {
            digests[i] = xxh3_128_of_file(infos[i].path);
        });
    }

    Box box;
    std::optional<Occupancy> occupancy;
    std::vector<PositionFile>& files = staged.files;
    for (Worker& worker : workers) {
        const std::vector<PositionFile> written = worker.stager.finish();
        files.insert(files.end(), written.begin(), written.end());
        box.extend(worker.box);
        if (occupancy) {
            occupancy->add(worker.occupancy);
        } else {
            occupancy.emplace(std::move(worker.occupancy));
        }
    }
    check_extent(box);
    std::sort(files.begin(), files.end(), [](const PositionFile& a, const PositionFile& b) {
        return std::tie(a.source, a.first) < std::tie(b.source, b.first);
    });

    std::vector<SourceEntry> entries;
    for (std::size_t i = 0; i < infos.size(); ++i) {
        SourceEntry entry;
        entry.info = infos[i];
        entry.given_path = infos[i].path == request.standard_input ? "-" : infos[i].path.string();
        entry.xxh3 = digests[i];
        for (const Worker& worker : workers) {
            entry.points += worker.tallies[i].points;
            entry.rejected += worker.tallies[i].rejected;
        }
        entries.push_back(std::move(entry));
    }
    return {SourceTable(std::move(entries), box), std::move(*occupancy), std::move(staged)};
}

}  // namespace knap
