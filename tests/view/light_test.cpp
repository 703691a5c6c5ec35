// SPDX-License-Identifier: Apache-2.0
// Falloff and cones of the lights against closed forms.
#include "volcomp/view/light.h"

#include <cmath>

#include <gtest/gtest.h>

#include "volcomp/base/random.h"

using namespace volcomp;

namespace {

Light lamp(LightKind kind)
{
    Light light;
    light.kind = kind;
    light.position = Vec3d(1, 2, 3);
    light.direction = Vec3d(0.6, 0, 0.8);
    return light;
}

/// Returns the light's weight summed over a sphere of radius r around it: what it emits, in units
/// of its strength.
double emitted(const Light& light, double r)
{
    constexpr int kAcross = 400;
    double sum = 0;
    for (int i = 0; i < kAcross; ++i)
        for (int j = 0; j < 2 * kAcross; ++j) {
            const double z = (i + 0.5) * 2 / kAcross - 1, s = std::sqrt(1 - z * z),
                         a = (j + 0.5) * kPi / kAcross;
            sum += illuminate(light,
                              light.position + r * Vec3d(s * std::cos(a), s * std::sin(a), z), 1e-3)
                       .weight;
        }
    return sum * 4 * kPi * r * r / (kAcross * 2 * kAcross);
}

} // namespace

TEST(Light, EmitsTheSameThroughEverySphereAroundIt)
{
    Light spot = lamp(LightKind::spot);
    spot.angle = 0.7;
    spot.soft_angle = 0;
    for (const double r : {0.1, 1.0, 30.0}) {
        EXPECT_NEAR(emitted(lamp(LightKind::point), r), 4 * kPi, 1e-9) << r;
        EXPECT_NEAR(emitted(lamp(LightKind::patch), r), kPi, 1e-4)
            << r; // the integral of the cosine over the half space
        EXPECT_NEAR(emitted(spot, r), 2 * kPi * (1 - std::cos(0.7)), 3e-3)
            << r; // the cone's solid angle
    }
}

// The direction and the distance of what arrives lead back to the light. A sun is the same
// everywhere.
TEST(Light, TheWayLeadsToTheLight)
{
    const Vec3d p(4, -1, 0.5);
    for (const LightKind kind : {LightKind::point, LightKind::spot, LightKind::patch}) {
        const Light light = lamp(kind);
        const Illumination in = illuminate(light, p, 1e-3);
        EXPECT_NEAR(in.L.length(), 1, 1e-12);
        EXPECT_LT((p + in.distance * in.L - light.position).length(), 1e-12);
    }
    const Light sun = lamp(LightKind::directional);
    const Illumination in = illuminate(sun, p, 1e-3);
    EXPECT_EQ(in.L, -sun.direction);
    EXPECT_TRUE(std::isinf(in.distance));
    EXPECT_EQ(in.weight, 1);
}

TEST(Light, ASpotsBorderIsASmoothstep)
{
    Light spot = lamp(LightKind::spot);
    spot.direction = Vec3d(0, -1, 0);
    spot.angle = 0.5;
    spot.soft_angle = 0.2;
    const auto at = [&](double angle) {
        return illuminate(spot, spot.position + Vec3d(std::sin(angle), -std::cos(angle), 0), 1e-3)
            .weight;
    };
    EXPECT_DOUBLE_EQ(at(0.29), 1);
    EXPECT_NEAR(at(0.35), 27.0 / 32, 1e-12); // 3 x^2 - 2 x^3 at 3/4, 1/2, 1/4
    EXPECT_NEAR(at(0.4), 0.5, 1e-12);
    EXPECT_NEAR(at(0.45), 5.0 / 32, 1e-12);
    EXPECT_DOUBLE_EQ(at(0.51), 0);
    spot.soft_angle = 2; // wider than the cone: the border begins at its axis
    EXPECT_DOUBLE_EQ(at(0), 1);
    EXPECT_NEAR(at(0.25), 0.5, 1e-12);
    // On the axis the cosine may be rounded to more than 1.
    Random random(1);
    for (int i = 0; i < 1000; ++i) {
        spot.direction = Vec3d(random.normal(), random.normal(), random.normal()).unit();
        EXPECT_NEAR(illuminate(spot, spot.position + 2.0 * spot.direction, 1e-3).weight, 0.25, 1e-6)
            << spot.direction;
    }
}

TEST(Light, StaysFiniteWhereItStands)
{
    for (const LightKind kind : {LightKind::point, LightKind::spot, LightKind::patch}) {
        const Light light = lamp(kind);
        const Illumination here = illuminate(light, light.position, 0.01);
        EXPECT_NEAR(here.L.length(), 1, 1e-12);
        EXPECT_NEAR(here.weight, 1e4, 1e-6);
    }
}
