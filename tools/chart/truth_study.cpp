// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/truth_study.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "tools/chart/kept.h"
#include "tools/shared/process.h"
#include "volcomp/base/clock.h"
#include "volcomp/base/error.h"
#include "volcomp/scene/place_scene.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kRepeats = 3;                             ///< of what takes less than a second
constexpr const char *kExactSeed = "1", *kSeed = "271"; ///< the curves' noise is their own

/// The cost of those stages of a program whose names are given, or of the whole program.
Cost costOf(const json& figures, const std::vector<std::string>& names = {})
{
    if (names.empty()) return {figures.at("cpu_seconds"), figures.at("wall_seconds")};
    Cost cost;
    for (const json& stage : figures.at("stages"))
        if (std::find(names.begin(), names.end(), stage.at("name")) != names.end()) {
            cost.cpu += double(stage.at("cpu_seconds"));
            cost.wall += double(stage.at("wall_seconds"));
        }
    return cost;
}

Cost rest(const Cost& all, const Cost& a, const Cost& b = {})
{
    return {std::max(0.0, all.cpu - a.cpu - b.cpu), std::max(0.0, all.wall - a.wall - b.wall)};
}

/// The name of a stage under a light.
std::string under(const OtherLight& light, const std::string& name)
{
    return light.own() ? name : light.name + ": " + name;
}

/// Fills in what curves of the same error take.
void findEqualErrors(std::vector<TruthResult>& results)
{
    std::vector<CurveCost> pixels, blocks;
    for (const TruthResult& r : results) {
        if (!r.curves) continue;
        const double samples = r.row.samples, all = r.costs.sum().cpu,
                     picture = r.costs.picture.cpu;
        pixels.push_back({samples, all, picture, r.error.rmse});
        blocks.push_back({samples, all, picture, r.error.block_rmse});
    }
    for (TruthResult& r : results) {
        if (r.curves) continue;
        r.at_pixels = curvesAtError(pixels, r.error.rmse);
        r.at_blocks = curvesAtError(blocks, r.error.block_rmse);
    }
}

} // namespace

TruthStudy::TruthStudy(Tool& tool, const Scene& scene, TruthSetup setup)
    : m_tool(tool), m_scene(scene), m_setup(std::move(setup)), m_scene_hash(contentHash(scene))
{
    for (const char* program : {"bake", "compose", "render", "truth"})
        m_programs[program] = contentHash(ownDirectory() / (std::string("volcomp-") + program));
    for (const std::string& warning : scene.warnings) m_warned.insert(warning); // said already
    fs::create_directories(m_setup.directory);
}

std::string TruthStudy::size() const { return fmt::format("{}x{}", m_setup.width, m_setup.height); }

json TruthStudy::key(std::initializer_list<const char*> programs, json what) const
{
    json key = {
        {"scene", m_scene_hash}, {"leave_out", m_setup.leave_out}, {"what", std::move(what)}};
    for (const char* program : programs) key["programs"].push_back(m_programs.at(program));
    return key;
}

TruthStudy::Command TruthStudy::withLeftOut(Command command) const
{
    for (const std::string& surface : m_setup.leave_out)
        command.insert(command.end(), {"--leave-out", surface});
    return command;
}

TruthStudy::Command TruthStudy::withLight(Command command, const OtherLight& light)
{
    for (std::string& option : light.options()) command.push_back(std::move(option));
    return command;
}

/// Passes on what a program has warned of, each line once.
void TruthStudy::warnOf(const std::string& output)
{
    std::istringstream lines(output);
    for (std::string line; std::getline(lines, line);) {
        const std::size_t after = line.find(": ");
        const std::string text = after == line.npos ? line : line.substr(after + 2);
        if (!text.empty() && m_warned.insert(text).second) m_tool.warn(text);
    }
}

/// Runs one of our programs, several times if it takes less than a second, and returns the figures
/// of the quickest run: its seconds from start to end, and its stages.
json TruthStudy::timed(const std::string& name, const Command& command, int repeats)
{
    const fs::path stats = m_setup.directory / "stats.json";
    Command arguments = command;
    arguments[0] = (ownDirectory() / command[0]).string();
    arguments.insert(arguments.end(), {"--quiet", "--stats", stats.string()});
    json best = m_tool.stage(name, [&](const Progress&) {
        json quickest;
        for (int run = 0; run < repeats; ++run) {
            const double start = wallSeconds();
            const ProcessResult result = runProcess(arguments);
            const double wall = wallSeconds() - start;
            if (result.status != 0) throw Error(arguments[0] + " failed:\n" + result.output);
            if (run == 0) warnOf(result.output);
            if (quickest.is_null() || result.cpu_seconds < double(quickest["cpu_seconds"]))
                quickest = {{"cpu_seconds", result.cpu_seconds},
                            {"wall_seconds", wall},
                            {"stages", readKept(stats).at("stages")}};
            if (result.cpu_seconds > 1) break;
        }
        return quickest;
    });
    std::error_code code;
    fs::remove(stats, code);
    return best;
}

json TruthStudy::pictured(const std::string& name, const json& key, const fs::path& file,
                          int repeats, const std::function<Command()>& command)
{
    const fs::path kept = fs::path(file).replace_extension(".json");
    const json known = readKept(kept);
    if (known.is_object() && fs::exists(file)) return known.at("figures");
    Command full = command();
    full.insert(full.end(), {"-o", file.string()});
    json figures = timed(name, full, repeats);
    keep(kept, {{"name", name}, {"key", key}, {"figures", figures}}); // the picture is complete
    return figures;
}

void TruthStudy::traceExact(TruthOfLight& light)
{
    const json exact = key(
        {"truth"}, {{"exact", m_setup.samples}, {"size", size()}, {"light", light.light.key()}});
    light.exact = keptFile(m_setup.directory, "exact", exact, ".exr");
    pictured(under(light.light, fmt::format("exact picture, {} samples", m_setup.samples)), exact,
             light.exact, 1, [&] {
                 return withLight(withLeftOut({"volcomp-truth", m_scene.file.string(), "--samples",
                                               std::to_string(m_setup.samples), "--seed",
                                               kExactSeed, "--size", size(), "--no-background"}),
                                  light.light);
             });
    const Image image = readImage(light.exact);
    if (std::all_of(image.pixels.begin(), image.pixels.end(), // R, G, B, A, then the half's
                    [i = 0](float x) mutable { return i++ % 4 == 3 || x <= 0; }))
        throw fileError(m_scene.file, light.light.name, "a camera that sees something lit",
                        "a black picture");
}

TruthResult TruthStudy::curves(const OtherLight& light, int samples)
{
    TruthResult result;
    result.curves = true;
    result.row.samples = samples;
    const json what =
        key({"truth"}, {{"curves", samples}, {"size", size()}, {"light", light.key()}});
    result.picture = keptFile(m_setup.directory, "curves", what, ".exr");
    const json figures = pictured(
        under(light, fmt::format("curves, {} a pixel", samples)), what, result.picture, kRepeats,
        [&] {
            return withLight(withLeftOut({"volcomp-truth", m_scene.file.string(), "--samples",
                                          std::to_string(samples), "--seed", kSeed, "--size",
                                          size(), "--no-background", "--no-halves"}),
                             light);
        });
    result.costs.build = costOf(figures, {"grow and place", "tree"});
    result.costs.picture = costOf(figures, {"trace"});
    result.costs.load = rest(costOf(figures), result.costs.build, result.costs.picture);
    return result;
}

json TruthStudy::bakeFigures()
{
    boxes();
    return readKept(boxes().string() + ".json").at("figures");
}

fs::path TruthStudy::boxes()
{
    const json what = key({"bake"}, "boxes");
    fs::path directory = keptFile(m_setup.directory, "truth_boxes", what, "");
    const fs::path kept = directory.string() + ".json"; // written when all boxes are there
    if (readKept(kept).is_object() && fs::is_directory(directory)) return directory;
    Command command{"volcomp-bake", m_scene.file.string(), "-o", directory.string()};
    for (const BoxKind& kind : usedBoxes(m_scene))
        command.insert(command.end(), {"--box", kind.name});
    keep(kept, {{"key", what}, {"figures", timed("bake", command, kRepeats)}});
    return directory;
}

json TruthStudy::composeKey(double factor) const
{
    return key({"bake", "compose"}, {{"volume", factor * m_setup.voxel}});
}

json TruthStudy::composeFigures(double factor)
{
    const fs::path kept = keptFile(m_setup.directory, "truth_compose", composeKey(factor), ".json");
    if (!readKept(kept).is_object()) composed(factor);
    return readKept(kept).at("figures");
}

/// The file of the volume, which is composed if there is none.
fs::path TruthStudy::composed(double factor)
{
    const json what = composeKey(factor);
    const fs::path kept = keptFile(m_setup.directory, "truth_compose", what, ".json");
    fs::path file = keptFile(m_setup.directory, "truth_volume", what, ".vdb");
    if (fs::exists(file) && readKept(kept).is_object()) return file;
    const json figures =
        timed(fmt::format("compose, voxels x{:g}", factor),
              withLeftOut({"volcomp-compose", m_scene.file.string(), "--boxes", boxes().string(),
                           "--voxel", fmt::format("{:.17g}", factor * m_setup.voxel), "-o",
                           file.string()}),
              kRepeats);
    keep(kept, {{"key", what}, {"figures", figures}});
    return file;
}

TruthResult TruthStudy::volume(const OtherLight& light, const TruthRow& row)
{
    TruthResult result;
    result.row = row;
    result.voxel = row.factor * m_setup.voxel;
    const std::string filter = wordOf(kFilterWords, row.filter),
                      shadows = wordOf(kShadowsWords, row.shadows),
                      samples = std::to_string(row.samples);
    const json what = key({"bake", "compose", "render"},
                          {{"voxel", result.voxel},
                           {"filter", filter},
                           {"shadows", shadows},
                           {"samples", samples},
                           {"size", size()},
                           {"light", light.key()}});
    result.picture = keptFile(m_setup.directory, "volume", what, ".exr");
    const json figures = pictured(
        under(
            light,
            fmt::format("voxels x{:g}, {}, {}, {} a pixel", row.factor, filter, shadows, samples)),
        what, result.picture, kRepeats, [&] {
            return withLight({"volcomp-render", m_scene.file.string(), "--volume",
                              composed(row.factor).string(), "--size", size(), "--samples", samples,
                              "--filter", filter, "--shadows", shadows, "--integration", "exact",
                              "--no-lod", "--no-background", "--checkpoint", "0"},
                             light);
        });
    result.costs.bake = costOf(bakeFigures());
    result.costs.build = costOf(composeFigures(row.factor));
    result.costs.picture = costOf(figures, {"render"});
    result.costs.load = rest(costOf(figures), result.costs.picture);
    return result;
}

std::vector<TruthOfLight> TruthStudy::measure()
{
    std::vector<TruthOfLight> lights(1);
    lights.reserve(1 + m_setup.other_lights.size());
    for (const OtherLight& other : m_setup.other_lights) lights.push_back({other, {}, {}});
    for (TruthOfLight& l : lights) {
        traceExact(l);
        for (const int samples : kCurveSamples) l.results.push_back(curves(l.light, samples));
    }
    const double nearest =
        *std::min_element(m_setup.factors.begin(), m_setup.factors.end(), [](double a, double b) {
            return std::abs(std::log(a)) < std::abs(std::log(b));
        });
    for (const double factor : m_setup.factors) {
        for (TruthOfLight& l : lights)
            for (const TruthRow& row : truthRows({factor}, m_setup.all_methods)) {
                const bool plain = row.filter == Filter::box && row.shadows == Shadows::sweep;
                if (!l.light.own() && !(plain && factor == nearest)) continue;
                l.results.push_back(volume(l.light, row));
            }
        std::error_code code; // volumes are large, and quick to make anew
        fs::remove(keptFile(m_setup.directory, "truth_volume", composeKey(factor), ".vdb"), code);
    }
    for (TruthOfLight& l : lights) {
        const Image exact = readImage(l.exact);
        for (TruthResult& r : l.results) r.error = pictureError(readImage(r.picture), exact);
        findEqualErrors(l.results);
    }
    return lights;
}

} // namespace volcomp
