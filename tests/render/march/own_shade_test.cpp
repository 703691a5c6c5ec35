// SPDX-License-Identifier: Apache-2.0
// A strand or leaf does not shade itself (MODEL section 3).
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/boxes.h"
#include "volcomp/bake/rasterise.h"
#include "volcomp/render/march/integrator.h"

namespace volcomp {
namespace {

/// What rays along -N see of the middle of a flat leaf of 40 x 20 voxels that is turned by
/// `degrees` about z and a little about x, over what they see of its coverage. The light is `slant`
/// degrees away from the normal, on the side that is seen.
std::vector<double> shownBy(double degrees, double slant, OwnShade own_shade)
{
    const double a = degrees * kDegree, tilt = 7 * kDegree;
    const Vec3d axis(std::cos(a), std::sin(a), 0),
        side = Vec3d(-std::sin(a) * std::sin(tilt), std::cos(a) * std::sin(tilt), std::cos(tilt)),
        N = side.cross(axis);
    Segment leaf;
    leaf.a = Vec3f(-20 * axis), leaf.b = Vec3f(20 * axis);
    leaf.side = Vec3f(side);
    leaf.size_a = leaf.size_b = 10;
    Volume volume;
    volume.parts.push_back(rasterise({leaf}, "leaf", MaterialKind::surface, 1.0));
    const VoxelTree tree(volume);
    Material material;
    material.name = "leaf";
    material.kind = MaterialKind::surface;
    material.alpha = 1;
    material.beta = 0;
    Light light;
    light.direction =
        -(std::cos(slant * kDegree) * N + std::sin(slant * kDegree) * (axis + side).unit());
    RenderParams params;
    params.own_shade = own_shade;
    const Integrator integrator(tree, {material}, {light}, params);
    Integrator::Scratch scratch;
    std::vector<double> shown;
    for (int i = 0; i < 60; ++i)
        for (int j = 0; j < 30; ++j) {
            const Vec3d p = (-15 + i * 0.5) * axis + (-7.4 + j * 0.5) * side;
            const RaySample s = integrator.trace(p + 30 * N, -N, scratch);
            shown.push_back(s.radiance[0] / (1 - s.transmittance));
        }
    return shown;
}

TEST(OwnShade, ALeafIsLitEvenlyHoweverItIsTurned)
{
    for (const double degrees : {0.0, 10.0, 20.0, 30.0, 45.0})
        for (const double slant : {0.0, 30.0, 60.0}) {
            const std::vector<double> shown = shownBy(degrees, slant, OwnShade::left_out),
                                      dark = shownBy(degrees, slant, OwnShade::counted);
            double mean = 0, square = 0, mean_dark = 0;
            for (const double s : shown) mean += s / double(shown.size());
            for (const double s : shown) square += (s - mean) * (s - mean) / double(shown.size());
            for (const double s : dark) mean_dark += s / double(dark.size());
            const double lambert = std::cos(slant * kDegree);
            EXPECT_NEAR(mean, lambert, 0.02 * lambert) << degrees << " " << slant;
            EXPECT_LT(std::sqrt(square), 0.02 * mean) << degrees << " " << slant;
            EXPECT_LT(mean_dark, 0.6 * lambert) << degrees << " " << slant; // the plain method
        }
}

} // namespace
} // namespace volcomp
