// SPDX-License-Identifier: Apache-2.0
#include "tools/volcomp/daily.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "tools/bake/bake_stage.h"
#include "tools/compose/compose_stage.h"
#include "tools/render/checkpoint.h"
#include "tools/render/render_stage.h"
#include "tools/shared/rendered_volume.h"
#include "tools/shared/place_stage.h"
#include "tools/shared/read_boxes.h"
#include "tools/volcomp/picture_recipe.h"
#include "volcomp/base/error.h"
#include "volcomp/render/tree/voxel_levels.h"
#include "volcomp/render/tree/voxel_tree_io.h"
#include "volcomp/scene/place_scene.h"
#include "volcomp/scene/scene_dome.h"
#include "volcomp/scene/scene_inputs.h"
#include "volcomp/scene/scene_recipe.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

/// The tag with the number that its run of # stands for: the first of which there is no picture, or
/// the one before it.
std::string numbered(const fs::path& directory, const std::string& name, const std::string& tag,
                     bool last)
{
    const std::size_t first = tag.find('#');
    if (first == std::string::npos) return tag;
    const std::size_t end = std::min(tag.find_first_not_of('#', first), tag.size());
    const auto with = [&](int number) {
        return tag.substr(0, first) + fmt::format("{:0{}}", number, end - first) + tag.substr(end);
    };
    int number = 1;
    while (fs::exists(directory / (name + "." + with(number) + ".exr"))) ++number;
    return with(last && number > 1 ? number - 1 : number);
}

/// The boxes that the picture needs; all if the scene places none.
std::vector<GrowthRule> neededBoxes(const Scene& scene)
{
    if (scene.layers.empty()) return scene.boxes;
    std::vector<GrowthRule> rules;
    for (const BoxKind& kind : usedBoxes(scene))
        for (const GrowthRule& rule : scene.boxes)
            if (rule.name == kind.name) rules.push_back(rule);
    return rules;
}

/// The recipe of a file; empty if it carries none. Returns false if it is no file that can be read.
bool readRecipe(const fs::path& file, Recipe& recipe)
{
    try {
        recipe = recipeOf(readVolumeMetadata(file));
        return true;
    } catch (const Error&) {
        return false;
    }
}

/// Why a box is to be baked; empty if it is as the scene would have it, or made by someone else.
std::string whyBake(const fs::path& file, const Recipe& wanted, bool again)
{
    if (!fs::exists(file)) return "there is no " + file.filename().string();
    Recipe made;
    if (!readRecipe(file, made)) return file.filename().string() + " cannot be read";
    if (made.empty()) return "";
    return again ? "asked for" : differenceText(differences(made, wanted));
}

std::vector<BoxPlan> planBoxes(const Scene& scene, const DailyFiles& files, bool again)
{
    std::vector<BoxPlan> plans;
    for (const GrowthRule& rule : neededBoxes(scene)) {
        if (!rule.files.empty()) continue;
        BoxPlan plan{rule, {}, ""};
        const Recipe wanted = boxRecipe(scene, rule);
        for (int variant = 0; variant < rule.variants; ++variant) {
            const std::string why =
                whyBake(boxFile(files.boxes, rule.name, variant), wanted, again);
            if (why.empty()) continue;
            plan.variants.push_back(variant);
            if (plan.why.empty()) plan.why = why;
        }
        if (!plan.variants.empty()) plans.push_back(std::move(plan));
    }
    return plans;
}

/// The box files that are there and carry no recipe.
std::vector<fs::path> foreignBoxes(const Scene& scene, const DailyFiles& files)
{
    std::vector<fs::path> foreign;
    for (const NamedFile& box : boxFiles(scene, files.boxes)) {
        Recipe recipe;
        if (fs::exists(box.file) && readRecipe(box.file, recipe) && recipe.empty())
            foreign.push_back(box.file);
    }
    return foreign;
}

/// Why the volume is to be composed; empty if it is as the scene would have it.
std::string whyCompose(const Scene& scene, const DailyFiles& files, bool again)
{
    if (!fs::exists(files.volume)) return "there is no " + files.volume.filename().string();
    Recipe made, wanted = placedRecipe(scene, wantedBoxes(scene)), by_scene;
    if (!readRecipe(files.volume, made)) return files.volume.filename().string() + " is unreadable";
    const Recipe asked = composeRecipe(scene, true);
    for (const auto& [name, value] : asked.entries()) wanted.add(kOption + name, value);
    for (const auto& [name, value] : made.entries()) // the voxel follows from the others
        if (name != std::string(kOption) + "voxel") by_scene.add(name, value);
    const std::string why = differenceText(differences(by_scene, wanted));
    return why.empty() && again ? "asked for" : why;
}

void say(const Tool& tool, const DailyFiles& files, const DailyPlan& plan,
         const DailyOptions& options)
{
    for (const BoxPlan& box : plan.boxes)
        tool.say(fmt::format("bake {} ({} of {}): {}", box.rule.name, box.variants.size(),
                             box.rule.variants, box.why));
    if (!plan.compose.empty()) tool.say("compose: " + plan.compose);
    if (!plan.render.empty()) tool.say("render: " + plan.render);
    if (plan.nothing())
        tool.say(options.until == Until::render
                     ? files.pictures[1].string() + " is up to date: nothing to do"
                     : "all is up to date: nothing to do");
}

/// Makes the folders and throws Error if an output cannot be written, or is a file of the scene.
void requireOutputs(const Tool& tool, const Scene& scene, const DailyFiles& files,
                    const DailyPlan& plan)
{
    fs::create_directories(files.boxes);
    std::vector<NamedFile> outputs;
    for (const BoxPlan& box : plan.boxes)
        for (const int variant : box.variants)
            outputs.push_back({"a box", boxFile(files.boxes, box.rule.name, variant)});
    if (!plan.compose.empty()) outputs.push_back({"the volume", files.volume});
    if (!plan.render.empty()) {
        for (const fs::path& picture : files.pictures) outputs.push_back({"a picture", picture});
        outputs.push_back({"the pictures' recipe", files.recipe});
    }
    tool.requireFiles(inputsOf(scene), outputs);
}

void composeVolume(Tool& tool, const Scene& scene, const DailyFiles& files,
                   const DailyOptions& options)
{
    const ReadBoxes read = tool.stage("read boxes", [&](const Progress& p) {
        return readBoxes(tool, scene, files.boxes, Stale::refused, p);
    });
    composeStage(tool, scene, read.boxes, placeStage(tool, scene),
                 volumeRecipe(scene, read.used, {}),
                 {files.volume, GridNames::houdini, options.max_memory_mb});
}

/// What a stopped render of these very pictures left; otherwise the start.
RenderState whatIsLeft(const Tool& tool, const fs::path& checkpoint,
                       const nlohmann::json& fingerprint)
{
    if (!fs::exists(checkpoint)) return {};
    try {
        RenderState state = readCheckpoint(checkpoint, fingerprint);
        tool.say("going on from " + checkpoint.string());
        return state;
    } catch (const Error&) { // of other settings
        return {};
    }
}

void renderPictures(Tool& tool, Scene scene, const DailyFiles& files, const DailyOptions& options)
{
    warnIfDark(tool, scene);
    for (const std::string& sun : loadSceneDome(scene)) tool.say(sun);
    RenderedVolume volume;
    if (options.volume) {
        volume.name = files.volume.string();
        volume.recipe = recipeOf(readVolumeMetadata(files.volume)).hash();
        volume.identity = fileIdentity(files.volume);
        volume.levels = tool.stage("load", [&](const Progress& p) {
            return voxelLevels(std::make_shared<const VoxelTree>(readVoxelTree(files.volume, p)),
                               scene.camera, scene.render);
        });
    } else
        volume =
            volumeOfBoxes(tool, scene, {files.boxes, Stale::refused, options.max_memory_mb, {}});
    const auto skins = skinStage(tool, scene);
    const PictureFiles to{files.pictures, {}, false, 20};
    const nlohmann::json fingerprint = renderFingerprint(scene, volume.identity);
    renderStage(tool, scene, volume, skins.get(), fingerprint,
                whatIsLeft(tool, checkpointOf(to), fingerprint), to);
}

} // namespace

DailyFiles dailyFiles(const Scene& scene, const DailyOptions& options, bool last)
{
    const std::string name = scene.file.stem().string();
    const fs::path directory =
        options.directory.empty() ? fs::path("out") / name : options.directory;
    if (options.tag.find('/') != std::string::npos)
        throw Error("--tag: expected a part of a file's name, such as warm or v##, found '"
                    + options.tag + "'");
    std::string stem = name;
    if (!options.tag.empty()) stem += "." + numbered(directory, name, options.tag, last);
    return {directory,
            directory / "boxes",
            directory / "volume.vdb",
            {directory / (stem + ".exr"), directory / (stem + ".png")},
            directory / (stem + ".recipe")};
}

DailyPlan planDaily(const Scene& scene, const DailyFiles& files, const DailyOptions& options)
{
    DailyPlan plan;
    plan.boxes = planBoxes(scene, files, options.again);
    if (options.until == Until::bake) return plan;
    plan.place = options.until == Until::place;
    if (plan.place) return plan;
    if (options.volume) plan.compose = whyCompose(scene, files, options.again);
    if (options.until == Until::compose) return plan;
    plan.picture = pictureRecipe(scene, foreignBoxes(scene, files), options.volume);
    plan.render = whyRender(files.recipe, plan.picture, files.pictures);
    if (plan.render.empty() && options.again) plan.render = "asked for";
    return plan;
}

void runDaily(Tool& tool, const Scene& scene, const DailyOptions& options)
{
    DailyFiles files = dailyFiles(scene, options, true);
    DailyPlan plan = planDaily(scene, files, options);
    if (!plan.render.empty()) files = dailyFiles(scene, options); // not over the last number
    say(tool, files, plan, options);
    if (options.dry_run || plan.nothing()) return;
    requireOutputs(tool, scene, files, plan);
    for (const BoxPlan& box : plan.boxes)
        bakeStage(tool, scene, box.rule, box.variants, {files.boxes, GridNames::houdini, nullptr});
    if (plan.place) placeStage(tool, scene);
    if (!plan.compose.empty()) composeVolume(tool, scene, files, options);
    if (plan.render.empty()) return;
    renderPictures(tool, scene, files, options);
    writePictureRecipe(files.recipe, plan.picture, files.pictures);
}

} // namespace volcomp
