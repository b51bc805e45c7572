#include "output/ply_writer.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "knap/error.hpp"
#include "support/clouds.hpp"

namespace knap {
namespace {

class PlyWriterFile : public testing::Test {
  protected:
    test::TemporaryFolder scratch_;
    std::filesystem::path path_ = scratch_.path() / "cloud.ply";
};

std::string data_of(const std::string& text) {
    const std::string end = "end_header\n";
    return text.substr(text.find(end) + end.size());
}

TEST_F(PlyWriterFile, HeaderNamesCountTypeAndComments) {
    PlyWriter writer(path_, 0, PlyWriter::Precision::kFloat, {"knap 1", "two\nlines\r"});
    writer.finish();
    EXPECT_EQ(read_text_file(path_),
              "ply\nformat binary_little_endian 1.0\ncomment knap 1\ncomment two lines \n"
              "element vertex 0\nproperty float x\nproperty float y\nproperty float z\n"
              "end_header\n");
}

TEST_F(PlyWriterFile, DoublesReadBackBitForBitHoweverTheyWereHandedOver) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> coordinate(-1e7, 1e7);
    std::vector<Vec3> points(100000);
    for (Vec3& point : points) {
        point = {coordinate(random), coordinate(random), -0.0};
    }
    PlyWriter writer(path_, points.size(), PlyWriter::Precision::kDouble, {});
    for (std::size_t at = 0; at < points.size();) {
        const std::size_t count = std::min<std::size_t>(random() % 9000, points.size() - at);
        writer.append(std::span(points).subspan(at, count));
        at += count;
    }
    const std::uint64_t size = writer.finish();
    EXPECT_EQ(size, std::filesystem::file_size(path_));
    const std::string data = data_of(read_text_file(path_));
    ASSERT_EQ(data.size(), points.size() * 24);
    EXPECT_EQ(std::memcmp(data.data(), points.data(), data.size()), 0);
}

TEST_F(PlyWriterFile, FloatsReadBackBitForBit) {
    const std::vector<float> values{1.5F, -0.0F, 3e-42F, 0.1F, 7, 1e30F};
    PlyWriter writer(path_, 2, PlyWriter::Precision::kFloat, {});
    writer.append(
        std::vector<Vec3>{{values[0], values[1], values[2]}, {values[3], values[4], values[5]}});
    writer.finish();
    const std::string data = data_of(read_text_file(path_));
    ASSERT_EQ(data.size(), 24U);
    EXPECT_EQ(std::memcmp(data.data(), values.data(), 24), 0);
}

TEST_F(PlyWriterFile, FewerPointsThanAnnouncedAreAnErrorThatLeavesNothing) {
    {
        PlyWriter writer(path_, 2, PlyWriter::Precision::kDouble, {});
        writer.append(std::vector<Vec3>{{1, 2, 3}});
        EXPECT_THROW(writer.finish(), StorageError);
    }
    EXPECT_TRUE(std::filesystem::is_empty(scratch_.path()));
}

}  // namespace
}  // namespace knap
