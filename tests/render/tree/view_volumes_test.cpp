// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/view_volumes.h"

#include <cmath>

#include <gtest/gtest.h>
#include <openvdb/tools/Interpolation.h>

#include "volcomp/base/random.h"
#include "volcomp/volume/volume.h"
#include "tests/support/volume_tiles.h"

namespace volcomp {
namespace {

constexpr double kDensity = 0.3, kEdge = 48, kThick = 8; // of a slab of fog, at the origin
constexpr int kPixels = 128;                             // a pixel is 1/128 wide at distance 1

// The fog in voxels of some widths, finest first, and a camera beside it that looks along it.
class ViewVolumes : public testing::Test {
protected:
    void SetUp() override
    {
        openvdb::initialize();
        const auto budget = std::make_shared<TileBudget>(std::size_t(1) << 30);
        std::vector<std::shared_ptr<const TileMaker>> makers;
        for (const double voxel : {0.125, 0.25, 0.5}) {
            Volume volume;
            VolumePart& part = volume.parts.emplace_back();
            part.density = openvdb::FloatGrid::create(0.0f);
            part.density->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
            const auto last = [&](double edge) { return int(std::lround(edge / voxel)) - 1; };
            part.density->denseFill(
                {openvdb::Coord(0), openvdb::Coord(last(kEdge), last(kEdge), last(kThick))},
                float(kDensity), true);
            makers.push_back(std::make_shared<VolumeTiles>(volume));
        }
        m_camera.eye = {5, -3, 4};
        m_camera.target = {20, 20, 4};
        m_camera.field_of_view = 2 * std::atan(0.5);
        m_params.width = kPixels;
        m_levels = tileLevels(tileTrees(makers, budget), m_camera, m_params, 1);
        ASSERT_EQ(m_levels.size(), 3u);
        for (std::size_t n = 0; n < m_levels.size(); ++n)
            m_volumes.push_back(unpack(viewVolume(m_levels, n, m_camera.eye)));
    }

    Camera m_camera;
    RenderParams m_params;
    std::vector<VoxelLevel> m_levels;
    std::vector<Volume> m_volumes;
};

} // namespace

TEST_F(ViewVolumes, HoldEverythingOnce)
{
    double sum = 0;
    for (const Volume& volume : m_volumes) {
        const openvdb::FloatGrid& grid = *volume.parts.at(0).density;
        EXPECT_GT(grid.activeVoxelCount(), 0u);
        for (auto value = grid.cbeginValueOn(); value; ++value) {
            EXPECT_FLOAT_EQ(*value, kDensity);
            sum += std::pow(grid.voxelSize()[0], 3);
        }
    }
    // Voxels that stand for each other lie beside each other by half a voxel.
    EXPECT_NEAR(sum, kEdge * kEdge * kThick, 0.01 * kEdge * kEdge * kThick);
    Random random(5);
    int once = 0;
    constexpr int kPoints = 20000;
    for (int i = 0; i < kPoints; ++i) {
        const Vec3d p(random.uniform() * kEdge, random.uniform() * kEdge,
                      random.uniform() * kThick);
        int here = 0;
        for (const Volume& volume : m_volumes) {
            const openvdb::FloatGrid& grid = *volume.parts[0].density;
            here += grid.tree().isValueOn(grid.transform().worldToIndexCellCentered(p));
        }
        EXPECT_LE(here, 2);
        once += here == 1;
    }
    EXPECT_GT(once, 0.97 * kPoints);
}

TEST_F(ViewVolumes, AreAsFineAsTheCameraWants)
{
    for (std::size_t n = 0; n < m_volumes.size(); ++n) {
        const openvdb::FloatGrid& grid = *m_volumes[n].parts[0].density;
        const double voxel = grid.voxelSize()[0];
        EXPECT_EQ(voxel, m_levels[n].tree->voxelSize());
        for (auto value = grid.cbeginValueOn(); value; ++value) {
            const double away =
                (grid.indexToWorld(value.getCoord()) - m_camera.eye).length() + 1e-9;
            ASSERT_GE(away, n > 0 ? kPixels * voxel : 0);
            ASSERT_LT(away, kPixels * 2 * voxel + std::sqrt(3.0) * voxel);
        }
    }
}

// Where two levels meet, up to half a finer voxel is missed or counted twice: half a thousandth of
// the way in a picture of 1000 pixels, and up to 0.4 % here.
TEST_F(ViewVolumes, HaveTheTransmittanceOfTheWhole)
{
    Random random(6);
    double sum = 0, expected = 0;
    constexpr int kRays = 300;
    for (int i = 0; i < kRays; ++i) {
        const Vec3d end(4 + random.uniform() * 40, 46, 1 + random.uniform() * 6),
            start(4 + random.uniform() * 40, 2, 1 + random.uniform() * 6);
        const double length = (end - start).length();
        constexpr int kSteps = 2000;
        double depth = 0;
        for (int k = 0; k < kSteps; ++k) {
            const Vec3d p = start + (end - start) * ((k + 0.5) / kSteps);
            for (const Volume& volume : m_volumes) {
                const openvdb::FloatGrid& grid = *volume.parts[0].density;
                depth += grid.tree().getValue(grid.transform().worldToIndexCellCentered(p)) * length
                    / kSteps;
            }
        }
        const double tau = 0.1;
        sum += std::exp(-tau * depth) / kRays;
        expected += std::exp(-tau * kDensity * length) / kRays;
    }
    EXPECT_NEAR(sum, expected, 0.01 * expected);
}

} // namespace volcomp
