// SPDX-License-Identifier: Apache-2.0
// volcomp-chart: time against error of the methods and settings, measured on one scene.
#include <algorithm>

#include <fmt/format.h>

#include "tools/chart/chart.h"
#include "tools/chart/gnuplot.h"
#include "tools/chart/measure.h"
#include "tools/chart/other_light.h"
#include "tools/chart/results.h"
#include "tools/chart/stability.h"
#include "tools/chart/truth_page.h"
#include "tools/chart/truth_study.h"
#include "tools/shared/process.h"
#include "tools/shared/leave_out.h"
#include "tools/shared/numbers.h"
#include "volcomp/scene/scene_inputs.h"
#include "tools/shared/tool.h"
#include "volcomp/base/atomic_file.h"
#include "volcomp/base/error.h"
#include "volcomp/scene/scene.h"
#include "volcomp/scene/scene_dome.h"

namespace {

using namespace volcomp;
namespace fs = std::filesystem;

struct Options {
    fs::path scene, directory;
    int width = 128;
    int samples =
        49; // no row has that many, so that none takes the reference's places in the pixel
    bool voxels = true, lights = false;
    std::vector<std::string> leave_out;
    bool truth = false, all_methods = false; ///< against the exact geometry
    int truth_samples = 256;
    std::vector<double> factors{0.5, 1, 2, 4}; ///< voxel sizes, on the scene's
};

/// Returns a panel with a series for each family.
ChartPanel timeAgainstError(const std::string& title, const std::string& error,
                            const std::vector<Result>& results, bool lines)
{
    ChartPanel panel;
    panel.title = title;
    panel.x_label = "CPU seconds";
    panel.y_label = error;
    panel.front = true;
    for (const Result& r : results) {
        auto series = std::find_if(panel.series.begin(), panel.series.end(),
                                   [&](const ChartSeries& s) { return s.name == r.row.family; });
        if (series == panel.series.end())
            series = panel.series.insert(series, {r.row.family, lines, false, {}, r.other_light});
        series->points.push_back({r.row.name, r.cpu_seconds, std::max(kLeastError, r.error)});
    }
    return panel;
}

ChartPanel voxelSizePanel()
{
    ChartPanel panel;
    panel.title = "Voxel size (compose + render, sweep, 16 samples)";
    panel.x_label = "voxel, mm";
    panel.y_label = "relative error (RMSE / mean)";
    panel.right_label = "CPU seconds";
    panel.series = {{"error", true, false, {}},
                    {"error, lod", true, false, {}},
                    {"render, s", true, true, {}},
                    {"render with lod, s", true, true, {}},
                    {"compose, s", true, true, {}}};
    return panel;
}

/// Returns the four panels with their places on the page and those of their keys.
std::vector<ChartPanel> arranged(std::vector<ChartPanel> panels)
{
    panels[1].key = "at graph 0.45, graph 0.42 left top";
    panels[2].key = "at graph 0.28, graph 0.98 left top";
    panels[3].key = "at graph 0.05, graph 0.4 left top";
    panels[0].place = {0.065, 0.03, 0.92, 0.49};
    panels[1].place = {0.065, 0.60, 0.25, 0.34};
    panels[2].place = {0.39, 0.60, 0.22, 0.34};
    panels[3].place = {0.735, 0.60, 0.25, 0.34};
    return panels;
}

/// Reads the scene as the options say, and checks what is to be written into the directory. Its
/// dome is not loaded.
Scene sceneOf(Tool& tool, const Options& options, const std::vector<std::string>& names)
{
    if (!hasProgram("gnuplot"))
        throw Error(
            "gnuplot draws the charts, and it is not installed: apt-get install gnuplot-nox");
    std::error_code code;
    if (fs::is_other(options.scene, code)) // a pipe cannot be read again by what this one runs
        throw fileError(options.scene, "", "a scene file (TOML)", "a pipe or a device");
    Scene scene = readScene(options.scene);
    for (const std::string& warning : scene.warnings) tool.warn(warning);
    leaveOut(scene, options.leave_out);
    std::vector<NamedFile> outputs;
    outputs.reserve(names.size());
    for (const std::string& name : names) outputs.push_back({"-o", options.directory / name});
    tool.requireFiles(inputsOf(scene), outputs);
    return scene;
}

/// Measures and draws how far pictures are from the geometry itself.
void runTruth(Tool& tool, const Options& options)
{
    std::vector<std::string> names = truthChartFiles("");
    names.insert(names.end(), {"truth.md", "truth.json"});
    if (options.lights)
        for (const char* light : {"single", "multiple", "dome", "no_dome"}) {
            const std::vector<std::string> more = truthChartFiles(light);
            names.insert(names.end(), more.begin(), more.end());
        }
    const Scene scene = sceneOf(tool, options, names);
    const RenderParams base = chartBase(scene, options.width);
    TruthSetup setup;
    setup.directory = options.directory / "cache";
    setup.width = base.width;
    setup.height = base.height;
    setup.samples = options.truth_samples;
    setup.voxel = sceneVoxel(scene, base.width, base.height);
    setup.factors = options.voxels ? options.factors : std::vector<double>{1};
    setup.all_methods = options.all_methods;
    setup.leave_out = options.leave_out;
    if (options.lights) setup.other_lights = otherLights(scene);
    tool.say(fmt::format("{} x {} pixels, voxels of {:.4g} m; everything measured is kept in {}",
                         base.width, base.height, setup.voxel, setup.directory.string()));
    TruthStudy study(tool, scene, setup);
    const std::vector<TruthOfLight> lights = study.measure();
    writeTruth(tool, options.directory, options.scene.stem().string(), setup, lights);
}

void run(Tool& tool, const Options& options)
{
    const std::string ending = options.directory.extension().string();
    if (ending == ".png" || ending == ".svg")
        throw fileError(options.directory, "-o", "the name of a folder, which gets the charts",
                        "that of a picture");
    if (options.truth) return runTruth(tool, options);
    const Scene read = sceneOf(
        tool, options, {"chart.svg", "chart.png", "chart.gnuplot", "results.csv", "table.md"});
    Scene scene = read;
    for (const std::string& sun : loadSceneDome(scene)) tool.say(sun);
    const RenderParams base = chartBase(scene, options.width);
    const double voxel = sceneVoxel(scene, base.width, base.height);
    tool.say(fmt::format("{} x {} pixels, voxels of {:.4g} m; everything measured is kept in {}",
                         base.width, base.height, voxel, (options.directory / "cache").string()));
    ChartPanel sizes = voxelSizePanel();
    std::vector<Result> radiance, transmittance, by_voxel;
    const fs::path cache = options.directory / "cache";
    { // holds a volume in memory
        ChartStudy study{tool,
                         scene,
                         cache,
                         options.samples,
                         voxel,
                         base,
                         {tool, scene, options.leave_out, cache}};
        radiance = measureRadiance(study, radianceRows());
        transmittance = measureTransmittance(study);
        if (options.voxels) by_voxel = measureVoxels(study, sizes);
    }
    if (options.lights) {
        const std::vector<Result> others = measureOtherLights(
            tool, read, options.width, options.samples, voxel, options.leave_out, cache);
        radiance.insert(radiance.end(), others.begin(), others.end());
    }

    const std::vector<ChartPanel> panels = arranged(
        {timeAgainstError(
             fmt::format("{}: radiance, against trilinear, shadow rays, {} samples per pixel "
                         "(names end in the samples per pixel)",
                         options.scene.stem().string(), options.samples),
             "relative error (RMSE / mean)", radiance, false),
         timeAgainstError("Transmittance, against exact trilinear (steps)",
                          "relative error (RMSE / mean)", transmittance, true),
         sizes, stabilityPanel()});
    tool.stage("draw", [&](const Progress&) {
        drawWithGnuplot(options.directory, "chart", [&](const std::string& output) {
            return gnuplotScript(panels, 1300, 1320, output);
        });
    });
    writeTextAtomically(options.directory / "results.csv",
                        "panel,name,family,cpu_seconds,error,error_without_sampling,settings\n"
                            + csvRows("radiance", radiance)
                            + csvRows("transmittance", transmittance) + csvRows("voxel", by_voxel));
    const std::string table = choiceTables(radiance, transmittance);
    writeTextAtomically(options.directory / "table.md", table);
    tool.say("wrote chart.svg, chart.png, results.csv and table.md in " + options.directory.string()
             + "\n" + table);
}

/// Adds the options of the chart against the exact geometry; returns the one that asks for it.
CLI::Option* addTruthOptions(CLI::App& app, Options& options)
{
    CLI::Option* truth = app.add_flag(
        "--truth", options.truth,
        "Compare with the strands, leaves and skins themselves instead of a better picture of the "
        "same voxels: curves traced directly, and volumes of several voxel sizes and settings");
    app.add_option("--truth-samples", options.truth_samples,
                   "Samples per pixel of the exact picture")
        ->capture_default_str()
        ->check(wholeNumber(2, 1 << 24))
        ->needs(truth);
    app.add_option("--voxels", options.factors, "Voxel sizes to compare, as factors on the scene's")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->capture_default_str()
        ->check(realNumber(0.01, 100))
        ->type_name("FACTOR,...")
        ->needs(truth);
    app.add_flag(
           "--all-methods", options.all_methods,
           "Compare trilinear density and shadow rays at every voxel size, not at the scene's "
           "alone")
        ->needs(truth);
    return truth;
}

} // namespace

int main(int argc, char** argv)
{
    Tool tool(
        "volcomp-chart",
        "Measures time and error of the methods and settings on a scene, and draws the chart. "
        "Bakes and composes what it needs.");
    Options options;
    tool.app.add_option("scene", options.scene, "Scene file (TOML)")
        ->required()
        ->type_name("SCENE");
    tool.app
        .add_option(
            "-o,--output", options.directory,
            "Directory for chart.svg, chart.png, results.csv, table.md, or with --truth truth.svg, "
            "truth.png, truth.md, truth.json, and for what was measured (cache/)")
        ->required()
        ->type_name("DIR");
    tool.app
        .add_option("--width", options.width,
                    "Width of the pictures, pixels; voxels follow from it as in the scene")
        ->capture_default_str()
        ->check(wholeNumber(16, 32768));
    CLI::Option* samples =
        tool.app.add_option("--samples", options.samples, "Samples per pixel of the reference")
            ->capture_default_str()
            ->check(wholeNumber(1, 65536));
    tool.app
        .add_option(
            "--leave-out", options.leave_out,
            "Measure without this surface and the layers on it; may be given more than once")
        ->type_name("SURFACE")
        ->allow_extra_args(false);
    tool.app.add_flag("!--no-voxels", options.voxels,
                      "Leave out the chart of voxel sizes, which composes eight volumes; with "
                      "--truth take the scene's voxel alone");
    tool.app.add_flag("--lights", options.lights,
                      "Measure also under the scattering that the scene does not have, and with a "
                      "dome, or without the scene's light from all around: each against "
                      "references in that light");
    addTruthOptions(tool.app, options)->excludes(samples);
    return tool.main(argc, argv, [&] { run(tool, options); });
}
