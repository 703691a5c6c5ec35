// volcomp-chart: time against error of the methods and settings, measured on one scene.
#include <algorithm>
#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "volcomp/base/atomic_file.h"
#include "tools/chart/chart.h"
#include "tools/chart/chart_cache.h"
#include "volcomp/base/error.h"
#include "volcomp/render/march/integrator.h"
#include "tools/shared/process.h"
#include "tools/shared/leave_out.h"
#include "volcomp/scene/scene.h"
#include "tools/shared/settings.h"
#include "tools/shared/tool.h"
#include "tools/chart/vdb_render.h"
#include "volcomp/place/voxel_size.h"

namespace {

using namespace volcomp;
namespace fs = std::filesystem;

struct Options {
    fs::path scene, directory;
    int width = 128, samples = 49; // not a number of the matrix: other places in the pixel
    bool voxels = true;
    std::vector<std::string> leave_out;
};

/// A setting: its name in the chart, the family that gives it its colour, and what it changes.
struct Row {
    std::string name, family;
    std::function<void(RenderParams&)> change;
};

// ---- the matrix: add a row here
// ----------------------------------------------------------------------------------

constexpr int kSamples =
    4; ///< of most rows; at that number errors are also taken without those of sampling

/// Changes of: exact, box, the scene's extinction, sweep, cutoff 0.001, 4 samples. Names end in the
/// samples.
std::vector<Row> radianceRows()
{
    std::vector<Row> rows;
    const auto add = [&](const std::string& name, const std::string& family,
                         std::function<void(RenderParams&)> change) {
        rows.push_back({name, family, std::move(change)});
    };
    for (const int samples : {1, 4, 16})
        add(fmt::format("sweep, {}", samples), "box, sweep",
            [=](RenderParams& p) { p.samples = samples; });
    for (const int samples : {1, 4, 16})
        add(fmt::format("rays, {}", samples), "box, shadow rays",
            [=](RenderParams& p) { p.samples = samples, p.shadows = Shadows::exact; });
    for (const int samples : {1, 4, 16})
        add(fmt::format("trilinear, {}", samples), "trilinear, shadow rays", [=](RenderParams& p) {
            p.samples = samples, p.shadows = Shadows::exact, p.filter = Filter::trilinear;
        });
    for (const int samples : {1, 4, 16})
        add(fmt::format("trilinear sweep, {}", samples), "trilinear, sweep",
            [=](RenderParams& p) { p.samples = samples, p.filter = Filter::trilinear; });
    for (const double step : {2.0, 1.0, 0.5})
        add(fmt::format("riemann, step {:g}, 4", step), "riemann, shadow rays",
            [=](RenderParams& p) {
                p.integration = Integration::riemann, p.step = step, p.shadows = Shadows::exact;
            });
    for (const double cutoff : {0.1, 0.01, 0.0}) {
        add(fmt::format("sweep, cutoff {:g}, 4", cutoff), "other cutoff",
            [=](RenderParams& p) { p.cutoff = cutoff; });
        add(fmt::format("trilinear, cutoff {:g}, 4", cutoff), "other cutoff", [=](RenderParams& p) {
            p.cutoff = cutoff, p.shadows = Shadows::exact, p.filter = Filter::trilinear;
        });
    }
    add("no shadows, 4", "left out", [](RenderParams& p) { p.shadows = Shadows::none; });
    add("isotropic, 4", "left out", [](RenderParams& p) { p.extinction = Extinction::isotropic; });
    return rows;
}

RenderParams radianceReference(RenderParams p, int samples)
{
    p.filter = Filter::trilinear;
    p.shadows = Shadows::exact;
    p.cutoff = 1e-6;
    p.samples = samples;
    return p;
}

/// Transmittance through pixel centres, isotropic: what other programs can do as well. Changes of:
/// exact, box, cutoff 0.
std::vector<Row> transmittanceRows()
{
    std::vector<Row> rows{
        {"exact, box", "exact", [](RenderParams&) {}},
        {"exact, trilinear", "exact", [](RenderParams& p) { p.filter = Filter::trilinear; }}};
    for (const double step : {2.0, 1.0, 0.5, 0.25})
        rows.push_back({fmt::format("{:g}", step), "riemann, box", [=](RenderParams& p) {
                            p.integration = Integration::riemann, p.step = step;
                        }});
    for (const double step : {2.0, 1.0, 0.5, 0.25, 0.125})
        rows.push_back({fmt::format("{:g}", step), "riemann, trilinear", [=](RenderParams& p) {
                            p.integration = Integration::riemann, p.filter = Filter::trilinear,
                            p.step = step;
                        }});
    return rows;
}

const std::vector<double> kPeerSteps{2, 1, 0.5, 0.25}; ///< of vdb_render
const std::vector<double> kVoxelFactors{
    0.35, 0.5, 0.71, 1, 1.41, 2, 2.83, 4}; ///< of the scene's voxel; the first is the truth

// -------------------------------------------------------------------------------------------------------------------

struct Result {
    Row row;
    nlohmann::json settings;
    double error, cpu_seconds;
    double method_error = -1; ///< without that of sampling; below 0: not known
};

const std::vector<std::string> kRgb{"R", "G", "B"};

/// Root mean square difference over all pixels and the channels, relative to the reference's mean.
double relativeError(const Image& image, const Image& reference,
                     const std::vector<std::string>& channels)
{
    const auto index = [](const Image& i, const std::string& name) {
        const auto at = std::find(i.channels.begin(), i.channels.end(), name);
        if (at == i.channels.end()) throw Error("a picture has no channel " + name);
        return std::size_t(at - i.channels.begin());
    };
    double square = 0, mean = 0;
    for (const std::string& channel : channels) {
        const std::size_t a = index(image, channel), b = index(reference, channel);
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x) {
                const double difference = double(image.pixel(x, y)[a]) - reference.pixel(x, y)[b];
                square += difference * difference;
                mean += reference.pixel(x, y)[b];
            }
    }
    const double count = double(image.width) * image.height * double(channels.size());
    if (!(mean > 0))
        throw Error(
            "the reference picture is black: the camera sees no lit volume, so there is nothing to compare");
    return std::sqrt(square / count) / (mean / count);
}

/// Error of a lit slab of 32 voxels against (1 - e^-32x) S, x the optical depth of a voxel, for
/// each method.
ChartPanel stabilityPanel()
{
    ChartPanel panel;
    panel.title = "Stability: a lit slab of 32 voxels";
    panel.x_label = "optical depth of a step (one voxel)";
    panel.y_label = "relative error";
    panel.series = {{"", true, false, {}},
                    {"riemann", true, false, {}},
                    {"1 - exp(-x) in float", true, false, {}}};
    panel.series[0].name = "exact";
    Material material;
    material.alpha = 1;
    Light light;
    light.direction = {0, 0, -1};
    RenderParams params;
    params.shadows = Shadows::none;
    params.cutoff = 0;
    for (double exponent = -8; exponent <= 3.001; exponent += 0.25) {
        const float x = float(std::pow(10, exponent));
        Volume volume;
        volume.parts.emplace_back();
        volume.parts[0].density = openvdb::FloatGrid::create(0.0f);
        volume.parts[0].density->fill(openvdb::CoordBBox({0, 0, 0}, {7, 7, 31}), x, true);
        const VoxelTree tree(volume);
        const double truth = 0.25 * -std::expm1(-32.0 * double(x));
        for (const Integration integration : {Integration::exact, Integration::riemann}) {
            params.integration = integration;
            const std::vector<Light> lights{light};
            const Integrator integrator(tree, {material}, lights, params);
            Integrator::Scratch scratch;
            const double found =
                integrator.trace({3.1, 3.2, 40.003}, {0, 0, -1}, scratch).radiance[0];
            panel.series[integration == Integration::riemann].points.push_back(
                {"", x, std::max(1e-16, std::abs(found / truth - 1))});
        }
        float light_left = 1, sum = 0;
        for (int i = 0; i < 32; ++i) {
            sum += light_left * (1 - std::exp(-x));
            light_left *= std::exp(-x);
        }
        panel.series[2].points.push_back(
            {"", x, std::max(1e-16, std::abs(0.25 * double(sum) / truth - 1))});
    }
    return panel;
}

constexpr double kLeastError = 1e-6; ///< that is shown: pictures are floats

/// The points of each family as one series, and all of them.
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

/// Which setting to choose, in Markdown.
std::string choiceTable(const std::string& title, const std::vector<ChartPoint>& points)
{
    std::string text =
        "| " + title + ": error at most | choose | error | CPU seconds |\n|---|---|---|---|\n";
    for (const double limit : {1e-1, 1e-2, 1e-3, 1e-4}) {
        const int best = cheapestWithin(points, limit);
        if (best >= 0)
            text += fmt::format(
                "| {:g} | {} | {} | {:.2f} |\n", limit, points[best].name,
                points[best].y < kLeastError ? "below 1e-6" : fmt::format("{:.2g}", points[best].y),
                points[best].x);
        else text += fmt::format("| {:g} | none of these | | |\n", limit);
    }
    return text;
}

std::string choiceTables(const std::vector<Result>& radiance,
                         const std::vector<Result>& transmittance)
{
    std::vector<ChartPoint> all, method, depth;
    for (const Result& r : radiance) {
        all.push_back({r.row.name, r.cpu_seconds, r.error});
        if (r.method_error >= 0) method.push_back({r.row.name, r.cpu_seconds, r.method_error});
    }
    for (const Result& r : transmittance)
        depth.push_back({(r.row.family == "exact" ? "" : r.row.family + ", step ") + r.row.name,
                         r.cpu_seconds, r.error});
    return choiceTable("radiance, sampling included", all) + "\n"
        + choiceTable("radiance, the same rays as the reference", method) + "\n"
        + choiceTable("transmittance at pixel centres", depth);
}

void writeText(const fs::path& file, const std::string& text)
{
    writeAtomically(file, [&](const fs::path& temporary) {
        std::ofstream stream(temporary);
        stream << text;
        if (!stream.flush())
            throw fileError(file, "", "a file to write", "an error", "Is the disk full?");
    });
}

void draw(const std::vector<ChartPanel>& panels, const fs::path& directory)
{
    for (const char* name : {"chart.svg", "chart.png"})
        writeAtomically(directory / name, [&](const fs::path& temporary) {
            const fs::path script = directory / "chart.gnuplot";
            writeText(script, gnuplotScript(panels, 1300, 1320, temporary.string()));
            const ProcessResult result = runProcess({"gnuplot", script.string()});
            if (result.status != 0 || !fs::exists(temporary))
                throw fileError(script, "", "a script that gnuplot draws", result.output);
        });
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

/// What all measurements start from.
struct Study {
    Tool& tool;
    const Options& options;
    const Scene& scene;
    double voxel;      ///< of the scene at the chart's width
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

std::vector<Result> measureTransmittance(Study& study)
{
    RenderParams centre = study.base; // quick: four times as wide
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
    if (!hasProgram("vdb_render")) {
        study.tool.say("vdb_render is not installed (libopenvdb-tools): the chart goes without it");
        return results;
    }
    for (const double step : kPeerSteps) {
        const Row row{fmt::format("{:g}", step), "vdb_render", {}};
        const nlohmann::json key{{"peer", "vdb_render"},
                                 {"voxel", study.voxel},
                                 {"step", step},
                                 {"width", centre.width},
                                 {"tau", study.base.tau}};
        const Measured m = study.cache.remember("vdb_render " + row.name, key, [&] {
            const fs::path volume = study.cache.volume(study.voxel);
            return study.tool.stage("vdb_render, step " + row.name, [&](const Progress&) {
                return vdbRender(study.scene, centre, volume, study.voxel, step,
                                 study.options.directory / "cache" / "vdb_render.exr");
            });
        });
        results.push_back(
            {row, {{"step", step}}, relativeError(m.image, exact.image, {"A"}), m.cpu_seconds});
    }
    return results;
}

/// Against the finest without level of detail; draws into `panel`.
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

std::string csvRows(const char* panel, const std::vector<Result>& results)
{
    std::string csv;
    for (const Result& r : results) {
        std::string settings = r.settings.dump(), doubled;
        for (const char c : settings) doubled += c == '"' ? "\"\"" : std::string(1, c);
        csv +=
            fmt::format("{},\"{}\",\"{}\",{:.4f},{:.6g},{},\"{}\"\n", panel, r.row.name,
                        r.row.family, r.cpu_seconds, r.error,
                        r.method_error < 0 ? "" : fmt::format("{:.6g}", r.method_error), doubled);
    }
    return csv;
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
    base.integration = Integration::exact;
    base.filter = Filter::box;
    base.shadows = Shadows::sweep;
    base.cutoff = 0.001;
    base.samples = kSamples;
    return base;
}

void run(Tool& tool, const Options& options)
{
    if (!hasProgram("gnuplot"))
        throw Error(
            "gnuplot draws the charts, and it is not installed: apt-get install gnuplot-nox");
    Scene scene = readScene(options.scene);
    leaveOut(scene, options.leave_out);
    const RenderParams base = baseParams(scene, options.width);
    const double voxel = sceneVoxel(scene, base.width, base.height);
    tool.say(fmt::format("{} x {} pixels, voxels of {:.4g} m; everything measured is kept in {}",
                         base.width, base.height, voxel, (options.directory / "cache").string()));
    Study study{tool,  options, scene,
                voxel, base,    {tool, scene, options.leave_out, options.directory / "cache"}};

    ChartPanel sizes;
    sizes.title = "Voxel size (compose + render, sweep, 16 samples)";
    sizes.x_label = "voxel, mm";
    sizes.y_label = "relative error (RMSE / mean)";
    sizes.right_label = "CPU seconds";
    sizes.series = {{"error", true, false, {}},
                    {"error, lod", true, false, {}},
                    {"render, s", true, true, {}},
                    {"render with lod, s", true, true, {}},
                    {"compose, s", true, true, {}}};
    const std::vector<Result> radiance = measureRadiance(study),
                              transmittance = measureTransmittance(study),
                              by_voxel = options.voxels ? measureVoxels(study, sizes)
                                                        : std::vector<Result>();

    std::vector<ChartPanel> panels{
        timeAgainstError(
            fmt::format(
                "{}: radiance, against trilinear, shadow rays, {} samples per pixel (names end in the samples per pixel)",
                options.scene.stem().string(), options.samples),
            "relative error (RMSE / mean)", radiance, false),
        timeAgainstError("Transmittance, against exact trilinear (steps)",
                         "relative error (RMSE / mean)", transmittance, true),
        sizes, stabilityPanel()};
    panels[1].key = "at graph 0.45, graph 0.42 left top";
    panels[2].key = "at graph 0.28, graph 0.98 left top";
    panels[3].key = "at graph 0.05, graph 0.4 left top";
    panels[0].place = {0.065, 0.03, 0.92, 0.49};
    panels[1].place = {0.065, 0.60, 0.25, 0.34};
    panels[2].place = {0.39, 0.60, 0.22, 0.34};
    panels[3].place = {0.735, 0.60, 0.25, 0.34};
    tool.stage("draw", [&](const Progress&) { draw(panels, options.directory); });
    writeText(options.directory / "results.csv",
              "panel,name,family,cpu_seconds,error,error_without_sampling,settings\n"
                  + csvRows("radiance", radiance) + csvRows("transmittance", transmittance)
                  + csvRows("voxel", by_voxel));
    const std::string table = choiceTables(radiance, transmittance);
    writeText(options.directory / "table.md", table);
    tool.say("wrote chart.svg, chart.png, results.csv and table.md in " + options.directory.string()
             + "\n" + table);
}

} // namespace

int main(int argc, char** argv)
{
    Tool tool(
        "volcomp-chart",
        "Measures time and error of the methods and settings on a scene, and draws the chart. Bakes and composes what it needs.");
    Options options;
    tool.app.add_option("scene", options.scene, "Scene file (TOML)")
        ->required()
        ->type_name("SCENE");
    tool.app
        .add_option(
            "-o,--output", options.directory,
            "Directory for chart.svg, chart.png, results.csv, table.md and what was measured (cache/)")
        ->required()
        ->type_name("DIR");
    tool.app
        .add_option("--width", options.width,
                    "Width of the pictures, pixels; voxels follow from it as in the scene")
        ->capture_default_str()
        ->check(CLI::Range(16, 32768));
    tool.app.add_option("--samples", options.samples, "Samples per pixel of the reference")
        ->capture_default_str()
        ->check(CLI::Range(1, 65536));
    tool.app
        .add_option(
            "--leave-out", options.leave_out,
            "Measure without this surface and the layers on it; may be given more than once")
        ->type_name("SURFACE")
        ->allow_extra_args(false);
    tool.app.add_flag("!--no-voxels", options.voxels,
                      "Leave out the chart of voxel sizes, which composes eight volumes");
    return tool.main(argc, argv, [&] { run(tool, options); });
}
