// volcomp-render: a volume file and a scene's camera and lights to a picture.
#include <cstdio>

#include <fmt/format.h>

#include "error.h"
#include "image.h"
#include "render.h"
#include "scene.h"
#include "tool.h"
#include "vdb_io.h"

using namespace volcomp;

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
    return tool.main(argc, argv, [&] {
        Scene scene = readScene(scene_file);
        RenderParams& params = scene.render;
        char rest = 0;
        if (!size.empty() && (std::sscanf(size.c_str(), "%dx%d%c", &params.width, &params.height, &rest) != 2 || params.width < 1 || params.height < 1))
            throw Error("--size: expected WIDTHxHEIGHT in pixels, such as 640x480, found '" + size + "'");
        if (samples > 0) params.samples = samples;
        if (!crop.empty()) {
            Crop& c = params.crop;
            if (std::sscanf(crop.c_str(), "%d,%d,%d,%d%c", &c.x, &c.y, &c.width, &c.height, &rest) != 4)
                throw Error("--crop: expected X,Y,WIDTH,HEIGHT in pixels, such as 100,50,64,64, found '" + crop + "'");
        }
        if (volume_file.empty()) volume_file = outputs[0].parent_path() / "volume.vdb";
        const Volume volume = tool.stage("load", [&](const Progress&) { return readVolume(volume_file); });
        RenderStats stats;
        const Image image = tool.stage("render", [&](const Progress& progress) {
            return render(volume, scene.materials, scene.camera, scene.lights, params, progress, &stats);
        });
        tool.stats["render"] = {{"width", params.width}, {"height", params.height}, {"samples", params.samples}, {"rays", stats.rays},
                                {"shadow_rays", stats.shadow_rays}, {"shaded_voxels", stats.shaded_voxels}, {"active_voxels", stats.active_voxels},
                                {"prepare_seconds", stats.prepare_seconds}, {"march_seconds", stats.march_seconds}};
        tool.say(fmt::format("{} rays, {} shadow rays, {} shaded voxels in {:.2f} s, {} voxels", stats.rays, stats.shadow_rays, stats.shaded_voxels,
                             stats.march_seconds, stats.active_voxels));
        tool.stage("write", [&](const Progress&) {
            for (const auto& output : outputs)
                writeImage(output, image, {{"Software", "volcomp"}, {"volcomp/scene", scene_file.string()}, {"volcomp/volume", volume_file.string()}});
        });
        for (const auto& output : outputs) tool.say("wrote " + output.string());
    });
}
