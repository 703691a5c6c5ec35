// SPDX-License-Identifier: Apache-2.0
// Volumes of other programs: which grid is the density, voxels of any shape, values that are not
// quite densities.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "volcomp/base/error.h"
#include "volcomp/render/tree/voxel_tree_io.h"
#include "volcomp/volume/cubic_voxels.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatGrid;
using openvdb::Mat4d;
using openvdb::Vec3SGrid;

class ForeignVolume : public testing::Test {
protected:
    static void SetUpTestSuite() { openvdb::initialize(); }

    fs::path write(const openvdb::GridPtrVec& grids, const std::string& name = "a.vdb") const
    {
        openvdb::io::File out((m_folder / name).string());
        out.write(grids);
        out.close();
        return m_folder / name;
    }
    static FloatGrid::Ptr fog(const std::string& name, float density)
    {
        auto grid = FloatGrid::create(0.0f);
        grid->setName(name);
        grid->denseFill(CoordBBox(Coord(0), Coord(9)), density);
        return grid;
    }
    static float densityOf(const Volume& volume)
    {
        return volume.parts.at(0).density->tree().getValue(Coord(5));
    }

private:
    TemporaryFolder m_folder;
};

TEST_F(ForeignVolume, DensityBesideOthersIsTheVolume)
{
    const Volume volume = readVolume(write({fog("density", 2), fog("density_old", 0.02f)}));
    ASSERT_EQ(volume.parts.size(), 1u);
    EXPECT_EQ(densityOf(volume), 2);
    ASSERT_EQ(volume.warnings.size(), 1u);
    EXPECT_NE(volume.warnings[0].find("density_old"), std::string::npos) << volume.warnings[0];
    EXPECT_NE(volume.warnings[0].find("a.vdb"), std::string::npos) << volume.warnings[0];
}

// In our own files it is the sum of the parts, and not read.
TEST_F(ForeignVolume, DensityBesideOurPartsIsTheirSum)
{
    Volume two;
    for (const char* name : {"bark", "fur"}) {
        VolumePart& part = two.parts.emplace_back();
        part.material = name;
        part.density = fog("", 2);
    }
    const fs::path file = write({fog("x", 1)});
    writeVolume(file, two);
    const Volume volume = readVolume(file);
    ASSERT_EQ(volume.parts.size(), 2u);
    EXPECT_EQ(densityOf(volume), 2);
    EXPECT_TRUE(volume.warnings.empty());
    EXPECT_EQ(densityOf(readVolume(file, false, "density")), 4);
}

TEST_F(ForeignVolume, AnyFloatGridCanBeTheDensity)
{
    const fs::path named = write({fog("voxel_fog", 3), fog("other", 4)}, "named.vdb"),
                   twice = write({fog("density", 5), fog("density", 6)}, "twice.vdb");
    for (const fs::path& file : {named, twice}) {
        const std::string message = messageOf([&] { readVolume(file); });
        EXPECT_NE(message.find("--grid"), std::string::npos) << message;
        EXPECT_NE(message.find(file == named ? "voxel_fog" : "density[1]"), std::string::npos)
            << message;
    }
    EXPECT_EQ(densityOf(readVolume(named, false, "voxel_fog")), 3);
    EXPECT_EQ(densityOf(readVolume(twice, false, "density[0]")), 5);
    EXPECT_EQ(densityOf(readVolume(twice, false, "density[1]")), 6);
    EXPECT_EQ(readVoxelTree(twice, {}, "density[1]").density(5, 5, 5), 6);
    EXPECT_NE(messageOf([&] { readVolume(named, false, "fog"); }).find("voxel_fog"),
              std::string::npos);
    EXPECT_NE(volumeIdentifier(twice, "density[0]"), volumeIdentifier(twice, "density[1]"));
}

// What resampling and sharpening leave behind is 0; what is more than 1e-6 of the largest is not.
TEST_F(ForeignVolume, TinyNegativeDensitiesAreZero)
{
    auto grid = fog("density", 2);
    grid->tree().setValue(Coord(4, 5, 6), -1e-9f);
    grid->tree().addTile(1, Coord(64, 0, 0), -1e-9f, true);
    const fs::path file = write({grid});
    const Volume volume = readVolume(file);
    EXPECT_EQ(volume.parts[0].density->tree().getValue(Coord(4, 5, 6)), 0);
    EXPECT_EQ(volume.parts[0].density->tree().getValue(Coord(64, 0, 0)), 0);
    const VoxelTree tree = readVoxelTree(file);
    EXPECT_EQ(tree.density(4, 5, 6), 0);
    EXPECT_EQ(tree.density(64, 0, 0), 0);
    EXPECT_EQ(tree.voxelCount(), 999u);
    for (const auto& warnings : {volume.warnings, tree.warnings()}) {
        ASSERT_EQ(warnings.size(), 1u);
        EXPECT_NE(warnings[0].find("-1e-09"), std::string::npos) << warnings[0];
        EXPECT_NE(warnings[0].find("a.vdb"), std::string::npos) << warnings[0];
    }
}

TEST_F(ForeignVolume, WhatIsNoDensityIsAnErrorInVoxelsAndTiles)
{
    for (const float bad : {-1e-5f, -1.0f, NAN, INFINITY, -INFINITY})
        for (const bool tile : {false, true}) {
            auto grid = fog("density", 2);
            if (tile) grid->tree().addTile(1, Coord(64, 0, 0), bad, true);
            else grid->tree().setValue(Coord(4, 5, 6), bad);
            const fs::path file = write({grid});
            const std::string voxel = tile ? "voxel (64, 0, 0)" : "voxel (4, 5, 6)";
            for (const std::string& message :
                 {messageOf([&] { readVolume(file); }), messageOf([&] { readVoxelTree(file); })}) {
                EXPECT_NE(message.find(voxel), std::string::npos) << message;
                if (bad == -1e-5f) {
                    EXPECT_NE(message.find("-1e-05"), std::string::npos) << message;
                }
            }
        }
}

TEST_F(ForeignVolume, VectorsThatAreNotFiniteAreZero)
{
    auto normal = Vec3SGrid::create(openvdb::Vec3s(0)), colour = normal->deepCopy();
    normal->setName("N");
    colour->setName("Cd");
    normal->tree().addTile(1, Coord(0), openvdb::Vec3s(0, NAN, 0), true);
    colour->tree().setValue(Coord(1, 2, 3), openvdb::Vec3s(INFINITY, 0, 0));
    const fs::path file = write({fog("density", 2), normal, colour});
    const VoxelTree tree = readVoxelTree(file);
    const int leaf = tree.leafAt(1, 2, 3);
    ASSERT_NE(leaf, VoxelTree::kEmpty);
    tree.contents(leaf, VoxelTree::offset(1, 2, 3), [](const VoxelContent& content) {
        EXPECT_FALSE(content.directed);
        EXPECT_EQ(content.colour, Vec3f(0.0f));
    });
}

// A kind that a later version may have is not taken for another.
TEST_F(ForeignVolume, AnUnknownKindIsAnError)
{
    auto grid = fog("density", 2);
    grid->insertMeta("volcomp_kind", openvdb::StringMetadata("granular"));
    EXPECT_NE(messageOf([&] { readVolume(write({grid})); }).find("granular"), std::string::npos);
}

TEST_F(ForeignVolume, APerspectiveIsAnError)
{
    auto grid = fog("density", 2);
    grid->setTransform(openvdb::math::Transform::createFrustumTransform(
        openvdb::BBoxd(openvdb::Vec3d(0.0), openvdb::Vec3d(9.0)), 0.5, 10, 1));
    EXPECT_NE(messageOf([&] { readVolume(write({grid})); }).find("linear"), std::string::npos);
}

/// The integral of the density.
double integral(const FloatGrid& grid)
{
    double sum = 0;
    for (auto v = grid.cbeginValueOn(); v; ++v) sum += double(*v) * double(v.getVoxelCount());
    return sum * std::abs(grid.transform().baseMap()->determinant());
}

struct Shape {
    const char* name;
    Mat4d matrix; ///< index to world
};

// Voxels of any affine transform. A Gaussian blob keeps its integral, (2 pi)^(3/2) s^3, and its
// optical depth through the middle along an axis, sqrt(2 pi) s, both times the largest density.
TEST_F(ForeignVolume, VoxelsOfAnyShapeBecomeCubes)
{
    const double c = std::cos(0.5), s = std::sin(0.5);
    const Shape shapes[] = {
        {"not cubic",
         {0.07033, 0., 0., 0., 0., 0.07033, 0., 0., 0., 0., 0.07164, 0., 1., 2., 3., 1.}},
        {"flat", {0.1, 0., 0., 0., 0., 0.05, 0., 0., 0., 0., 0.03, 0., 0., 0., 0., 1.}},
        {"rotated",
         {0.06 * c, 0.06 * s, 0., 0., -0.06 * s, 0.06 * c, 0., 0., 0., 0., 0.06, 0., 0., 1., 0.,
          1.}},
        {"sheared", {0.06, 0., 0., 0., 0.03, 0.06, 0., 0., 0., 0., 0.06, 0., 0., 0., 0., 1.}},
        {"mirrored", {-0.06, 0., 0., 0., 0., 0.06, 0., 0., 0., 0., 0.06, 0., 0., 0., 0., 1.}}};
    const double width = 0.3, largest = 2;
    for (const Shape& shape : shapes) {
        auto grid = FloatGrid::create(0.0f);
        grid->setName("density");
        grid->setTransform(openvdb::math::Transform::createLinearTransform(shape.matrix));
        const openvdb::Vec3d centre = grid->indexToWorld(openvdb::Vec3d(0.0));
        for (int x = -60; x <= 60; ++x)
            for (int y = -60; y <= 60; ++y)
                for (int z = -60; z <= 60; ++z) {
                    const double r2 =
                        (grid->indexToWorld(Coord(x, y, z)) - centre).lengthSqr() / (width * width);
                    if (r2 < 36)
                        grid->tree().setValue(Coord(x, y, z), float(largest * std::exp(-r2 / 2)));
                }
        const fs::path file = write({grid});
        const Volume volume = readVolume(file, true);
        const FloatGrid& cubes = *volume.parts[0].density;
        EXPECT_TRUE(hasCubicVoxels(cubes.transform())) << shape.name;
        const double h = cubes.voxelSize()[0];
        const openvdb::Vec3d edges = grid->voxelSize();
        EXPECT_NEAR(h, std::min({edges[0], edges[1], edges[2]}), 1e-12) << shape.name;
        // Interpolation widens a variance by at most a sixth of the longest edge's square.
        EXPECT_NEAR(integral(cubes), largest * std::pow(2 * M_PI, 1.5) * std::pow(width, 3),
                    0.005 * integral(cubes))
            << shape.name;
        const Coord middle = cubes.transform().worldToIndexCellCentered(centre);
        double depth = 0;
        for (int x = -1000; x <= 1000; ++x)
            depth += h * double(cubes.tree().getValue(middle.offsetBy(x, 0, 0)));
        const double expected = largest * std::sqrt(2 * M_PI) * width;
        EXPECT_NEAR(std::exp(-depth), std::exp(-expected), 0.02 * std::exp(-expected) * expected)
            << shape.name;
        ASSERT_EQ(volume.warnings.size(), 1u);
        EXPECT_NE(volume.warnings[0].find("resampled"), std::string::npos);
        EXPECT_EQ(readVoxelTree(file).warnings(), volume.warnings);
    }
}

// What lies on the new lattice keeps its values, directions and colours.
TEST_F(ForeignVolume, MirroredVoxelsKeepTheirValues)
{
    auto density = fog("density", 2);
    auto normal = Vec3SGrid::create(openvdb::Vec3s(0)), colour = normal->deepCopy();
    normal->setName("N");
    colour->setName("Cd");
    const auto mirrored = openvdb::math::Transform::createLinearTransform(
        Mat4d(-0.5, 0., 0., 0., 0., 0.5, 0., 0., 0., 0., 0.5, 0., 3., 0., 0., 1.));
    for (const openvdb::GridBase::Ptr& grid :
         {openvdb::GridBase::Ptr(density), openvdb::GridBase::Ptr(normal),
          openvdb::GridBase::Ptr(colour)})
        grid->setTransform(mirrored);
    for (auto v = density->beginValueOn(); v; ++v) {
        const Coord at = v.getCoord();
        v.setValue(float(1 + at.x()));
        normal->tree().setValue(at, openvdb::Vec3s(1, float(at.y()), 0).unit());
        colour->tree().setValue(at, openvdb::Vec3s(float(at.z()), 0.5f, 1));
    }
    const Volume volume = readVolume(write({density, normal, colour}));
    const VolumePart& part = volume.parts[0];
    EXPECT_EQ(part.density->activeVoxelCount(), 1000u);
    for (auto v = part.density->cbeginValueOn(); v; ++v) {
        const Coord at =
            Coord::round(mirrored->worldToIndex(part.density->indexToWorld(v.getCoord())));
        ASSERT_NEAR(*v, 1 + at.x(), 1e-5);
        ASSERT_LT((part.direction->tree().getValue(v.getCoord())
                   - openvdb::Vec3s(1, float(at.y()), 0).unit())
                      .length(),
                  1e-5);
        ASSERT_LT(
            (part.colour->tree().getValue(v.getCoord()) - openvdb::Vec3s(float(at.z()), 0.5f, 1))
                .length(),
            1e-4);
    }
}

// A constant density stays what it is, and one with voxels like hairs is refused at once.
TEST_F(ForeignVolume, ResampledVolumesBeyondReasonAreErrors)
{
    auto grid = fog("density", 2);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(
        Mat4d(1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 0.5, 0., 0., 0., 0., 1.)));
    EXPECT_FLOAT_EQ(densityOf(readVolume(write({grid}))), 2);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(
        Mat4d(1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1e-4, 0., 0., 0., 0., 1.)));
    EXPECT_NE(messageOf([&] { readVolume(write({grid})); }).find("2^31"), std::string::npos);
}

} // namespace
} // namespace volcomp
