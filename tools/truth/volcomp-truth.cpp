// SPDX-License-Identifier: Apache-2.0
// volcomp-truth: the exact picture of a scene's geometry, and how far another picture is from it.
#include <filesystem>
#include <iostream>
#include <limits>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "tools/shared/choice.h"
#include "tools/shared/even_dome.h"
#include "tools/shared/leave_out.h"
#include "tools/shared/numbers.h"
#include "tools/shared/picture_error.h"
#include "tools/shared/tool.h"
#include "tools/truth/exact_picture.h"
#include "volcomp/base/error.h"
#include "volcomp/scene/scene.h"
#include "volcomp/scene/scene_dome.h"
#include "volcomp/scene/scene_inputs.h"
#include "volcomp/view/image.h"

namespace {

using namespace volcomp;
namespace fs = std::filesystem;

struct Options {
    fs::path scene, compared, known;
    std::vector<std::string> settings;
    std::vector<fs::path> outputs;
    std::vector<std::string> leave_out;
    std::string size;
    ExactParams params;
    double solid_radius = 0;
    int block = 4;
    int bounces = 0; // 0: by the scene
    std::optional<Scattering> scattering;
    std::optional<double> dome;
    bool background = true;
};

Scene sceneOf(const Tool& tool, const Options& options)
{
    Scene scene = readScene(options.scene, options.settings);
    for (const std::string& warning : scene.warnings) tool.warn(warning);
    std::vector<NamedFile> outputs, inputs = inputsOf(scene);
    for (const fs::path& output : options.outputs) outputs.push_back({"-o", output});
    inputs.push_back({"--compare", options.compared});
    tool.requireFiles(inputs, outputs);
    scene.render.scattering = options.scattering.value_or(scene.render.scattering);
    applyEvenDome(scene.render, options.dome);
    for (const std::string& sun : loadSceneDome(scene)) tool.say(sun);
    leaveOut(scene, options.leave_out);
    if (!options.background) {
        scene.render.background = Vec3d(0.0);
        scene.render.dome.visible = false;
    }
    // What is scattered more than once has to have an albedo.
    if (options.bounces > 1) scene.render.scattering = Scattering::multiple;
    if (options.size.empty()) return scene;
    const std::string expected = "WIDTHxHEIGHT in pixels, such as 640x480";
    const std::size_t x = options.size.find('x');
    const auto read = [&](const std::string& text) {
        return readWhole("--size", text, expected, options.size);
    };
    scene.render.width = read(options.size.substr(0, x));
    scene.render.height = read(x == options.size.npos ? "" : options.size.substr(x + 1));
    return scene;
}

ExactParams paramsOf(const Options& options, const Scene& scene)
{
    constexpr int kBounces = 64; // what is still under way then is below 0.1 % up to a = 0.95
    ExactParams params = options.params;
    params.paths.bounces = options.bounces;
    if (options.bounces == 0)
        params.paths.bounces =
            scene.render.scattering == Scattering::multiple && params.paths.shadows ? kBounces : 1;
    return params;
}

Image makePicture(Tool& tool, const Options& options)
{
    Scene scene = sceneOf(tool, options);
    const ExactParams params = paramsOf(options, scene);
    const ExactScene exact = tool.stage(
        "grow and place", [&](const Progress& p) { return makeExactScene(std::move(scene), p); });
    for (const std::string& warning : exact.warnings) tool.warn(warning);
    tool.say(fmt::format("{} boxes, {} segments", exact.placed.boxes.size(), exact.segmentCount()));
    const double solid =
        options.solid_radius > 0 ? options.solid_radius : std::numeric_limits<double>::infinity();
    const auto embree = tool.stage(
        "tree", [&](const Progress&) { return std::make_unique<EmbreeScene>(exact, solid); });
    Image image = tool.stage(
        "trace", [&](const Progress& p) { return exactPicture(exact, *embree, params, p); });
    tool.stats["segments"] = exact.segmentCount();
    tool.stats["placements"] = exact.placed.boxes.size();
    tool.stats["samples"] = options.params.samples;
    tool.stats["seed"] = options.params.seed;
    tool.stats["bounces"] = params.paths.bounces;
    const std::vector<std::pair<std::string, std::string>> about{
        {"Software", "volcomp"},
        {"volcomp/scene", options.scene.string()},
        {"volcomp/samples", std::to_string(options.params.samples)},
        {"volcomp/seed", std::to_string(options.params.seed)},
        {"volcomp/bounces", std::to_string(params.paths.bounces)}};
    for (const fs::path& output : options.outputs) writeImage(output, image, about);
    return image;
}

void compare(Tool& tool, const Options& options, const Image& exact)
{
    const PictureError e = pictureError(readImage(options.compared), exact, options.block);
    std::cout << fmt::format("mean radiance       {:.5g}\n"
                             "bias of the mean    {:+.2f} %\n"
                             "RMSE                {:.4f} of the mean\n"
                             "RMSE in {}x{} blocks  {:.4f} of the mean\n"
                             "mean alpha          {:.4f}\n"
                             "bias of alpha       {:+.4f}\n"
                             "RMSE of alpha       {:.4f}, in blocks {:.4f}\n",
                             e.mean, 100 * e.bias, e.rmse, options.block, options.block,
                             e.block_rmse, e.alpha_mean, e.alpha_bias, e.alpha_rmse,
                             e.alpha_block_rmse);
    if (!std::cout.flush())
        throw Error("--compare: the figures could not be written to the output");
    tool.stats["error"] = toJson(e);
}

void run(Tool& tool, const Options& options)
{
    for (const fs::path& output : options.outputs) requirePictureName(output);
    if (!options.known.empty() && !options.outputs.empty())
        throw Error("--known: expected no -o beside it, as nothing is traced");
    if (options.bounces > 1 && !options.params.paths.shadows)
        throw Error(
            fmt::format("--bounces: expected 1 beside --no-shadows, as paths are blocked by "
                        "what they meet, found {}",
                        options.bounces));
    if (options.params.halves && options.params.samples < 2)
        throw Error("--samples: expected at least 2, one for each half, or --no-halves, found 1");
    if (!options.params.halves && !options.compared.empty())
        throw Error("--no-halves: expected no --compare beside it, which needs the halves");
    if (options.outputs.empty() && options.compared.empty())
        throw Error("nothing to do: expected -o or --compare");
    const Image exact =
        options.known.empty() ? makePicture(tool, options) : readImage(options.known);
    if (!options.compared.empty()) compare(tool, options, exact);
}

void addOptions(CLI::App& app, Options& options)
{
    app.add_option("scene", options.scene, "Scene file (TOML)")->required()->type_name("SCENE");
    app.add_option("--set", options.settings,
                   "Give a key of the scene another value; may be given more than once")
        ->type_name("KEY=VALUE")
        ->allow_extra_args(false);
    app.add_option(
           "-o,--output", options.outputs,
           "Picture to write, .exr (with what --known needs) or .png; may be given more than "
           "once")
        ->type_name("PICTURE")
        ->allow_extra_args(false);
    app.add_option("--samples", options.params.samples, "Rays per pixel")
        ->capture_default_str()
        ->check(wholeNumber(1, 1 << 24));
    app.add_flag(
        "!--no-halves", options.params.halves,
        "All samples in one jittered grid, as a renderer takes them; the picture lacks what "
        "--known needs");
    app.add_option("--seed", options.params.seed, "Of the random numbers")->capture_default_str();
    app.add_option("--size", options.size, "Size of the picture, pixels (default: the scene's)")
        ->type_name("WxH");
    app.add_flag("!--no-background", options.background,
                 "Nothing behind everything: black there, and alpha 0, whatever the scene says");
    addChoice(app, "--scattering", options.scattering,
              "Whether light is scattered once or any number of times (default: the scene's)",
              kScatteringWords);
    addEvenDome(app, options.dome);
    app.add_option(
           "--bounces", options.bounces,
           "How often light is scattered at most between a light and the eye; 0: once if "
           "the scene's scattering is \"single\", 64 times if it is \"multiple\". More "
           "than once takes the diffuse light of \"multiple\". Highlights show lights alone")
        ->capture_default_str()
        ->check(wholeNumber(0, 1 << 16));
    app.add_flag("!--no-shadows", options.params.paths.shadows,
                 "Light is not blocked by anything, and scattered once");
    app.add_option("--solid", options.solid_radius,
                   "Fibres of this radius in metres or more shade themselves, as solid bodies; 0: "
                   "none does")
        ->capture_default_str()
        ->check(realNumber(0));
    app.add_option("--leave-out", options.leave_out,
                   "Without this surface and the layers on it; may be given more than once")
        ->type_name("SURFACE")
        ->allow_extra_args(false);
    app.add_option("--compare", options.compared,
                   "Say how far this picture of the scene is from the exact one")
        ->type_name("PICTURE");
    app.add_option("--block", options.block, "Compare also in blocks of so many pixels a side")
        ->capture_default_str()
        ->check(wholeNumber(1, 1024));
    app.add_option("--known", options.known,
                   "Take this exact picture, which an earlier run wrote, instead of tracing it")
        ->type_name("PICTURE.exr");
}

} // namespace

int main(int argc, char** argv)
{
    Tool tool("volcomp-truth",
              "Traces the strands, leaves and skins of a scene themselves, without any voxel: the "
              "picture that volcomp-render's is to come close to.");
    Options options;
    addOptions(tool.app, options);
    return tool.main(argc, argv, [&] { run(tool, options); });
}
