#include "view.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "compose.h"
#include "error.h"
#include "placements_io.h"
#include "random.h"
#include "placement_sheet.h"
#include "terrain.h"

namespace volcomp {
namespace {

struct Start {
    Start() { openvdb::initialize(); }
} start;

Surface ground(double size, double height)
{
    TerrainSpec spec;
    spec.width = spec.depth = size;
    Mesh m = makeTerrain(spec);
    prepareMesh(m, 1, Vec3d(0, height, 0), Orientation::outward);
    return Surface(std::move(m), MapProjection{});
}

Camera above(double height)
{
    Camera c;
    c.eye = Vec3d(0, height, 0);
    c.target = Vec3d(0, 0, 0);
    c.up = Vec3d(0, 0, -1);
    return c;
}

Box dot(double voxel)
{
    Box box{"dot", 0, {}};
    VolumePart part;
    part.material = "fur";
    part.density = openvdb::FloatGrid::create(0.0f);
    part.density->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
    for (int y = 0; y < 20; ++y) part.density->tree().setValue(openvdb::Coord(0, y, 0), 10.0f);
    box.volume.parts.push_back(part);
    return box;
}

TEST(View, theVoxelFollowsTheNearestVisiblePoint)
{
    const Surface low = ground(4, 0), high = ground(1, 2);
    const Camera c = above(5);
    const double at0 = 2 * 5 * std::tan(c.field_of_view / 2) / 640, at2 = at0 * 3 / 5;
    EXPECT_NEAR(voxelFromCamera({&low}, c, 640, 480, 0.5), 0.5 * at0, 1e-9);
    EXPECT_NEAR(voxelFromCamera({&low, &high}, c, 640, 480, 0.5), 0.5 * at2, 1e-9);
    EXPECT_NEAR(voxelFromCamera({&low}, c, 1280, 480, 2), at0, 1e-9);
    // What another surface hides does not count: from below the lower one hides the upper one.
    Camera below = above(-3);
    below.target = Vec3d(0, 10, 0);
    EXPECT_NEAR(voxelFromCamera({&low, &high}, below, 640, 480, 0.5), 0.5 * at0 * 3 / 5, 1e-9);
    Camera away = above(5);
    away.target = Vec3d(0, 10, 0);
    EXPECT_EQ(voxelFromCamera({&low, &high}, away, 640, 480, 0.5), 0);
}

TEST(View, boxesOutOfThePictureAreCulledUnlessTheyThrowAShadowIntoIt)
{
    const Camera c = above(5); // sees about x, z within 1.8
    std::vector<Placement> p(4);
    p[1].position = Vec3d(10, 0, 0); // outside
    p[2].position = Vec3d(0, 20, 0); // behind the eye, but between the light and the picture
    p[3].position = Vec3d(1.7, 0, 0);
    Light sun;
    sun.direction = Vec3d(0, -1, 0);
    const auto kept = cullPlacements(p, {dot(0.01)}, c, 640, 480, {sun});
    ASSERT_EQ(kept.size(), 3u);
    EXPECT_EQ(kept[1].position[1], 20);
    sun.direction = Vec3d(-1, 0, 0);
    EXPECT_EQ(cullPlacements(p, {dot(0.01)}, c, 640, 480, {sun}).size(), 3u); // now the one at x = 10, and not the one above
    EXPECT_EQ(cullPlacements(p, {dot(0.01)}, c, 640, 480, {}).size(), 2u);
    Light lamp;
    lamp.kind = LightKind::point;
    lamp.position = Vec3d(12, 0, 0);
    EXPECT_EQ(cullPlacements(p, {dot(0.01)}, c, 640, 480, {lamp}).size(), 3u);
}

TEST(Terrain, heightsFollowTheMap)
{
    const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "volcomp_terrain.pgm";
    std::ofstream(file) << "P2\n2 1\n255\n0 255\n";
    TerrainSpec spec;
    spec.width = 4;
    spec.depth = 2;
    spec.height_map = file;
    spec.low = 1;
    spec.high = 3;
    spec.cells = 64;
    Mesh m = makeTerrain(spec);
    prepareMesh(m, 1, Vec3d(0.0), Orientation::outward);
    EXPECT_EQ(m.triangles.size(), 64u * 32 * 2);
    for (const Vec3d& p : m.points) EXPECT_NEAR(p[1], 1 + 2 * std::clamp((p[0] + 1) / 2, 0.0, 1.0), 1e-5);
    for (const Vec3f& n : m.normals) EXPECT_GT(n[1], 0.6f);
    spec.width = 0;
    EXPECT_THROW(makeTerrain(spec), Error);
}

TEST(Compose, theEstimateIsNearTheTruth)
{
    const Surface s = ground(2, 0);
    Layer l;
    l.name = "dots";
    l.density = 4000;
    l.tilt = {0, 1};
    const auto placements = scatter(s, l, {}, 0);
    ComposeParams params;
    params.voxel = 0.01;
    const std::vector<Box> boxes{dot(0.01)};
    const ComposeEstimate e = estimateCompose(boxes, placements, {}, params);
    const PackedVolume v = compose(boxes, placements, params);
    EXPECT_NEAR(e.voxels / double(v.voxels()), 1, 0.1); // 256 of some 2,500 tiles
    const double least = double(v.voxels()) * sizeof(float) + double(v.parts[0].blocks.size()) * sizeof(PackedBlock);
    EXPECT_GT(e.bytes, 0.9 * least);
    EXPECT_LT(e.bytes, 3 * least);
    params.voxel = 1e-7; // must not take long, nor the memory
    EXPECT_GT(estimateCompose(boxes, placements, {}, params).bytes, 1e15);
}

TEST(PlacementsIo, jsonAndPlyHoldWhatIsPlaced)
{
    std::vector<Placement> p(3);
    p[1].position = Vec3d(1.5, -2, 1e6);
    p[1].scale = 0.5f;
    p[2].layer = 1;
    const std::filesystem::path dir = ::testing::TempDir();
    writePlacements(dir / "volcomp_p.json", p, {"a \"b\""}, {"x", "y"});
    std::ifstream stream(dir / "volcomp_p.json");
    const auto json = nlohmann::json::parse(stream);
    ASSERT_EQ(json.size(), 3u);
    EXPECT_EQ(json[1]["position"][2], 1e6);
    EXPECT_EQ(json[1]["scale"], 0.5);
    EXPECT_EQ(json[0]["box"], "a \"b\"");
    EXPECT_EQ(json[2]["layer"], "y");
    writePlacements(dir / "volcomp_p.ply", p, {"a"}, {"x", "y"});
    EXPECT_THROW(writePlacements(dir / "volcomp_p.txt", p, {"a"}, {"x", "y"}), Error);
    std::ifstream ply(dir / "volcomp_p.ply", std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(ply)), {});
    EXPECT_EQ(bytes.size() - (bytes.find("end_header\n") + 11), 3u * 51);
}

TEST(Sheet, panelsShowThePlacementsAndEachMap)
{
    const Surface s = ground(4, 0);
    Layer l;
    l.name = "grass";
    MapSpec half, green;
    half.constant = Vec3d(0.5);
    green.constant = Vec3d(0, 1, 0);
    l.where = {half};
    l.colour = {green};
    std::vector<Placement> p(1);
    p[0].position = Vec3d(0, 0, 0);
    const Image image = placementSheet({&s}, {{&s, &l}}, p, above(5), 64, 48);
    EXPECT_EQ(image.width, 3 * 64);
    EXPECT_GT(image.pixel(32, 24)[0], 0.5f);             // the first layer's dot is red
    EXPECT_NEAR(image.pixel(32, 36)[0], 0.3, 0.05);      // the bare surface
    EXPECT_NEAR(image.pixel(64 + 32, 24)[0], 0.5, 0.05); // the map
    EXPECT_GT(image.pixel(128 + 32, 24)[1], 0.9f);
    EXPECT_EQ(image.pixel(128 + 32, 24)[0], 0);
    int red = 0, pale = 0; // the layer's name in its colour, and the map's
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 64; ++x) {
            const float *a = image.pixel(x, y), *b = image.pixel(64 + x, y);
            red += a[0] > 0.6f && a[1] < 0.3f;
            pale += b[0] > 0.75f && b[1] > 0.75f;
        }
    EXPECT_GT(red, 20);
    EXPECT_GT(pale, 20);
}

} // namespace
} // namespace volcomp
