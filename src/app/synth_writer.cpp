#include "app/synth_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <iterator>
#include <string>
#include <vector>

#include "app/interrupt.hpp"
#include "base/file.hpp"
#include "base/threads.hpp"

namespace knap::app {

namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written as it lies in memory");

constexpr std::uint64_t kBlock = 1 << 15;  // points
constexpr std::uint64_t kBlocks = 64;      // generated at once, then written in order

std::string ply_header(std::uint64_t points) {
    return fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
        "property float x\nproperty float y\nproperty float z\nend_header\n",
        points);
}

void append_binary(std::string& bytes, const Vec3& p) {
    const std::array<float, 3> xyz{static_cast<float>(p.x), static_cast<float>(p.y),
                                   static_cast<float>(p.z)};
    std::array<char, sizeof(xyz)> raw{};
    std::memcpy(raw.data(), xyz.data(), sizeof(xyz));
    bytes.append(raw.data(), raw.size());
}

void append_text(std::string& bytes, const Vec3& p) {
    fmt::format_to(std::back_inserter(bytes), "{} {} {}\n", static_cast<float>(p.x),
                   static_cast<float>(p.y), static_cast<float>(p.z));
}

}  // namespace

void write_cloud(const SynthCloud& cloud, std::uint64_t points, const std::filesystem::path& path) {
    const bool text = path.extension() == ".xyz";
    AtomicFile file(path);
    if (!text) {
        file.write(ply_header(points));
    }
    std::vector<std::string> blocks(kBlocks);
    for (std::uint64_t first = 0; first < points; first += kBlocks * kBlock) {
        throw_if_interrupted();
        const std::uint64_t left = std::min(points - first, kBlocks * kBlock);
        const std::uint64_t count = (left + kBlock - 1) / kBlock;
        parallel_for(count, 1, [&](std::size_t begin, std::size_t end) {
            std::vector<Vec3> positions;
            for (std::size_t block = begin; block < end; ++block) {
                positions.resize(std::min(left - block * kBlock, kBlock));
                cloud.fill(first + block * kBlock, positions);
                blocks[block].clear();
                for (const Vec3& p : positions) {
                    text ? append_text(blocks[block], p) : append_binary(blocks[block], p);
                }
            }
        });
        for (std::uint64_t block = 0; block < count; ++block) {
            file.write(blocks[block]);
        }
    }
    file.commit();
}

}  // namespace knap::app
