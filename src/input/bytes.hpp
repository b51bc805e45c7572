#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstring>

namespace knap {

/// The value stored at `from`, which need not be aligned.
/// @tparam kSwap  the bytes are in the other order than this machine's
template <typename T, bool kSwap>
T load(const std::byte* from) {
    std::array<std::byte, sizeof(T)> bytes;
    std::memcpy(bytes.data(), from, sizeof(T));
    if constexpr (kSwap) {
        std::reverse(bytes.begin(), bytes.end());
    }
    return std::bit_cast<T>(bytes);
}

/// The little-endian value stored at `from`.
template <typename T>
T load_little(const std::byte* from) {
    return load<T, std::endian::native != std::endian::little>(from);
}

/// Writes `value` in little-endian order at `to`.
template <typename T>
void store_little(std::byte* to, T value) {
    auto bytes = std::bit_cast<std::array<std::byte, sizeof(T)>>(value);
    if constexpr (std::endian::native != std::endian::little) {
        std::reverse(bytes.begin(), bytes.end());
    }
    std::memcpy(to, bytes.data(), bytes.size());
}

}  // namespace knap
