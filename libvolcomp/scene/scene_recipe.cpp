// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/scene_recipe.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "volcomp/scene/place_scene.h"
#include "volcomp/scene/scene_inputs.h"

namespace volcomp {
namespace {

// A stage whose results change for the same scene counts its version up, so that older files are
// made anew.
constexpr const char* kBakeVersion = "3";
constexpr const char* kComposeVersion = "4";

/// The content of the files that a table names.
void addInputs(Recipe& recipe, const std::string& prefix, const std::vector<NamedFile>& inputs)
{
    for (const NamedFile& input : inputs)
        recipe.addFile(prefix + input.name + " content", input.file);
}

std::string prefixOf(const SurfaceSpec& s) { return "surface." + s.name + "."; }

/// The keys and files of a surface: those of its skin, or the others.
void addKeys(Recipe& recipe, const SurfaceSpec& s, bool of_skin)
{
    const auto counts = [&](const std::string& key) {
        return (key.rfind("skin", 0) == 0) == of_skin; // the keys of skins begin so
    };
    const std::string prefix = prefixOf(s);
    Recipe all;
    all.addLines(prefix, s.source);
    for (const auto& [name, value] : all.entries())
        if (counts(name.substr(prefix.size()))) recipe.add(name, value);
    std::vector<NamedFile> inputs = inputsOf(s);
    inputs.erase(std::remove_if(inputs.begin(), inputs.end(),
                                [&](const NamedFile& input) { return !counts(input.name); }),
                 inputs.end());
    addInputs(recipe, prefix, inputs);
}
void addShape(Recipe& recipe, const SurfaceSpec& s) { addKeys(recipe, s, false); }
void addSkin(Recipe& recipe, const SurfaceSpec& s) { addKeys(recipe, s, true); }

bool hasSkin(const SurfaceSpec& s, SkinAs as)
{
    return !s.skin.material.empty() && s.skin.as == as;
}

/// What a volume has of a surface: nothing of one without boxes and voxels.
void addSurface(Recipe& recipe, const Scene& scene, const SurfaceSpec& s)
{
    const bool carries = std::any_of(scene.layers.begin(), scene.layers.end(),
                                     [&](const Layer& l) { return l.surface == s.name; });
    const bool avoided = std::any_of(scene.layers.begin(), scene.layers.end(), [&](const Layer& l) {
        return std::any_of(l.avoid.begin(), l.avoid.end(),
                           [&](const Avoid& a) { return a.surface == s.name; });
    });
    if (carries || avoided || hasSkin(s, SkinAs::voxels)) addShape(recipe, s);
    if (hasSkin(s, SkinAs::voxels)) addSkin(recipe, s);
}

void addLayer(Recipe& recipe, const Layer& l)
{
    const std::string prefix = "layer." + l.name + ".";
    recipe.addLines(prefix, l.source);
    addInputs(recipe, prefix, inputsOf(l));
}

/// Whether a value is a hash, which says nothing to a reader.
bool isHash(const std::string& value)
{
    return value.size() == 16 && value.find_first_not_of("0123456789abcdef") == value.npos;
}

} // namespace

Recipe boxRecipe(const Scene& scene, const GrowthRule& rule)
{
    Recipe recipe;
    recipe.add("bake version", kBakeVersion);
    const bool is_groom = rule.curves && rule.curves->groom;
    const std::string prefix = (is_groom ? "groom." : "box.") + rule.name + ".";
    Recipe all;
    all.addLines(prefix, rule.source);
    for (const auto& [name, value] : all.entries()) // curves are cut into the variants
        if (rule.curves || name != prefix + "variants") recipe.add(name, value);
    addInputs(recipe, prefix, inputsOf(rule));
    std::set<std::string> materials;
    if (rule.curves) materials.insert(rule.material);
    for (const GrowthLevel& level : rule.levels)
        materials.insert(level.material.empty() ? rule.material : level.material);
    addInputs(recipe, prefix, inputsOf(rule));
    if (!rule.mesh.file.empty()) materials.insert(rule.material);
    for (const MeshMatch& match : rule.mesh.materials) materials.insert(match.material);
    for (const Material& m : scene.materials)
        if (materials.count(m.name))
            recipe.add("material." + m.name + ".kind",
                       m.kind == MaterialKind::fibre ? "fibre" : "surface");
    return recipe;
}

Recipe placedRecipe(const Scene& scene, const std::vector<UsedBox>& boxes)
{
    Recipe recipe;
    recipe.add("compose version", kComposeVersion);
    for (const SurfaceSpec& s : scene.surfaces) addSurface(recipe, scene, s);
    for (const Layer& l : scene.layers) addLayer(recipe, l);
    for (const UsedBox& box : boxes) {
        recipe.add("box." + box.name, box.hash);
        for (const GrowthRule& rule : scene.boxes)
            if (rule.name == box.name)
                recipe.add("box." + box.name + ".variants", std::to_string(rule.variants));
    }
    return recipe;
}

Recipe skinRecipe(const Scene& scene)
{
    Recipe recipe;
    for (const SurfaceSpec& s : scene.surfaces)
        if (hasSkin(s, SkinAs::mesh)) {
            addShape(recipe, s);
            addSkin(recipe, s);
        }
    return recipe;
}

std::vector<UsedBox> wantedBoxes(const Scene& scene)
{
    std::vector<UsedBox> boxes;
    for (const BoxKind& kind : usedBoxes(scene))
        for (const GrowthRule& rule : scene.boxes)
            if (rule.name == kind.name) boxes.push_back({rule.name, boxRecipe(scene, rule).hash()});
    return boxes;
}

Recipe recipeOf(const openvdb::MetaMap& metadata)
{
    const auto text = metadata.getMetadata<openvdb::StringMetadata>(kRecipe);
    return text ? Recipe::fromText(text->value()) : Recipe();
}

std::string differenceText(const std::vector<RecipeDifference>& differences)
{
    std::string text;
    constexpr std::size_t kShown = 3;
    for (std::size_t i = 0; i < std::min(kShown, differences.size()); ++i) {
        const auto& [name, made, wanted] = differences[i];
        if (i) text += "; ";
        if (made.empty()) text += fmt::format("{} is new ({})", name, wanted);
        else if (wanted.empty()) text += fmt::format("{} is gone (it was {})", name, made);
        else if (isHash(made) && isHash(wanted)) text += name + " has changed";
        else text += fmt::format("{} was {} and is {} now", name, made, wanted);
    }
    if (differences.size() > kShown)
        text += fmt::format("; and {} more", differences.size() - kShown);
    return text;
}

} // namespace volcomp
