// SPDX-License-Identifier: Apache-2.0
// volcomp-chart: time against error of the methods and settings, measured on one scene.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/chart/chart.h"
#include "tools/chart/chart_cache.h"
#include "tools/chart/gnuplot.h"
#include "tools/chart/matrix.h"
#include "tools/chart/results.h"
#include "tools/chart/stability.h"
#include "tools/chart/truth_chart.h"
#include "tools/chart/truth_report.h"
#include "tools/chart/truth_study.h"
#include "tools/chart/vdb_render.h"
#include "tools/shared/process.h"
#include "tools/shared/leave_out.h"
#include "tools/shared/numbers.h"
#include "volcomp/scene/scene_inputs.h"
#include "tools/shared/settings.h"
#include "tools/shared/tool.h"
#include "volcomp/base/atomic_file.h"
#include "volcomp/base/error.h"
#include "volcomp/place/voxel_size.h"
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
    bool voxels = true;
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
            series = panel.series.insert(series, {r.row.family, lines, false, {}});
        series->points.push_back({r.row.name, r.cpu_seconds, std::max(kLeastError, r.error)});
    }
    return panel;
}

double sceneVoxel(const Scene& scene, int width, int height)
{
    if (scene.compose.voxel > 0) return scene.compose.voxel * scene.render.width / width;
    const PlacedScene bare = place(scene.surfaces, {}, {}); // no boxes
    const double voxel =
        voxelFromCamera(bare, scene.camera, width, height, scene.compose.voxel_pixels);
    if (!(voxel > 0))
        throw fileError(scene.file, "compose.voxel", "a voxel size, as the camera sees no surface",
                        "0");
    return voxel;
}

/// What all measurements have in common.
struct Study {
    Tool& tool;
    const Options& options;
    const Scene& scene;
    double voxel;      ///< the scene's voxel size at the chart's width, metres
    RenderParams base; ///< exact, box, the scene's extinction, sweep, cutoff 0.001, 4 samples
    ChartCache cache;
};

std::vector<Result> measureRadiance(Study& study)
{
    const Image reference =
        study.cache
            .render(fmt::format("reference, {} samples", study.options.samples), study.voxel,
                    radianceReference(study.base, study.options.samples))
            .image;
    const Image same_rays =
        study.cache
            .render("reference, 4 samples", study.voxel, radianceReference(study.base, kSamples))
            .image;
    std::vector<Result> results;
    for (const Row& row : radianceRows()) {
        RenderParams params = study.base;
        row.change(params);
        if (params.samples >= study.options.samples) continue; // the reference would be no better
        const Measured m = study.cache.render(row.name, study.voxel, params);
        results.push_back(
            {row, settingsOf(params), relativeError(m.image, reference, kRgb), m.cpu_seconds,
             params.samples == kSamples ? relativeError(m.image, same_rays, kRgb) : -1});
    }
    return results;
}

/// Adds the results of vdb_render, if it is installed.
void measurePeer(Study& study, const RenderParams& params, const Image& exact,
                 std::vector<Result>& results)
{
    if (!hasProgram("vdb_render")) {
        study.tool.say("vdb_render is not installed (libopenvdb-tools): the chart goes without it");
        return;
    }
    for (const double step : kPeerSteps) {
        const Row row{fmt::format("{:g}", step), "vdb_render", {}};
        const nlohmann::json key{{"peer", "vdb_render"},
                                 {"voxel", study.voxel},
                                 {"step", step},
                                 {"width", params.width},
                                 {"tau", study.base.tau}};
        const Measured m = study.cache.remember("vdb_render " + row.name, key, [&] {
            const fs::path volume = study.cache.volume(study.voxel);
            return study.tool.stage("vdb_render, step " + row.name, [&](const Progress&) {
                return vdbRender(study.scene, params, volume, study.voxel, step,
                                 study.options.directory / "cache" / "vdb_render.exr");
            });
        });
        results.push_back(
            {row, {{"step", step}}, relativeError(m.image, exact, {"A"}), m.cpu_seconds});
    }
}

/// The transmittance through the pixels' centres against exact trilinear integration.
std::vector<Result> measureTransmittance(Study& study)
{
    RenderParams centre = study.base; // it is quick, so the picture is four times as wide
    centre.width *= 4;
    centre.height *= 4;
    centre.samples = 1;
    centre.extinction = Extinction::isotropic;
    centre.shadows = Shadows::none;
    centre.ambient = Vec3d(0.0);
    centre.cutoff = 0;
    RenderParams reference = centre;
    reference.filter = Filter::trilinear;
    const Measured exact =
        study.cache.render("transmittance, trilinear, exact", study.voxel, reference, false);
    std::vector<Result> results;
    for (const Row& row : transmittanceRows()) {
        RenderParams params = centre;
        row.change(params);
        const Measured m = study.cache.render("transmittance, " + row.family + " " + row.name,
                                              study.voxel, params, false);
        results.push_back(
            {row, settingsOf(params), relativeError(m.image, exact.image, {"A"}), m.cpu_seconds});
    }
    measurePeer(study, centre, exact.image, results);
    return results;
}

/// Measures voxel sizes against the finest without level of detail; adds to the series of `panel`.
std::vector<Result> measureVoxels(Study& study, ChartPanel& panel)
{
    std::vector<Result> results;
    Image truth;
    for (const double factor : kVoxelFactors) {
        const double size = factor * study.voxel;
        const double compose = study.cache.composeSeconds(size);
        panel.series[4].points.push_back({"", 1000 * size, compose});
        for (const bool lod : {false, true}) {
            RenderParams params = study.base;
            params.samples = 16;
            params.lod = lod;
            const std::string name = fmt::format("{:.3g} mm{}", 1000 * size, lod ? ", lod" : "");
            const Measured m = study.cache.render("voxels of " + name, size, params);
            panel.series[2 + lod].points.push_back({"", 1000 * size, m.cpu_seconds});
            if (truth.pixels.empty()) {
                truth = m.image;
                continue;
            }
            const double error = relativeError(m.image, truth, kRgb);
            panel.series[lod].points.push_back({"", 1000 * size, error});
            results.push_back({{name, "voxel size", {}},
                               {{"voxel_m", size}, {"lod", lod}, {"compose_cpu_seconds", compose}},
                               error,
                               m.cpu_seconds});
        }
        if (factor != 1) study.cache.forget(size);
    }
    return results;
}

RenderParams baseParams(const Scene& scene, int width)
{
    RenderParams base = scene.render;
    base.width = width;
    base.height =
        std::max(1, int(std::lround(double(width) * scene.render.height / scene.render.width)));
    base.crop = {};
    base.aovs = false;
    base.background = Vec3d(0.0);
    base.dome.visible = false;
    base.integration = Integration::exact;
    base.filter = Filter::box;
    base.shadows = Shadows::sweep;
    base.cutoff = 0.001;
    base.samples = kSamples;
    return base;
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

/// Reads the scene as the options say, and checks what is to be written into the directory.
Scene sceneOf(Tool& tool, const Options& options, std::initializer_list<const char*> names)
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
    for (const char* name : names) outputs.push_back({"-o", options.directory / name});
    tool.requireFiles(inputsOf(scene), outputs);
    for (const std::string& sun : loadSceneDome(scene)) tool.say(sun);
    return scene;
}

/// Measures and draws how far pictures are from the geometry itself.
void runTruth(Tool& tool, const Options& options)
{
    const Scene scene = sceneOf(
        tool, options, {"truth.svg", "truth.png", "truth.gnuplot", "truth.md", "truth.json"});
    const RenderParams base = baseParams(scene, options.width);
    TruthSetup setup;
    setup.directory = options.directory / "cache";
    setup.width = base.width;
    setup.height = base.height;
    setup.samples = options.truth_samples;
    setup.voxel = sceneVoxel(scene, base.width, base.height);
    setup.factors = options.voxels ? options.factors : std::vector<double>{1};
    setup.all_methods = options.all_methods;
    setup.leave_out = options.leave_out;
    tool.say(fmt::format("{} x {} pixels, voxels of {:.4g} m; everything measured is kept in {}",
                         base.width, base.height, setup.voxel, setup.directory.string()));
    TruthStudy study(tool, scene, setup);
    const std::vector<TruthResult> results = study.measure();
    const std::string
        title = truthTitle(options.scene.stem().string(), results),
        about =
            fmt::format("Error: root mean square against the strands, leaves and skins "
                        "themselves, of the mean brightness, {}x{} pixels.\nTime: bake + compose "
                        "+ load + render; of curves Embree's tree + tracing. Points of a line: 1, "
                        "4, 16 samples a pixel.",
                        base.width, base.height);
    tool.stage("draw", [&](const Progress&) {
        drawWithGnuplot(options.directory, "truth", [&](const std::string& output) {
            return truthScript(title, about, results, output);
        });
    });
    std::string sentences = truthSentences(results);
    tool.stats["truth"] = truthJson(results, setup, study.exactFile(), options.directory);
    writeTextAtomically(options.directory / "truth.json", tool.stats["truth"].dump(2) + '\n');
    writeTextAtomically(options.directory / "truth.md",
                        "# " + title + "\n\n" + about + "\n\n" + sentences + "\n"
                            + truthTable(results));
    tool.say("wrote truth.svg, truth.png, truth.md and truth.json in " + options.directory.string()
             + "\n" + sentences);
}

void run(Tool& tool, const Options& options)
{
    const std::string ending = options.directory.extension().string();
    if (ending == ".png" || ending == ".svg")
        throw fileError(options.directory, "-o", "the name of a folder, which gets the charts",
                        "that of a picture");
    if (options.truth) return runTruth(tool, options);
    const Scene scene = sceneOf(
        tool, options, {"chart.svg", "chart.png", "chart.gnuplot", "results.csv", "table.md"});
    const RenderParams base = baseParams(scene, options.width);
    const double voxel = sceneVoxel(scene, base.width, base.height);
    tool.say(fmt::format("{} x {} pixels, voxels of {:.4g} m; everything measured is kept in {}",
                         base.width, base.height, voxel, (options.directory / "cache").string()));
    Study study{tool,  options, scene,
                voxel, base,    {tool, scene, options.leave_out, options.directory / "cache"}};

    ChartPanel sizes = voxelSizePanel();
    const std::vector<Result> radiance = measureRadiance(study),
                              transmittance = measureTransmittance(study),
                              by_voxel = options.voxels ? measureVoxels(study, sizes)
                                                        : std::vector<Result>();

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
    addTruthOptions(tool.app, options)->excludes(samples);
    return tool.main(argc, argv, [&] { run(tool, options); });
}
