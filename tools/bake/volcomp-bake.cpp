// SPDX-License-Identifier: Apache-2.0
// Bakes the boxes of a scene: one VDB file for each variant of each [box.NAME].
#include <algorithm>
#include <filesystem>

#include "tools/bake/bake_stage.h"
#include "tools/shared/choice.h"
#include "volcomp/scene/scene_inputs.h"
#include "tools/shared/read_boxes.h"
#include "tools/shared/scene_option.h"
#include "tools/shared/tool.h"
#include "volcomp/base/error.h"
#include "volcomp/inspect/box_sheet.h"
#include "volcomp/scene/scene.h"
#include "volcomp/view/image.h"

using namespace volcomp;

namespace {

/// Returns the rules of the boxes to bake: all, or those of the given names. Throws Error if there
/// is none of such a name.
std::vector<GrowthRule> chosenBoxes(const Scene& scene, const std::vector<std::string>& names)
{
    if (names.empty()) return scene.boxes;
    const auto chosen = [&](const GrowthRule& rule) {
        return std::find(names.begin(), names.end(), rule.name) != names.end();
    };
    for (const std::string& name : names)
        if (std::none_of(scene.boxes.begin(), scene.boxes.end(),
                         [&](const GrowthRule& rule) { return rule.name == name; }))
            throw fileError(scene.file, "box", "a [box." + name + "] table, as --box says", "none");
    std::vector<GrowthRule> rules;
    std::copy_if(scene.boxes.begin(), scene.boxes.end(), std::back_inserter(rules), chosen);
    return rules;
}

/// Throws Error if a box or the sheet cannot be written, or is a file of the scene.
void requireOutputs(const Tool& tool, const Scene& scene, const std::vector<GrowthRule>& rules,
                    const std::filesystem::path& directory, const std::filesystem::path& sheet)
{
    std::vector<NamedFile> outputs{{"--sheet", sheet}};
    for (const GrowthRule& rule : rules)
        for (int variant = rule.files.empty() ? 0 : rule.variants; variant < rule.variants;
             ++variant)
            outputs.push_back({"-o", boxFile(directory, rule.name, variant)});
    tool.requireFiles(inputsOf(scene), outputs);
}

} // namespace

int main(int argc, char** argv)
{
    Tool tool("volcomp-bake",
              "Grows the boxes of a scene and bakes them into voxels: DIR/NAME_1.vdb ... "
              "DIR/NAME_N.vdb for each [box.NAME].");
    std::filesystem::path directory, sheet;
    std::vector<std::string> only;
    GridNames grid_names = GridNames::houdini;
    const SceneOption scene_option(tool.app);
    tool.app
        .add_option("-o,--output", directory, "Directory for the boxes; made if it is not there")
        ->required()
        ->type_name("DIR");
    tool.app
        .add_option("--sheet", sheet,
                    "Also render every box into one labelled sheet (.png or .exr)")
        ->type_name("FILE");
    tool.app.add_option("--box", only, "Bake these boxes only")->type_name("NAME");
    addChoice(tool.app, "--grid-names", grid_names,
              "Name of the colour's grid: Cd as in Houdini (the default), or color as in Blender",
              kGridNamesWords);

    return tool.main(argc, argv, [&] {
        if (!sheet.empty()) requirePictureName(sheet);
        const Scene scene = scene_option.read(tool);
        if (scene.boxes.empty() && only.empty()) { // a look at a mesh alone needs none
            std::filesystem::create_directories(directory);
            tool.say(scene.file.string() + ": no boxes");
            return;
        }
        const std::vector<GrowthRule> rules = chosenBoxes(scene, only);
        requireOutputs(tool, scene, rules, directory, sheet);
        std::vector<BoxThumbnail> thumbnails;
        const BakeToFiles to{directory, grid_names, sheet.empty() ? nullptr : &thumbnails};
        for (const GrowthRule& rule : rules) bakeStage(tool, scene, rule, allVariants(rule), to);
        if (!sheet.empty()) writeImage(sheet, contactSheet(thumbnails), {});
    });
}
