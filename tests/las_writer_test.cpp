#include "output/las_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "knap/error.hpp"
#include "output/las_fields.hpp"
#include "support/las_bytes.hpp"
#include "support/scan_files.hpp"

namespace knap {
namespace {

using test::get;
using test::LasBytes;
using test::raw;

using enum ScalarType;

const std::vector<Attribute> kLegacy{
    {"intensity", kUint16},     {"return_number", kUint8},       {"number_of_returns", kUint8},
    {"scan_direction", kUint8}, {"edge_of_flight_line", kUint8}, {"classification", kUint8},
    {"synthetic", kUint8},      {"key_point", kUint8},           {"withheld", kUint8},
    {"scan_angle_rank", kInt8}, {"user_data", kUint8},           {"point_source_id", kUint16}};
const std::vector<Attribute> kExtended{
    {"intensity", kUint16},      {"return_number", kUint8},    {"number_of_returns", kUint8},
    {"scanner_channel", kUint8}, {"scan_direction", kUint8},   {"edge_of_flight_line", kUint8},
    {"classification", kUint8},  {"synthetic", kUint8},        {"key_point", kUint8},
    {"withheld", kUint8},        {"overlap", kUint8},          {"scan_angle", kInt16, 1, 0.006},
    {"user_data", kUint8},       {"point_source_id", kUint16}, {"gps_time", kFloat64}};
const std::vector<Attribute> kColours{{"red", kUint16}, {"green", kUint16}, {"blue", kUint16}};

std::vector<Attribute> operator+(std::vector<Attribute> a, const std::vector<Attribute>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

/// A cloud of random points and values, and the file that is written of it.
struct Case {
    CloudHeader header;
    std::vector<Vec3> positions;
    std::vector<std::byte> rows;

    Case(int point_format, const std::vector<Attribute>& attributes, std::size_t points = 3000) {
        header.points = points;
        header.coordinates = {CoordinateKind::kInt32, {0.01, 0.02, 0.001}, {500000, 4e6, 0.5}};
        header.attributes = attributes;
        header.las.emplace();
        header.las->version_minor = point_format >= 6 ? 4 : 2;
        header.las->point_format = point_format;
        std::mt19937_64 random(static_cast<std::uint64_t>(point_format) + attributes.size());
        for (std::size_t i = 0; i < points; ++i) {
            Vec3 position;
            for (int axis = 0; axis < 3; ++axis) {
                position[axis] =
                    header.coordinates.axis(axis).at(static_cast<std::int32_t>(random()));
            }
            positions.push_back(position);
            for (const Attribute& attribute : attributes) {
                for (std::size_t b = 0; b < attribute.value_size(); ++b) {
                    rows.push_back(static_cast<std::byte>(random() % limit(attribute.name)));
                }
            }
        }
    }

    /// Values of bit fields are below this, those of all other bytes anything.
    std::uint64_t limit(const std::string& name) const {
        const bool extended = header.las->point_format >= 6;
        if (name == "return_number" || name == "number_of_returns") {
            return extended ? 16 : 8;
        }
        if (name == "classification" && !extended) {
            return 32;
        }
        if (name == "scanner_channel") {
            return 4;
        }
        for (const char* flag : {"scan_direction", "edge_of_flight_line", "synthetic", "key_point",
                                 "withheld", "overlap"}) {
            if (name == flag) {
                return 2;
            }
        }
        return 256;
    }

    void write(const std::filesystem::path& path) const {
        const std::unique_ptr<CloudWriter> writer = open_cloud_writer(path, header);
        const std::size_t row = row_size(header.attributes);
        for (std::size_t at = 0; at < positions.size();) {
            const std::size_t n = std::min<std::size_t>(1 + at % 777, positions.size() - at);
            writer->append(std::span(positions).subspan(at, n),
                           std::span(rows).subspan(at * row, n * row));
            at += n;
        }
        const std::uint64_t size = writer->finish();
        EXPECT_EQ(size, std::filesystem::file_size(path));
    }

    std::string value(std::size_t point, std::size_t attribute) const {
        std::size_t at = point * row_size(header.attributes);
        for (std::size_t i = 0; i < attribute; ++i) {
            at += header.attributes[i].value_size();
        }
        return {reinterpret_cast<const char*>(rows.data() + at),
                header.attributes[attribute].value_size()};
    }
};

class LasWriterFile : public testing::Test {
  protected:
    test::ScanFolder folder_;
    std::filesystem::path las_ = folder_.path() / "cloud.las";
    std::filesystem::path laz_ = folder_.path() / "cloud.laz";
};

void expect_values(const Case& cloud, const LasBytes& file) {
    ASSERT_EQ(file.points(), cloud.positions.size());
    for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
        for (int axis = 0; axis < 3; ++axis) {
            ASSERT_EQ(cloud.header.coordinates.axis(axis).at(file.step(i, axis)),
                      cloud.positions[i][axis]);
        }
        for (std::size_t a = 0; a < cloud.header.attributes.size(); ++a) {
            ASSERT_EQ(file.field(i, cloud.header.attributes[a].name), cloud.value(i, a))
                << cloud.header.attributes[a].name << " of point " << i;
        }
    }
}

TEST_F(LasWriterFile, EveryFieldOfEveryPointFormatIsThereBitForBit) {
    const std::vector<Attribute> time{{"gps_time", kFloat64}};
    const std::vector<std::pair<int, std::vector<Attribute>>> cases{
        {0, kLegacy},
        {1, kLegacy + time},
        {2, kLegacy + kColours},
        {3, kLegacy + time + kColours},
        {6, kExtended},
        {7, kExtended + kColours},
        {8, kExtended + kColours + std::vector<Attribute>{{"near_infrared", kUint16}}}};
    for (const auto& [format, attributes] : cases) {
        const Case cloud(format, attributes);
        cloud.write(las_);
        const LasBytes file(las_);
        EXPECT_EQ(file.point_format(), format);
        EXPECT_EQ(file.record_length(), test::LasFile::kRecordLengths.at(format));
        expect_values(cloud, file);
        std::filesystem::remove(las_);
    }
}

TEST_F(LasWriterFile, OnlyTheFieldsThatAreThereDecideTheFormat) {
    Case cloud(5, {{"classification", kUint8}}, 3);
    cloud.write(las_);
    EXPECT_EQ(LasBytes(las_).point_format(), 0);
    EXPECT_THAT(notes_on(CloudFormat::kLas, cloud.header),
                testing::ElementsAre(testing::HasSubstr("format 5 becomes 0")));
    cloud = Case(10, kColours, 3);
    cloud.write(folder_.path() / "b.las");
    EXPECT_EQ(LasBytes(folder_.path() / "b.las").point_format(), 7);
}

TEST_F(LasWriterFile, WhatIsNoFieldBecomesExtraBytesWithAllThatIsKnownOfIt) {
    const std::vector<Attribute> extra{
        {"Amplitude", kUint16, 1, 0.01, -5, "Echo signal amplitude [dB]"},
        {"normal", kFloat32, 3},
        {"pair", kInt64, 2},
        {"bytes", kUint8, 7},
        {"quality", kFloat64},
        {"intensity", kFloat32},
        {std::string(40, 'n'), kInt8},
        {std::string(41, 'n'), kInt32}};
    const Case cloud(6, extra);
    cloud.write(las_);
    const LasBytes file(las_);
    EXPECT_EQ(file.point_format(), 6);
    EXPECT_EQ(file.record_length(), 30 + row_size(extra));
    const std::string descriptors = file.record("LASF_Spec", 4);
    ASSERT_EQ(descriptors.size(), extra.size() * 192);
    EXPECT_EQ(descriptors[2], 3) << "unsigned short";
    EXPECT_EQ(descriptors[3], 8 + 16) << "scale and offset";
    EXPECT_EQ(get<double>(descriptors, 112), 0.01);
    EXPECT_EQ(get<double>(descriptors, 136), -5);
    EXPECT_STREQ(descriptors.c_str() + 4, "Amplitude");
    EXPECT_STREQ(descriptors.c_str() + 160, "Echo signal amplitude [dB]");
    EXPECT_EQ(descriptors[192 + 2], 29) << "three floats";
    EXPECT_EQ(descriptors[2 * 192 + 2], 18) << "two signed long longs";
    EXPECT_EQ(descriptors[3 * 192 + 2], 0);
    EXPECT_EQ(descriptors[3 * 192 + 3], 7) << "bytes";
    EXPECT_EQ(descriptors.substr(6 * 192 + 4, 32), std::string(32, 'n'));
    EXPECT_EQ(descriptors.substr(7 * 192 + 4, 32), std::string(30, 'n') + "_2");
    for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
        ASSERT_EQ(
            file.point(i).substr(30),
            std::string(reinterpret_cast<const char*>(cloud.rows.data()) + i * row_size(extra),
                        row_size(extra)));
    }
}

TEST_F(LasWriterFile, ExtraBytesHaveTheLimitsThatAreKnown) {
    std::vector<Attribute> extra{{"one", kUint16}, {"three", kFloat64, 3}, {"five", kInt16, 5}};
    extra[0].limits = {{65535}, {1}, {9}};
    extra[1].limits.least = {11, 12, 13};
    extra[2].limits.missing = {21, 22, 23, 24, 25};
    const Case cloud(6, extra);
    cloud.write(las_);
    const std::string descriptors = LasBytes(las_).record("LASF_Spec", 4);
    ASSERT_EQ(descriptors.size(), 7 * 192U);
    const auto value = [&](std::size_t descriptor, std::size_t at) {
        return get<std::uint64_t>(descriptors, descriptor * 192 + at);
    };
    EXPECT_EQ(descriptors[3], 7);
    EXPECT_EQ(value(0, 40), 65535U);
    EXPECT_EQ(value(0, 64), 1U);
    EXPECT_EQ(value(0, 88), 9U);
    EXPECT_EQ(descriptors[192 + 3], 2);
    EXPECT_EQ(value(1, 64), 11U);
    EXPECT_EQ(value(1, 80), 13U);
    for (std::size_t i = 2; i < 7; ++i) {
        EXPECT_EQ(descriptors[i * 192 + 3], 1);
        EXPECT_EQ(value(i, 40), 19 + i);
    }
}

TEST_F(LasWriterFile, LazHoldsTheSameRecords) {
    const std::vector<Attribute> extra{{"a", kUint16}, {"b", kFloat64, 2}};
    const std::vector<std::pair<int, std::vector<Attribute>>> cases{
        {0, {}},
        {3, kLegacy + std::vector<Attribute>{{"gps_time", kFloat64}} + kColours + extra},
        {6, kExtended + extra},
        {8, kExtended + kColours + std::vector<Attribute>{{"near_infrared", kUint16}} + extra}};
    for (const auto& [format, attributes] : cases) {
        const Case cloud(format, attributes, 120001);
        cloud.write(las_);
        cloud.write(laz_);
        const LasBytes las(las_);
        const std::string laz = test::file_bytes(laz_);
        EXPECT_EQ(laz[104], static_cast<char>(format | 0x80));
        EXPECT_EQ(laz.substr(105, 122), las.bytes().substr(105, 122)) << "counts, grid and box";
        EXPECT_EQ(test::laz_records(laz_), las.all_points()) << "point format " << format;
        EXPECT_EQ(test::read_all(laz_), cloud.positions);
        std::filesystem::remove(las_);
        std::filesystem::remove(laz_);
    }
}

TEST_F(LasWriterFile, RecordsAndHeaderOfTheSourceAreCarriedByteForByte) {
    Case cloud(6, {{"return_number", kUint8}});
    LasHeaderInfo& info = *cloud.header.las;
    info.file_source_id = 77;
    info.global_encoding = 0x17;
    info.project_id.fill(std::byte{9});
    info.system_identifier = "a scanner";
    info.creation_day = 40;
    info.creation_year = 2020;
    const std::string wkt = std::string("PROJCS[...]\0", 12);
    const auto content = [](const std::string& text) {
        const auto bytes = std::as_bytes(std::span(text.data(), text.size()));
        return std::vector<std::byte>(bytes.begin(), bytes.end());
    };
    const std::string large(100000, 'L');
    info.records = {{"LASF_Projection", 2112, "OGC WKT", false, content(wkt)},
                    {"mine", 7, "", false, {}},
                    {"behind", 8, "far", true, content(large)}};
    for (const auto& path : {las_, laz_}) {
        cloud.write(path);
        const LasBytes file(path);
        EXPECT_EQ(get<std::uint16_t>(file.bytes(), 4), 77);
        EXPECT_EQ(get<std::uint16_t>(file.bytes(), 6), 0x11) << "there are no waveforms";
        EXPECT_EQ(file.bytes().substr(8, 16), std::string(16, 9));
        EXPECT_STREQ(file.bytes().c_str() + 26, "a scanner");
        EXPECT_EQ(get<std::uint16_t>(file.bytes(), 90), 40);
        EXPECT_EQ(get<std::uint16_t>(file.bytes(), 92), 2020);
        EXPECT_EQ(file.record("LASF_Projection", 2112), wkt);
        EXPECT_EQ(file.record("mine", 7), "");
        EXPECT_EQ(file.record("behind", 8, true), large);
        EXPECT_EQ(open_source(path)->info().crs, "PROJCS[...]");
        EXPECT_EQ(test::read_all(path), cloud.positions);
    }
}

TEST_F(LasWriterFile, TheHeaderCountsReturnsAndBoundsThePoints) {
    Case cloud(6, {{"return_number", kUint8}});
    cloud.write(las_);
    const LasBytes file(las_);
    std::array<std::uint64_t, 16> by_return{};
    Box box;
    for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
        ++by_return.at(static_cast<std::size_t>(cloud.rows[i]));
        box.extend(cloud.positions[i]);
    }
    EXPECT_EQ(get<std::uint64_t>(file.bytes(), 247), cloud.positions.size());
    EXPECT_EQ(get<std::uint32_t>(file.bytes(), 107), 0U) << "not for format 6";
    for (std::size_t i = 0; i < 15; ++i) {
        EXPECT_EQ(get<std::uint64_t>(file.bytes(), 255 + 8 * i), by_return.at(i + 1));
    }
    for (int axis = 0; axis < 3; ++axis) {
        const auto at = static_cast<std::size_t>(179 + 16 * axis);
        EXPECT_EQ(get<double>(file.bytes(), at), box.max[axis]);
        EXPECT_EQ(get<double>(file.bytes(), at + 8), box.min[axis]);
    }
}

TEST_F(LasWriterFile, AnEmptyCloudIsAFile) {
    for (const auto& path : {las_, laz_}) {
        Case(6, kColours, 0).write(path);
        EXPECT_TRUE(test::read_all(path).empty());
    }
}

TEST_F(LasWriterFile, ACloudWithoutReturnsHasOneReturnAPoint) {
    Case cloud(0, {}, 2);
    cloud.header.las.reset();
    cloud.write(las_);
    const LasBytes file(las_);
    EXPECT_EQ(file.point_format(), 6);
    EXPECT_EQ(file.point(1)[14], 0x11);
    EXPECT_EQ(get<std::uint64_t>(file.bytes(), 255), 2U);
}

TEST_F(LasWriterFile, ACrsThatNoRecordTellsGetsOne) {
    Case cloud(0, {}, 1);
    cloud.header.las.reset();
    cloud.header.crs = "EPSG:32633";
    cloud.write(las_);
    EXPECT_EQ(open_source(las_)->info().crs, "EPSG:32633");
    cloud.header.crs = "PROJCS[\"x\"]";
    cloud.write(laz_);
    EXPECT_EQ(open_source(laz_)->info().crs, "PROJCS[\"x\"]");
    EXPECT_EQ(get<std::uint16_t>(test::file_bytes(laz_), 6), 16);
}

TEST_F(LasWriterFile, AValueThatAFieldDoesNotHoldIsAnErrorThatLeavesNothing) {
    Case cloud(0, {{"classification", kUint8}}, 2);
    cloud.rows = {std::byte{31}, std::byte{32}};
    try {
        cloud.write(las_);
        FAIL() << "was written";
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), testing::EndsWith("cloud.las: point 1: classification: expected "
                                                    "0 .. 31, as point format 0 has it, found 32"));
    }
    cloud.rows = {std::byte{31}, std::byte{3}};
    cloud.positions[1].y = 1e20;
    EXPECT_THROW(cloud.write(laz_), InputError);
    EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

}  // namespace
}  // namespace knap
