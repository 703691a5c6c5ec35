// Bakes the boxes of a scene: one VDB file for each variant of each [box.NAME].
#include <filesystem>

#include <fmt/format.h>

#include "volcomp/bake/bake.h"
#include "tools/shared/choice.h"
#include "volcomp/base/error.h"
#include "volcomp/view/image.h"
#include "volcomp/scene/scene.h"
#include "volcomp/inspect/box_sheet.h"
#include "tools/shared/tool.h"
#include "volcomp/volume/vdb_io.h"

using namespace volcomp;

int main(int argc, char** argv)
{
    Tool tool(
        "volcomp-bake",
        "Grows the boxes of a scene and bakes them into voxels: DIR/NAME_1.vdb ... DIR/NAME_N.vdb for each [box.NAME].");
    std::filesystem::path scene_file, directory, sheet;
    std::vector<std::string> only;
    GridNames grid_names = GridNames::houdini;
    tool.app.add_option("scene", scene_file, "Scene file (TOML)")->required()->type_name("SCENE");
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
        const Scene scene = readScene(scene_file);
        if (scene.boxes.empty())
            throw fileError(scene_file, "box", "at least one [box.NAME] table", "none");
        for (const std::string& name : only)
            if (std::none_of(scene.boxes.begin(), scene.boxes.end(),
                             [&](const GrowthRule& p) { return p.name == name; }))
                throw fileError(scene_file, "box", "a [box." + name + "] table, as --box says",
                                "none");
        std::vector<BoxThumbnail> tiles;
        for (const GrowthRule& primitive : scene.boxes) {
            if (!only.empty() && std::find(only.begin(), only.end(), primitive.name) == only.end())
                continue;
            std::uint64_t voxels = 0;
            double voxel = 0;
            tool.stage("bake " + primitive.name, [&](const Progress& progress) {
                for (int variant = 0; variant < primitive.variants; ++variant) {
                    const Box box = bake(primitive, scene.materials, variant, [&](double f) {
                        report(progress, (variant + f) / primitive.variants);
                    });
                    for (const VolumePart& part : box.volume.parts)
                        voxels += part.density->activeVoxelCount();
                    voxel = box.volume.voxelSize();
                    writeVolume(directory / fmt::format("{}_{}.vdb", primitive.name, variant + 1),
                                box.volume, boxMetadata(primitive, variant), grid_names);
                    if (!sheet.empty())
                        tiles.push_back(renderBoxThumbnail(box, scene.materials, scene.render));
                }
            });
            tool.stats["boxes"][primitive.name] = {
                {"variants", primitive.variants}, {"voxels", voxels}, {"voxel", voxel}};
            tool.say(fmt::format(
                "{}: {} of {} voxels of {:.4g} m", primitive.name,
                primitive.variants == 1 ? "1 box" : fmt::format("{} boxes", primitive.variants),
                voxels, voxel));
        }
        if (!sheet.empty()) writeImage(sheet, contactSheet(tiles), {});
    });
}
