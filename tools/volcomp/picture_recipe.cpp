// SPDX-License-Identifier: Apache-2.0
#include "tools/volcomp/picture_recipe.h"

#include <algorithm>
#include <fstream>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "tools/compose/compose_stage.h"
#include "tools/shared/settings.h"
#include "volcomp/base/atomic_file.h"
#include "volcomp/scene/scene_recipe.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

/// The beginning of the entries with the pictures' hashes.
constexpr const char* kPicture = "picture file ";

/// Adds the members of an object, each under its name with `prefix` in front.
void addSettings(Recipe& recipe, const std::string& prefix, const nlohmann::json& settings)
{
    for (const auto& [name, value] : settings.items()) {
        if (value.is_object()) addSettings(recipe, prefix + name + ".", value);
        else if (value.is_string()) recipe.add(prefix + name, value.get<std::string>());
        else recipe.add(prefix + name, value.dump());
    }
}

/// Adds the entries of another recipe that are not there yet.
void addNew(Recipe& recipe, const Recipe& other)
{
    const Recipe before = recipe;
    for (const auto& entry : other.entries())
        if (std::find(before.entries().begin(), before.entries().end(), entry)
            == before.entries().end())
            recipe.add(entry.first, entry.second);
}

/// Adds things that have names, each with its own settings.
template <class T>
void addNamed(Recipe& recipe, const std::string& table, const std::vector<T>& things)
{
    for (const T& thing : things) {
        nlohmann::json settings = settingsOf(thing);
        settings.erase("name");
        addSettings(recipe, table + "." + thing.name + ".", settings);
    }
}

std::string entryOf(const fs::path& picture) { return kPicture + picture.filename().string(); }

Recipe readRecipe(const fs::path& file)
{
    std::ifstream stream(file, std::ios::binary);
    return Recipe::fromText({std::istreambuf_iterator<char>(stream), {}});
}

} // namespace

Recipe pictureRecipe(const Scene& scene, const std::vector<fs::path>& boxes, bool as_file)
{
    Recipe recipe;
    recipe.addFile("the program", "/proc/self/exe");
    addNew(recipe, placedRecipe(scene, wantedBoxes(scene)));
    for (const fs::path& box : boxes) recipe.addFile(box.filename().string() + " content", box);
    recipe.add("volume", as_file ? "of a file" : "made where rays look");
    addNew(recipe, composeRecipe(scene, as_file));
    addNew(recipe, skinRecipe(scene));
    addSettings(recipe, "camera.", settingsOf(scene.camera));
    addNamed(recipe, "light", scene.lights);
    addNamed(recipe, "material", scene.materials);
    addSettings(recipe, "render.", settingsOf(scene.render));
    if (const auto& dome = scene.render.dome; dome.kind == DomeKind::image)
        recipe.addFile("dome.image content", dome.file);
    addSettings(recipe, "picture.", lookOf(scene.look));
    return recipe;
}

void writePictureRecipe(const fs::path& file, const Recipe& recipe,
                        const std::vector<fs::path>& pictures)
{
    Recipe all = recipe;
    for (const fs::path& picture : pictures) all.addFile(entryOf(picture), picture);
    writeTextAtomically(file, all.text());
}

std::string whyRender(const fs::path& file, const Recipe& wanted,
                      const std::vector<fs::path>& pictures)
{
    for (const fs::path& picture : pictures)
        if (!fs::exists(picture)) return "there is no " + picture.filename().string();
    if (!fs::exists(file)) return "nothing says what the picture was made from";
    const Recipe written = readRecipe(file);
    Recipe made;
    for (const auto& [name, value] : written.entries()) {
        if (name.rfind(kPicture, 0) != 0) {
            made.add(name, value);
            continue;
        }
        for (const fs::path& picture : pictures) {
            Recipe now;
            now.addFile(entryOf(picture), picture);
            if (now.entries()[0].first == name && now.entries()[0].second != value)
                return picture.filename().string() + " was written by something else since";
        }
    }
    return differenceText(differences(made, wanted));
}

} // namespace volcomp
