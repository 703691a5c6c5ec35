// SPDX-License-Identifier: Apache-2.0
// volcomp-compose: a scene and its boxes become one sparse volume.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <unistd.h>

#include "tools/shared/choice.h"
#include "tools/shared/leave_out.h"
#include "tools/shared/tool.h"
#include "volcomp/base/error.h"
#include "volcomp/compose/compose.h"
#include "volcomp/inspect/placement_sheet.h"
#include "volcomp/place/culling.h"
#include "volcomp/place/placements_io.h"
#include "volcomp/scene/place_scene.h"
#include "volcomp/scene/scene.h"
#include "volcomp/view/image.h"
#include "volcomp/volume/vdb_io.h"

namespace {

using namespace volcomp;
namespace fs = std::filesystem;

struct Options {
    fs::path scene, output, boxes;
    fs::path placements, sheet;
    std::vector<std::string> leave_out;
    GridNames grid_names = GridNames::houdini;
    double voxel = 0, max_memory_mb = 0;
};

double machineMegabytes()
{
    return double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE)) / 1048576;
}

/// Reads the boxes that the scene's layers use, in the order of usedBoxes().
std::vector<Box> readBoxes(const Tool& tool, const Scene& scene, const fs::path& directory,
                           const Progress& progress)
{
    std::vector<Box> boxes;
    const std::vector<BoxKind> kinds = usedBoxes(scene);
    for (std::size_t k = 0; k < kinds.size(); ++k) {
        for (int variant = 0; variant < kinds[k].variants; ++variant) {
            const fs::path file = directory / fmt::format("{}_{}.vdb", kinds[k].name, variant + 1);
            if (!fs::exists(file))
                throw fileError(file, "",
                                "the box '" + kinds[k].name + "', variant "
                                    + std::to_string(variant + 1),
                                "no file", "Run volcomp-bake first, or check --boxes.");
            boxes.push_back({kinds[k].name, variant, readVolume(file)});
            for (const std::string& warning : boxes.back().volume.warnings) tool.warn(warning);
        }
        report(progress, double(k + 1) / double(kinds.size()));
    }
    return boxes;
}

/// Says what place() has found, and adds it to the statistics.
void reportPlaced(Tool& tool, const Scene& scene, const PlacedScene& placed)
{
    for (std::size_t i = 0; i < placed.surfaces.size(); ++i) {
        const PlacedSurface& s = placed.surfaces[i];
        const MeshReport& r = s.surface.mesh().report;
        tool.say(fmt::format("surface '{}': {}, {:.4g} m^2", s.name, r.text(), s.surface.area()));
        for (const std::string& warning : r.warnings) tool.warn(warning);
        if (r.non_manifold_faces)
            tool.warn(fmt::format(
                "{}: {} non-manifold faces at {} edges that more than two faces share; they are kept",
                scene.surfaces[i].mesh.string(), r.non_manifold_faces, r.non_manifold_edges));
        tool.stats["surfaces"][s.name] = {{"triangles", r.triangles},
                                          {"area_m2", s.surface.area()},
                                          {"non_manifold_faces", r.non_manifold_faces},
                                          {"open_edges", r.boundary_edges},
                                          {"zero_area", r.zero_area},
                                          {"turned", r.turned},
                                          {"parts", r.parts}};
    }
    for (const PlacedLayer& l : placed.layers) {
        tool.say(fmt::format("layer '{}': {} boxes", l.layer.name, l.boxes));
        tool.stats["layers"].push_back({{"name", l.layer.name}, {"placements", l.boxes}});
    }
    for (const std::string& warning : placed.warnings) tool.warn(warning);
}

/// Writes the placements and the sheet if the options ask for them.
void writePlaced(Tool& tool, const Options& options, const Scene& scene, const PlacedScene& placed)
{
    if (!options.placements.empty())
        tool.stage("write placements",
                   [&](const Progress&) { writePlacements(options.placements, placed); });
    if (!options.sheet.empty())
        tool.stage("sheet", [&](const Progress&) {
            writeImage(
                options.sheet,
                placementSheet(placed, scene.camera, scene.render.width, scene.render.height));
        });
}

/// Returns the edge of a voxel to compose with, and says where it comes from.
double voxelSize(const Tool& tool, const Scene& scene, const PlacedScene& placed,
                 const std::vector<Box>& boxes)
{
    const ChosenVoxel voxel = chooseVoxel(scene, placed, boxes);
    if (voxel.source == VoxelSource::camera)
        tool.say(fmt::format(
            "voxels of {:.4g} m: {:g} of a pixel at the nearest point that the camera sees",
            voxel.size, scene.compose.voxel_pixels));
    if (voxel.source == VoxelSource::boxes)
        tool.warn(fmt::format(
            "the camera sees no surface; voxels of {:.4g} m, as the finest box has", voxel.size));
    return voxel.size;
}

void cull(Tool& tool, const Scene& scene, const std::vector<Box>& boxes, PlacedScene& placed)
{
    const std::size_t before = placed.boxes.size();
    tool.stats["culled"] = tool.stage("cull", [&](const Progress&) {
        return cullPlacements(placed.boxes, boxes, scene.camera, scene.render.width,
                              scene.render.height, scene.lights);
    });
    tool.say(fmt::format("{} of {} boxes matter to the picture", placed.boxes.size(), before));
}

/// Returns a voxel size whose estimate is below the limit.
double fittingVoxel(const std::vector<Box>& boxes, const PlacedScene& placed, ComposeParams params,
                    double limit, double needed)
{
    for (int i = 0; i < 30 && needed > limit; ++i) {
        params.voxel *= std::clamp(std::cbrt(needed / limit), 1.05, 8.0);
        needed = estimateCompose(boxes, placed, params).bytes / 1048576;
    }
    return params.voxel;
}

/// Throws Error if composing would need more memory than the limit.
void checkMemory(Tool& tool, const Options& options, const std::vector<Box>& boxes,
                 const PlacedScene& placed, const ComposeParams& params)
{
    const double limit =
        options.max_memory_mb > 0 ? options.max_memory_mb : 0.75 * machineMegabytes();
    const ComposeEstimate estimate = tool.stage(
        "estimate", [&](const Progress&) { return estimateCompose(boxes, placed, params); });
    const double needed = estimate.bytes / 1048576;
    tool.say(fmt::format("about {:.3g} voxels, {:.0f} MB", estimate.voxels, needed));
    tool.stats["estimate"] = {{"voxels", estimate.voxels}, {"mb", needed}};
    if (needed > limit)
        throw fileError(options.scene, "compose",
                        fmt::format("a volume of at most {:.0f} MB (--max-memory)", limit),
                        fmt::format("about {:.0f} MB", needed),
                        fmt::format("A voxel of {:.3g} m instead of {:.3g} m would fit.",
                                    fittingVoxel(boxes, placed, params, limit, needed),
                                    params.voxel));
}

/// Reads the scene, changed as the options say, and prints its warnings.
Scene sceneOf(const Tool& tool, const Options& options)
{
    Scene scene = readScene(options.scene);
    for (const std::string& warning : scene.warnings) tool.warn(warning);
    leaveOut(scene, options.leave_out);
    if (options.voxel > 0) scene.compose.voxel = options.voxel;
    return scene;
}

void run(Tool& tool, const Options& options)
{
    const Scene scene = sceneOf(tool, options);
    const std::vector<Box> boxes = tool.stage(
        "read boxes", [&](const Progress& p) { return readBoxes(tool, scene, options.boxes, p); });
    PlaceOptions place_options;
    place_options.keep_uvs = !options.placements.empty();
    PlacedScene placed =
        tool.stage("place", [&](const Progress& p) { return place(scene, place_options, p); });
    reportPlaced(tool, scene, placed);
    writePlaced(tool, options, scene, placed);
    if (options.output.empty()) return;

    ComposeParams params = scene.compose;
    params.voxel = voxelSize(tool, scene, placed, boxes);
    if (params.cull) cull(tool, scene, boxes, placed);
    checkMemory(tool, options, boxes, placed, params);
    const PackedVolume volume =
        tool.stage("compose", [&](const Progress& p) { return compose(boxes, placed, params, p); });
    tool.say(fmt::format("{} placements, {} voxels of {:.4g} m, {:.0f} MB", placed.boxes.size(),
                         volume.voxels(), params.voxel, double(volume.bytes()) / 1048576));
    tool.stats["placements"] = placed.boxes.size();
    tool.stats["voxel_m"] = params.voxel;
    tool.stats["active_voxels"] = volume.voxels();
    tool.stats["volume_bytes"] = volume.bytes();
    tool.stage("write", [&](const Progress&) {
        writeVolume(options.output, volume, {}, options.grid_names);
    });
}

} // namespace

int main(int argc, char** argv)
{
    Tool tool("volcomp-compose",
              "Places the scene's boxes on its surfaces and adds them into one sparse volume");
    Options options;
    tool.app.add_option("scene", options.scene, "Scene file (TOML)")
        ->required()
        ->type_name("SCENE");
    tool.app.add_option("-o,--output", options.output, "Volume to write")->type_name("VOLUME.vdb");
    tool.app.add_option("--boxes", options.boxes, "Directory of the boxes that volcomp-bake wrote")
        ->required()
        ->type_name("DIR");
    tool.app
        .add_option("--voxel", options.voxel,
                    "Edge of a voxel in metres; 0: compose.voxel of the scene")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    tool.app
        .add_option("--max-memory", options.max_memory_mb,
                    "Refuse a volume that needs more, in MB; 0: 3/4 of the machine's memory")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    tool.app
        .add_option(
            "--leave-out", options.leave_out,
            "Compose without this surface and the layers on it; may be given more than once")
        ->type_name("SURFACE")
        ->allow_extra_args(false);
    addChoice(tool.app, "--grid-names", options.grid_names,
              "Name of the colour's grid: Cd as in Houdini (the default), or color as in Blender",
              kGridNamesWords);
    tool.app.add_option("--placements", options.placements, "Also write where the boxes stand")
        ->type_name("FILE.json|.ply");
    tool.app
        .add_option(
            "--sheet", options.sheet,
            "Also write a picture of the placements and of each map as it falls on the surface")
        ->type_name("FILE.png");
    return tool.main(argc, argv, [&] {
        if (options.output.empty() && options.placements.empty() && options.sheet.empty())
            throw Error("nothing to write: expected -o, --placements or --sheet");
        run(tool, options);
    });
}
