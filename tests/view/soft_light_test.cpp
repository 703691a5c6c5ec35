// SPDX-License-Identifier: Apache-2.0
// Soft lights as hard ones: what they cover seen from places, against closed forms.
#include "volcomp/view/soft_light.h"

#include <cmath>

#include <gtest/gtest.h>

using namespace volcomp;

namespace {

Light soft(LightKind kind)
{
    Light light;
    light.kind = kind;
    light.position = Vec3d(1, 2, 3);
    light.direction = Vec3d(0.6, 0, 0.8);
    light.disc = 0.4;
    light.radius = 0.5;
    return light;
}

/// The share of a unit disc beyond a line at distance q (-1 to 1) from its middle.
double beyond(double q) { return (std::acos(q) - q * std::sqrt(1 - q * q)) / kPi; }

/// The worst difference between the share of `places` (across the unit disc) beyond a line and the
/// disc's own, over lines in all directions.
double worstShare(const std::vector<std::pair<double, double>>& places)
{
    double worst = 0;
    for (int a = 0; a < 72; ++a)
        for (double q = -0.95; q < 1; q += 0.05) {
            double count = 0;
            for (const auto& [x, y] : places)
                count += x * std::cos(a * kPi / 36) + y * std::sin(a * kPi / 36) > q;
            worst = std::max(worst, std::abs(count / double(places.size()) - beyond(q)));
        }
    return worst;
}

// The shares of all parts together are the soft light: across its disc, a line has as much of them
// on one side as of an even disc. The parts' middles alone are up to 0.09 off here.
TEST(SoftLight, TheSharesFillTheDisc)
{
    constexpr int kCount = 8, kSteps = 40;
    for (const LightKind kind : {LightKind::directional, LightKind::patch}) {
        Light light;
        light.kind = kind;
        light.direction = Vec3d(0.2, -1, 0.3).unit();
        light.disc = 0.02;
        light.radius = 0.5;
        const Vec3d side = light.direction.cross(Vec3d(0, 0, 1)).unit();
        for (const double line : {-0.7, -0.3, 0.0, 0.4, 0.8}) {
            int beyond = 0;
            for (const Light& hard : hardLights(light, kCount))
                for (int i = 0; i < kSteps * kSteps; ++i) {
                    const Light at =
                        movedInShare(shareOf(hard, light, kCount), (i / kSteps + 0.5) / kSteps,
                                     (i % kSteps + 0.5) / kSteps);
                    beyond += kind == LightKind::directional
                        ? at.direction.dot(side) > line * std::sin(0.01)
                        : (at.position - light.position).dot(side) > line * light.radius;
                }
            const double share = double(beyond) / (kCount * kSteps * kSteps),
                         expected = (std::acos(line) - line * std::sqrt(1 - line * line)) / kPi;
            EXPECT_NEAR(share, expected, 0.04) << int(kind) << ' ' << line;
        }
    }
    Light hard;
    EXPECT_EQ(movedInShare(hard, 0.3, 0.7).direction, hard.direction);
}

} // namespace

TEST(SoftLight, AHardLightAndOneLightAreTheMiddle)
{
    Light hard = soft(LightKind::directional);
    hard.disc = 0;
    for (const Light& light : hardLights(hard, 5)) EXPECT_EQ(light.direction, hard.direction);
    for (const LightKind kind :
         {LightKind::directional, LightKind::point, LightKind::spot, LightKind::patch}) {
        const std::vector<Light> one = hardLights(soft(kind), 1);
        ASSERT_EQ(one.size(), 1u);
        EXPECT_FALSE(one[0].isSoft());
        EXPECT_EQ(one[0].position, soft(kind).position);
        EXPECT_EQ(one[0].direction, soft(kind).direction);
    }
}

TEST(SoftLight, TheMiddleOfAllIsTheLightsOwn)
{
    for (const int count : {2, 3, 4, 8, 15, 16})
        for (const LightKind kind :
             {LightKind::directional, LightKind::point, LightKind::spot, LightKind::patch}) {
            const Light light = soft(kind);
            Vec3d place(0.0), direction(0.0);
            for (const Light& one : hardLights(light, count)) {
                one.validate();
                EXPECT_FALSE(one.isSoft());
                EXPECT_EQ(one.strength, light.strength);
                if (kind == LightKind::directional) {
                    EXPECT_GT(one.direction.dot(light.direction), std::cos(0.2) - 1e-9);
                } else {
                    EXPECT_LE((one.position - light.position).length(), light.radius * (1 + 1e-9));
                }
                if (kind == LightKind::spot || kind == LightKind::patch) {
                    EXPECT_NEAR((one.position - light.position).dot(light.direction), 0, 1e-12);
                }
                place += one.position / count;
                direction += one.direction / count;
            }
            EXPECT_LT((place - light.position).length(), 1e-12) << count;
            EXPECT_LT((direction.unit() - light.direction).length(), 1e-12) << count;
        }
}

// The discs' places, and the ball's as they are seen from many sides.
TEST(SoftLight, LiesEvenlyOverItsDisc)
{
    for (const auto& [count, disc, ball] :
         {std::tuple{4, 0.29, 0.48}, {8, 0.19, 0.32}, {16, 0.13, 0.20}, {64, 0.06, 0.10}}) {
        std::vector<std::pair<double, double>> sun, patch;
        const Vec3d axis(0.6, 0, 0.8), b(0, 1, 0), c = axis.cross(b);
        const double scale = 1 / std::sqrt(2 * (1 - std::cos(0.2))); // to an equal-area disc
        for (const Light& one : hardLights(soft(LightKind::directional), count)) {
            const double along = one.direction.dot(axis), aside = std::sqrt(2 * (1 - along)),
                         sine = std::sqrt(std::max(1e-30, 1 - along * along));
            sun.emplace_back(one.direction.dot(b) / sine * aside * scale,
                             one.direction.dot(c) / sine * aside * scale);
        }
        for (const Light& one : hardLights(soft(LightKind::patch), count)) {
            const Vec3d at = (one.position - Vec3d(1, 2, 3)) / 0.5;
            patch.emplace_back(at.dot(b), at.dot(c));
        }
        EXPECT_LT(worstShare(sun), disc) << count;
        EXPECT_LT(worstShare(patch), disc) << count;
        double worst = 0;
        for (int i = 0; i < 40; ++i) {
            const double z = (i + 0.5) / 20 - 1, s = std::sqrt(1 - z * z);
            const Vec3d from(s * std::cos(2.4 * i), s * std::sin(2.4 * i), z),
                e = from.cross(std::abs(z) < 0.6 ? Vec3d(0, 0, 1) : Vec3d(1, 0, 0)).unit(),
                f = from.cross(e);
            std::vector<std::pair<double, double>> seen;
            for (const Light& one : hardLights(soft(LightKind::point), count)) {
                const Vec3d at = (one.position - Vec3d(1, 2, 3)) / 0.5;
                seen.emplace_back(at.dot(e), at.dot(f));
            }
            worst = std::max(worst, worstShare(seen));
        }
        EXPECT_LT(worst, ball) << count;
    }
}

// A matt surface in front of an evenly bright ball receives what the ball's middle would send: the
// cosine over the square of the distance is a harmonic function.
TEST(SoftLight, ABallLightsAMattSurfaceAsItsMiddleDoes)
{
    const Light ball = soft(LightKind::point);
    for (const Vec3d& way : {Vec3d(0, 0, 1.5), Vec3d(1.2, 0.4, -0.9), Vec3d(-2, 1, 0)}) {
        const Vec3d p = ball.position + way, normal = (-way + Vec3d(0.2, 0.3, 0)).unit();
        const auto received = [&](const Light& light) {
            const Illumination in = illuminate(light, p, 1e-6);
            return in.weight * std::max(0.0, in.L.dot(normal));
        };
        Light middle = ball;
        middle.radius = 0;
        double mean = 0;
        for (const Light& one : hardLights(ball, 64)) mean += received(one) / 64;
        EXPECT_NEAR(mean / received(middle), 1, 0.03) << way;
    }
}
