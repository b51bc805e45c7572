#include "base/checksum.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <set>
#include <vector>

#include "knap/error.hpp"
#include "support/clouds.hpp"

namespace knap {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

std::vector<std::byte> random_bytes(std::size_t size) {
    std::mt19937_64 random(size);
    std::vector<std::byte> bytes(size);
    for (std::byte& byte : bytes) {
        byte = static_cast<std::byte>(random());
    }
    return bytes;
}

void write(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
}

TEST(Checksum, IsXxh3) {
    // The published values for no input.
    EXPECT_EQ(xxh3_64({}), 0x2d06800538d394c2U);
    const test::TemporaryFolder folder;
    write(folder / "empty", {});
    EXPECT_EQ(xxh3_64_of_file(folder / "empty"), "2d06800538d394c2");
    EXPECT_EQ(xxh3_128_of_file(folder / "empty"), "99aa06d3014798d86001c324468d497f");
}

TEST(Checksum, OfAFileIsThatOfItsBytesAcrossTheBlocksItIsReadIn) {
    const test::TemporaryFolder folder;
    constexpr std::size_t kMebibyte = std::size_t{1} << 20;
    for (const std::size_t size : {std::size_t{1}, std::size_t{240}, kMebibyte - 1, kMebibyte,
                                   kMebibyte + 1, 2 * kMebibyte + 77}) {
        const std::vector<std::byte> bytes = random_bytes(size);
        write(folder / "file", bytes);
        EXPECT_EQ(xxh3_64_of_file(folder / "file"), fmt::format("{:016x}", xxh3_64(bytes)));
    }
}

TEST(Checksum, OfAFileChangesWithEveryByte) {
    const test::TemporaryFolder folder;
    std::vector<std::byte> bytes = random_bytes(200);
    std::set<std::string> seen64;
    std::set<std::string> seen128;
    for (std::size_t i = 0; i <= bytes.size(); ++i) {
        write(folder / "file", bytes);
        seen64.insert(xxh3_64_of_file(folder / "file"));
        seen128.insert(xxh3_128_of_file(folder / "file"));
        if (i < bytes.size()) {
            bytes[i] ^= std::byte{1};
        }
    }
    EXPECT_EQ(seen64.size(), bytes.size() + 1);
    EXPECT_EQ(seen128.size(), bytes.size() + 1);
}

TEST(Checksum, OfAMissingFileIsAnErrorNamingIt) {
    const test::TemporaryFolder folder;
    EXPECT_THAT([&] { xxh3_64_of_file(folder / "none"); },
                ThrowsMessage<InputError>(HasSubstr((folder / "none").string())));
    EXPECT_THAT([&] { xxh3_128_of_file(folder / "none"); },
                ThrowsMessage<InputError>(HasSubstr((folder / "none").string())));
}

TEST(Splitmix64, IsTheOneOfTheMethod) {
    // The first two numbers of the generator with seed 0.
    EXPECT_EQ(splitmix64(0), 0xe220a8397b1dcdafU);
    EXPECT_EQ(splitmix64(0x9e3779b97f4a7c15U), 0x6e789e6aa1b965f4U);
}

TEST(Splitmix64, NeverMapsTwoIdsToOne) {
    std::set<std::uint64_t> seen;
    for (std::uint64_t id = 0; id < 100000; ++id) {
        seen.insert(splitmix64(id));
    }
    EXPECT_EQ(seen.size(), 100000U);
}

}  // namespace
}  // namespace knap
