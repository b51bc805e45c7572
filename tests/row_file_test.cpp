#include "store/row_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "knap/error.hpp"
#include "support/clouds.hpp"
#include "support/damage.hpp"

namespace knap {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

std::vector<std::byte> random_bytes(std::mt19937_64& random, std::size_t size) {
    std::vector<std::byte> bytes(size);
    for (std::byte& byte : bytes) {
        byte = static_cast<std::byte>(random());
    }
    return bytes;
}

void write(const std::filesystem::path& path, std::size_t row_size,
           const std::vector<std::byte>& rows) {
    RowWriter writer(path, row_size);
    for (std::size_t at = 0; at < rows.size(); at += row_size) {
        writer.add(std::span(rows).subspan(at, row_size));
    }
    const std::uint64_t size = writer.finish();
    EXPECT_EQ(size, std::filesystem::file_size(path));
}

TEST(RowFile, GivesBackEveryRow) {
    std::mt19937_64 random(1);
    const test::TemporaryFolder folder;
    for (const std::size_t row_size : {1U, 3U, 40U, 5000U, 300000U}) {
        for (const std::size_t count : {0U, 1U, 51U, 53U}) {
            const std::vector<std::byte> rows = random_bytes(random, row_size * count);
            write(folder / "rows", row_size, rows);
            RowReader reader(folder / "rows", row_size);
            std::vector<std::byte> found;
            for (std::size_t i = 0; i < count; ++i) {
                const auto row = reader.next();
                found.insert(found.end(), row.begin(), row.end());
            }
            EXPECT_EQ(found, rows);
            EXPECT_THAT([&] { reader.next(); }, ThrowsMessage<StorageError>(HasSubstr("rows")));
        }
    }
}

TEST(RowFile, ThatIsDamagedCutOrOfOtherRowsIsAnErrorNamingIt) {
    std::mt19937_64 random(2);
    const test::TemporaryFolder folder;
    const std::filesystem::path file = folder / "rows";
    write(file, 7, random_bytes(random, 700));
    const std::string good = test::read_bytes(file);
    const auto read_all = [&] {
        RowReader reader(file, 7);
        for (int i = 0; i < 100; ++i) {
            reader.next();
        }
    };
    for (std::size_t i = 0; i + 16 < good.size(); i += 5) {
        std::string bad = good;
        bad[i] = static_cast<char>(bad[i] ^ (1 << (random() % 8)));
        test::write_bytes(file, bad);
        EXPECT_TRUE(test::refuses(file, read_all)) << i;
        test::write_bytes(file, good.substr(0, i));
        EXPECT_TRUE(test::refuses(file, read_all)) << i;
    }
    test::write_bytes(file, good);
    EXPECT_NO_THROW(read_all());
    EXPECT_TRUE(test::refuses(file, [&] { RowReader(file, 8); }));
}

}  // namespace
}  // namespace knap
