// SPDX-License-Identifier: Apache-2.0
// What the table of light from all around takes of a dome's image.
#include "volcomp/render/march/sky_light.h"

#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"
#include "volcomp/base/interval.h"
#include "volcomp/render/sky/neighbour_directions.h"
#include "volcomp/view/image.h"

using namespace volcomp;

namespace {

constexpr int kHeight = 512; ///< texels of the image, of a third of a degree

/// The solid angle of each texel of a row.
double sizeOf(int row)
{
    const double angle = kPi / kHeight;
    return angle * (std::cos(row * angle) - std::cos((row + 1) * angle));
}

/// The table under a grey image whose texels are radiance(row, column).
SkyTable tableOf(const std::function<double(int, int)>& radiance)
{
    Image image;
    image.width = 2 * kHeight;
    image.height = kHeight;
    image.channels = {"R", "G", "B"};
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < 2 * kHeight; ++x)
            image.pixels.insert(image.pixels.end(), 3, float(radiance(y, x)));
    const TemporaryFolder folder;
    writeImage(folder / "sky.exr", image);
    RenderParams params;
    params.dome.kind = DomeKind::image;
    params.dome.file = folder / "sky.exr";
    EXPECT_TRUE(loadDome(params.dome).empty()) << "no lamp is a sun";
    return makeSkyTable(params, VoxelTree(emptyVolume()));
}

} // namespace

// A lamp of one texel in each of the 26 directions, each with a 26th of the image's light, which is
// too little for a sun. Each direction has its lamp's light, as if it were spread over its share of
// the sphere.
TEST(SkyTable, SmallLampsOfAnImageKeepTheirEnergy)
{
    std::array<std::pair<int, int>, Openness::kDirections> lamps;
    for (int d = 0; d < Openness::kDirections; ++d) {
        const NeighbourStep step = neighbourStep(d);
        const Vec3d v = Vec3d(step[0], step[1], step[2]).unit();
        const double down = std::acos(v[1]), around = std::atan2(v[0], -v[2]);
        lamps[d] = {std::min(int(down / kPi * kHeight), kHeight - 1),
                    int((around / (2 * kPi) + 0.5) * 2 * kHeight) % (2 * kHeight)};
    }
    constexpr double kLight = 0.01; // radiance times solid angle of each lamp
    const SkyTable sky = tableOf([&](int y, int x) {
        double sum = 0;
        for (const auto& lamp : lamps)
            if (lamp == std::pair(y, x)) sum += kLight / sizeOf(y);
        return sum;
    });
    double all = 0;
    for (int d = 0; d < Openness::kDirections; ++d) {
        const double light = 4 * kPi * sky.weight[d] * sky.radiance[0][d];
        // Soft radiance has the lamp's light within 1 %, but at the poles, where the first texel
        // goes on over its edge, 8 % more.
        const bool pole = std::abs(sky.y[d]) > 0.99F;
        EXPECT_NEAR(light / kLight, pole ? 1.08 : 1, pole ? 0.02 : 0.01)
            << sky.x[d] << ' ' << sky.y[d] << ' ' << sky.z[d];
        all += light;
    }
    EXPECT_NEAR(all / (26 * kLight), 1, 0.01);
}

// A sky that changes slowly is as it was: the mean of 1 + y is 1, and straight up it is its mean
// over the directions nearest to +y.
TEST(SkyTable, ASlowChangeOfTheSkyIsKept)
{
    const SkyTable sky =
        tableOf([](int y, int) { return 1 + std::cos(kPi * (y + 0.5) / kHeight); });
    double mean = 0, size = 0, up = 0, share = 0;
    for (int d = 0; d < Openness::kDirections; ++d) {
        mean += double(sky.weight[d]) * sky.radiance[1][d];
        size += double(sky.weight[d]);
    }
    EXPECT_NEAR(size, 1, 1e-5);
    EXPECT_NEAR(mean, 1, 1e-3);
    constexpr int kSteps = 700; // of a brute-force sum over places of equal area
    for (int i = 0; i < kSteps; ++i)
        for (int k = 0; k < kSteps; ++k) {
            const double y = -1 + 2 * (i + 0.5) / kSteps, turn = 2 * kPi * (k + 0.5) / kSteps,
                         s = std::sqrt(1 - y * y);
            if (nearestNeighbour({s * std::cos(turn), y, s * std::sin(turn)})
                != neighbourNumber({0, 1, 0}))
                continue;
            up += 1 + y;
            share += 1;
        }
    EXPECT_NEAR(sky.radiance[1][neighbourNumber({0, 1, 0})], up / share, 2e-3);
}
