// SPDX-License-Identifier: Apache-2.0
// Where methods fail (MODEL section 10), for rays: each test shows the plain method failing and
// ours holding.
#include <atomic>
#include <cmath>

#include <gtest/gtest.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"
#include "volcomp/render/march/integrator.h"
#include "volcomp/render/march/dual_march.h"
#include "volcomp/render/march/integration.h"
#include "volcomp/render/march/march.h"
#include "volcomp/base/random.h"
#include "tests/support/each_target.h"
#include "tests/support/volumes.h"

using namespace volcomp;

namespace {

/// A cube of one density, corner coordinates.
struct Cube {
    Vec3d low;
    double size;
    float density;

    /// Length of the ray inside, up to `end`; a ray in a face belongs to the cube above.
    double length(const Vec3d& o, const Vec3d& d, double end = 1e30) const
    {
        double t0 = 0, t1 = end;
        for (int a = 0; a < 3; ++a) {
            if (d[a] == 0) {
                if (!(o[a] >= low[a] && o[a] < low[a] + size)) return 0;
                continue;
            }
            const double p = (low[a] - o[a]) / d[a], q = (low[a] + size - o[a]) / d[a];
            t0 = std::max(t0, std::min(p, q));
            t1 = std::min(t1, std::max(p, q));
        }
        return std::max(0.0, t1 - t0);
    }
};

/// Voxels around the corner of eight blocks and a few far away, so that rays cross leaves and
/// blocks, full and empty.
struct Scattered {
    Volume volume = emptyVolume();
    std::vector<Cube> cubes;
    openvdb::Coord origin;

    explicit Scattered(openvdb::Coord at) : origin(at)
    {
        Random random(17);
        const auto add = [&](const openvdb::Coord& ijk) {
            cubes.push_back({ijk.asVec3d(), 1, float(random.uniform(0.1, 1))});
            volume.parts[0].density->tree().setValue(ijk, cubes.back().density);
        };
        for (int x = -3; x < 3; ++x)
            for (int y = -3; y < 3; ++y)
                for (int z = -3; z < 3; ++z)
                    if (random.uniform() < 0.35) add(origin.offsetBy(x, y, z));
        for (int i = 0; i < 6; ++i)
            add(origin.offsetBy(i % 2 ? 150 : -20, 30 * (i - 3), i < 3 ? 9 : -140));
    }
    int find(const openvdb::Coord& ijk) const
    {
        for (std::size_t i = 0; i < cubes.size(); ++i)
            if (openvdb::Coord::floor(cubes[i].low) == ijk) return int(i);
        return -1;
    }
};

/// Rays of every kind: random ones, along axes, in planes, with -0, along edges and faces, through
/// corners, from faces, from inside, away.
void makeRay(std::uint64_t i, const Vec3d& middle, Vec3d& o, Vec3d& d)
{
    Random random(hashKey(5, i));
    const auto grid = [&] {
        return Vec3d(std::floor(random.uniform(-4, 5)), std::floor(random.uniform(-4, 5)),
                     std::floor(random.uniform(-4, 5)));
    };
    o = middle + Vec3d(random.uniform(-4, 4), random.uniform(-4, 4), random.uniform(-4, 4));
    d = Vec3d(random.normal(), random.normal(), random.normal());
    const int axis = int(random.uniform(0, 3));
    const double away =
        random.uniform() < 0.5 ? 300 * random.uniform() : 0; // half of them start inside
    switch (i % 8) {
    case 1:
        d[axis] = random.uniform() < 0.5 ? 0.0 : -0.0;
        break; // in a plane
    case 2:
        d = Vec3d(-0.0), d[axis] = random.uniform() < 0.5 ? 1 : -1;
        break; // along an axis
    case 3:
        d = Vec3d(0.0), d[axis] = random.uniform() < 0.5 ? 1 : -1, o = middle + grid();
        break; // along an edge, from a corner
    case 4:
        o[axis] = std::floor(o[axis]), d[axis] = 0;
        break; // in a face
    case 5:
        o[axis] = std::floor(o[axis]);
        break; // from a face or through one
    case 6:
        o = middle + grid(),
        d = Vec3d(random.uniform() < 0.5 ? 1 : -1, random.uniform() < 0.5 ? 1 : -1,
                  random.uniform() < 0.5 ? 1 : -1);
        break; // a diagonal through corners
    case 7:
        d[axis] = std::pow(10.0, -random.uniform(16, 323));
        break; // almost in a plane
    default:
        break;
    }
    d.normalize();
    if (i % 8 != 3 && i % 8 != 6) o -= away * d;
    else
        o -= std::floor(away)
            * (i % 8 == 3 ? d
                          : Vec3d(d[0] > 0 ? 1 : -1, d[1] > 0 ? 1 : -1,
                                  d[2] > 0 ? 1 : -1)); // stays on the grid
}

/// What a walk that steps a little over each face does: it misses voxels whose corner it cuts.
int missedByNudging(const Scattered& scene, const VoxelTree& tree, const Vec3d& o, const Vec3d& d)
{
    std::vector<char> met(scene.cubes.size());
    double t = 0;
    for (int step = 0; step < 40; ++step) {
        const Vec3d p = o + t * d;
        const openvdb::Coord ijk = openvdb::Coord::floor(p);
        if (tree.density(ijk[0], ijk[1], ijk[2]) > 0) met[scene.find(ijk)] = 1;
        double end = 1e30;
        for (int a = 0; a < 3; ++a)
            if (d[a] != 0) end = std::min(end, (ijk[a] + (d[a] > 0 ? 1 : 0) - o[a]) / d[a]);
        t = end + 1e-3;
    }
    int missed = 0;
    for (std::size_t i = 0; i < met.size(); ++i)
        missed += !met[i] && scene.cubes[i].length(o, d) > 1e-6;
    return missed;
}

} // namespace

// A million rays meet each voxel that a slab test says they meet, once, and no other, near the
// origin and a million voxels away.
TEST(Stability, AMillionRaysMissNoVoxelAndMeetNoneTwice)
{
    for (const openvdb::Coord& origin :
         {openvdb::Coord(0), openvdb::Coord(-1000064, 1000192, 1000064)}) {
        const Scattered scene(origin);
        const VoxelTree tree(scene.volume);
        const double far = origin == openvdb::Coord(0) ? 1 : 1e3,
                     tolerance = 2e-9 * far;      // doubles at 1e6 hold 1e-10
        std::vector<int> index(20 * 20 * 20, -1); // of the voxels in the middle
        const auto cell = [&](const openvdb::Coord& p) {
            const openvdb::Coord q = p - origin + openvdb::Coord(10);
            return q[0] < 0 || q[1] < 0 || q[2] < 0 || q[0] > 19 || q[1] > 19 || q[2] > 19
                ? -1
                : (q[0] * 20 + q[1]) * 20 + q[2];
        };
        for (std::size_t i = 0; i < scene.cubes.size(); ++i)
            if (const int c = cell(openvdb::Coord::floor(scene.cubes[i].low)); c >= 0)
                index[c] = int(i);
        std::atomic<int> wrong{0}, twice{0};
        std::atomic<long> met{0};
        tbb::parallel_for(
            tbb::blocked_range<int>(0, 500000), [&](const tbb::blocked_range<int>& range) {
                std::vector<double> length(scene.cubes.size());
                for (int i = range.begin(); i < range.end(); ++i) {
                    Vec3d o, d;
                    makeRay(std::uint64_t(i), origin.asVec3d(), o, d);
                    std::fill(length.begin(), length.end(), 0.0);
                    const MarchRay r(tree, o, d, kInfinity);
                    forEachLeaf(tree, r, [&](const LeafSpan& span) {
                        forEachVoxel(r, *span.start, [&](int voxel, double t, double end) {
                            if (!(tree.densities(span.leaf)[voxel] > 0)
                                || std::min(end, r.t1) - t <= tolerance)
                                return;
                            const openvdb::Coord ijk(span.cell[0] + (voxel >> 6),
                                                     span.cell[1] + (voxel >> 3 & 7),
                                                     span.cell[2] + (voxel & 7));
                            const int c = cell(ijk),
                                      at = c >= 0 && index[c] >= 0 ? index[c] : scene.find(ijk);
                            if (at < 0) ++wrong;
                            else {
                                twice += length[at] > 0;
                                length[at] += std::min(end, r.t1) - t;
                            }
                        });
                        return true;
                    });
                    for (std::size_t k = 0; k < length.size(); ++k) {
                        const double expected = scene.cubes[k].length(o, d);
                        wrong += std::abs(length[k] - expected) > 10 * tolerance;
                        met += expected > 0;
                    }
                }
            });
        EXPECT_EQ(wrong, 0) << origin;
        EXPECT_EQ(twice, 0) << origin;
        EXPECT_GT(met, 500000);
    }
    const Scattered scene{openvdb::Coord(0)};
    const VoxelTree tree(scene.volume);
    int missed = 0;
    for (int i = 0; i < 20000; ++i) {
        Vec3d o, d;
        makeRay(8 * std::uint64_t(i), Vec3d(0.0), o, d);
        missed += missedByNudging(scene, tree, o, d);
    }
    EXPECT_GT(missed, 10);
}

// A million voxels from the origin, float positions lose the sub-voxel part; ours keep it.
TEST(Stability, FarFromTheOriginThePositionInsideAVoxelIsKept)
{
    const openvdb::Coord at(1000000, -3000000, 2000000);
    Volume volume = emptyVolume();
    volume.parts[0].density->tree().setValue(at, 1);
    const VoxelTree tree(volume);
    double worst = 0, worst_float = 0;
    Random random(3);
    for (int i = 0; i < 1000; ++i) {
        const Vec3d d = Vec3d(random.normal(), random.normal(), random.normal()).unit(),
                    offset(random.uniform(), random.uniform(), random.uniform());
        const double expected = Cube{Vec3d(0.0), 1, 1}.length(offset - 30.0 * d, d);
        const Vec3d o = at.asVec3d() + offset - 30.0 * d;
        worst = std::max(
            worst,
            std::abs(lineIntegral<false>(tree, MarchRay(tree, o, d, kInfinity), d, kInfinity)
                     - expected));
        const Vec3d rounded = Vec3d(float(o[0]), float(o[1]), float(o[2]));
        worst_float =
            std::max(worst_float, std::abs(Cube{at.asVec3d(), 1, 1}.length(rounded, d) - expected));
    }
    EXPECT_LT(worst, 1e-7);
    EXPECT_GT(worst_float, 0.1);
}

// Directions that are none see nothing, and do not hang.
TEST(Stability, RaysWithoutADirectionSeeNothing)
{
    const Scattered scene{openvdb::Coord(0)};
    const VoxelTree tree(scene.volume);
    const std::vector<Light> lights(1);
    for (const Filter filter : {Filter::box, Filter::trilinear})
        for (const Integration integration : {Integration::exact, Integration::riemann}) {
            RenderParams params;
            params.filter = filter;
            params.integration = integration;
            const Integrator integrator(tree, {Material()}, lights, params);
            Integrator::Scratch scratch;
            for (const Vec3d& d :
                 {Vec3d(0.0), Vec3d(NAN), Vec3d(INFINITY, 0, 0), Vec3d(1e-300, 0, 0)})
                EXPECT_EQ(integrator.trace(Vec3d(0.0), d, scratch).transmittance, 1);
            EXPECT_EQ(integrator.trace(Vec3d(1e12), Vec3d(1, 0, 0), scratch).transmittance,
                      1); // outside, pointing away
        }
}

// A direction that leaves a face by less than a double can tell stays in it: every such ray has the
// depth of the ray along the face. 1 / d overflows there, and 0 times infinity is not a number.
TEST(Stability, DirectionsAlmostAlongAFaceAreAlongIt)
{
    const Scattered scene{openvdb::Coord(0)};
    const VoxelTree tree(scene.volume);
    for (int i = 0; i < 2000; ++i) {
        Vec3d o, d;
        makeRay(8 * std::uint64_t(i) + 4, Vec3d(0.0), o, d); // in a face
        const auto depth = [&](double off) {
            Vec3d almost = d;
            for (int a = 0; a < 3; ++a)
                if (d[a] == 0) almost[a] = off;
            return lineIntegral<false>(tree, MarchRay(tree, o, almost, kInfinity), almost,
                                       kInfinity);
        };
        for (const double off : {-0.0, 1e-19, -1e-19, 5e-324, -5e-324, -1e-310})
            ASSERT_EQ(depth(off), depth(0)) << o << d << off;
    }
}

// Tiles of every level beside leaves, in one volume, against the slabs of their cubes.
TEST(Stability, TilesOfEveryLevelBesideLeaves)
{
    Volume volume = emptyVolume();
    auto& tree = volume.parts[0].density->tree();
    std::vector<Cube> cubes{{Vec3d(-4096, 0, 0), 4096, 0.0003f},
                            {Vec3d(0, 128, -128), 128, 0.01f},
                            {Vec3d(8, -8, 16), 8, 0.2f},
                            {Vec3d(3, 5, -7), 1, 2.0f},
                            {Vec3d(-1, -1, -1), 1, 3.0f}};
    tree.addTile(3, {-4096, 0, 0}, cubes[0].density, true);
    tree.addTile(2, {0, 128, -128}, cubes[1].density, true);
    tree.addTile(1, {8, -8, 16}, cubes[2].density, true);
    tree.setValue({3, 5, -7}, cubes[3].density);
    tree.setValue({-1, -1, -1}, cubes[4].density);
    ASSERT_EQ(tree.activeTileCount(), 3u);
    const VoxelTree packed(volume);
    Random random(4);
    double met = 0;
    for (int i = 0; i < 20000; ++i) {
        const Cube& aim = cubes[i % cubes.size()];
        const Vec3d target =
            aim.low + aim.size * Vec3d(random.uniform(), random.uniform(), random.uniform());
        Vec3d d(random.normal(), random.normal(), random.normal());
        if (i % 7 == 0) d[i % 3] = 0;
        d.normalize();
        const double way = 5000 * random.uniform(),
                     end = i % 2 ? kInfinity : way; // half of them end in the cube
        const Vec3d o = target - way * d;
        double expected = 0;
        for (const Cube& c : cubes) expected += double(c.density) * c.length(o, d, end);
        ASSERT_NEAR(lineIntegral<false>(packed, MarchRay(packed, o, d, end), d, kInfinity),
                    expected, 1e-8 * (1 + expected))
            << o << " " << d;
        met += expected > 0;
    }
    EXPECT_GE(met, 19980);
}

// The vectors of each instruction set find what the plain C++ finds, bit by bit, and so do whole
// rays with their light.
TEST(Stability, EveryInstructionSetFindsTheSame)
{
    const Scattered scene{openvdb::Coord(0)};
    const VoxelTree tree(scene.volume);
    std::vector<Light> lights(2);
    lights[0].direction = Vec3d(1, -2, 0.5).unit();
    lights[1].kind = LightKind::point;
    lights[1].position = {-6, 7, 4};
    for (const Filter filter : {Filter::box, Filter::trilinear}) {
        RenderParams params;
        params.filter = filter;
        params.cutoff = 0;
        const MarchScene march(tree, {Material()}, lights, params);
        const Integrator integrator(tree, {Material()}, lights, params);
        std::vector<double> first; // radiance on the first target
        onEachTarget([&] {
            int met = 0;
            std::vector<double> radiance;
            for (int i = 0; i < 4000; ++i) {
                Vec3d o, d;
                makeRay(std::uint64_t(i), Vec3d(0.0), o, d);
                const MarchRay r = march.dual ? MarchRay(*march.dual, o - Vec3d(0.5), d, kInfinity)
                                              : MarchRay(tree, o, d, kInfinity);
                const double plain = march.dual ? lineIntegral(*march.dual, r, kInfinity)
                                                : lineIntegral<false>(tree, r, d, kInfinity);
                ASSERT_EQ(depthAlong(march, r, d), march.extinction * plain) << o << d;
                met += plain > 0;
                Integrator::Scratch scratch;
                radiance.push_back(integrator.trace(o, d, scratch).radiance[1]);
            }
            EXPECT_GT(met, 1500);
            if (first.empty()) first = radiance;
            ASSERT_EQ(radiance, first);
        });
    }
}

// A turned grid is seen turned; voxels that are not cubes are refused.
TEST(Stability, TransformsAreHandledOrRefused)
{
    Scattered scene{openvdb::Coord(0)};
    openvdb::Mat4d turn = openvdb::Mat4d::identity();
    turn.postRotate(openvdb::math::Y_AXIS, 0.7);
    turn.postRotate(openvdb::math::X_AXIS, -0.4);
    turn.preScale(Vec3d(0.25));
    turn.postTranslate(Vec3d(3, -2, 1));
    const VoxelTree plain(scene.volume);
    scene.volume.parts[0].density->setTransform(
        openvdb::math::Transform::createLinearTransform(turn));
    const VoxelTree turned(scene.volume);
    EXPECT_NEAR(turned.voxelSize(), 0.25, 1e-12);
    for (int i = 0; i < 2000; ++i) {
        Vec3d o, d;
        makeRay(std::uint64_t(i), Vec3d(0.0), o, d);
        const double expected =
            lineIntegral<false>(plain, MarchRay(plain, o, d, kInfinity), d, kInfinity);
        const openvdb::math::Transform& t = scene.volume.parts[0].density->transform();
        const Vec3d o_world = t.indexToWorld(o - Vec3d(0.5)),
                    d_world = (t.indexToWorld(o + d - Vec3d(0.5)) - o_world).unit();
        if (i % 8 != 0 && i % 8 != 7) continue; // in faces, where rounding decides
        EXPECT_NEAR(lineIntegral<false>(turned,
                                        MarchRay(turned, turned.toCorner(o_world),
                                                 turned.directionToCorner(d_world), kInfinity),
                                        d_world, kInfinity),
                    expected, 1e-9);
    }
    // The same world, turned and a quarter as wide: with four times the density, and lamps of a
    // sixteenth, it looks the same.
    const openvdb::math::Transform& t = scene.volume.parts[0].density->transform();
    std::vector<Light> lights(3), turned_lights;
    lights[0].direction = Vec3d(1, -2, 0.5).unit();
    lights[1].kind = LightKind::point;
    lights[1].position = {-6, 7, 4};
    lights[2].kind = LightKind::spot;
    lights[2].position = {5, -8, 1};
    lights[2].direction = Vec3d(-0.5, 1, 0).unit();
    RenderParams params;
    params.cutoff = 0;
    const auto directionOf = [&](const Vec3d& d) {
        return (t.indexToWorld(d) - t.indexToWorld(Vec3d(0.0))).unit();
    };
    for (Light light : lights) {
        light.position = t.indexToWorld(light.position);
        light.direction = directionOf(light.direction);
        if (light.kind != LightKind::directional) light.strength /= 16;
        turned_lights.push_back(light);
    }
    const Integrator before(plain, {Material()}, lights, params);
    params.tau = 4;
    const Integrator after(turned, {Material()}, turned_lights, params);
    Integrator::Scratch scratch;
    for (int i = 0; i < 300; ++i) {
        Vec3d o, d;
        makeRay(8 * std::uint64_t(i), Vec3d(0.0), o, d);
        const RaySample a = before.trace(o, d, scratch),
                        b = after.trace(t.indexToWorld(o), directionOf(d), scratch);
        EXPECT_NEAR(a.transmittance, b.transmittance, 1e-9);
        EXPECT_NEAR(a.radiance[0], b.radiance[0], 1e-7 * (1 + a.radiance[0]));
    }
    openvdb::Mat4d stretch = openvdb::Mat4d::identity();
    stretch.preScale(Vec3d(1, 1, 1.01));
    openvdb::Mat4d shear = openvdb::Mat4d::identity();
    shear(1, 0) = 0.2;
    openvdb::Mat4d lean = shear; // of edges as long as before
    lean(1, 1) = std::sqrt(1 - 0.2 * 0.2);
    for (const openvdb::Mat4d& bad : {stretch, shear, lean}) {
        scene.volume.parts[0].density->setTransform(
            openvdb::math::Transform::createLinearTransform(bad));
        EXPECT_THROW(VoxelTree{scene.volume}, Error);
    }
}
