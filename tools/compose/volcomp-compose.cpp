// volcomp-compose: a scene and its boxes become one sparse volume.
#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <map>

#include <fmt/format.h>
#include <unistd.h>

#include "tools/shared/choice.h"
#include "volcomp/compose/compose.h"
#include "volcomp/base/error.h"
#include "volcomp/view/image.h"
#include "volcomp/place/placements_io.h"
#include "volcomp/place/scatter.h"
#include "volcomp/scene/scene.h"
#include "volcomp/inspect/placement_sheet.h"
#include "tools/shared/tool.h"
#include "volcomp/volume/vdb_io.h"
#include "volcomp/place/culling.h"

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

/// The boxes that the layers use, in the order of their kinds, and where each kind begins.
struct BoxSet {
    std::vector<Box> boxes;
    std::map<std::string, LayerBoxes> kinds;
};

BoxSet readBoxes(const Scene& scene, const fs::path& directory, const Progress& progress)
{
    BoxSet set;
    std::vector<const GrowthRule*> used;
    for (const GrowthRule& p : scene.boxes)
        if (std::any_of(scene.layers.begin(), scene.layers.end(),
                        [&](const Layer& l) { return l.box == p.name; }))
            used.push_back(&p);
    for (std::size_t k = 0; k < used.size(); ++k) {
        set.kinds[used[k]->name] = {static_cast<std::int32_t>(set.boxes.size()), used[k]->variants};
        for (int variant = 0; variant < used[k]->variants; ++variant) {
            const fs::path file = directory / fmt::format("{}_{}.vdb", used[k]->name, variant + 1);
            if (!fs::exists(file))
                throw fileError(file, "",
                                "the box '" + used[k]->name + "', variant "
                                    + std::to_string(variant + 1),
                                "no file", "Run volcomp-bake first, or check --boxes.");
            set.boxes.push_back({used[k]->name, variant, readVolume(file)});
        }
        report(progress, double(k + 1) / double(used.size()));
    }
    return set;
}

/// A voxel size whose estimate is below the limit.
double fittingVoxel(const std::vector<Box>& boxes, const std::vector<Placement>& placements,
                    const ComposeExtras& extras, ComposeParams params, double limit, double needed)
{
    for (int i = 0; i < 30 && needed > limit; ++i) {
        params.voxel *= std::clamp(std::cbrt(needed / limit), 1.05, 8.0);
        needed = estimateCompose(boxes, placements, extras, params).bytes / 1048576;
    }
    return params.voxel;
}

void run(Tool& tool, const Options& options)
{
    Scene scene = readScene(options.scene);
    for (const std::string& surface : options.leave_out) removeSurface(scene, surface);
    ComposeParams params = scene.compose;
    if (options.voxel > 0) params.voxel = options.voxel;

    std::deque<Surface> surfaces; // stays in place while skins and tints point into it
    std::map<std::string, const Surface*> by_name;
    ComposeExtras extras;
    tool.stage("surfaces", [&](const Progress&) {
        for (const SurfaceSpec& spec : scene.surfaces) {
            surfaces.push_back(loadSurface(spec));
            by_name[spec.name] = &surfaces.back();
            const MeshReport& r = surfaces.back().mesh().report;
            tool.say(fmt::format("surface '{}': {}, {:.4g} m^2", spec.name, r.text(),
                                 surfaces.back().area()));
            if (r.non_manifold_faces)
                tool.warn(fmt::format(
                    "{}: {} non-manifold faces at {} edges that more than two faces share; they are kept",
                    spec.mesh.string(), r.non_manifold_faces, r.non_manifold_edges));
            tool.stats["surfaces"][spec.name] = {{"triangles", r.triangles},
                                                 {"area_m2", surfaces.back().area()},
                                                 {"non_manifold_faces", r.non_manifold_faces},
                                                 {"open_edges", r.boundary_edges},
                                                 {"zero_area", r.zero_area},
                                                 {"turned", r.turned},
                                                 {"parts", r.parts}};
            if (!spec.skin.material.empty()) extras.skins.emplace_back(surfaces.back(), spec.skin);
        }
    });

    const BoxSet set = tool.stage(
        "read boxes", [&](const Progress& p) { return readBoxes(scene, options.boxes, p); });

    std::deque<SecondDensity> maps;
    std::vector<Placement> placements = tool.stage("scatter", [&](const Progress& progress) {
        std::vector<Placement> all;
        for (std::size_t i = 0; i < scene.layers.size(); ++i) {
            const Layer& layer = scene.layers[i];
            const Surface* surface = by_name.at(layer.surface); // readScene() has checked the names
            const auto placed = scatter(
                *surface, layer, set.kinds.at(layer.box), static_cast<int>(i),
                [&](double f) { report(progress, (double(i) + f) / double(scene.layers.size())); });
            tool.say(fmt::format("layer '{}': {} boxes", layer.name, placed.size()));
            tool.stats["layers"].push_back({{"name", layer.name}, {"placements", placed.size()}});
            all.insert(all.end(), placed.begin(), placed.end());
            extras.tints.emplace_back();
            if (layer.tint == TintAt::voxel && !layer.colour.empty()) {
                maps.emplace_back(layer.colour, true);
                extras.tints.back() = {surface, &maps.back()};
            }
        }
        return all;
    });

    std::vector<const Surface*> all_surfaces;
    all_surfaces.reserve(surfaces.size());
    for (const Surface& s : surfaces) all_surfaces.push_back(&s);
    if (!options.placements.empty()) {
        std::vector<std::string> boxes, layers;
        for (const Box& b : set.boxes) boxes.push_back(fmt::format("{}_{}", b.name, b.variant + 1));
        for (const Layer& l : scene.layers) layers.push_back(l.name);
        tool.stage("write placements", [&](const Progress&) {
            writePlacements(options.placements, placements, boxes, layers);
        });
    }
    if (!options.sheet.empty())
        tool.stage("sheet", [&](const Progress&) {
            std::vector<SheetLayer> layers;
            for (const Layer& l : scene.layers) layers.push_back({by_name.at(l.surface), &l});
            writeImage(options.sheet,
                       placementSheet(all_surfaces, layers, placements, scene.camera,
                                      scene.render.width, scene.render.height));
        });
    if (options.output.empty()) return;

    if (params.voxel == 0) {
        params.voxel = voxelFromCamera(all_surfaces, scene.camera, scene.render.width,
                                       scene.render.height, params.voxel_pixels);
        if (params.voxel > 0)
            tool.say(fmt::format(
                "voxels of {:.4g} m: {:g} of a pixel at the nearest point that the camera sees",
                params.voxel, params.voxel_pixels));
        else {
            params.voxel = std::numeric_limits<double>::max();
            for (const Box& b : set.boxes)
                params.voxel = std::min(params.voxel, b.volume.voxelSize());
            if (set.boxes.empty())
                throw fileError(
                    scene.file, "compose.voxel",
                    "a voxel size, as the camera sees no surface and there are no boxes", "0");
            tool.warn(
                fmt::format("the camera sees no surface; voxels of {:.4g} m, as the finest box has",
                            params.voxel));
        }
    }
    if (params.cull) {
        const std::size_t before = placements.size();
        placements = tool.stage("cull", [&](const Progress&) {
            return cullPlacements(placements, set.boxes, scene.camera, scene.render.width,
                                  scene.render.height, scene.lights);
        });
        tool.say(fmt::format("{} of {} boxes matter to the picture", placements.size(), before));
        tool.stats["culled"] = before - placements.size();
    }

    const double limit =
        options.max_memory_mb > 0 ? options.max_memory_mb : 0.75 * machineMegabytes();
    const ComposeEstimate estimate = tool.stage("estimate", [&](const Progress&) {
        return estimateCompose(set.boxes, placements, extras, params);
    });
    const double needed = estimate.bytes / 1048576;
    tool.say(fmt::format("about {:.3g} voxels, {:.0f} MB", estimate.voxels, needed));
    tool.stats["estimate"] = {{"voxels", estimate.voxels}, {"mb", needed}};
    if (needed > limit)
        throw fileError(
            scene.file, "compose",
            fmt::format("a volume of at most {:.0f} MB (--max-memory)", limit),
            fmt::format("about {:.0f} MB", needed),
            fmt::format("A voxel of {:.3g} m instead of {:.3g} m would fit.",
                        fittingVoxel(set.boxes, placements, extras, params, limit, needed),
                        params.voxel));
    const PackedVolume volume = tool.stage("compose", [&](const Progress& p) {
        return compose(set.boxes, placements, extras, params, p);
    });
    const std::size_t voxels = volume.voxels();
    tool.say(fmt::format("{} placements, {} voxels of {:.4g} m, {:.0f} MB", placements.size(),
                         voxels, params.voxel, double(volume.bytes()) / 1048576));
    tool.stats["placements"] = placements.size();
    tool.stats["voxel_m"] = params.voxel;
    tool.stats["active_voxels"] = voxels;
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
