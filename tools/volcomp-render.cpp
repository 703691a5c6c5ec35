// volcomp-render: a volume file and a scene's camera and lights to a picture.
#include <cstdio>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "error.h"
#include "image.h"
#include "render.h"
#include "scene.h"
#include "tool.h"
#include "vdb_io.h"
#include "voxel_tree.h"

using namespace volcomp;

namespace {

/// What the picture was computed with, in the words of the scene file.
nlohmann::json settingsOf(const RenderParams& p)
{
    static constexpr const char* kIntegration[] = {"exact", "riemann"};
    static constexpr const char* kFilter[] = {"box", "trilinear"};
    static constexpr const char* kExtinction[] = {"isotropic", "fibre"};
    static constexpr const char* kShadows[] = {"exact", "sweep", "none"};
    static constexpr const char* kUndirected[] = {"isotropic", "gradient"};
    return {{"width", p.width}, {"height", p.height}, {"samples", p.samples}, {"tau", p.tau}, {"step", p.step}, {"cutoff", p.cutoff},
            {"integration", kIntegration[int(p.integration)]}, {"filter", kFilter[int(p.filter)]}, {"extinction", kExtinction[int(p.extinction)]},
            {"shadows", kShadows[int(p.shadows)]}, {"undirected", kUndirected[int(p.undirected)]}};
}

} // namespace

int main(int argc, char** argv)
{
    Tool tool("volcomp-render", "Renders the volume of a scene to a picture.");
    std::filesystem::path scene_file, volume_file;
    std::vector<std::filesystem::path> outputs;
    std::string size, crop;
    int samples = 0;
    tool.app.add_option("scene", scene_file, "Scene file (TOML)")->required()->type_name("SCENE");
    tool.app.add_option("-o,--output", outputs, "Picture to write, .exr or .png; may be given more than once")->required()->type_name("PICTURE")->allow_extra_args(false);
    tool.app.add_option("--volume", volume_file, "Volume to render, any fog volume (default: volume.vdb beside the first picture)")->type_name("FILE.vdb");
    tool.app.add_option("--size", size, "Size of the picture, pixels (default: the scene's)")->type_name("WxH");
    tool.app.add_option("--samples", samples, "Samples per pixel (default: the scene's)")->check(CLI::Range(1, 65536));
    tool.app.add_option("--crop", crop, "Render only this rectangle, pixels from the top left corner")->type_name("X,Y,W,H");
    std::optional<Shadows> shadows;
    std::optional<Integration> integration;
    std::optional<Filter> filter;
    std::optional<Extinction> extinction;
    std::optional<double> step, cutoff;
    const auto choice = [&](const char* name, auto& value, const char* meaning, auto words) {
        using E = typename std::decay_t<decltype(value)>::value_type;
        tool.app.add_option_function<E>(name, [&value](const E& e) { value = e; }, meaning)->transform(CLI::CheckedTransformer(words, CLI::ignore_case));
    };
    choice("--shadows", shadows, "Light on its way to a voxel (default: the scene's)",
           std::map<std::string, Shadows>{{"exact", Shadows::exact}, {"sweep", Shadows::sweep}, {"none", Shadows::none}});
    choice("--integration", integration, "Closed form, or the paper's sums (default: the scene's)",
           std::map<std::string, Integration>{{"exact", Integration::exact}, {"riemann", Integration::riemann}});
    choice("--filter", filter, "Density between voxel centres (default: the scene's)",
           std::map<std::string, Filter>{{"box", Filter::box}, {"trilinear", Filter::trilinear}});
    choice("--extinction", extinction, "Whether fibres cover less seen end on (default: the scene's)",
           std::map<std::string, Extinction>{{"isotropic", Extinction::isotropic}, {"fibre", Extinction::fibre}});
    tool.app.add_option("--step", step, "Step of the sums, voxels (default: the scene's)")->check(CLI::Range(0.001, 1000.0));
    tool.app.add_option("--cutoff", cutoff, "Rays end where a smaller fraction of light passes; no radiance is off by more than this fraction of the brightest voxel's (default: the scene's)")->check(CLI::Range(0.0, 0.99));
    return tool.main(argc, argv, [&] {
        for (const auto& output : outputs) isExrName(output);
        Scene scene = readScene(scene_file);
        RenderParams& params = scene.render;
        char rest = 0;
        if (!size.empty() && (std::sscanf(size.c_str(), "%dx%d%c", &params.width, &params.height, &rest) != 2 || params.width < 1 || params.height < 1))
            throw Error("--size: expected WIDTHxHEIGHT in pixels, such as 640x480, found '" + size + "'");
        if (samples > 0) params.samples = samples;
        params.shadows = shadows.value_or(params.shadows);
        params.integration = integration.value_or(params.integration);
        params.filter = filter.value_or(params.filter);
        params.extinction = extinction.value_or(params.extinction);
        params.step = step.value_or(params.step);
        params.cutoff = cutoff.value_or(params.cutoff);
        if (!crop.empty()) {
            Crop& c = params.crop;
            if (std::sscanf(crop.c_str(), "%d,%d,%d,%d%c", &c.x, &c.y, &c.width, &c.height, &rest) != 4)
                throw Error("--crop: expected X,Y,WIDTH,HEIGHT in pixels, such as 100,50,64,64, found '" + crop + "'");
        }
        if (volume_file.empty()) volume_file = outputs[0].parent_path() / "volume.vdb";
        const VoxelTree tree = tool.stage("load", [&](const Progress& progress) { return readVoxelTree(volume_file, progress); });
        RenderStats stats;
        const Image image = tool.stage("render", [&](const Progress& progress) {
            return render(tree, scene.materials, scene.camera, scene.lights, params, progress, &stats);
        });
        tool.stats["settings"] = settingsOf(params);
        tool.stats["render"] = {{"rays", stats.rays}, {"shadow_rays", stats.shadow_rays}, {"shaded_voxels", stats.shaded_voxels}, {"active_voxels", stats.active_voxels}, {"volume_bytes", tree.memoryBytes()},
                                {"prepare_seconds", stats.prepare_seconds}, {"march_seconds", stats.march_seconds}};
        tool.say(fmt::format("{} rays, {} shadow rays, {} shaded voxels in {:.2f} s, {} voxels", stats.rays, stats.shadow_rays, stats.shaded_voxels,
                             stats.march_seconds, stats.active_voxels));
        tool.stage("write", [&](const Progress&) {
            for (const auto& output : outputs)
                writeImage(output, image, {{"Software", "volcomp"}, {"volcomp/scene", scene_file.string()}, {"volcomp/volume", volume_file.string()},
                                            {"volcomp/settings", tool.stats["settings"].dump()},
                                            {"volcomp/seconds", fmt::format("{:.2f}", stats.prepare_seconds + stats.march_seconds)}});
        });
        for (const auto& output : outputs) tool.say("wrote " + output.string());
    });
}
