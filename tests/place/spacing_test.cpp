// SPDX-License-Identifier: Apache-2.0
// What the keys of a layer promise of where boxes stand, against brute force and closed forms.
#include "volcomp/place/spacing.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/temporary_folder.h"
#include "volcomp/place/placed_scene.h"
#include "volcomp/place/scatter.h"

namespace volcomp {
namespace {

SurfaceSpec groundSpec(const std::string& name, double size, double height = 0)
{
    SurfaceSpec s;
    s.name = name;
    s.terrain.width = s.terrain.depth = size;
    s.move = Vec3d(0, height, 0);
    return s;
}

Layer layerOf(const std::string& name, double density)
{
    Layer l;
    l.name = name;
    l.box = "oak";
    l.surface = "ground";
    l.density = density;
    return l;
}

PlacedScene placed(const std::vector<Layer>& layers, double size = 1)
{
    return place({groundSpec("ground", size)}, layers, {{"oak", 1}});
}

TEST(Spacing, NoTwoRootsAreNearer)
{
    Layer trees = layerOf("trees", 4000), bushes = layerOf("bushes", 9000);
    trees.spacing = 0.05;
    trees.scale = {0.5, 2};
    bushes.spacing = 0.02;
    const PlacedScene scene = placed({trees, bushes});
    const auto& p = scene.boxes.placements;
    ASSERT_GT(scene.layers[0].boxes, 150u);
    ASSERT_GT(scene.layers[1].boxes, 200u);
    const double spacing[] = {trees.spacing, bushes.spacing};
    double nearest = 1e9;
    for (std::size_t i = 0; i < p.size(); ++i)
        for (std::size_t k = 0; k < i; ++k) {
            const double room = 0.5
                * (spacing[p[i].layer] * double(p[i].scale)
                   + spacing[p[k].layer] * double(p[k].scale));
            nearest = std::min(nearest, (p[i].position - p[k].position).length() / room);
        }
    EXPECT_GE(nearest, 1);
    EXPECT_LT(nearest, 1.01); // it is no larger than it must be
}

TEST(Spacing, LowFrequenciesAreGone)
{
    Layer l = layerOf("trees", 10 / (0.02 * 0.02));
    l.spacing = 0.02;
    const auto scene = placed({l});
    const auto& p = scene.boxes.placements;
    // The periodogram at the frequencies (a, b) of the unit square, mean over rings.
    constexpr int kRings = 70;
    std::vector<double> power(kRings, 0), count(kRings, 0);
    for (int a = 0; a < kRings; ++a)
        for (int b = -kRings + 1; b < kRings; ++b) {
            const double f = std::hypot(a, b);
            const int ring = int(std::lround(f));
            if (ring < 1 || ring >= kRings || (a == 0 && b <= 0)) continue;
            std::complex<double> sum = 0;
            for (const Placement& q : p)
                sum += std::polar(1.0, 2 * kPi * (a * q.position[0] + b * q.position[2]));
            power[std::size_t(ring)] += std::norm(sum) / double(p.size());
            ++count[std::size_t(ring)];
        }
    int peak = 1;
    for (int r = 1; r < kRings; ++r) {
        power[std::size_t(r)] /= count[std::size_t(r)];
        if (power[std::size_t(r)] > power[std::size_t(peak)]) peak = r;
    }
    EXPECT_GT(power[std::size_t(peak)], 1.5);
    double below = 0, cells = 0;
    for (int r = 1; r < peak / 2; ++r) {
        below += power[std::size_t(r)] * count[std::size_t(r)];
        cells += count[std::size_t(r)];
        EXPECT_LT(power[std::size_t(r)], r < 4 ? 0.3 : 0.2) << r; // few frequencies: noise
    }
    EXPECT_LT(below / cells, 0.1) << "peak at " << peak;
}

TEST(Spacing, IsTheSameForAnyNumberOfThreads)
{
    Layer l = layerOf("trees", 20000), other = layerOf("other", 5000);
    l.spacing = 0.01;
    other.avoid = {{"trees", "", 0.004}};
    const auto positions = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        std::vector<double> all;
        for (const Placement& p : placed({l, other}).boxes.placements)
            all.insert(all.end(), {p.position[0], p.position[2]});
        return all;
    };
    EXPECT_EQ(positions(1), positions(4));
}

TEST(Avoid, RootsKeepAwayFromRootsAndSurfaces)
{
    Layer trees = layerOf("trees", 40), flowers = layerOf("flowers", 3000);
    flowers.avoid = {{"trees", "", 0.08}, {"", "pond", 0.2}};
    SurfaceSpec pond = groundSpec("pond", 0.3);
    const PlacedScene scene =
        place({groundSpec("ground", 1), pond}, {trees, flowers}, {{"oak", 1}});
    const auto& p = scene.boxes.placements;
    const auto distance = [&](const Placement& q) {
        double d = std::hypot(std::max(0.0, std::abs(q.position[0]) - 0.15),
                              std::max(0.0, std::abs(q.position[2]) - 0.15))
            / 0.2;
        for (const Placement& tree : p)
            if (tree.layer == 0) d = std::min(d, (tree.position - q.position).length() / 0.08);
        return d;
    };
    double nearest = 1e9;
    for (const Placement& q : p)
        if (q.layer == 1) nearest = std::min(nearest, distance(q));
    EXPECT_GE(nearest, 1 - 1e-9);
    // All others are where they stand without the key.
    Layer alone = flowers;
    alone.avoid.clear();
    std::size_t expected = 0;
    for (const Placement& q : placed({trees, alone}).boxes.placements)
        expected += q.layer == 1 && distance(q) >= 1;
    EXPECT_EQ(scene.layers[1].boxes, expected);
}

/// A half ball, whose slopes are those of its normals.
class MaskTest : public testing::Test {
protected:
    MaskTest()
    {
        std::string obj;
        const int across = 96, up = 48;
        for (int j = 0; j <= up; ++j)
            for (int i = 0; i < across; ++i) {
                const double a = 2 * kPi * i / across, b = 0.5 * kPi * j / up;
                obj += fmt::format("v {} {} {}\n", std::cos(b) * std::cos(a), std::sin(b),
                                   std::cos(b) * std::sin(a));
            }
        for (int j = 0; j < up; ++j)
            for (int i = 0; i < across; ++i) {
                const int n = (i + 1) % across, a = j * across, b = a + across;
                obj += fmt::format("f {} {} {} {}\n", a + i + 1, b + i + 1, b + n + 1, a + n + 1);
            }
        m_ball.name = "ground";
        m_ball.mesh = m_folder.write("ball.obj", obj);
    }
    std::vector<Placement> on(const Layer& layer) const
    {
        return place({m_ball}, {layer}, {{"oak", 1}}).boxes.placements;
    }

private:
    TemporaryFolder m_folder;
    SurfaceSpec m_ball;
};

TEST_F(MaskTest, SlopeAndHeightLimitWhereBoxesStand)
{
    Layer l = layerOf("grass", 4000);
    l.slope = {30 * kDegree, 60 * kDegree, 0};
    const auto sloped = on(l);
    for (const Placement& p : sloped) {
        const double slope = std::acos(p.y_axis[1]) / kDegree;
        EXPECT_TRUE(slope > 29.9 && slope < 60.1) << slope;
    }
    // The zone of a ball between two heights has the area 2 pi (h1 - h0).
    const double zone = 2 * kPi * (std::cos(30 * kDegree) - std::cos(60 * kDegree));
    EXPECT_NEAR(double(sloped.size()), 4000 * zone, 150);
    l.slope = {};
    l.height = {0.25, 0.5, 0};
    const auto high = on(l);
    for (const Placement& p : high)
        EXPECT_TRUE(p.position[1] >= 0.25 && p.position[1] <= 0.5) << p.position[1];
    EXPECT_NEAR(double(high.size()), 4000 * 2 * kPi * 0.25, 150);
    // A fade of 0.2 on both sides has half its boxes in the mean, half on each.
    l.height.fade = 0.2;
    EXPECT_NEAR(double(on(l).size()), 4000 * 2 * kPi * 0.45, 200);
}

TEST(Sizes, HaveTheirDistribution)
{
    const auto scales = [](const Layer& l) {
        std::vector<double> all;
        for (const Placement& p : placed({l}).boxes.placements) all.push_back(double(p.scale));
        std::sort(all.begin(), all.end());
        return all;
    };
    Layer l = layerOf("stones", 40000);
    l.scale = {0.5, 8};
    l.sizes = SizeDistribution::power;
    for (const double power : {-2.0, -1.0, 1.5}) {
        l.size_power = power;
        const auto s = scales(l);
        EXPECT_GE(s.front(), 0.5f);
        EXPECT_LE(s.back(), 8.0f);
        const double x = 2, e = power + 1; // the part below 2
        const double below = power == -1
            ? std::log(x / 0.5) / std::log(16.0)
            : (std::pow(x, e) - std::pow(0.5, e)) / (std::pow(8.0, e) - std::pow(0.5, e));
        const auto found = std::lower_bound(s.begin(), s.end(), x) - s.begin();
        EXPECT_NEAR(double(found) / double(s.size()), below, 0.01) << power;
    }
    l.sizes = SizeDistribution::normal;
    l.scale = {1, 3};
    const auto s = scales(l);
    double mean = 0, square = 0;
    for (const double x : s) mean += x / double(s.size());
    for (const double x : s) square += (x - mean) * (x - mean) / double(s.size());
    EXPECT_NEAR(mean, 2, 0.01);
    // A normal distribution that is cut at two standard deviations has 0.8796 of its deviation.
    EXPECT_NEAR(std::sqrt(square), 0.5 * 0.8796, 0.01);
}

TEST(Angles, MapsMultiplyThem)
{
    MapFactor half;
    half.constant = Vec3d(0.5);
    Layer l = layerOf("grass", 500);
    l.tilt = {40 * kDegree, 40 * kDegree};
    l.tilt_map = {half};
    for (const Placement& p : placed({l}).boxes.placements)
        EXPECT_NEAR(std::acos(p.y_axis[1]), 20 * kDegree, 1e-3);
    l.tilt = {0, 0};
    l.combed = true;
    l.comb = Vec3d(1, 0, 0);
    l.comb_angle = 60 * kDegree;
    l.comb_angle_map = {half};
    for (const Placement& p : placed({l}).boxes.placements) {
        EXPECT_NEAR(std::acos(p.y_axis[1]), 30 * kDegree, 1e-3);
        EXPECT_GT(p.y_axis[0], 0);
    }
}

} // namespace
} // namespace volcomp
