#include "base/checksum.hpp"

#include <fmt/format.h>
#include <xxhash.h>

#include <memory>
#include <vector>

#include "base/file.hpp"
#include "knap/error.hpp"

namespace knap {

namespace {

using State = std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)>;

template <typename Update>
void for_each_block(const std::filesystem::path& path, Update update) {
    const InputFile file(path);
    std::vector<std::byte> block(std::size_t{1} << 20);
    for (std::uint64_t at = 0;;) {
        const std::size_t got = file.read_some(at, block);
        if (got == 0) {
            return;
        }
        update(block.data(), got);
        at += got;
    }
}

}  // namespace

std::uint64_t xxh3_64(std::span<const std::byte> bytes) {
    return XXH3_64bits(bytes.data(), bytes.size());
}

std::string xxh3_64_of_file(const std::filesystem::path& path) {
    const State state(XXH3_createState(), XXH3_freeState);
    XXH3_64bits_reset(state.get());
    for_each_block(path, [&](const std::byte* data, std::size_t size) {
        XXH3_64bits_update(state.get(), data, size);
    });
    return fmt::format("{:016x}", XXH3_64bits_digest(state.get()));
}

std::string xxh3_128_of_file(const std::filesystem::path& path) {
    const State state(XXH3_createState(), XXH3_freeState);
    XXH3_128bits_reset(state.get());
    for_each_block(path, [&](const std::byte* data, std::size_t size) {
        XXH3_128bits_update(state.get(), data, size);
    });
    const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
    return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace knap
