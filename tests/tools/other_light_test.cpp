// SPDX-License-Identifier: Apache-2.0
// Under which other light volcomp-chart measures a scene.
#include "tools/chart/other_light.h"

#include <gtest/gtest.h>

namespace volcomp {
namespace {

std::vector<std::string> namesOf(const Scene& scene)
{
    std::vector<std::string> names;
    for (const OtherLight& light : otherLights(scene)) names.push_back(light.name);
    return names;
}

using Names = std::vector<std::string>;

TEST(OtherLight, IsTheOtherScatteringAndADomeOrNone)
{
    Scene scene;
    EXPECT_EQ(namesOf(scene), (Names{"multiple", "dome"}));
    scene.render.scattering = Scattering::multiple;
    scene.render.ambient = Vec3d(0.1);
    EXPECT_EQ(namesOf(scene), Names{"single"}) << "it would be dark without ambient light";
    scene.lights.emplace_back();
    EXPECT_EQ(namesOf(scene), (Names{"single", "no_dome"}));
    scene.render.ambient = Vec3d(0.0);
    scene.render.dome.kind = DomeKind::image; // not loaded
    EXPECT_EQ(namesOf(scene), (Names{"single", "no_dome"}));
}

TEST(OtherLight, ChangesTheSceneAsItsOptionsDo)
{
    Scene scene;
    scene.lights.emplace_back();
    const std::vector<OtherLight> lights = otherLights(scene);
    EXPECT_EQ(lights[0].options(), (Names{"--scattering", "multiple"}));
    EXPECT_EQ(lights[1].options(), (Names{"--dome", "0.5"}));
    Scene bounces = scene, dome = scene;
    lights[0].apply(bounces);
    EXPECT_EQ(bounces.render.scattering, Scattering::multiple);
    EXPECT_TRUE(bounces.render.dome.black());
    lights[1].apply(dome);
    EXPECT_EQ(dome.render.scattering, Scattering::single);
    EXPECT_EQ(dome.render.dome.radiance({0, -1, 0}), Vec3d(0.5));
    EXPECT_FALSE(dome.render.dome.visible);

    dome.render.ambient = Vec3d(1.0);
    Scene without = dome;
    ASSERT_EQ(otherLights(dome)[1].options(), (Names{"--dome", "0"}));
    otherLights(dome)[1].apply(without);
    EXPECT_EQ(without.render.ambient, Vec3d(0.0));
    EXPECT_TRUE(without.render.dome.black());
}

TEST(OtherLight, IsTheScenesOwnWithoutAName)
{
    Scene scene;
    const OtherLight own;
    EXPECT_TRUE(own.own());
    EXPECT_TRUE(own.key().is_null());
    EXPECT_TRUE(own.options().empty());
    scene.render.ambient = Vec3d(0.3);
    own.apply(scene);
    EXPECT_EQ(scene.render.ambient, Vec3d(0.3));
    EXPECT_FALSE(otherLights(scene)[0].own());
    EXPECT_NE(otherLights(scene)[0].key(), own.key());
}

} // namespace
} // namespace volcomp
