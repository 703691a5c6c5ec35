// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/render.h"

#include <cmath>
#include <fstream>
#include <limits>
#include <map>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "volcomp/render/march/integrator.h"
#include "volcomp/render/march/march.h"
#include "volcomp/base/parallel.h"
#include "volcomp/base/random.h"
#include "tests/support/volumes.h"

using namespace volcomp;

namespace {

// A cube of density `rho` and edge 1, of 32^3 voxels; its centre is the origin but for half a
// voxel.
Volume slab(float rho)
{
    VolumePart part = emptyPart(1.0 / 32);
    part.density->fill(openvdb::CoordBBox({-16, -16, -16}, {15, 15, 15}), rho, true);
    Volume volume;
    volume.parts.push_back(part);
    return volume;
}

Camera ortho()
{
    Camera camera;
    camera.projection = Projection::orthographic;
    camera.eye = {0, 0, 5.003}; // so that no sample of a sum lies exactly in a face
    camera.width = 0.5;
    return camera;
}

Light alongView()
{
    Light light;
    light.direction = {0, 0, -1};
    return light;
}

RenderParams exactParams(int width = 4, int height = 4)
{
    RenderParams params;
    params.width = width;
    params.height = height;
    params.cutoff = 0;
    return params;
}

} // namespace

TEST(Render, LineIntegralsAgreeWithTheReference)
{
    std::ifstream stream(VOLCOMP_TEST_DATA "/line_integrals.json");
    const nlohmann::json data = nlohmann::json::parse(stream);
    Volume volume;
    volume.parts.push_back(emptyPart());
    for (const auto& v : data["grid"])
        volume.parts[0].density->tree().setValue({v["ijk"][0], v["ijk"][1], v["ijk"][2]},
                                                 v["density"].get<float>());
    const VoxelTree tree(volume);
    for (const auto& ray : data["rays"]) {
        const Vec3d o(ray["origin"][0], ray["origin"][1], ray["origin"][2]),
            d(ray["direction"][0], ray["direction"][1], ray["direction"][2]);
        const MarchRay r(tree, tree.toCorner(o), d, MarchRay::kFar);
        const double expected = ray["box"];
        EXPECT_NEAR(lineIntegral<false>(tree, r, d, MarchRay::kFar), expected,
                    1e-6 * std::max(1.0, expected))
            << ray.dump();
        const double trilinear = ray["trilinear"];
        RenderParams params = exactParams();
        params.shadows = Shadows::none;
        for (const Filter filter : {Filter::box, Filter::trilinear})
            for (const bool lit : {false, true}) { // without light, only the depth is summed
                params.filter = filter;
                const std::vector<Light> lights(lit ? 1 : 0);
                const Integrator integrator(tree, {Material()}, lights, params);
                Integrator::Scratch scratch;
                const double integral = filter == Filter::box ? expected : trilinear;
                EXPECT_NEAR(-std::log(integrator.trace(o, d, scratch).transmittance), integral,
                            1e-6 * std::max(1.0, integral))
                    << int(filter) << lit << ray.dump();
                EXPECT_EQ(scratch.counts.shaded_voxels > 0, lit && integral > 0)
                    << int(filter) << ray.dump();
            }
    }
}

// A homogeneous slab of optical depth d that is lit and seen along its normal shows
// S (1 - e^-2d) / 2, for every d.
TEST(Render, SlabLitAlongTheViewShowsTheClosedForm)
{
    Material material;
    material.alpha = 1;
    for (float depth : {1e-7f, 1e-3f, 0.1f, 1.0f, 30.0f, 1e4f, 1e8f}) {
        const Image image = render(slab(depth), {material}, ortho(), {alongView()}, exactParams());
        const double expected = 0.25 * -std::expm1(-2.0 * depth) / 2;
        EXPECT_NEAR(image.pixel(1, 1)[0], expected, 1e-5 * expected) << depth;
        EXPECT_NEAR(image.pixel(1, 1)[3], -std::expm1(-double(depth)),
                    1e-6 * -std::expm1(-double(depth)))
            << depth;
    }
}

TEST(Render, PictureDoesNotDependOnThreads)
{
    Light light = alongView();
    light.direction = Vec3d(1, -1, -1).unit();
    for (const Shadows shadows : {Shadows::exact, Shadows::sweep}) {
        RenderParams params = exactParams(50, 40);
        params.shadows = shadows;
        Image images[2];
        for (int i = 0; i < 2; ++i) {
            const ThreadLimit limit(i == 0 ? 1 : 4);
            images[i] = render(slab(3), {}, ortho(), {light}, params);
        }
        EXPECT_EQ(images[0].pixels, images[1].pixels);
    }
}

// By the paper's sum (4), a lit homogeneous slab in steps of optical depth x shows x / (e^x - 1) of
// the right answer, which is right for small x.
TEST(Render, SumsDarkenWithTheDepthOfAStepAndTheClosedFormDoesNot)
{
    Material material;
    material.alpha = 1;
    for (double x : {1e-8, 0.01, 0.1, 1.0, 5.0}) {
        RenderParams params = exactParams();
        params.shadows = Shadows::none;
        const Volume volume = slab(float(32 * x)); // 32 steps of depth x
        const double expected = 0.25 * -std::expm1(-32 * x);
        EXPECT_NEAR(render(volume, {material}, ortho(), {alongView()}, params).pixel(1, 1)[0],
                    expected, 1e-5 * expected)
            << x;
        params.integration = Integration::riemann;
        EXPECT_NEAR(render(volume, {material}, ortho(), {alongView()}, params).pixel(1, 1)[0],
                    expected * x / std::expm1(x), 0.02 * expected)
            << x;
        if (x >= 0.1) {
            EXPECT_LT(render(volume, {material}, ortho(), {alongView()}, params).pixel(1, 1)[0],
                      0.96 * expected)
                << x;
        }
    }
}

namespace {

Volume noise(openvdb::Coord origin, int size, std::uint64_t seed)
{
    Volume volume;
    volume.parts.push_back(emptyPart());
    Random random(seed);
    for (int x = 0; x < size; ++x)
        for (int y = 0; y < size; ++y)
            for (int z = 0; z < size; ++z)
                if (random.uniform() < 0.4)
                    volume.parts[0].density->tree().setValue(origin.offsetBy(x, y, z),
                                                             float(random.uniform()));
    return volume;
}

// Each voxel along a ray with the length of the ray inside, by intersecting it with slabs.
std::map<openvdb::Coord, double> slabs(const Volume& volume, const Vec3d& o, const Vec3d& d)
{
    std::map<openvdb::Coord, double> result;
    for (auto v = volume.parts[0].density->cbeginValueOn(); v; ++v) {
        double t0 = 0, t1 = 1e30;
        bool misses = false;
        for (int a = 0; a < 3; ++a) {
            const double low = v.getCoord()[a], high = low + 1;
            if (d[a] == 0) misses |= !(o[a] >= low && o[a] < high);
            else {
                const double p = (low - o[a]) / d[a], q = (high - o[a]) / d[a];
                t0 = std::max(t0, std::min(p, q));
                t1 = std::min(t1, std::max(p, q));
            }
        }
        if (!misses && t1 - t0 > 1e-7) result[v.getCoord()] = t1 - t0;
    }
    return result;
}

void expectSameVoxels(const Volume& volume, const VoxelTree& tree, const Vec3d& o, const Vec3d& d,
                      double tolerance)
{
    std::map<openvdb::Coord, double> expected = slabs(volume, o, d), found;
    const MarchRay r(tree, o, d, std::numeric_limits<double>::infinity());
    forEachLeaf(tree, r, [&](const LeafSpan& span) {
        forEachVoxel(r, *span.start, [&](int voxel, double t, double end) {
            if (!(tree.densities(span.leaf)[voxel] > 0) || std::min(end, r.t1) - t <= 1e-7) return;
            const openvdb::Coord ijk(span.cell[0] + (voxel >> 6), span.cell[1] + (voxel >> 3 & 7),
                                     span.cell[2] + (voxel & 7));
            EXPECT_TRUE(found.emplace(ijk, std::min(end, r.t1) - t).second) << "twice: " << ijk;
        });
        return true;
    });
    for (const auto& [ijk, length] : expected)
        ASSERT_NEAR(found[ijk], length, tolerance) << ijk << " from " << o << " along " << d;
    ASSERT_EQ(found.size(), expected.size()) << "from " << o << " along " << d;
}

} // namespace

TEST(March, RaysMeetEachVoxelOnceWithItsLength)
{
    for (const openvdb::Coord& origin :
         {openvdb::Coord(-3, 2, -9), openvdb::Coord(1000000, -1000000, 1000000)}) {
        const Volume volume = noise(origin, 11, 3);
        const VoxelTree tree(volume);
        const double tolerance = std::abs(origin[0]) > 1000 ? 1e-6 : 1e-9;
        Random random(9);
        const Vec3d corner = origin.asVec3d();
        for (int i = 0; i < 3000; ++i) {
            const Vec3d target =
                corner + Vec3d(random.uniform(0, 11), random.uniform(0, 11), random.uniform(0, 11));
            Vec3d d(random.symmetric(), random.symmetric(), random.symmetric()), o = target;
            if (i % 5 == 1) d[i % 3] = i % 2 ? 0.0 : -0.0;             // in a plane
            if (i % 5 == 2) d = Vec3d(0.0), d[i % 3] = i % 2 ? 1 : -1; // along an axis
            if (i % 5 == 3)
                o = Vec3d(std::floor(o[0]), std::floor(o[1]),
                          std::floor(o[2])); // through a corner or along a face
            if (i % 10 == 8)
                d = Vec3d(i % 20 < 10 ? 1 : -1, 1, 1), o = corner - Vec3d(3.0); // a diagonal
            d.normalize();
            if (i % 2) o -= 40.0 * d;
            // From a corner, either side is right if a component of the direction is 0.
            if (i % 5 == 3 && i % 2 == 0) continue;
            expectSameVoxels(volume, tree, o, d, i % 5 == 3 ? 1e-5 : tolerance);
        }
    }
}

TEST(March, EmptyVolumesAndRaysThatPointAwaySeeNothing)
{
    Volume empty;
    empty.parts.push_back(emptyPart());
    const VoxelTree none(empty);
    EXPECT_EQ(lineIntegral<false>(none, MarchRay(none, Vec3d(0.0), Vec3d(1, 0, 0), MarchRay::kFar),
                                  Vec3d(1, 0, 0), 1e30),
              0);
    const VoxelTree tree(slab(1));
    EXPECT_EQ(lineIntegral<false>(tree,
                                  MarchRay(tree, Vec3d(100.0), Vec3d(1, 0, 0), MarchRay::kFar),
                                  Vec3d(1, 0, 0), 1e30),
              0);
    Integrator integrator(tree, {Material()}, {}, exactParams());
    Integrator::Scratch scratch;
    EXPECT_EQ(integrator.trace(Vec3d(0.0), Vec3d(0.0), scratch).transmittance, 1);
}

// Tiles of every level are filled with their value.
TEST(March, TilesAreFilled)
{
    for (int size : {8, 128, 4096}) {
        Volume volume;
        volume.parts.push_back(emptyPart());
        volume.parts[0].density->sparseFill(
            openvdb::CoordBBox(openvdb::Coord(0), openvdb::Coord(size - 1)), 0.5f, true);
        const VoxelTree tree(volume);
        EXPECT_EQ(tree.voxelCount(), std::uint64_t(size) * size * size);
        const MarchRay r(tree, Vec3d(-5, 1.5, 2.5), Vec3d(1, 0, 0), MarchRay::kFar);
        EXPECT_NEAR(lineIntegral<false>(tree, r, Vec3d(1, 0, 0), 1e30), 0.5 * size, 1e-9 * size);
    }
}

// A random volume with lights of every kind against MODEL section 3, computed with slabs in double.
TEST(Render, RadianceAgreesWithBruteForce)
{
    Volume volume = noise({0, 0, 0}, 6, 4);
    volume.parts[0].direction = openvdb::Vec3SGrid::create(Vec3f(0.0f));
    Random random(8);
    for (auto v = volume.parts[0].density->cbeginValueOn(); v; ++v) {
        Vec3f d(float(random.symmetric()), float(random.symmetric()), float(random.symmetric()));
        d.normalize();
        volume.parts[0].direction->tree().setValue(v.getCoord(), d);
    }
    const VoxelTree tree(volume);
    std::vector<Light> lights(3);
    lights[0].direction = Vec3d(1, -2, 0.5).unit();
    lights[1].kind = LightKind::point;
    lights[1].position = {-4, 7, 9};
    lights[1].strength = Vec3d(50, 20, 10);
    lights[2].kind = LightKind::spot;
    lights[2].position = {3, -6, 3};
    lights[2].direction = {0, 1, 0};
    lights[2].angle = 0.6;
    lights[2].strength = Vec3d(40.0);
    RenderParams params = exactParams();
    params.extinction = Extinction::isotropic;
    params.ambient = Vec3d(0.1);
    const Material material;
    const Integrator integrator(tree, {material}, lights, params);
    const auto depth = [&](const Vec3d& p, const Vec3d& d, double length) {
        double sum = 0;
        for (auto v = volume.parts[0].density->cbeginValueOn(); v; ++v) {
            double t0 = 0, t1 = length;
            for (int a = 0; a < 3; ++a) {
                const double x = (v.getCoord()[a] - p[a]) / d[a],
                             y = (v.getCoord()[a] + 1 - p[a]) / d[a];
                t0 = std::max(t0, std::min(x, y));
                t1 = std::min(t1, std::max(x, y));
            }
            if (t1 > t0) sum += double(*v) * (t1 - t0);
        }
        return sum;
    };
    for (int i = 0; i < 200; ++i) {
        const Vec3d target(random.uniform(0, 6), random.uniform(0, 6), random.uniform(0, 6));
        const Vec3d d = Vec3d(random.normal(), random.normal(), random.normal()).unit(),
                    o = target - 10.0 * d; // corner coordinates
        std::vector<std::pair<double, openvdb::Coord>> order;
        const auto lengths = slabs(volume, o, d);
        order.reserve(lengths.size());
        for (const auto& [ijk, length] : lengths)
            order.push_back({(ijk.asVec3d() + Vec3d(0.5) - o).dot(d), ijk});
        const auto entry = [&](const openvdb::Coord& ijk) {
            double t = 0;
            for (int a = 0; a < 3; ++a)
                t = std::max(t, std::min((ijk[a] - o[a]) / d[a], (ijk[a] + 1 - o[a]) / d[a]));
            return t;
        };
        for (auto& [t, ijk] : order) t = entry(ijk);
        std::sort(order.begin(), order.end());
        Vec3d radiance(0.0);
        double T = 1;
        for (const auto& [t, ijk] : order) {
            const double length = lengths.at(ijk),
                         delta = volume.parts[0].density->tree().getValue(ijk) * length;
            VoxelContent content;
            tree.contents(tree.leafAt(ijk[0], ijk[1], ijk[2]),
                          VoxelTree::offset(ijk[0], ijk[1], ijk[2]),
                          [&](const VoxelContent& c) { content = c; });
            const Vec3f stored = volume.parts[0].direction->tree().getValue(ijk);
            ASSERT_GT(std::abs(content.direction.dot(Vec3d(stored))), 1 - 1e-6); // 7e-4 rad
            const Vec3d p = o + t * d, middle = p + 0.5 * length * d;
            radiance += T * -std::expm1(-delta) * material.alpha * params.ambient;
            for (const Light& light : lights) {
                const auto toLight = [&](const Vec3d& x) {
                    return light.kind == LightKind::directional
                        ? Vec3d(-light.direction)
                        : (light.position + Vec3d(0.5) - x).unit();
                };
                const auto far = [&](const Vec3d& x) {
                    return light.kind == LightKind::directional
                        ? 1e30
                        : (light.position + Vec3d(0.5) - x).length();
                };
                constexpr int kPieces = 100; // each sends as much to its begin
                double passes = 0;
                for (int n = 0; n < kPieces; ++n) {
                    const double v = (n + 0.5) / kPieces,
                                 u = -std::log1p(v * std::expm1(-delta)) / delta;
                    const Vec3d x = p + u * length * d;
                    passes += std::exp(-depth(x, toLight(x), far(x))) / kPieces;
                }
                const Illumination in = illuminate(light, middle - Vec3d(0.5), 0.5);
                const Reflection f = reflectFibre(makeLobe(material), content.direction, -d, in.L);
                radiance += T * -std::expm1(-delta) * passes * in.weight * light.strength
                    * (f.diffuse * content.colour + f.specular * material.specular_colour);
            }
            T *= std::exp(-delta);
        }
        Integrator::Scratch scratch;
        const RaySample sample = integrator.trace(o - Vec3d(0.5), d, scratch);
        for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(sample.radiance[c], radiance[c], 0.01 * radiance[c]);
        ASSERT_NEAR(sample.transmittance, T, 1e-9);
    }
}

TEST(Render, AovsAddUp)
{
    std::vector<Light> lights{alongView(), alongView()};
    lights[1].direction = Vec3d(1, -1, -1).unit();
    RenderParams params = exactParams();
    params.aovs = true;
    const Image image = render(slab(100), {}, ortho(), lights, params);
    ASSERT_EQ(image.channels.size(), 26u);
    const float* p = image.pixel(2, 2);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(p[c], p[11 + c] + p[14 + c], 1e-6);
    EXPECT_NEAR(p[4], 4.5 + 0.5 / 32 + 0.013,
                0.01); // the near face, half a voxel off, and a mean free path
    EXPECT_NEAR(p[8], 0.8, 1e-3);
}

// If voxels without direction are shaded by the density's gradient, a dense ball is a matte one: it
// shows alpha cos theta on the side that faces the light.
TEST(Render, TheGradientIsANormalWithASide)
{
    Volume volume;
    volume.parts.push_back(emptyPart());
    for (int x = -12; x <= 12; ++x)
        for (int y = -12; y <= 12; ++y)
            for (int z = -12; z <= 12; ++z) // with a soft border, over which differences are taken
                if (const double r = Vec3d(x, y, z).length(); r < 12)
                    volume.parts[0].density->tree().setValue(
                        {x, y, z}, float(2 * std::min(1.0, (12 - r) / 6)));
    Material material;
    material.alpha = 1;
    material.beta = 0;
    RenderParams params = exactParams();
    params.shadows = Shadows::none;
    params.undirected = Undirected::gradient;
    const VoxelTree tree(volume);
    Integrator::Scratch scratch;
    for (const Vec3d& direction : {Vec3d(0, 0, -1), Vec3d(0, -1, -1).unit(), Vec3d(0, 0, 1)}) {
        Light light = alongView();
        light.direction = direction;
        const RaySample sample =
            Integrator(tree, {material}, {light}, params).trace({0, 0, 40}, {0, 0, -1}, scratch);
        EXPECT_NEAR(sample.radiance[0], std::max(0.0, -direction[2]) * (1 - sample.transmittance),
                    0.01);
    }
}

TEST(Render, HalfTheLightIsHalfThePicture)
{
    Light full = alongView(), weak = alongView();
    weak.strength = Vec3d(0.5);
    const Image a = render(slab(2), {}, ortho(), {full}, exactParams()),
                b = render(slab(2), {}, ortho(), {weak}, exactParams());
    for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(a.pixel(1, 1)[c], 2 * b.pixel(1, 1)[c]);
}

// The factor of directed extinction has the mean 1 over all directions, for every spread. Without
// spread it is 0 along a fibre, and 2 across a sheet.
TEST(VoxelTree, TheDirectionFactorIsOneInTheMean)
{
    for (const auto& [kind, spread] : {std::pair(MaterialKind::fibre, 0.0f),
                                       {MaterialKind::fibre, 0.3f},
                                       {MaterialKind::fibre, 0.7f},
                                       {MaterialKind::surface, 0.0f},
                                       {MaterialKind::surface, 0.3f},
                                       {MaterialKind::surface, 0.7f}}) {
        Volume volume;
        volume.parts.push_back(emptyPart());
        volume.parts[0].kind = kind;
        volume.parts[0].density->tree().setValue({0, 0, 0}, 1);
        volume.parts[0].direction = openvdb::Vec3SGrid::create(Vec3f(0.0f));
        volume.parts[0].direction->tree().setValue({0, 0, 0}, Vec3f(0, 1 - spread, 0));
        const VoxelTree tree(volume);
        double mean = 0;
        for (int i = 0; i < 20000; ++i) {
            const double y = (i + 0.5) / 20000;
            mean += tree.directionFactor(tree.leafAt(0, 0, 0), 0, Vec3d(std::sqrt(1 - y * y), y, 0))
                / 20000;
        }
        EXPECT_NEAR(mean, 1, 1e-4) << spread;
        if (spread == 0) {
            EXPECT_NEAR(tree.directionFactor(tree.leafAt(0, 0, 0), 0, Vec3d(0, 1, 0)),
                        kind == MaterialKind::fibre ? 0 : 2, 1e-6);
        }
    }
}
