#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "knap/error.hpp"
#include "support/clouds.hpp"

/// What becomes of a file of knap's own when it is damaged.
namespace knap::test {

inline void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

/// True if reading throws StorageError with one line that names the file.
inline bool refuses(const std::filesystem::path& path, const std::function<void()>& read) {
    try {
        read();
        return false;
    } catch (const StorageError& error) {
        const std::string text = error.what();
        EXPECT_NE(text.find(path.string()), std::string::npos) << text;
        EXPECT_EQ(text.find('\n'), std::string::npos) << text;
        return true;
    }
}

/// Calls check(at) with each bit of byte `at` flipped in turn; restores the file.
inline void with_each_bit_flipped(const std::filesystem::path& path,
                                  const std::function<void(std::size_t at)>& check) {
    const std::string good = read_bytes(path);
    std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
    const auto overwrite = [&](std::size_t at, int byte) {
        file.seekp(static_cast<std::streamoff>(at));
        file.put(static_cast<char>(byte)).flush();
    };
    for (std::size_t at = 0; at < good.size(); ++at) {
        for (int bit = 0; bit < 8; ++bit) {
            overwrite(at, good[at] ^ (1 << bit));
            check(at);
        }
        overwrite(at, good[at]);
    }
}

/// Calls check(size) with the file cut to every size below its own; restores the file.
inline void with_each_cut(const std::filesystem::path& path,
                          const std::function<void(std::size_t size)>& check) {
    const std::string good = read_bytes(path);
    for (std::size_t size = 0; size < good.size(); ++size) {
        write_bytes(path, good.substr(0, size));
        check(size);
    }
    write_bytes(path, good);
}

}  // namespace knap::test
