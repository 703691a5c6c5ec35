#include "render.h"

#include <cmath>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "integrator.h"
#include "march.h"
#include "parallel.h"
#include "random.h"

using namespace volcomp;

namespace {

VolumePart emptyPart(double voxel = 1)
{
    VolumePart part;
    part.density = openvdb::FloatGrid::create(0.0f);
    part.density->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    return part;
}

// A cube of density `rho` of 32 voxels, edge 1, centred at the origin up to half a voxel.
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
    camera.eye = {0, 0, 5};
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
    for (const auto& v : data["grid"]) volume.parts[0].density->tree().setValue({v["ijk"][0], v["ijk"][1], v["ijk"][2]}, v["density"].get<float>());
    const VoxelTree tree(volume);
    for (const auto& ray : data["rays"]) {
        const Vec3d o(ray["origin"][0], ray["origin"][1], ray["origin"][2]), d(ray["direction"][0], ray["direction"][1], ray["direction"][2]);
        const MarchRay r(tree, tree.toCorner(o), d, MarchRay::kFar);
        const double expected = ray["box"];
        EXPECT_NEAR(lineIntegral<false>(tree, r, d, MarchRay::kFar), expected, 1e-6 * std::max(1.0, expected)) << ray.dump();
    }
}

// Lit and seen along its normal, a homogeneous slab of optical depth d shows S (1 - e^-2d) / 2, for every depth.
TEST(Render, SlabLitAlongTheViewShowsTheClosedForm)
{
    Material material;
    material.alpha = 1;
    for (float depth : {1e-7f, 1e-3f, 0.1f, 1.0f, 30.0f, 1e4f, 1e8f}) {
        const Image image = render(slab(depth), {material}, ortho(), {alongView()}, exactParams());
        const double expected = 0.25 * -std::expm1(-2.0 * depth) / 2;
        EXPECT_NEAR(image.pixel(1, 1)[0], expected, 1e-5 * expected) << depth;
        EXPECT_NEAR(image.pixel(1, 1)[3], -std::expm1(-double(depth)), 1e-6 * -std::expm1(-double(depth))) << depth;
    }
}

TEST(Render, PictureDoesNotDependOnThreads)
{
    Light light = alongView();
    light.direction = Vec3d(1, -1, -1).unit();
    Image images[2];
    for (int i = 0; i < 2; ++i) {
        const ThreadLimit limit(i == 0 ? 1 : 4);
        images[i] = render(slab(3), {}, ortho(), {light}, exactParams(50, 40));
    }
    EXPECT_EQ(images[0].pixels, images[1].pixels);
}
