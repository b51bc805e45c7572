#include "support/clouds.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>

#include "knap/source.hpp"

namespace knap::test {

namespace {

using Random = std::mt19937_64;

double uniform(Random& random, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
}

std::size_t pick(Random& random, std::size_t low, std::size_t high) {
    return std::uniform_int_distribution<std::size_t>(low, high)(random);
}

std::vector<Vec3> surface(Random& random, std::size_t n) {
    const double bend = uniform(random, 0.1, 4);
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < n; ++i) {
        const double x = uniform(random, -1, 1);
        const double y = uniform(random, -1, 1);
        points.push_back({x, y, 0.3 * std::sin(bend * x) * std::cos(bend * y) + std::abs(x) * 0.5});
    }
    return points;
}

std::vector<Vec3> noise(Random& random, std::size_t n) {
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < n; ++i) {
        points.push_back({uniform(random, 0, 1), uniform(random, 0, 1), uniform(random, 0, 1)});
    }
    return points;
}

std::vector<Vec3> line(Random& random, std::size_t n) {
    const Vec3 direction{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < n; ++i) {
        const double t = uniform(random, 0, 10);
        points.push_back({direction.x * t, direction.y * t, direction.z * t});
    }
    return points;
}

std::vector<Vec3> plane(Random& random, std::size_t n) {
    const double slope = pick(random, 0, 1) == 0 ? 0 : uniform(random, -1, 1);
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < n; ++i) {
        const double x = uniform(random, 0, 3);
        points.push_back({x, uniform(random, 0, 2), slope * x});
    }
    return points;
}

std::vector<Vec3> lattice(Random& random, std::size_t n) {
    const bool flat = pick(random, 0, 1) == 0;
    const double side =
        std::ceil(flat ? std::sqrt(static_cast<double>(n)) : std::cbrt(static_cast<double>(n)));
    const double step = pick(random, 0, 1) == 0 ? 1 : 0.1;
    std::vector<Vec3> points;
    for (double x = 0; x < side; ++x) {
        for (double y = 0; y < side; ++y) {
            for (double z = 0; z < (flat ? 1 : side); ++z) {
                points.push_back({x * step, y * step, z * step});
            }
        }
    }
    std::shuffle(points.begin(), points.end(), random);
    return points;
}

std::vector<Vec3> duplicates(Random& random, std::size_t n) {
    std::vector<Vec3> points = surface(random, n / 3 + 1);
    while (points.size() < n) {
        points.push_back(points[pick(random, 0, points.size() - 1)]);
    }
    return points;
}

std::vector<Vec3> clusters(Random& random, std::size_t n) {
    const std::size_t count = pick(random, 2, 5);
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < n; ++i) {
        const auto cluster = static_cast<double>(pick(random, 0, count - 1));
        points.push_back({cluster * 1000 + uniform(random, 0, 1),
                          cluster * cluster * 500 + uniform(random, 0, 1), uniform(random, 0, 1)});
    }
    return points;
}

}  // namespace

std::vector<Vec3> random_cloud(Random& random) {
    using Maker = std::vector<Vec3> (*)(Random&, std::size_t);
    constexpr Maker kMakers[] = {surface, noise, line, plane, lattice, duplicates, clusters};
    const std::size_t size = pick(random, 0, 19) == 0 ? pick(random, 0, 1) : pick(random, 2, 700);
    std::vector<Vec3> points;
    if (size > 0) {
        points = kMakers[pick(random, 0, std::size(kMakers) - 1)](random, size);
        points.resize(size <= 1 ? 1 : points.size());
    }
    if (pick(random, 0, 4) == 0) {
        const Vec3 far{uniform(random, -1e6, 1e6), uniform(random, -1e6, 1e6),
                       uniform(random, -1e3, 1e3)};
        for (Vec3& p : points) {
            p = p + far;
        }
    }
    if (pick(random, 0, 2) == 0) {
        for (Vec3& p : points) {
            p = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
        }
    }
    if (pick(random, 0, 4) == 0) {
        constexpr double kBad[] = {std::numeric_limits<double>::quiet_NaN(),
                                   std::numeric_limits<double>::infinity(),
                                   -std::numeric_limits<double>::infinity()};
        for (std::size_t i = pick(random, 1, 5); i > 0; --i) {
            Vec3 bad{1, 2, 3};
            bad[static_cast<int>(pick(random, 0, 2))] = kBad[pick(random, 0, 2)];
            points.insert(
                points.begin() + static_cast<std::ptrdiff_t>(pick(random, 0, points.size())), bad);
        }
    }
    return points;
}

std::vector<Vec3> sphere_cloud(std::size_t n, std::uint64_t seed) {
    Random random(seed);
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < n; ++i) {
        const double z = uniform(random, -1, 1);
        const double angle = uniform(random, 0, 2 * std::numbers::pi);
        const double r = std::sqrt(1 - z * z);
        points.push_back({r * std::cos(angle), r * std::sin(angle), z});
    }
    return points;
}

TemporaryFolder::TemporaryFolder() {
    static std::atomic<int> next{0};
    path_ =
        std::filesystem::temp_directory_path() / fmt::format("knap-test-{}-{}", ::getpid(), next++);
    std::filesystem::create_directories(path_);
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
}

void write_ply(const std::filesystem::path& path, const std::vector<Vec3>& points, bool as_float) {
    std::ofstream file(path, std::ios::binary);
    const char* type = as_float ? "float" : "double";
    file << "ply\nformat binary_little_endian 1.0\nelement vertex " << points.size()
         << "\nproperty " << type << " x\nproperty " << type << " y\nproperty " << type
         << " z\nend_header\n";
    for (const Vec3& p : points) {
        for (int axis = 0; axis < 3; ++axis) {
            const double wide = p[axis];
            const auto narrow = static_cast<float>(wide);
            file.write(as_float ? reinterpret_cast<const char*>(&narrow)
                                : reinterpret_cast<const char*>(&wide),
                       as_float ? sizeof narrow : sizeof wide);
        }
    }
}

void write_ascii_ply(const std::filesystem::path& path, const std::vector<Vec3>& points) {
    std::ofstream file(path);
    file << "ply\nformat ascii 1.0\nelement vertex " << points.size()
         << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    file.precision(std::numeric_limits<float>::max_digits10);
    for (const Vec3& p : points) {
        file << static_cast<float>(p.x) << ' ' << static_cast<float>(p.y) << ' '
             << static_cast<float>(p.z) << '\n';
    }
}

std::vector<PointId> read_ids(const std::filesystem::path& path) {
    std::ifstream file(path);
    std::vector<PointId> ids;
    for (PointId id = 0; file >> id;) {
        ids.push_back(id);
    }
    return ids;
}

std::string read_bytes(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

std::filesystem::path shared_file(const std::string& name, const TemporaryFolder& folder) {
    const std::filesystem::path path = std::filesystem::path(KNAP_SHARED_DATA) / name;
    if (!std::filesystem::exists(path) || path.extension() != ".gz") {
        return std::filesystem::exists(path) ? path : std::filesystem::path();
    }
    const std::filesystem::path unpacked = folder / path.stem().string();
    const std::string command =
        fmt::format("gzip -dc '{}' > '{}'", path.string(), unpacked.string());
    return std::system(command.c_str()) == 0 ? unpacked : std::filesystem::path();
}

std::vector<Vec3> read_cloud(const std::filesystem::path& path) {
    const std::unique_ptr<PointSource> source = open_source(path);
    std::vector<Vec3> points;
    constexpr std::size_t kChunk = 65536;
    for (Chunk chunk; source->read(chunk, kChunk);) {
        points.insert(points.end(), chunk.positions.begin(), chunk.positions.end());
    }
    return points;
}

}  // namespace knap::test
