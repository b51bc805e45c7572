#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace knap {

/// XXH3-64 of a block of memory.
std::uint64_t xxh3_64(std::span<const std::byte> bytes);

/// XXH3-64 of a whole file as 16 hex digits.
/// @throws InputError if the file cannot be read
std::string xxh3_64_of_file(const std::filesystem::path& path);

/// XXH3-128 of a whole file as 32 hex digits.
/// @throws InputError if the file cannot be read
std::string xxh3_128_of_file(const std::filesystem::path& path);

/// The finaliser of splitmix64: a bijection that scatters neighbouring ids.
constexpr std::uint64_t splitmix64(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15U;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
    return x ^ (x >> 31);
}

/// Of a block of `count` items: an empty one has a checksum of its own.
inline std::uint64_t block_checksum(std::uint32_t count, std::span<const std::byte> payload) {
    return xxh3_64(payload) ^ splitmix64(count);
}

}  // namespace knap
