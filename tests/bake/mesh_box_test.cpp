// SPDX-License-Identifier: Apache-2.0
// Boxes of triangles: areas and volumes against closed forms, and against strands that are baked.
#include <cmath>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/growth_rules.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "volcomp/bake/bake.h"
#include "volcomp/bake/leaf_filler.h"
#include "volcomp/bake/mesh_model.h"
#include "volcomp/bake/rasterise.h"
#include "volcomp/bake/solid_fill.h"

namespace volcomp {
namespace {

const std::vector<Material> kMaterials = [] {
    Material leaf, bark;
    leaf.name = "leaf";
    bark.name = "bark";
    leaf.kind = bark.kind = MaterialKind::surface;
    return std::vector<Material>{leaf, bark};
}();

class MeshBoxTest : public testing::Test {
protected:
    std::filesystem::path write(const std::string& name, const std::string& content) const
    {
        const std::filesystem::path file = m_folder.path() / name;
        std::ofstream(file, std::ios::binary) << content;
        return file;
    }
    GrowthRule ruleOf(const std::string& obj, double voxel) const
    {
        GrowthRule rule = growthRule({}, "box", "leaf");
        rule.variants = 1;
        rule.voxel = voxel;
        rule.mesh.file = write("mesh.obj", obj);
        return rule;
    }

private:
    TemporaryFolder m_folder;
};

/// A turned rectangle, width along one side and length along the other.
std::string rectangle(double width, double length)
{
    const Vec3d a = Vec3d(0.6, 0.64, 0.48) * length, b = Vec3d(-0.8, 0.48, 0.36) * width;
    std::string obj = "v 0.013 0.017 0.011\n";
    const Vec3d o(0.013, 0.017, 0.011);
    for (const Vec3d& p : {o + a, o + a + b, o + b})
        obj += fmt::format("v {} {} {}\n", p[0], p[1], p[2]);
    return obj + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
}

/// A prism around a line of this length, with or without its ends.
std::string prism(double radius, double length, bool closed)
{
    constexpr int kSides = 24;
    const Vec3d axis(0.48, 0.6, 0.64), x(0.8, -0.6, 0), y = axis.cross(x);
    // The polygon of the circle's area.
    const double r = radius * std::sqrt(kPi / (0.5 * kSides * std::sin(2 * kPi / kSides)));
    std::string obj;
    for (int i = 0; i < kSides; ++i)
        for (const double along : {0.0, length}) {
            const double angle = 2 * kPi * i / kSides;
            const Vec3d p = Vec3d(0.003, 0.007, 0.005) + axis * along
                + (x * std::cos(angle) + y * std::sin(angle)) * r;
            obj += fmt::format("v {} {} {}\n", p[0], p[1], p[2]);
        }
    std::string low = "f", high = "f";
    for (int i = 0; i < kSides; ++i) {
        const int a = 2 * i + 1, b = 2 * ((i + 1) % kSides) + 1;
        obj += fmt::format("f {} {} {} {}\n", a, b, b + 1, a + 1);
        low += fmt::format(" {}", 2 * (kSides - 1 - i) + 1);
        high += fmt::format(" {}", a + 1);
    }
    return closed ? obj + low + "\n" + high + "\n" : obj;
}

/// The sum of what the voxels cover, in squares of a voxel's side.
double covered(const VolumePart& part)
{
    const double h = part.density->voxelSize()[0];
    double sum = 0;
    for (auto v = part.density->cbeginValueOn(); v; ++v) sum += 1 - std::exp(-double(*v) * h);
    return sum;
}

double depth(const VolumePart& part)
{
    const double h = part.density->voxelSize()[0];
    double sum = 0;
    for (auto v = part.density->cbeginValueOn(); v; ++v) sum += double(*v) * h;
    return sum;
}

TEST_F(MeshBoxTest, ASheetCoversHalfItsAreaTimesTheFactorOfItsWidth)
{
    const double h = 0.01;
    for (const double width : {0.3, 0.9}) { // thin enough that no voxel is full
        const Box box = bake(ruleOf(rectangle(width * h, 0.5), h), kMaterials, 0);
        ASSERT_EQ(box.volume.parts.size(), 1u);
        const VolumePart& part = box.volume.parts[0];
        const double expected = 0.5 * width * h * 0.5 / (h * h) * flatFactor(width);
        EXPECT_NEAR(covered(part), expected, 1e-3 * expected) << width;
        // Along the normal of the plane.
        const Vec3d n = Vec3d(0.6, 0.64, 0.48).cross(Vec3d(-0.8, 0.48, 0.36));
        for (auto v = part.direction->cbeginValueOn(); v; ++v)
            EXPECT_NEAR(std::abs(Vec3d(*v).dot(n)), 1, 1e-3);
    }
}

TEST_F(MeshBoxTest, APictureCutsOutItsPartOfTheArea)
{
    // Dark where u < 1/4: a quarter of the rectangle's length is left out.
    std::string picture = "P5 16 1 255\n";
    for (int i = 0; i < 16; ++i) picture += static_cast<char>(i < 4 ? 0 : 255);
    const double h = 0.01;
    GrowthRule rule = ruleOf(rectangle(0.3 * h, 0.5), h);
    const double whole = covered(bake(rule, kMaterials, 0).volume.parts[0]);
    MeshMatch match;
    match.material = "leaf";
    match.alpha = write("alpha.pgm", picture);
    rule.mesh.materials = {match};
    EXPECT_NEAR(covered(bake(rule, kMaterials, 0).volume.parts[0]), 0.75 * whole, 2e-3 * whole);
    rule.mesh.materials[0].cutoff = 0;
    EXPECT_NEAR(covered(bake(rule, kMaterials, 0).volume.parts[0]), whole, 1e-6 * whole);
}

TEST_F(MeshBoxTest, ATextureGivesTheColourOfItsPlace)
{
    const std::string texture = "P6 2 1 255\n" + std::string("\xff\x00\x00\x00\x00\xff", 6);
    const double h = 0.01;
    GrowthRule rule = ruleOf(rectangle(0.1, 0.5), h);
    MeshMatch match;
    match.material = "leaf";
    match.colour = Vec3d(0.5, 1, 0.25);
    match.texture = write("texture.ppm", texture);
    rule.mesh.materials = {match};
    const Box box = bake(rule, kMaterials, 0);
    const VolumePart& part = box.volume.parts[0];
    ASSERT_TRUE(part.colour);
    for (auto v = part.colour->cbeginValueOn(); v; ++v) {
        const Vec3d p = part.density->transform().indexToWorld(v.getCoord());
        const double u = (p - Vec3d(0.013, 0.017, 0.011)).dot(Vec3d(0.6, 0.64, 0.48)) / 0.5;
        if (std::abs(u - 0.5) < 0.05) continue; // a voxel at the border has both
        EXPECT_NEAR((*v)[0], u < 0.5 ? 0.5 : 0, 1e-5) << u;
        EXPECT_NEAR((*v)[2], u < 0.5 ? 0 : 0.25, 1e-5) << u;
    }
}

TEST_F(MeshBoxTest, BodiesAreFullInsideAndHaveTheirVolume)
{
    const double h = 0.01, radius = 0.08, length = 0.4;
    for (const bool closed : {true, false}) { // the ends of a tube are closed for it
        const Box box = bake(ruleOf(prism(radius, length, closed), h), kMaterials, 0);
        const VolumePart& part = box.volume.parts[0];
        const Vec3d axis(0.48, 0.6, 0.64), root(0.003, 0.007, 0.005);
        int inside = 0;
        for (auto v = part.density->cbeginValueOn(); v; ++v) {
            const Vec3d p = part.density->transform().indexToWorld(v.getCoord()) - root;
            const double along = p.dot(axis), out = (p - axis * along).length();
            if (along < 2 * h || along > length - 2 * h || out > radius - 2 * h) continue;
            ++inside;
            EXPECT_NEAR(*v * h, -std::log(0.01), 1e-3);
        }
        const double expected =
            kPi * (radius - 2 * h) * (radius - 2 * h) * (length - 4 * h) / (h * h * h);
        EXPECT_NEAR(inside, expected, 0.03 * expected) << closed;
    }
}

TEST_F(MeshBoxTest, FillingHasTheVolumeOfOverlappingBodiesOnce)
{
    // Two boxes of 4 x 3 x 2 voxels that share 1 x 3 x 2.
    std::vector<std::array<Vec3d, 3>> triangles;
    for (const double x : {0.3, 3.3}) {
        const Vec3d low(x, 0.2, 0.7), size(4, 3, 2);
        const auto corner = [&](int i) {
            return low + Vec3d(i & 1 ? size[0] : 0, i & 2 ? size[1] : 0, i & 4 ? size[2] : 0);
        };
        for (const auto& [a, b, c, d] : {std::array{0, 2, 3, 1},
                                         {4, 5, 7, 6},
                                         {0, 1, 5, 4},
                                         {2, 6, 7, 3},
                                         {0, 4, 6, 2},
                                         {1, 3, 7, 5}}) {
            triangles.push_back({corner(a), corner(b), corner(c)});
            triangles.push_back({corner(a), corner(c), corner(d)});
        }
    }
    const auto grid = fillSolids(triangles);
    double volume = 0;
    for (auto v = grid->cbeginValueOn(); v; ++v) {
        volume += double(*v);
        EXPECT_LE(*v, 1 + 1e-5f);
    }
    EXPECT_NEAR(volume, 7 * 3 * 2, 0.02 * 42);
    EXPECT_NEAR(grid->tree().getValue({3, 1, 1}), 1, 1e-5);
}

/// A rod of triangles blocks what the same rod blocks as a strand, thin, about a voxel thick, and
/// thick.
TEST_F(MeshBoxTest, ARodIsBakedAsAStrandIs)
{
    const double h = 0.01, length = 0.5;
    for (const double radius : {0.1, 0.3, 0.45, 0.8, 1.5, 3.0}) {
        Segment s;
        s.a = Vec3f(0.003f, 0.007f, 0.005f);
        s.b = s.a + Vec3f(0.48f, 0.6f, 0.64f) * float(length);
        s.size_a = s.size_b = float(radius * h);
        const VolumePart strand = rasterise({s}, "leaf", MaterialKind::surface, h);
        const Box box = bake(ruleOf(prism(radius * h, length, true), h), kMaterials, 0);
        const double ratio = covered(box.volume.parts[0]) / covered(strand),
                     depths = depth(box.volume.parts[0]) / depth(strand);
        EXPECT_NEAR(ratio, 1, 0.12) << radius;
        EXPECT_NEAR(depths, 1, 0.15) << radius;
    }
}

TEST_F(MeshBoxTest, APartGoesToTheFirstMaterialThatMeansIt)
{
    const std::string two = "o Trunk\n" + prism(0.03, 0.2, true) + "o Leaves.001\n"
        + "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 49 50 51\n";
    GrowthRule rule = ruleOf(two, 0.01);
    MeshMatch trunk, others;
    trunk.name = "Tr?nk";
    trunk.material = "bark";
    others.name = "Leaves*";
    others.material = "leaf";
    rule.mesh.materials = {trunk, others};
    const MeshModel model = loadMeshModel(rule, kMaterials);
    ASSERT_EQ(model.parts.size(), 2u);
    EXPECT_EQ(model.parts[0].material, "leaf");
    EXPECT_EQ(model.parts[0].triangles.size(), 1u);
    EXPECT_FALSE(model.parts[0].sheets[0].solid);
    EXPECT_TRUE(model.parts[1].sheets[0].solid);
    rule.mesh.materials[0].name = "Branch*";
    const std::string message = messageOf([&] { loadMeshModel(rule, kMaterials); });
    EXPECT_NE(message.find("'Branch*'"), message.npos) << message;
    EXPECT_NE(message.find("'Trunk'"), message.npos) << message;
}

TEST(FillSolids, ABodyThatIsTooLargeForItsVoxelsIsRefused)
{
    const double a = 480; // 480^3 voxels are more than 1e8
    const std::vector<std::array<Vec3d, 3>> sides = {
        {Vec3d(0, 0, 0), Vec3d(0, 0, a), Vec3d(0, a, a)},
        {Vec3d(0, 0, 0), Vec3d(0, a, a), Vec3d(0, a, 0)},
        {Vec3d(a, 0, 0), Vec3d(a, a, a), Vec3d(a, 0, a)},
        {Vec3d(a, 0, 0), Vec3d(a, a, 0), Vec3d(a, a, a)}}; // the others lie along the lines
    const std::string message = messageOf([&] { fillSolids(sides); });
    EXPECT_NE(message.find("a larger voxel"), message.npos) << message;
}

TEST_F(MeshBoxTest, ScaleUpAndMoveArePartOfTheBox)
{
    GrowthRule rule = ruleOf("v 0 0 0\nv 100 0 0\nv 0 0 200\nf 1 2 3\n", 0.05);
    rule.mesh.axes.scale = 0.01;
    rule.mesh.axes.up = UpAxis::z;
    rule.mesh.move = Vec3d(0, 0.5, 0);
    const MeshModel model = loadMeshModel(rule, kMaterials);
    const auto& t = model.parts[0].triangles[0].corners;
    double top = 0, right = 0;
    for (const Vec3d& p : t) top = std::max(top, p[1]), right = std::max(right, p[0]);
    EXPECT_NEAR(top, 2.5, 1e-12);
    EXPECT_NEAR(right, 1, 1e-12);
}

TEST_F(MeshBoxTest, IsTheSameForAnyNumberOfThreads)
{
    const GrowthRule rule = ruleOf(prism(0.03, 0.4, false) + prism(0.002, 0.3, true), 0.01);
    const auto bytes = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        const Box box = bake(rule, kMaterials, 0);
        std::vector<float> all;
        const VolumePart& part = box.volume.parts[0];
        for (auto v = part.density->cbeginValueOn(); v; ++v) all.push_back(*v);
        for (auto v = part.direction->cbeginValueOn(); v; ++v)
            for (int k = 0; k < 3; ++k) all.push_back((*v)[k]);
        return all;
    };
    EXPECT_EQ(bytes(1), bytes(4));
}

TEST(Matches, StarsAndQuestionMarks)
{
    EXPECT_TRUE(matches("*", ""));
    EXPECT_TRUE(matches("a*b*c", "a--b-b--c"));
    EXPECT_FALSE(matches("a*b*c", "a--b-b--"));
    EXPECT_TRUE(matches("l?af", "leaf"));
    EXPECT_FALSE(matches("l?af", "laf"));
    EXPECT_FALSE(matches("", "a"));
}

TEST(WidthOf, IsTheNarrowSideOfARectangle)
{
    EXPECT_NEAR(widthOf(6, 10), 2, 1e-12);
    EXPECT_NEAR(widthOf(kPi, 2 * kPi), std::sqrt(kPi), 1e-12); // a disc
}

} // namespace
} // namespace volcomp
