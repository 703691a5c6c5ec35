// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/measure.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/chart/vdb_render.h"
#include "tools/shared/process.h"
#include "tools/shared/settings.h"
#include "volcomp/base/error.h"
#include "volcomp/place/voxel_size.h"
#include "volcomp/scene/scene_dome.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

/// Adds the results of vdb_render, if it is installed.
void measurePeer(ChartStudy& study, const RenderParams& params, const Image& exact,
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
                                 study.directory / "vdb_render.exr");
            });
        });
        results.push_back(
            {row, {{"step", step}}, relativeError(m.image, exact, {"A"}), m.cpu_seconds});
    }
}

} // namespace

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

std::vector<Result> measureRadiance(ChartStudy& study, const std::vector<Row>& rows,
                                    const OtherLight& light)
{
    const std::string under = light.own() ? "" : light.name + ": ";
    const Image reference =
        study.cache
            .render(fmt::format("{}reference, {} samples", under, study.samples), study.voxel,
                    radianceReference(study.base, study.samples))
            .image;
    const Image same_rays = study.cache
                                .render(under + "reference, 4 samples", study.voxel,
                                        radianceReference(study.base, kSamples))
                                .image;
    std::vector<Result> results;
    for (const Row& row : rows) {
        RenderParams params = study.base;
        row.change(params);
        if (params.samples >= study.samples) continue; // the reference would be no better
        const Measured m = study.cache.render(row.name, study.voxel, params);
        results.push_back(
            {row, settingsOf(params), relativeError(m.image, reference, kRgb), m.cpu_seconds,
             params.samples == kSamples ? relativeError(m.image, same_rays, kRgb) : -1,
             !light.own()});
    }
    return results;
}

std::vector<Result> measureTransmittance(ChartStudy& study)
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

std::vector<Result> measureVoxels(ChartStudy& study, ChartPanel& panel)
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

RenderParams chartBase(const Scene& scene, int width)
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

std::vector<Result> measureOtherLights(Tool& tool, const Scene& scene, int width, int samples,
                                       double voxel, const std::vector<std::string>& leave_out,
                                       const std::filesystem::path& directory)
{
    std::vector<Result> results;
    for (const OtherLight& light : otherLights(scene)) {
        Scene lit = scene;
        light.apply(lit);
        loadSceneDome(lit);
        ChartStudy study{tool,
                         lit,
                         directory,
                         samples,
                         voxel,
                         chartBase(lit, width),
                         {tool, lit, leave_out, directory}};
        const std::vector<Result> found = measureRadiance(study, otherLightRows(light.name), light);
        results.insert(results.end(), found.begin(), found.end());
    }
    return results;
}

} // namespace volcomp
