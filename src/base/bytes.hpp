#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

/// Writing and reading the numbers of knap's own files: little endian, unaligned.
namespace knap {

static_assert(std::endian::native == std::endian::little, "knap's files are little endian");

template <typename T>
concept Scalar = std::is_arithmetic_v<T>;

template <Scalar T>
void put(std::vector<std::byte>& out, T value) {
    const std::size_t at = out.size();
    out.resize(at + sizeof value);
    std::memcpy(out.data() + at, &value, sizeof value);
}

/// The lowest `width` bytes of a number, width in [1, 8].
inline void put_bytes(std::vector<std::byte>& out, std::uint64_t value, std::size_t width) {
    const std::size_t at = out.size();
    out.resize(at + width);
    std::memcpy(out.data() + at, &value, width);
}

/// Base 128, low groups first: one byte a number below 128, ten at most.
inline void put_varint(std::vector<std::byte>& out, std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) {
        out.push_back(static_cast<std::byte>(value | 0x80));
    }
    out.push_back(static_cast<std::byte>(value));
}

/// Reads what the functions above wrote. Running past the end yields zeros and clears ok().
class ByteReader {
  public:
    explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

    template <Scalar T>
    T get() {
        T value{};
        if (const std::byte* at = take(sizeof value)) {
            std::memcpy(&value, at, sizeof value);
        }
        return value;
    }

    std::uint64_t get_bytes(std::size_t width) {
        std::uint64_t value = 0;
        if (const std::byte* at = take(width)) {
            std::memcpy(&value, at, width);
        }
        return value;
    }

    std::uint64_t get_varint() {
        std::uint64_t value = 0;
        for (int shift = 0; shift < 64; shift += 7) {
            const std::byte* at = take(1);
            if (at == nullptr) {
                return 0;
            }
            const auto group = static_cast<std::uint64_t>(*at);
            value |= (group & 0x7f) << shift;
            if (group < 0x80) {
                return value;
            }
        }
        ok_ = false;
        return 0;
    }

    /// The next `size` bytes where they lie; null past the end.
    const std::byte* take(std::size_t size) {
        if (size > bytes_.size()) {
            ok_ = false;
            bytes_ = {};
            return nullptr;
        }
        const std::byte* at = bytes_.data();
        bytes_ = bytes_.subspan(size);
        return at;
    }

    std::size_t left() const { return bytes_.size(); }
    bool ok() const { return ok_; }

  private:
    std::span<const std::byte> bytes_;
    bool ok_ = true;
};

}  // namespace knap
