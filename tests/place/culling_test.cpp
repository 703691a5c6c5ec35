#include "volcomp/place/culling.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "volcomp/compose/compose.h"
#include "volcomp/base/error.h"
#include "volcomp/place/placements_io.h"
#include "volcomp/base/random.h"
#include "volcomp/inspect/placement_sheet.h"
#include "volcomp/surface/terrain.h"
#include "tests/support/volumes.h"

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
    VolumePart part = emptyPart(voxel);
    part.material = "fur";
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
    // A needle has next to no area, but its tip counts.
    Mesh needle;
    needle.points = {{0, 4, 0}, {1e-7, 0, 0}, {0, 0, 1e-7}};
    needle.triangles = {{0, 1, 2}};
    prepareMesh(needle, 1, Vec3d(0.0), Orientation::file);
    const Surface tip(std::move(needle), MapProjection{});
    EXPECT_NEAR(voxelFromCamera({&low, &tip}, c, 640, 480, 0.5), 0.5 * at0 / 5, 1e-9);
}

// A ball that touches one of the picture's four planes is in view, one just beyond is not; nor is
// one behind the eye.
TEST(View, ABallIsInViewAsFarAsItReaches)
{
    const double radius = 0.3;
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
        Camera c;
        c.eye = Vec3d(1, 2, 3);
        c.target = Vec3d(2, 2.5, 1);
        c.projection = projection;
        const Vec3d forward = (c.target - c.eye).unit(), right = forward.cross(c.up).unit(),
                    up = right.cross(forward);
        for (const double side : {-1.0, 1.0})
            for (const bool upright : {false, true}) {
                const double aspect = upright ? 480.0 / 640 : 1,
                             slope = std::tan(c.field_of_view / 2) * aspect;
                const Vec3d across = side * (upright ? up : right);
                const bool fan = projection == Projection::perspective;
                const Vec3d border = c.eye + 3.0 * forward
                    + across * (fan ? 3 * slope : 0.5 * c.width * aspect),
                            outwards = fan ? (across - slope * forward).unit() : across;
                EXPECT_TRUE(mayBeInView(c, 640, 480, border + 0.99 * radius * outwards, radius))
                    << fan << side << upright;
                EXPECT_FALSE(mayBeInView(c, 640, 480, border + 1.01 * radius * outwards, radius))
                    << fan << side << upright;
            }
        EXPECT_TRUE(mayBeInView(c, 640, 480, c.eye - 0.99 * radius * forward, radius));
        EXPECT_FALSE(mayBeInView(c, 640, 480, c.eye - 1.01 * radius * forward, radius));
    }
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
    EXPECT_EQ(cullPlacements(p, {dot(0.01)}, c, 640, 480, {sun}).size(),
              3u); // now the one at x = 10, and not the one above
    EXPECT_EQ(cullPlacements(p, {dot(0.01)}, c, 640, 480, {}).size(), 2u);
    Light lamp;
    lamp.kind = LightKind::point;
    lamp.position = Vec3d(12, 0, 0);
    EXPECT_EQ(cullPlacements(p, {dot(0.01)}, c, 640, 480, {lamp}).size(), 3u);
    lamp.position = Vec3d(10, 0.1, 0); // in the box
    EXPECT_EQ(cullPlacements(p, {dot(0.01)}, c, 640, 480, {lamp}).size(), 3u);
}

TEST(View, boxesAreCulledAsLargeAsTheyStand)
{
    const Camera c = above(5);
    const Box big = dot(0.05);
    Box none = dot(0.05);
    none.volume.parts[0].density = openvdb::FloatGrid::create(0.0f);
    Light sun;
    sun.direction = Vec3d(-1, 0, 0);
    const auto kept = [&](const Placement& p, const std::vector<Light>& lights) {
        const std::vector<Placement> placements{Placement{}, p}; // one in the middle of the picture
        return cullPlacements(placements, {big, none}, c, 640, 480, lights).size() == 2;
    };
    Placement p; // its box reaches 1 upwards; the picture's side is 1.82 from the middle
    p.position = Vec3d(2.7, 0, 0);
    EXPECT_FALSE(kept(p, {}));
    p.y_axis = Vec3f(-1, 0, 0);
    p.x_axis = Vec3f(0, 1, 0);
    EXPECT_TRUE(kept(p, {}));
    p.position = Vec3d(4.5, 0, 0);
    EXPECT_FALSE(kept(p, {}));
    p.scale = 4;
    EXPECT_TRUE(kept(p, {}));
    // A shadow goes one way, and is as wide as its box.
    p = Placement{};
    p.position = Vec3d(9, 0, 0);
    EXPECT_TRUE(kept(p, {sun}));
    p.position = Vec3d(-9, 0, 0);
    EXPECT_FALSE(kept(p, {sun}));
    p.position = Vec3d(9, 0, 0.9); // both balls have a radius of 0.5
    EXPECT_TRUE(kept(p, {sun}));
    p.position = Vec3d(9, 0, 1.2);
    EXPECT_FALSE(kept(p, {sun}));
    p.position = Vec3d(9, 0, 0);
    p.box = 1; // of no voxels
    EXPECT_FALSE(kept(p, {sun}));
    Placement large;
    large.scale = 6;
    sun.direction = Vec3d(0, 1, 0);
    EXPECT_EQ(cullPlacements({large, p}, {big, none}, c, 640, 480, {sun}).size(), 1u);
}

TEST(Terrain, heightsFollowTheMap)
{
    const std::filesystem::path file =
        std::filesystem::path(::testing::TempDir()) / "volcomp_terrain.pgm";
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
    for (const Vec3d& p : m.points)
        EXPECT_NEAR(p[1], 1 + 2 * std::clamp((p[0] + 1) / 2, 0.0, 1.0), 1e-5);
    for (const Vec3f& n : m.normals) EXPECT_GT(n[1], 0.6f);
    for (std::size_t t = 0; t < m.triangles.size(); ++t)
        for (int k = 0; k < 3; ++k) {
            const Vec3d& p = m.points[m.triangles[t][k]];
            EXPECT_NEAR(m.uv[t][k][0], 0.5 + p[0] / 4, 1e-6);
            EXPECT_NEAR(m.uv[t][k][1], 0.5 - p[2] / 2, 1e-6);
        }
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
    const double least =
        double(v.voxels()) * sizeof(float) + double(v.parts[0].blocks.size()) * sizeof(PackedBlock);
    EXPECT_GT(e.bytes, 0.9 * least);
    EXPECT_LT(e.bytes, 3 * least);
    params.voxel = 1e-7; // must not take long, nor the memory
    const ComposeEstimate fine = estimateCompose(boxes, placements, {}, params);
    EXPECT_GT(fine.bytes, 1e15);
    params.voxel = 2e-7;
    EXPECT_NEAR(fine.voxels / estimateCompose(boxes, placements, {}, params).voxels, 8, 1e-9);
}

TEST(PlacementsIo, jsonAndPlyHoldWhatIsPlaced)
{
    std::vector<Placement> p(3);
    p[1].position = Vec3d(1.5, -2, 1e6);
    p[1].scale = 0.5f;
    p[1].x_axis = Vec3f(0, 0, -1);
    p[1].z_axis = Vec3f(1, 0, 0);
    p[1].uv = {0.25, 0.75};
    p[1].tint = Vec3f(1, 0.5f, 0.2f);
    p[2].layer = 1;
    const std::filesystem::path dir = ::testing::TempDir();
    writePlacements(dir / "volcomp_p.json", p, {"a \"b\""}, {"x", "y"});
    std::ifstream stream(dir / "volcomp_p.json");
    const auto json = nlohmann::json::parse(stream);
    ASSERT_EQ(json.size(), 3u);
    EXPECT_EQ(json[1]["position"][2], 1e6);
    EXPECT_EQ(json[1]["scale"], 0.5);
    EXPECT_EQ(json[1]["x_axis"], (std::vector<double>{0, 0, -1}));
    EXPECT_EQ(json[1]["y_axis"], (std::vector<double>{0, 1, 0}));
    EXPECT_EQ(json[1]["z_axis"], (std::vector<double>{1, 0, 0}));
    EXPECT_EQ(json[1]["uv"], (std::vector<double>{0.25, 0.75}));
    EXPECT_EQ(json[0]["box"], "a \"b\"");
    EXPECT_EQ(json[2]["layer"], "y");
    writePlacements(dir / "volcomp_p.ply", p, {"a"}, {"x", "y"});
    EXPECT_THROW(writePlacements(dir / "volcomp_p.txt", p, {"a"}, {"x", "y"}), Error);
    std::ifstream ply(dir / "volcomp_p.ply", std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(ply)), {});
    const char* record = bytes.data() + bytes.find("end_header\n")
        + 11; // packed: position, normal, colour, scale, box, layer
    ASSERT_EQ(bytes.data() + bytes.size() - record, 3 * 51);
    const auto read = [&](int placement, int offset, auto value) {
        std::memcpy(&value, record + 51 * placement + offset, sizeof value);
        return value;
    };
    EXPECT_EQ(read(1, 0, 0.0), 1.5);
    EXPECT_EQ(read(1, 16, 0.0), 1e6);
    EXPECT_EQ(Vec3f(read(1, 24, 0.0f), read(1, 28, 0.0f), read(1, 32, 0.0f)), Vec3f(0, 1, 0));
    for (int c = 0; c < 3; ++c)
        EXPECT_EQ(int(read(1, 36 + c, std::uint8_t())), c == 0 ? 255 : c == 1 ? 128 : 51);
    EXPECT_EQ(read(1, 39, 0.0f), 0.5f);
    EXPECT_EQ(read(2, 43, 0), 0);
    EXPECT_EQ(read(2, 47, 0), 1);
}

TEST(Sheet, panelsShowThePlacementsAndEachMap)
{
    const Surface s = ground(4, 0);
    Layer l;
    l.name = "grass";
    MapFactor half, green;
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

TEST(Sheet, panelsShowWhatIsInFront)
{
    const Surface low = ground(4, 0), high = ground(1, 2);
    Layer l;
    l.name = "a";
    MapFactor white;
    white.constant = Vec3d(1);
    l.where = {white};
    std::vector<Placement> p(3);
    p[0].position = Vec3d(0, 0, 0);       // hidden by the upper surface
    p[1].position = Vec3d(1.2, 0, -0.6);  // to the right and, the camera's up being -z, above
    p[2].position = Vec3d(1.2, 10, -0.6); // behind the eye
    for (const auto& surfaces :
         {std::vector<const Surface*>{&low, &high}, std::vector<const Surface*>{&high, &low}}) {
        const Image image = placementSheet(surfaces, {{&low, &l}}, p, above(5), 64, 48);
        ASSERT_EQ(image.width, 2 * 64);
        const auto isRed = [&](int x, int y) {
            return image.pixel(x, y)[0] > 0.6f && image.pixel(x, y)[1] < 0.3f;
        };
        const double per_metre = 64 / (2 * 5 * std::tan(above(5).field_of_view / 2));
        const int x = int(32 + 1.2 * per_metre), y = int(24 - 0.6 * per_metre);
        EXPECT_TRUE(isRed(x, y));
        int red = 0; // below the layer's name
        for (int j = 17; j < 48; ++j)
            for (int i = 0; i < 64; ++i) red += isRed(i, j);
        EXPECT_EQ(red, 0);
        EXPECT_NEAR(image.pixel(32, 24)[0], 0.3, 0.02);
        // The layer's own surface alone shows the map; what stands before it is dark.
        EXPECT_LT(image.pixel(64 + 32, 24)[0], 0.1f);
        EXPECT_GT(image.pixel(64 + x, 40)[0], 0.8f);
    }
}

} // namespace
} // namespace volcomp
