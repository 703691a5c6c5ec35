// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/place_scene.h"

#include <filesystem>
#include <fstream>
#include <memory>

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include "volcomp/bake/bake.h"
#include "volcomp/base/error.h"
#include "volcomp/compose/compose.h"
#include "volcomp/place/scatter.h"

namespace volcomp {
namespace {

struct Start {
    Start() { openvdb::initialize(); }
} start;

constexpr const char* kScene = R"(
[material.fur]
kind = "fibre"

[material.leather]
kind = "surface"

[box.unused]
material = "fur"
level = [{length = 0.1, radius = 0.01}]

[box.tuft]
material = "fur"
variants = 2
voxel = 0.01
level = [{length = 0.2, radius = 0.004, count = 8, spread = 0.03}]

[box.blade]
material = "fur"
variants = 1
voxel = 0.01
level = [{length = 0.1, radius = 0.006, outline = "blade"}]

[surface.ground]
ground = [1, 1]
skin = "leather"
skin_as = "voxels"

[surface.hill]
ground = [0.5, 0.5]
translate = [0, 0.3, 0]

[[layer]]
name = "fur"
box = "tuft"
surface = "ground"
density = 60
tint = "voxel"
colour = [{constant = [0.5, 0.25, 1]}]

[[layer]]
name = "grass"
box = "blade"
surface = "hill"
density = 100

[compose]
voxel = 0.02

[camera]
eye = [0, 1.5, 2]

[render]
width = 64
height = 48
)";

Scene readText(const std::string& text)
{
    const std::filesystem::path file = std::filesystem::path(testing::TempDir())
        / (std::string("place_scene_")
           + testing::UnitTest::GetInstance()->current_test_info()->name() + ".toml");
    std::ofstream(file) << text;
    const Scene scene = readScene(file);
    std::filesystem::remove(file);
    return scene;
}

std::vector<Box> bakeAll(const Scene& scene)
{
    std::vector<Box> boxes;
    for (const BoxKind& kind : usedBoxes(scene))
        for (const GrowthRule& rule : scene.boxes)
            for (int variant = 0; rule.name == kind.name && variant < rule.variants; ++variant)
                boxes.push_back(bake(rule, scene.materials, variant));
    return boxes;
}

void expectSameVolume(const PackedVolume& packed, const PackedVolume& other)
{
    const Volume a = unpack(packed), b = unpack(other);
    ASSERT_EQ(a.parts.size(), b.parts.size());
    for (std::size_t i = 0; i < a.parts.size(); ++i) {
        const VolumePart &p = a.parts[i], &q = b.parts[i];
        EXPECT_EQ(p.material, q.material);
        ASSERT_GT(p.density->activeVoxelCount(), 100u);
        ASSERT_EQ(p.density->activeVoxelCount(), q.density->activeVoxelCount());
        ASSERT_EQ(bool(p.colour), bool(q.colour));
        for (auto it = p.density->cbeginValueOn(); it; ++it) {
            ASSERT_EQ(*it, q.density->tree().getValue(it.getCoord()));
            if (p.colour) {
                ASSERT_EQ(p.colour->tree().getValue(it.getCoord()),
                          q.colour->tree().getValue(it.getCoord()));
            }
        }
    }
}

PackedVolume composed(const Scene& scene, const PlacedScene& placed)
{
    return compose(bakeAll(scene), placed, scene.compose);
}

TEST(PlaceScene, holdsWhatTheSceneSays)
{
    const Scene scene = readText(kScene);
    const PlacedScene placed = place(scene);
    ASSERT_EQ(placed.kinds.size(), 2u); // in the order of the scene's boxes, which is by name
    EXPECT_EQ(boxNames(placed.kinds), (std::vector<std::string>{"blade_1", "tuft_1", "tuft_2"}));
    ASSERT_EQ(placed.surfaces.size(), 2u);
    EXPECT_EQ(placed.surfaces[0].name, "ground");
    EXPECT_NEAR(placed.surfaces[0].surface.area(), 1, 1e-12);
    EXPECT_EQ(placed.layers[0].boxes, 60u);
    EXPECT_EQ(placed.layers[1].boxes, 25u);
    ASSERT_EQ(placed.boxes.size(), 85u);
    EXPECT_TRUE(placed.boxes.uvs.empty());
    for (std::size_t i = 0; i < 85; ++i) {
        const Placement& p = placed.boxes.placements[i];
        EXPECT_EQ(p.layer, i < 60 ? 0 : 1);
        EXPECT_TRUE(i < 60 ? p.box == 1 || p.box == 2 : p.box == 0);
        EXPECT_NEAR(p.position[1], i < 60 ? 0 : 0.3, 1e-12);
        // The triangle is the one below the root.
        const Surface& s = placed.surfaces[placed.layers[p.layer].surface].surface;
        EXPECT_EQ(placed.boxes.triangle(i), s.nearest(p.position).triangle);
    }
}

// The same boxes, scattered layer by layer and joined by hand.
TEST(PlaceScene, composesAsItsLayersDoByThemselves)
{
    Scene scene = readText(kScene);
    scene.surfaces[0].skin.material.clear();
    scene.layers[0].tint = TintAt::root;
    std::vector<Placement> all;
    const LayerBoxes boxes[2] = {{1, 2}, {0, 1}};
    for (int i = 0; i < 2; ++i) {
        const Surface surface = loadSurface(scene.surfaces[i]);
        const PlacementList list = scatter(surface, scene.layers[i], boxes[i], i);
        all.insert(all.end(), list.placements.begin(), list.placements.end());
    }
    expectSameVolume(composed(scene, place(scene)), compose(bakeAll(scene), all, scene.compose));
}

// Voxel tints and skins refer to surfaces: they must still find them.
TEST(PlaceScene, isTheSameAfterAMove)
{
    const Scene scene = readText(kScene);
    PlacedScene first = place(scene);
    const PackedVolume before = composed(scene, first);
    EXPECT_EQ(before.parts.size(), 2u);
    auto second = std::make_unique<PlacedScene>(std::move(first));
    first = place(readText(kScene)); // other memory where it was
    PlacedScene third;
    third = std::move(*second);
    second.reset();
    expectSameVolume(before, composed(scene, third));
}

TEST(PlaceScene, choosesTheVoxel)
{
    Scene scene = readText(kScene);
    const PlacedScene placed = place(scene);
    const std::vector<Box> boxes = bakeAll(scene);
    ChosenVoxel voxel = chooseVoxel(scene, placed, boxes);
    EXPECT_EQ(voxel.source, VoxelSource::scene);
    EXPECT_EQ(voxel.size, 0.02);
    scene.compose.voxel = 0;
    voxel = chooseVoxel(scene, placed, boxes);
    EXPECT_EQ(voxel.source, VoxelSource::camera);
    EXPECT_GT(voxel.size, 0);
    scene.camera.target = Vec3d(0, 1.5, 10); // looks away
    voxel = chooseVoxel(scene, placed, boxes);
    EXPECT_EQ(voxel.source, VoxelSource::boxes);
    EXPECT_NEAR(voxel.size, 0.01, 1e-12);
    EXPECT_THROW(chooseVoxel(scene, placed, {}), Error);
}

TEST(PlaceScene, wrongInputIsRefused)
{
    Scene scene = readText(kScene);
    Layer layer = scene.layers[0];
    layer.surface = "moon";
    EXPECT_THROW(place(scene.surfaces, {layer}, usedBoxes(scene)), Error);
    layer = scene.layers[0];
    layer.box = "tree";
    EXPECT_THROW(place(scene.surfaces, {layer}, usedBoxes(scene)), Error);
    EXPECT_THROW(place(scene.surfaces, {scene.layers[0]}, {{"tuft", 100000}}), Error);
}

TEST(PlaceScene, aSkinsMapNeedsTextureCoordinates)
{
    const std::filesystem::path dir = testing::TempDir();
    std::ofstream(dir / "place_scene_bare.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::ofstream(dir / "place_scene_map.pgm") << "P2\n1 1\n255\n9\n";
    SurfaceSpec bare;
    bare.name = "bare";
    bare.mesh = dir / "place_scene_bare.obj";
    bare.skin.material = "leather";
    EXPECT_EQ(place({bare}, {}, {}).surfaces.size(), 1u);
    MapFactor image;
    image.image = dir / "place_scene_map.pgm";
    bare.skin.maps = {image};
    try {
        place({bare}, {}, {});
        FAIL();
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("texture coordinates"), std::string::npos) << e.what();
    }
    bare.projection.kind = ProjectionKind::plane;
    EXPECT_EQ(place({bare}, {}, {}).surfaces.size(), 1u);
}

TEST(RemoveSurface, takesItsLayersAlong)
{
    Scene scene = readText(kScene);
    EXPECT_FALSE(removeSurface(scene, "moon"));
    EXPECT_EQ(scene.surfaces.size(), 2u);
    EXPECT_TRUE(removeSurface(scene, "ground"));
    ASSERT_EQ(scene.layers.size(), 1u);
    EXPECT_EQ(scene.layers[0].name, "grass");
}

} // namespace
} // namespace volcomp
