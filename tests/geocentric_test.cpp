#include "tileset/geocentric.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "knap/error.hpp"
#include "tileset/frame.hpp"

namespace knap {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

void expect_near(const Vec3& found, const Vec3& expected, double tolerance) {
    EXPECT_LE(std::sqrt(squared_distance(found, expected)), tolerance)
        << found.x << " " << found.y << " " << found.z;
}

constexpr double kEquator = 6378137;

/// On the central meridian of UTM 31, 3 degrees east, on the equator.
Vec3 off_africa(double height) {
    const double angle = 3 * std::numbers::pi / 180;
    return {(kEquator + height) * std::cos(angle), (kEquator + height) * std::sin(angle), 0};
}

TEST(Geocentric, IsThatOfTheEpsgGuidance) {
    // Guidance note 7-2: 53 48 33.820 N, 2 07 46.380 E, 73.0 m.
    const Vec3 place{2 + 7 / 60.0 + 46.380 / 3600, 53 + 48 / 60.0 + 33.820 / 3600, 73};
    for (const char* crs : {"EPSG:4326", "EPSG:4979"}) {
        expect_near(Geocentric(crs, place).at(place), {3771793.968, 140253.342, 5124304.349}, 2e-3);
    }
}

TEST(Geocentric, TakesHeightsInTheUnitOfThePlaneUnlessTheyHaveTheirOwn) {
    const Vec3 metres{500000, 0, 1000};
    expect_near(Geocentric("EPSG:32631", metres).at(metres), off_africa(1000), 1e-6);
    const Vec3 feet{500000 / 0.3048, 0, 1000};
    const char* const utm_in_feet = "+proj=utm +zone=31 +datum=WGS84 +units=ft +type=crs";
    expect_near(Geocentric(utm_in_feet, feet).at(feet), off_africa(304.8), 1e-6);
    // Heights in US survey feet, in a system of their own; without a grid, above the ellipsoid.
    expect_near(Geocentric("EPSG:32631+6360", metres).at(metres), off_africa(1000 * 1200 / 3937.0),
                1e-6);
    expect_near(Geocentric("EPSG:32631+5703", metres).at(metres), off_africa(1000), 1e-6);
}

TEST(Geocentric, SaysWhyAPlaceIsNotOnTheEarth) {
    EXPECT_THAT([] { Geocentric("nonsense", {}); },
                ThrowsMessage<InputError>(HasSubstr("PROJ does not know")));
    EXPECT_THROW(Geocentric("LOCAL_CS[\"site\"]", {}), InputError);
    EXPECT_THAT(
        [] {
            Geocentric("EPSG:4326", {515384, 4918360, 2330});
        },
        ThrowsMessage<InputError>(HasSubstr("no place on the Earth")));
    // A geocentric system, 1400 km below the ground: so says lone-star.copc.laz.
    EXPECT_THAT(
        [] {
            Geocentric("EPSG:4978", {515384, 4918360, 2330});
        },
        ThrowsMessage<InputError>(HasSubstr("no place on the Earth")));
}

TEST(Frame, FitsASmallBoxAndKnowsByHowMuchItIsOff) {
    const Vec3 origin{300000, 5800000, 50};
    const Geocentric earth("EPSG:32631", origin);
    double before = 0;
    for (const double side : {1.0, 100.0, 1000.0, 10000.0}) {
        const Box box{origin, origin + Vec3{side, side, side / 10}};
        const Frame frame = fit_frame(box, origin, earth);
        std::mt19937_64 random(1);
        double farthest = 0;
        for (int i = 0; i < 200; ++i) {
            const auto at = [&] { return static_cast<double>(random() % 1000001) / 1e6; };
            const Vec3 p{at() * side, at() * side, at() * side / 10};
            const Vec3 seen = seen_from(frame, earth.at(origin + p));
            const Vec3 off =
                seen - Vec3{p.x * frame.scale.x, p.y * frame.scale.y, p.z * frame.scale.z};
            farthest = std::max(farthest, std::sqrt(squared_distance(off, {})));
        }
        EXPECT_LE(farthest, frame.error + 1e-8);
        // The Earth falls off by d^2 / 2R; that of the middle is shared out.
        EXPECT_LE(frame.error, side * side / kEquator + 1e-8) << side;
        EXPECT_GT(frame.error, before);
        before = frame.error;
        EXPECT_NEAR(frame.scale.x, 1, 1e-3);
        EXPECT_NEAR(frame.scale.z, 1, 1e-6);
    }
}

TEST(Frame, ATransformWithinAnotherLeadsToTheSamePlace) {
    const Vec3 origin{300000, 5800000, 50};
    const Geocentric earth("EPSG:32631", origin);
    const Matrix outer =
        matrix_of(fit_frame({origin, origin + Vec3{900, 800, 90}}, origin, earth), {1, 1, 1});
    const Vec3 inside = origin + Vec3{200, 100, 10};
    const Matrix inner =
        matrix_of(fit_frame({inside, inside + Vec3{90, 80, 9}}, inside, earth), {1, 0.999, 1.001});
    const Matrix between = relative_to(outer, inner);
    for (std::size_t column = 0; column < 4; ++column) {
        for (std::size_t row = 0; row < 4; ++row) {
            double sum = 0;
            for (std::size_t k = 0; k < 4; ++k) {
                sum += outer[4 * k + row] * between[4 * column + k];
            }
            EXPECT_NEAR(sum, inner[4 * column + row],
                        1e-8 + 1e-14 * std::abs(inner[4 * column + row]));
        }
    }
}

}  // namespace
}  // namespace knap
