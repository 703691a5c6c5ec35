#include "shadow_sweep.h"

#include <cmath>

#include <gtest/gtest.h>

#include "march.h"
#include "random.h"

using namespace volcomp;

namespace {

Volume noise(int size, double fill, double brightest)
{
    VolumePart part;
    part.density = openvdb::FloatGrid::create(0.0f);
    Random random(5);
    for (int x = 0; x < size; ++x)
        for (int y = 0; y < size; ++y)
            for (int z = 0; z < size; ++z)
                if (random.uniform() < fill) part.density->tree().setValue({x - 9, y, z + 3}, float(brightest * random.uniform()));
    Volume volume;
    volume.parts.push_back(part);
    return volume;
}

Light from(Vec3d direction)
{
    Light light;
    direction.normalize();
    light.direction = direction;
    return light;
}

const Vec3d kDirections[] = {{-0.6, -0.7, -0.4}, {0.1, 0.2, -0.9}, {0.9, 0.1, 0.3}, {0, -1, 0}, {1, 1, 1}, {-1, 0, 1}, {0, 0, 1}};

} // namespace

// In a homogeneous block the depth is linear along the way to the light, which the interpolation reproduces away from the faces.
TEST(ShadowSweep, IsExactInAHomogeneousBlock)
{
    for (const Vec3d& direction : kDirections) {
        Volume volume = noise(0, 0, 0);
        volume.parts[0].density->denseFill(openvdb::CoordBBox({0, 0, 0}, {31, 31, 31}), 0.1f, true);
        const VoxelTree tree(volume);
        const Light light = from(direction);
        const ShadowSweep sweep(tree, {light}, std::vector<char>(tree.leafCount(), ShadowSweep::fine), 1, 8, false);
        Random random(1);
        for (int i = 0; i < 200; ++i) {
            const Vec3d p(random.uniform(12, 20), random.uniform(12, 20), random.uniform(12, 20));
            const int cell[3] = {int(p[0]), int(p[1]), int(p[2])};
            double a = -1, b = -1;
            ASSERT_TRUE(sweep.depths(0, tree.leafAt(cell[0], cell[1], cell[2]), VoxelTree::offset(cell[0], cell[1], cell[2]), cell, p, p, a, b));
            const double exact = lineIntegral<false>(tree, MarchRay(tree, p, -light.direction, MarchRay::kFar), Vec3d(0.0), MarchRay::kFar);
            EXPECT_NEAR(a, exact, 0.1) << direction; // codes are 0.03 apart at this depth; a kink where the nearest face changes costs the rest
            EXPECT_EQ(a, b);
        }
    }
}

// Light averaged over a volume of random voxels: no bias worth mentioning, and a small error of each query.
TEST(ShadowSweep, AgreesWithRaysThroughNoise)
{
    for (const Vec3d& direction : kDirections) {
        const Volume volume = noise(40, 0.3, 0.2);
        const VoxelTree tree(volume);
        const Light light = from(direction);
        const ShadowSweep sweep(tree, {light}, std::vector<char>(tree.leafCount(), ShadowSweep::fine), 1, 8, false);
        Random random(2);
        double mean = 0, difference = 0, square = 0;
        int count = 0;
        while (count < 3000) {
            const Vec3d p(random.uniform(-9, 31), random.uniform(0, 40), random.uniform(3, 43));
            const int cell[3] = {int(std::floor(p[0])), int(p[1]), int(p[2])};
            if (!(tree.density(cell[0], cell[1], cell[2]) > 0)) continue;
            ++count;
            double a = -1, b = -1;
            ASSERT_TRUE(sweep.depths(0, tree.leafAt(cell[0], cell[1], cell[2]), VoxelTree::offset(cell[0], cell[1], cell[2]), cell, p, p, a, b));
            const double exact = std::exp(-lineIntegral<false>(tree, MarchRay(tree, p, -light.direction, MarchRay::kFar), Vec3d(0.0), MarchRay::kFar));
            mean += exact;
            difference += std::exp(-a) - exact;
            square += (std::exp(-a) - exact) * (std::exp(-a) - exact);
        }
        EXPECT_NEAR(difference / mean, 0, 0.01) << direction;
        EXPECT_LT(std::sqrt(square / count), 0.13 * mean / count) << direction;
    }
}
