// SPDX-License-Identifier: Apache-2.0
// The light inside of voxels (MODEL section 3): the depth to a light jumps or has kinks there, and
// what a ray shows is still the limit of the sums (3) and (4).
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "volcomp/base/random.h"
#include "volcomp/render/march/integrator.h"
#include "volcomp/render/march/segment_light.h"
#include "tests/support/volumes.h"

using namespace volcomp;

namespace {

/// A cube of kSize^3 voxels whose lowest corner is the corner coordinates' origin, with the sums
/// (1) and (2) in double.
struct Block {
    static constexpr int kSize = 8;
    std::vector<float> densities = std::vector<float>(kSize * kSize * kSize);
    Filter filter = Filter::box;

    float& at(int x, int y, int z) { return densities[(x * kSize + y) * kSize + z]; }
    double voxel(int x, int y, int z) const
    {
        const auto in = [](int v) { return v >= 0 && v < kSize; };
        return in(x) && in(y) && in(z) ? densities[(x * kSize + y) * kSize + z] : 0;
    }
    Volume volume(const openvdb::Coord& origin = openvdb::Coord(0)) const
    {
        Volume volume = emptyVolume();
        for (int x = 0; x < kSize; ++x)
            for (int y = 0; y < kSize; ++y)
                for (int z = 0; z < kSize; ++z)
                    if (voxel(x, y, z) > 0)
                        volume.parts[0].density->tree().setValue(origin.offsetBy(x, y, z),
                                                                 float(voxel(x, y, z)));
        return volume;
    }
    /// The density at a place in corner coordinates.
    double density(const Vec3d& p) const
    {
        if (filter == Filter::box)
            return voxel(int(std::floor(p[0])), int(std::floor(p[1])), int(std::floor(p[2])));
        double f[3], sum = 0;
        int c[3];
        for (int a = 0; a < 3; ++a) {
            c[a] = int(std::floor(p[a] - 0.5));
            f[a] = p[a] - 0.5 - c[a];
        }
        for (int k = 0; k < 8; ++k) {
            const int x = k >> 2, y = k >> 1 & 1, z = k & 1;
            sum += (x ? f[0] : 1 - f[0]) * (y ? f[1] : 1 - f[1]) * (z ? f[2] : 1 - f[2])
                * voxel(c[0] + x, c[1] + y, c[2] + z);
        }
        return sum;
    }
    /// The places between 0 and `end` where the density along a ray changes its formula.
    std::vector<double> borders(const Vec3d& o, const Vec3d& d, double end) const
    {
        std::vector<double> t{0, end};
        const double shift = filter == Filter::box ? 0 : 0.5;
        for (int a = 0; a < 3; ++a)
            for (int face = -1; face <= kSize + 1 && d[a] != 0; ++face) {
                const double at = (face + shift - o[a]) / d[a];
                if (at > 0 && at < end) t.push_back(at);
            }
        std::sort(t.begin(), t.end());
        return t;
    }
    /// The depth between two places of a ray with no border between them: the density is cubic.
    double depth(const Vec3d& o, const Vec3d& d, double t0, double t1) const
    {
        const double middle = 0.5 * (t0 + t1), half = 0.5 * (t1 - t0), reach = half / std::sqrt(3);
        return half * (density(o + (middle - reach) * d) + density(o + (middle + reach) * d));
    }
    double depth(const Vec3d& p, const Light& light) const
    {
        const bool sun = light.kind == LightKind::directional;
        const Vec3d way = light.position + Vec3d(0.5) - p;
        const double end = sun ? 3 * kSize : way.length();
        const Vec3d L = sun ? -light.direction : way / end;
        const std::vector<double> t = borders(p, L, end);
        double sum = 0;
        for (std::size_t i = 1; i < t.size(); ++i) sum += depth(p, L, t[i - 1], t[i]);
        return sum;
    }
    /// (2) with I_t = `light` at each place, each voxel in `pieces`.
    double radiance(const Vec3d& o, const Vec3d& d, int pieces,
                    const std::function<double(const Vec3d&)>& light) const
    {
        const std::vector<double> t = borders(o, d, 6 * kSize);
        double T = 1, sum = 0;
        for (std::size_t i = 1; i < t.size() && T > 1e-6; ++i)
            for (int n = 0; n < pieces; ++n) {
                const double step = (t[i] - t[i - 1]) / pieces, at = t[i - 1] + n * step,
                             delta = depth(o, d, at, at + step);
                if (!(delta > 0)) continue;
                sum += T * -std::expm1(-delta) * light(o + (at + 0.5 * step) * d);
                T *= std::exp(-delta);
            }
        return sum;
    }
    double radiance(const Vec3d& o, const Vec3d& d, int pieces, const Light& light) const
    {
        return radiance(o, d, pieces,
                        [&](const Vec3d& p) { return 0.25 * std::exp(-depth(p, light)); });
    }
};

Block noiseBlock(double most, Filter filter)
{
    Block block;
    block.filter = filter;
    Random random(21);
    for (float& rho : block.densities)
        if (random.uniform() < 0.6) rho = float(random.uniform(0, most));
    return block;
}

Light sun(Vec3d direction)
{
    Light light;
    direction.normalize();
    light.direction = direction;
    return light;
}

/// What an Integrator shows of a volume, with alpha = 1; rays are in corner coordinates.
class Rays {
public:
    Rays(const Volume& volume, const Light& light, Filter filter, Shadows shadows) : m_tree(volume)
    {
        RenderParams params;
        params.filter = filter;
        params.shadows = shadows;
        params.cutoff = 0;
        params.extinction = Extinction::isotropic;
        Material material;
        material.alpha = 1;
        m_integrator = std::make_unique<Integrator>(m_tree, std::vector<Material>{material},
                                                    std::vector<Light>{light}, params);
        if (shadows != Shadows::sweep) return;
        m_sweep =
            std::make_unique<ShadowSweep>(m_tree, std::vector<Light>{light},
                                          std::vector<float>(m_tree.leafCount(), 1), 1, 12, false);
        m_integrator->useSweep(*m_sweep);
    }
    double radiance(const Vec3d& o, const Vec3d& d)
    {
        return m_integrator->trace(o - Vec3d(0.5), d, m_scratch).radiance[0];
    }
    double raysPerSegment() const
    {
        return double(m_scratch.counts.shadow_rays) / double(m_scratch.counts.shaded_voxels);
    }

private:
    VoxelTree m_tree;
    std::unique_ptr<Integrator> m_integrator;
    std::unique_ptr<ShadowSweep> m_sweep;
    Integrator::Scratch m_scratch;
};

/// How far some rays are from what is expected.
struct Difference {
    double sum = 0, expected = 0, squares = 0, greatest = 0;
    int count = 0;

    void add(double found, double value)
    {
        sum += found - value;
        expected += value;
        squares += (found - value) * (found - value);
        greatest = std::max(greatest, std::abs(found - value));
        ++count;
    }
    double mean() const { return expected / count; }
    double bias() const { return sum / expected; }
    double rmse() const { return std::sqrt(squares / count) / mean(); }
    double worst() const { return greatest / mean(); }
};

std::vector<Vec3d> specialDirections()
{
    std::vector<Vec3d> directions;
    for (int a = 0; a < 3; ++a)
        for (const double sign : {1.0, -1.0}) {
            Vec3d d(0.0);
            d[a] = sign;
            directions.push_back(d);
            for (const double off : {1e-6, 1e-3, 0.03}) { // near an axis
                Vec3d near = d;
                near[(a + 1) % 3] = off;
                near[(a + 2) % 3] = -1.3 * off;
                directions.push_back(near);
            }
            Vec3d face(0.0); // in a face
            face[a] = sign;
            face[(a + 1) % 3] = 0.4;
            directions.push_back(face);
        }
    for (const Vec3d& diagonal : {Vec3d(1, 1, 1), Vec3d(-1, 1, -1), Vec3d(1, -1, 0)})
        directions.push_back(diagonal);
    return directions;
}

} // namespace

// Exact shadows are the sums with their step going to 0, for every direction and density.
TEST(LightInsideVoxel, ExactIsTheLimitOfTheSumsForEveryDirection)
{
    std::vector<Vec3d> directions = specialDirections();
    Random random(3);
    for (int i = 0; i < 100; ++i)
        directions.push_back(Vec3d(random.normal(), random.normal(), random.normal()));
    for (const Filter filter : {Filter::box, Filter::trilinear})
        for (const double most : {0.1, 1.0, 5.0}) {
            const Block block = noiseBlock(most, filter);
            const Volume volume = block.volume();
            Difference all;
            for (const Vec3d& direction : directions) {
                const Light light = sun(direction);
                Rays rays(volume, light, filter, Shadows::exact);
                const int count = filter == Filter::box ? 12 : 3;
                for (int i = 0; i < count; ++i) {
                    const Vec3d d = i % 3 == 0
                        ? Vec3d(0, 0, -1)
                        : Vec3d(random.normal(), random.normal(), random.normal()).unit();
                    const Vec3d o =
                        Vec3d(random.uniform(1, 7), random.uniform(1, 7), random.uniform(1, 7))
                        - 20.0 * d;
                    all.add(rays.radiance(o, d), block.radiance(o, d, 48, light));
                }
            }
            EXPECT_LT(std::abs(all.bias()), 0.002) << int(filter) << " " << most;
            EXPECT_LT(all.rmse(), most > 1 ? 0.006 : 0.0015) << int(filter) << " " << most;
            EXPECT_LT(all.worst(), most > 1 ? 0.07 : 0.01) << int(filter) << " " << most;
        }
}

// The paper's sums themselves, with steps of 0.02 and 0.01 voxel, whose error is in proportion to
// the step: from both follows the sum of step 0.
TEST(LightInsideVoxel, TheSumsGoToExact)
{
    for (const Filter filter : {Filter::box, Filter::trilinear})
        for (const double most : {0.1, 1.0}) {
            const Block block = noiseBlock(most, filter);
            const VoxelTree tree(block.volume());
            Random random(4);
            Difference coarse, limit;
            for (const Vec3d& direction : {Vec3d(0, -1, 0), Vec3d(0.5, -1, -0.4)}) {
                const std::vector<Light> lights{sun(direction)};
                const auto radiance = [&](Integration integration, double step, const Vec3d& o) {
                    RenderParams params;
                    params.filter = filter;
                    params.cutoff = 0;
                    params.integration = integration;
                    params.step = step;
                    Integrator::Scratch scratch;
                    return Integrator(tree, {Material()}, lights, params)
                        .trace(o, Vec3d(0, 0, -1), scratch)
                        .radiance[0];
                };
                for (int i = 0; i < 12; ++i) {
                    const Vec3d o(random.uniform(0, 7), random.uniform(0, 7), 20.003);
                    const double exact = radiance(Integration::exact, 1, o),
                                 sum = radiance(Integration::riemann, 0.02, o);
                    coarse.add(sum, exact);
                    limit.add(2 * radiance(Integration::riemann, 0.01, o) - sum, exact);
                }
            }
            // The order of a point's random coordinates is the compiler's: 0.0022 with another.
            EXPECT_LT(std::abs(limit.bias()), 0.0025) << int(filter) << " " << most;
        }
}

// If the depth to the light were taken as linear between the ends of segments, of which the first
// lies in the block's face, the block would be 75 % too bright in all.
TEST(LightInsideVoxel, ABlockLitAlongItsFaceShowsTheClosedForm)
{
    Block block;
    std::fill(block.densities.begin(), block.densities.end(), 0.5f);
    const Light light = sun({0, -1, 0});
    for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
        Rays rays(block.volume(), light, Filter::box, shadows);
        for (int row = 0; row < Block::kSize; ++row)
            for (const double x : {0.0, 3.0, 3.4}) { // in faces, too
                const double depth = 0.5 * (row + 0.5),
                             expected = 0.25 * std::exp(-depth) * -std::expm1(-0.5 * Block::kSize);
                EXPECT_NEAR(rays.radiance(Vec3d(x, Block::kSize - row - 0.5, 20), Vec3d(0, 0, -1)),
                            expected,
                            shadows == Shadows::exact ? 1e-6 * expected : 0.01 * expected + 5e-4)
                    << row << " " << x << " " << int(shadows);
            }
    }
}

// With the trilinear filter the density grows from 0 to that of the block over the first cell, and
// so does the depth to the light. In the row of voxels `row` the column above has row + 1/2 voxels.
TEST(LightInsideVoxel, ATrilinearBlockLitAlongItsFaceShowsTheClosedForm)
{
    constexpr double kRho = 0.5;
    Block block;
    std::fill(block.densities.begin(), block.densities.end(), float(kRho));
    for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
        Rays rays(block.volume(), sun({0, -1, 0}), Filter::trilinear, shadows);
        for (int row = 0; row < Block::kSize; ++row) {
            const double column = kRho * (row + 0.5);
            double first = 0, last = 0; // of the cells at the ends, by Simpson's rule
            constexpr int kSteps = 1000;
            for (int n = 0; n <= kSteps; ++n) {
                const double u = double(n) / kSteps,
                             weight = (n % kSteps == 0 ? 1
                                           : n % 2     ? 4
                                                       : 2)
                    / (3.0 * kSteps);
                first += weight * kRho * u * std::exp(-0.5 * kRho * u * u - column * u);
                last += weight * kRho * u * std::exp(-0.5 * kRho * (1 - u * u) - column * u);
            }
            const double inside = kRho * (Block::kSize - 1),
                         shown = first
                + std::exp(-0.5 * kRho)
                    * (std::exp(-column) * -std::expm1(-inside) + std::exp(-inside) * last);
            const double found =
                rays.radiance(Vec3d(3.5, Block::kSize - row - 0.5, 20), Vec3d(0, 0, -1));
            // Behind other voxels the sweep is rough.
            const double tolerance = shadows == Shadows::exact ? 1e-4 : 8e-4;
            EXPECT_NEAR(found, 0.25 * shown, 0.003 * found + tolerance)
                << row << " " << int(shadows);
        }
    }
}

// A ball of fog that is lit along an axis, or nearly, has no speckle: rays through neighbouring
// places of the same column of voxels see nearly the same.
TEST(LightInsideVoxel, ABallHasNoSpeckle)
{
    for (const Filter filter : {Filter::box, Filter::trilinear}) {
        Block block;
        block.filter = filter;
        for (int x = 0; x < Block::kSize; ++x)
            for (int y = 0; y < Block::kSize; ++y)
                for (int z = 0; z < Block::kSize; ++z)
                    if ((Vec3d(x, y, z) + Vec3d(0.5 - Block::kSize / 2)).length()
                        < Block::kSize / 2)
                        block.at(x, y, z) = 0.7f;
        for (const Vec3d& direction : {Vec3d(0, -1, 0), Vec3d(0.001, -1, 0.0013)}) {
            const Light light = sun(direction);
            for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
                Rays rays(block.volume(), light, filter, shadows);
                Difference difference;
                for (int x = 0; x < 12; ++x)
                    for (int y = 0; y < 12; ++y) {
                        const Vec3d d = Vec3d(0.02 * (x - 6), 0.02 * (y - 6), -1).unit(),
                                    o = Vec3d(4 + 0.3 * (x - 6), 4 + 0.3 * (y - 6), 4) - 20.0 * d;
                        difference.add(rays.radiance(o, d), block.radiance(o, d, 48, light));
                    }
                const double limit = shadows == Shadows::exact ? 1 : 5;
                EXPECT_LT(std::abs(difference.bias()), 0.002 * limit)
                    << int(filter) << int(shadows) << direction;
                EXPECT_LT(difference.rmse(), 0.003 * limit)
                    << int(filter) << int(shadows) << direction;
            }
        }
    }
}

// A homogeneous slab that is lit and seen slantwise, near the origin and far from it:
// S (1/v) / (1/v + 1/l) (1 - e^-(tau (1/v + 1/l))), v and l the cosines of view and light.
TEST(LightInsideVoxel, SlabsShowTheClosedForm)
{
    constexpr int kThick = 6, kWide = 40;
    for (const double at : {0.0, 1e6})
        for (const double rho : {1e-3, 0.1, 1.0, 5.0, 1e3}) {
            const openvdb::Coord origin{int(at), int(-at), int(at)};
            Volume volume = emptyVolume();
            volume.parts[0].density->denseFill(
                openvdb::CoordBBox(origin, origin.offsetBy(kWide - 1, kThick - 1, kWide - 1)),
                float(rho), true);
            Random random(9);
            for (int i = 0; i < 30; ++i) {
                const auto slant = [&] {
                    return Vec3d(random.uniform(-1, 1), random.uniform(-2, -0.7),
                                 random.uniform(-1, 1))
                        .unit();
                };
                const Vec3d L = i % 3 == 0 ? Vec3d(1e-6, -1, 1e-3).unit() : slant(), d = slant();
                Rays rays(volume, sun(L), Filter::box, Shadows::exact);
                const Vec3d o = origin.asVec3d()
                    + Vec3d(0.5 * kWide + random.uniform(), kThick, 0.5 * kWide + random.uniform())
                    - 5.0 * d;
                const double by_view = -1 / d[1], by_light = -1 / L[1], both = by_view + by_light;
                const double expected = 0.25 * by_view / both * -std::expm1(-rho * kThick * both);
                ASSERT_NEAR(rays.radiance(o, d), expected, 1e-6 * expected)
                    << at << " " << rho << L << d;
            }
        }
}

// Lights at a place, outside of the volume and in it, whose way differs along a segment.
TEST(LightInsideVoxel, LightsAtAPlaceAgreeWithBruteForce)
{
    for (const Filter filter : {Filter::box, Filter::trilinear}) {
        const Block block = noiseBlock(1, filter);
        const Volume volume = block.volume();
        Random random(6);
        Difference all;
        for (const Vec3d& position : {Vec3d(3.4, 30, 3.6), Vec3d(3.2, 3.3, 3.1), Vec3d(-2, 9, 4)})
            for (const LightKind kind : {LightKind::point, LightKind::spot}) {
                Light light;
                light.kind = kind;
                light.position = position;
                light.direction = (Vec3d(4.0) - position).unit();
                light.angle = 3;
                Rays rays(volume, light, filter, Shadows::exact);
                for (int i = 0; i < 60; ++i) {
                    const Vec3d d = Vec3d(random.normal(), random.normal(), random.normal()).unit(),
                                target(random.uniform(1, 7), random.uniform(1, 7),
                                       random.uniform(1, 7)),
                                o = target - 20.0 * d, middle = position + Vec3d(0.5);
                    // The falloff is that of a segment's middle, so it is taken from the same ray
                    // with nothing in the light's way.
                    const double near = d.cross(middle - o).length();
                    if (near < 2) continue;
                    const double expected = block.radiance(o, d, 48, [&](const Vec3d& p) {
                        return 0.25 * illuminate(light, p - Vec3d(0.5), 0.5).weight
                            * std::exp(-block.depth(p, light));
                    });
                    all.add(rays.radiance(o, d) / expected, 1);
                }
            }
        EXPECT_LT(std::abs(all.bias()), 0.005) << int(filter);
        EXPECT_LT(all.rmse(), 0.015) << int(filter);
    }
}

// The share of a segment's depth before a place, for densities of every shape.
TEST(LightInsideVoxel, PlacesFollowTheDensityAlongASegment)
{
    RaySegment segment{};
    for (const auto& c : {std::array<double, 4>{1, 0, 0, 0},
                          {0, 2, 0, 0},
                          {2, -2, 0, 0},
                          {0, 0, 0, 4},
                          {0, 6, -6, 0},
                          {3, -12, 15, 0}}) {
        std::copy(c.begin(), c.end(), segment.profile);
        for (const double x : {0.0, 1e-9, 0.1, 0.5, 0.9, 1.0}) {
            const double u = placeAtShare(segment, x);
            EXPECT_NEAR(u * (c[0] + u * (c[1] / 2 + u * (c[2] / 3 + u * c[3] / 4))), x, 1e-7) << x;
        }
    }
}
