// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/coarser_voxel.h"

#include <cmath>

#include <gtest/gtest.h>

#include "volcomp/base/random.h"

namespace volcomp {
namespace {

using Eight = std::array<double, 8>;

EightVoxels eight(const Eight& densities)
{
    EightVoxels voxels;
    voxels.densities = densities;
    return voxels;
}

Eight same(double density)
{
    Eight densities;
    densities.fill(density);
    return densities;
}

double coarserDensity(const Eight& densities, double extinction)
{
    return coarserVoxel(eight(densities), 0, extinction).density;
}

TEST(CoarserVoxel, KeepsTheMeanTransmittanceOfColumns)
{
    EXPECT_NEAR(coarserDensity(same(2), 0.3), 2, 1e-12);
    EXPECT_NEAR(coarserDensity(same(2), 0), 2, 1e-12);
    EXPECT_NEAR(coarserDensity(same(1e6), 1), 1e6, 1);
    // A wall across x: it is in all columns along x, and in half of the columns along y and z.
    const Eight wall{3, 3, 3, 3, 0, 0, 0, 0};
    const double across = std::log(2 / (1 + std::exp(-6.0))) / 2;
    EXPECT_NEAR(coarserDensity(wall, 1), (1.5 + 2 * across) / 3, 1e-12);
    const Eight one{1e-9, 0, 0, 0, 0, 0, 0, 0};
    EXPECT_NEAR(coarserDensity(one, 1), 1e-9 / 8, 1e-18);
}

// Single scattering in eight voxels, summed over many thin beams, against that of the coarser voxel
// times its scatter ratio.
TEST(CoarserVoxel, ScattersTheLightThatTheEightScatter)
{
    Random random(11);
    for (int n = 0; n < 20; ++n) {
        Eight depths;
        for (double& d : depths)
            d = n == 0 ? 0.7 : random.uniform() < 0.5 ? 0 : 3 * random.uniform();
        depths[3] += 0.01;
        if (n == 0) depths[3] = 0.7;
        // What is a strand's own in its voxel does not shade it; in one half of the cases there is
        // such a share.
        EightVoxels fine = eight(depths);
        const double own_share = n % 2 ? 0.3 : 0;
        if (n % 2)
            for (double& own : fine.own_shares) own = random.uniform();
        const CoarserVoxel v = coarserVoxel(fine, own_share, 1);
        const Eight whole = same(v.density);
        // A beam into the face across axis `eye`, upwards or downwards, and light along axis
        // `light`: midpoints of kCuts^2 columns in each voxel.
        constexpr int kCuts = 48;
        // With `one`, the eight are one voxel, and its own share is of the way through all of it.
        const auto scattered = [&](const Eight& density, const Eight& own, bool one, int eye,
                                   bool eye_up, int light, bool light_up) {
            double sum = 0;
            for (int k = 0; k < 8; ++k)
                for (int i = 0; i < kCuts; ++i)
                    for (int j = 0; j < kCuts; ++j) {
                        const double in_eye = (i + 0.5) / kCuts,
                                     in_light = eye == light ? in_eye : (j + 0.5) / kCuts;
                        // To the face by which the beam enters: in the voxel, and before it.
                        const auto inside = [&](bool up, double at) {
                            return density[k] * (up ? 1 - at : at);
                        };
                        const auto beside = [&](int axis, bool up) {
                            const int along = 4 >> axis;
                            const bool before = up ? !(k & along) : (k & along);
                            return before ? density[k ^ along] : 0;
                        };
                        sum += density[k] * std::exp(-inside(eye_up, in_eye) - beside(eye, eye_up))
                            * (own[k] * (one ? 1 : std::exp(-beside(light, light_up)))
                               + (1 - own[k])
                                   * std::exp(-inside(light_up, in_light)
                                              - beside(light, light_up)));
                    }
            return sum / (4 * kCuts * kCuts);
        };
        double parts[3] = {0, 0, 0}, even[3] = {0, 0, 0};
        for (int eye = 0; eye < 3; ++eye)
            for (int light = 0; light < 3; ++light)
                for (int ends = 0; ends < 4; ++ends) {
                    const int from = eye != light ? 1 : (ends & 1) == ends >> 1 ? 0 : 2;
                    parts[from] +=
                        scattered(depths, fine.own_shares, false, eye, ends & 1, light, ends >> 1);
                    even[from] +=
                        scattered(whole, same(own_share), true, eye, ends & 1, light, ends >> 1);
                }
        for (int from = 0; from < 3; ++from)
            EXPECT_NEAR(v.scatter_ratio[from] * even[from], parts[from], 1e-3 * even[from])
                << n << " " << from;
        for (const float scatter_ratio : v.scatter_ratio)
            EXPECT_TRUE(n > 0 || std::abs(scatter_ratio - 1) < 1e-6) << scatter_ratio;
    }
}

} // namespace
} // namespace volcomp
