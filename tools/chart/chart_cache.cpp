// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/chart_cache.h"

#include <fstream>
#include <iterator>
#include <system_error>

#include <fmt/format.h>

#include "volcomp/base/atomic_file.h"
#include "volcomp/base/clock.h"
#include "volcomp/base/error.h"
#include "volcomp/base/hash.h"
#include "tools/shared/process.h"
#include "volcomp/base/random.h"
#include "volcomp/render/render.h"
#include "tools/shared/settings.h"
#include "volcomp/render/tree/voxel_tree_io.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string readBytes(const fs::path& file)
{
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

/// Returns a hash of the scene's file and of every file that it names and that exists.
std::uint64_t hashFiles(const Scene& scene)
{
    std::uint64_t hash = 0;
    std::error_code code;
    for (const fs::path& file : usedFiles(scene))
        if (fs::is_regular_file(file, code)) hash = hashKey(hash, fnv1a(readBytes(file)));
    return hash;
}

std::string hex(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

void writeJson(const fs::path& file, const json& value)
{
    writeTextAtomically(file, value.dump(2) + '\n');
}

/// Returns what was written under that name; null if there is none or it is damaged.
json readJson(const fs::path& file)
{
    std::ifstream stream(file);
    return stream ? json::parse(stream, nullptr, false) : json();
}

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
    m_scene_key = {hex(hashFiles(scene)), m_leave_out};
    for (const char* program : {"volcomp-bake", "volcomp-compose", "volcomp-chart"})
        m_program_key.push_back(hex(fnv1a(readBytes(ownDirectory() / program))));
    fs::create_directories(m_directory);
}

fs::path ChartCache::place(const std::string& kind, const json& key, const char* ending) const
{
    return m_directory / (kind + "_" + hex(fnv1a(key.dump())) + ending);
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
    if (fs::exists(file) && readJson(figures).is_object()) return file;
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
    writeJson(figures, {{"key", files["key"]}, {"cpu_seconds", seconds}});
    return file;
}

double ChartCache::composeSeconds(double voxel)
{
    const fs::path figures = composed(voxel)["figures"].get<std::string>();
    if (!readJson(figures).is_object()) volume(voxel);
    return readJson(figures).at("cpu_seconds");
}

void ChartCache::forget(double voxel)
{
    std::error_code code;
    const fs::path file = composed(voxel)["volume"].get<std::string>();
    fs::remove(file, code);
    for (int n = 1; fs::remove(levelFile(file, n), code); ++n) { }
}

std::vector<VoxelLevel> ChartCache::levels(double voxel, const RenderParams& params)
{
    const fs::path file = volume(voxel);
    if (params.lod) {
        if (storedLevels(file, params.tau) == 0)
            m_tool.stage("levels",
                         [&](const Progress& p) { writeVoxelLevels(file, params.tau, p); });
        return m_tool.stage("load", [&](const Progress& p) {
            return readVoxelLevels(file, m_scene.camera, params, p);
        });
    }
    if (!m_tree || m_tree_voxel != voxel) {
        m_tree.reset();
        m_tree = std::make_shared<const VoxelTree>(
            m_tool.stage("load", [&](const Progress& p) { return readVoxelTree(file, p); }));
        m_tree_voxel = voxel;
    }
    return {{m_tree}};
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
    const json known = readJson(figures);
    if (known.is_object() && fs::exists(picture))
        return {readImage(picture), known.at("cpu_seconds")};
    Measured result = measure();
    writeImage(picture, result.image);
    writeJson(figures,
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
