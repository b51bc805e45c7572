#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <thread>

#include "knap/error.hpp"
#include "report/drawing.hpp"
#include "report/shading.hpp"
#include "support/clouds.hpp"
#include "support/damage.hpp"

namespace knap {
namespace {

constexpr double kSpacing = 0.02;

Box box_of(const std::vector<RankedPoint>& points) {
    Box box;
    for (const RankedPoint& point : points) {
        box.extend(point.position);
    }
    return box;
}

std::vector<RankedPoint> ranked_sphere(std::size_t n) {
    std::vector<RankedPoint> points;
    for (const Vec3& p : test::sphere_cloud(n, 5)) {
        // More curved to the right, so that colours differ.
        points.push_back({1 + 0.5 * p.x, points.size(), p});
    }
    return points;
}

/// All points of a cloud, drawn as a job draws them.
struct Drawn {
    std::vector<Frame> frames;
    CloudDrawing drawing;

    explicit Drawn(const std::vector<RankedPoint>& points)
        : frames(measure(points).frames()),
          drawing(measure(points).histogram(), frames, CurvatureScale(1), kSpacing) {
        drawing.draw(points);
    }

    static CloudMeasure measure(const std::vector<RankedPoint>& points) {
        CloudMeasure measure(box_of(points), false, CurvatureScale(1));
        measure.add(points);
        return measure;
    }

    Relief surface(const std::filesystem::path& file, std::size_t view = 0) const {
        drawing.save(file);
        const SavedDrawing saved = SavedDrawing::load(file);
        return surface_of(saved.splats(view), saved.frames[view], CurvatureScale(1), kSpacing);
    }
};

class Drawing : public testing::Test {
  protected:
    std::filesystem::path file() const { return folder_ / "drawing"; }
    test::TemporaryFolder folder_;
};

TEST_F(Drawing, APictureOfASphereIsRoundWholeAndFacesOutward) {
    const Drawn drawn(ranked_sphere(30000));
    const Relief surface = drawn.surface(file());
    const Frame& frame = drawn.frames[0];
    const Place centre = frame.place_of({0, 0, 0});
    const double radius = 1 / frame.pixel;
    // Discs reach over the rim.
    const double rim = 2 * kSpacing / frame.pixel + 2;
    double facing_error = 0;
    int inside = 0;
    for (int y = 0; y < surface.height; ++y) {
        for (int x = 0; x < surface.width; ++x) {
            const double dx = (x + 0.5 - centre.x) / radius;
            const double dy = (y + 0.5 - centre.y) / radius;
            const double away = std::hypot(dx, dy);
            ASSERT_FALSE(away < 1 && surface.is_empty(x, y)) << x << ", " << y;
            ASSERT_FALSE(away > 1 + rim / radius && !surface.is_empty(x, y)) << x << ", " << y;
            if (away < 0.9) {
                const Facing facing = unpack_facing(surface.facing[surface.index(x, y)]);
                facing_error += std::hypot(static_cast<double>(facing.x) - dx,
                                           static_cast<double>(facing.y) - dy);
                ++inside;
            }
        }
    }
    // The discs face the eye, and each reaches over 2 spacings of the bent surface.
    EXPECT_LT(facing_error / inside, 0.1);
}

TEST_F(Drawing, WhatIsNearerHidesWhatIsFarther) {
    const Frame frame = Drawn(ranked_sphere(100)).frames[0];
    const Place near{10.5, 10.5, 3};
    const Place far{10.5, 10.5, 40};
    SplatBuffer buffer(frame);
    buffer.draw(far, 5, 100);
    buffer.draw(near, 5, 200);
    buffer.draw(far, 5, 300);
    EXPECT_EQ(buffer.at(10, 10).code, 200U);
    EXPECT_NEAR(buffer.at(10, 10).depth, 3, 0.01);
    EXPECT_TRUE(buffer.is_empty(16, 10)) << "beyond the radius";
    EXPECT_FALSE(buffer.is_empty(14, 10));
}

TEST_F(Drawing, DoesNotDependOnTheOrderOfPointsNorOnThreads) {
    std::vector<RankedPoint> points = ranked_sphere(20000);
    Drawn(points).drawing.save(file());
    const std::string expected = test::read_bytes(file());
    std::shuffle(points.begin(), points.end(), std::mt19937_64(1));
    const CloudMeasure measure = Drawn::measure(points);
    CloudDrawing drawing(measure.histogram(), measure.frames(), CurvatureScale(1), kSpacing);
    const std::span<const RankedPoint> all(points);
    std::thread other([&] { drawing.draw(all.subspan(0, 9000)); });
    drawing.draw(all.subspan(9000));
    other.join();
    drawing.save(file());
    EXPECT_EQ(test::read_bytes(file()) == expected, true);
}

TEST_F(Drawing, KeptPointsOnTheFarSideAreLeftOut) {
    const std::vector<RankedPoint> points = ranked_sphere(30000);
    const Drawn drawn(points);
    const Relief surface = drawn.surface(file());
    const Frame& frame = drawn.frames[0];
    for (const double side : {1.0, -1.0}) {
        const Vec3& toward = frame.view.toward;
        const RankedPoint point{1, 0, {side * toward.x, side * toward.y, side * toward.z}};
        for (const auto kind : {KeptDrawing::Kind::kCells, KeptDrawing::Kind::kDots}) {
            KeptDrawing kept(
                kind, frame, surface, [](double) { return 0.1; }, kSpacing, 1);
            kept.draw(std::vector{point});
            const auto pixels = kept.splats().pixels();
            EXPECT_EQ(std::all_of(pixels.begin(), pixels.end(),
                                  [](auto pixel) { return pixel == SplatBuffer::kEmpty; }),
                      side < 0);
        }
    }
}

TEST_F(Drawing, ACellReachesAsFarAsItsRange) {
    const Drawn drawn(ranked_sphere(30000));
    const Relief surface = drawn.surface(file());
    const Frame& frame = drawn.frames[0];
    KeptDrawing kept(
        KeptDrawing::Kind::kCells, frame, surface, [](double) { return 0.2; }, kSpacing, 1);
    kept.draw(std::vector{RankedPoint{1, 0, frame.view.toward}});
    const auto pixels = kept.splats().pixels();
    const auto covered = std::count_if(pixels.begin(), pixels.end(),
                                       [](auto pixel) { return pixel != SplatBuffer::kEmpty; });
    const double radius = (0.2 + 2 * kSpacing) / frame.pixel;
    EXPECT_NEAR(static_cast<double>(covered) / (std::numbers::pi * radius * radius), 1, 0.05);
}

TEST_F(Drawing, AFlippedBitInTheFileIsNoticed) {
    std::mt19937_64 random(4);
    const Drawn drawn(ranked_sphere(500));
    drawn.drawing.save(file());
    const std::string whole = test::read_bytes(file());
    for (int round = 0; round < 20; ++round) {
        std::string bytes = whole;
        const std::size_t at = round < 10 ? random() % 40 : random() % bytes.size();
        bytes[at] ^= static_cast<char>(1 << random() % 8);
        test::write_bytes(file(), bytes);
        EXPECT_THAT(
            [&] {
                const SavedDrawing saved = SavedDrawing::load(file());
                saved.splats(0);
                saved.splats(1);
            },
            testing::ThrowsMessage<StorageError>(testing::HasSubstr("drawing: scratch file is")))
            << "byte " << at;
    }
}

TEST(Views, LookAtTheBroadSideOfWhatStandsAndFromAboveAtWhatIsFlat) {
    const auto views = [](const Vec3& size, bool is_terrain = false) {
        return choose_views({{0, 0, 0}, size}, is_terrain);
    };
    const auto dot = [](const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
    for (const Vec3& size : {Vec3{2, 1.4, 0.9}, Vec3{0.8, 2, 0.8}, Vec3{1, 1, 3}, Vec3{3, 2, 0.1},
                             Vec3{1, 3, 0.1}, Vec3{3, 0.1, 2}, Vec3{0, 0, 0}, Vec3{0.1, 2, 3}}) {
        for (const View& view : views(size)) {
            EXPECT_NEAR(dot(view.right, view.up), 0, 1e-12);
            EXPECT_NEAR(dot(view.right, view.toward), 0, 1e-12);
            for (const Vec3& axis : {view.right, view.up, view.toward}) {
                EXPECT_NEAR(dot(axis, axis), 1, 1e-12);
            }
        }
    }
    EXPECT_GT(views({2, 1.4, 0.9})[0].toward.z, 0.8);
    EXPECT_LT(views({2, 1.4, 0.9})[1].toward.z, -0.8);
    EXPECT_GT(views({1, 1, 3})[0].up.z, 0.9);
    EXPECT_GT(views({3, 2, 0.1})[0].toward.z, 0.7);
    EXPECT_LT(views({3, 2, 0.1})[1].toward.z, -0.7);
    EXPECT_GT(views({3, 2, 0.1}, true)[1].toward.z, 0.7);
    EXPECT_GT(views({0.1, 2, 3})[0].toward.x, 0.8);
}

TEST(Views, AFarOutlierDoesNotMakeTheCloudADot) {
    std::vector<RankedPoint> points = ranked_sphere(10000);
    points.push_back({1, points.size(), {500, 0, 0}});
    for (const Frame& frame : Drawn::measure(points).frames()) {
        EXPECT_GT(2 / frame.pixel, 400);
    }
}

TEST(Colours, LightnessFallsAllTheWay) {
    double before = 1e9;
    for (int i = 0; i <= 100; ++i) {
        const Light light = map_colour(i / 100.0);
        const double luminance = 0.2126 * static_cast<double>(light.red) +
                                 0.7152 * static_cast<double>(light.green) +
                                 0.0722 * static_cast<double>(light.blue);
        EXPECT_LT(luminance, before);
        before = luminance;
    }
}

TEST(Shading, APngHasItsSizeInItsHeader) {
    Image image(3, 2, {255, 0, 0});
    const std::vector<std::byte> png = encode_png(image);
    ASSERT_GT(png.size(), 24U);
    EXPECT_EQ(png[1], std::byte{'P'});
    EXPECT_EQ(png[19], std::byte{3});
    EXPECT_EQ(png[23], std::byte{2});
}

}  // namespace
}  // namespace knap
