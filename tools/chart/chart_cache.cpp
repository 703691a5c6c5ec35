// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/chart_cache.h"

#include <fstream>
#include <system_error>

#include <fmt/format.h>

#include "volcomp/base/clock.h"
#include "volcomp/base/error.h"
#include "tools/chart/kept.h"
#include "tools/shared/process.h"
#include "volcomp/render/render.h"
#include "tools/shared/settings.h"
#include "volcomp/render/tree/voxel_tree_io.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Runs one of our programs and returns its CPU seconds. Throws Error if it fails.
double runOwn(std::vector<std::string> arguments)
{
    arguments[0] = (ownDirectory() / arguments[0]).string();
    arguments.push_back("--quiet");
    const ProcessResult result = runProcess(arguments);
    if (result.status != 0) throw Error(arguments[0] + " failed:\n" + result.output);
    return result.cpu_seconds;
}

} // namespace

ChartCache::ChartCache(Tool& tool, const Scene& scene, std::vector<std::string> leave_out,
                       fs::path directory)
    : m_tool(tool), m_scene(scene), m_leave_out(std::move(leave_out)),
      m_directory(std::move(directory))
{
    m_scene_key = {contentHash(scene), m_leave_out};
    for (const char* program : {"volcomp-bake", "volcomp-compose", "volcomp-chart"})
        m_program_key.push_back(contentHash(ownDirectory() / program));
    fs::create_directories(m_directory);
}

fs::path ChartCache::place(const std::string& kind, const json& key, const char* ending) const
{
    return keptFile(m_directory, kind, key, ending);
}

json ChartCache::composed(double voxel)
{
    const json key = {{"scene", m_scene_key},
                      {"programs", {m_program_key[0], m_program_key[1]}},
                      {"voxel", voxel}};
    return {{"key", key},
            {"figures", place("compose", key, ".json").string()},
            {"volume", place("volume", key, ".vdb").string()}};
}

fs::path ChartCache::boxes()
{
    fs::path directory = place("boxes", {m_scene_key, m_program_key[0]}, "");
    if (fs::exists(directory / "done")) return directory;
    m_tool.stage("bake", [&](const Progress&) {
        runOwn({"volcomp-bake", m_scene.file.string(), "-o", directory.string()});
    });
    std::ofstream(directory / "done").flush();
    return directory;
}

fs::path ChartCache::volume(double voxel)
{
    const json files = composed(voxel);
    const fs::path figures = files["figures"].get<std::string>();
    fs::path file = files["volume"].get<std::string>();
    if (fs::exists(file) && readKept(figures).is_object()) return file;
    const fs::path directory = boxes();
    const double seconds =
        m_tool.stage(fmt::format("compose at {:.4g} m", voxel), [&](const Progress&) {
            std::vector<std::string> command{
                "volcomp-compose", m_scene.file.string(),         "--boxes", directory.string(),
                "--voxel",         fmt::format("{:.17g}", voxel), "-o",      file.string()};
            for (const std::string& surface : m_leave_out)
                command.insert(command.end(), {"--leave-out", surface});
            return runOwn(command);
        });
    keep(figures, {{"key", files["key"]}, {"cpu_seconds", seconds}});
    return file;
}

double ChartCache::composeSeconds(double voxel)
{
    const fs::path figures = composed(voxel)["figures"].get<std::string>();
    if (!readKept(figures).is_object()) volume(voxel);
    return readKept(figures).at("cpu_seconds");
}

void ChartCache::forget(double voxel)
{
    std::error_code code;
    const fs::path file = composed(voxel)["volume"].get<std::string>();
    fs::remove(file, code);
}

std::vector<VoxelLevel> ChartCache::levels(double voxel, const RenderParams& params)
{
    const fs::path file = volume(voxel);
    if (!m_tree || m_tree_voxel != voxel) {
        m_tree.reset();
        m_tree = std::make_shared<const VoxelTree>(
            m_tool.stage("load", [&](const Progress& p) { return readVoxelTree(file, p); }));
        m_tree_voxel = voxel;
    }
    return voxelLevels(m_tree, m_scene.camera, params);
}

/// The skins that are meshes; null if the scene has none.
const SkinTracer* ChartCache::skins()
{
    if (!m_skins) m_skins = loadSkins(m_scene);
    return m_skins.get();
}

Measured ChartCache::remember(const std::string& name, const json& key,
                              const std::function<Measured()>& measure)
{
    const json full_key = {{"scene", m_scene_key}, {"programs", m_program_key}, {"what", key}};
    const fs::path figures = place("render", full_key, ".json"),
                   picture = place("render", full_key, ".exr");
    const json known = readKept(figures);
    if (known.is_object() && fs::exists(picture))
        return {readImage(picture), known.at("cpu_seconds")};
    Measured result = measure();
    writeImage(picture, result.image);
    keep(figures,
         {{"name", name},
          {"key", full_key},
          {"cpu_seconds",
           result.cpu_seconds}}); // written last: it tells that the picture is complete
    return result;
}

Measured ChartCache::render(const std::string& name, double voxel, const RenderParams& params,
                            bool lights)
{
    json settings = settingsOf(params);
    return remember(name, {{"voxel", voxel}, {"settings", settings}, {"lights", lights}}, [&] {
        const std::vector<VoxelLevel> volume = levels(voxel, params);
        const SkinTracer* meshes = lights ? skins() : nullptr;
        return m_tool.stage(name, [&](const Progress& progress) {
            Measured best;
            for (int run = 0; run < 3; ++run) { // a short render is measured three times
                const double start = cpuSeconds();
                best.image = volcomp::render(volume, m_scene.materials, m_scene.camera,
                                             lights ? m_scene.lights : std::vector<Light>(), params,
                                             progress, nullptr, nullptr, meshes);
                const double seconds = cpuSeconds() - start;
                best.cpu_seconds = run == 0 ? seconds : std::min(best.cpu_seconds, seconds);
                if (seconds > 1) break;
            }
            return best;
        });
    });
}

} // namespace volcomp
