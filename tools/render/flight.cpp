// SPDX-License-Identifier: Apache-2.0
#include "tools/render/flight.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "volcomp/base/clock.h"
#include "volcomp/base/error.h"
#include "volcomp/render/render.h"
#include "volcomp/view/image.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

std::size_t tilesMade(const RenderedVolume& volume)
{
    std::size_t tiles = 0;
    for (const auto& tree : volume.trees) tiles += tree->tiles()->tileCount();
    return tiles;
}

} // namespace

std::vector<Camera> readCameras(const fs::path& file, const Camera& camera)
{
    constexpr std::size_t kMostCameras = 1000000;
    std::ifstream stream(file);
    if (!stream)
        throw fileError(file, "", "a file of cameras", "no file that can be read",
                        "Check --cameras.");
    std::vector<Camera> cameras;
    std::string line;
    for (int number = 1; std::getline(stream, line); ++number) {
        line.resize(std::min(line.find('#'), line.size()));
        std::replace(line.begin(), line.end(), ',', ' ');
        std::istringstream words(line);
        std::vector<double> values;
        for (double value = 0; words >> value;) values.push_back(value);
        words.clear();
        std::string rest;
        if (words >> rest || (!values.empty() && values.size() != 6 && values.size() != 7))
            throw fileError(file, fmt::format("line {}", number),
                            "eye and target, three numbers each, and at most a field of view",
                            rest.empty() ? fmt::format("{} numbers", values.size())
                                         : "'" + rest.substr(0, 40) + "'");
        if (values.empty()) continue;
        Camera& c = cameras.emplace_back(camera);
        c.eye = {values[0], values[1], values[2]};
        c.target = {values[3], values[4], values[5]};
        if (values.size() == 7) c.field_of_view = values[6] * kDegree;
        try {
            c.validate();
        } catch (const Error& e) {
            throw Error(fmt::format("{}, line {}: {}", file.string(), number, e.what()));
        }
        if (cameras.size() > kMostCameras)
            throw fileError(file, "", "at most a million cameras", "more", "Cut the file.");
    }
    if (cameras.empty())
        throw fileError(file, "", "a camera a line", "none",
                        "A line is eye x y z, target x y z and a field of view in degrees.");
    return cameras;
}

fs::path frameFile(const fs::path& pattern, int number)
{
    const std::string name = pattern.filename().string();
    const std::size_t last = name.rfind('#');
    if (last == std::string::npos)
        throw Error(fmt::format("-o {}: expected a # in the name for the number of the picture, as "
                                "in flight.####.png, found none",
                                pattern.string()));
    std::size_t first = last;
    while (first > 0 && name[first - 1] == '#') --first;
    return pattern.parent_path()
        / (name.substr(0, first) + fmt::format("{:0{}}", number, last - first + 1)
           + name.substr(last + 1));
}

void renderFlight(Tool& tool, const Scene& scene, const std::vector<Camera>& cameras,
                  const RenderedVolume& volume, const SkinTracer* skins,
                  const std::vector<fs::path>& patterns)
{
    nlohmann::json& frames = tool.stats["frames"] = nlohmann::json::array();
    tool.stage("render", [&](const Progress& progress) {
        for (std::size_t n = 0; n < cameras.size(); ++n) {
            const double wall = wallSeconds(), cpu = cpuSeconds();
            const std::size_t before = tilesMade(volume);
            RenderStats stats;
            const Image image = render(
                tileLevels(volume.trees, cameras[n], scene.render, scene.compose.voxel_pixels),
                scene.materials, cameras[n], scene.lights, scene.render, {}, &stats, nullptr,
                skins);
            for (const fs::path& pattern : patterns)
                writeImage(frameFile(pattern, int(n) + 1), image,
                           {{"Software", "volcomp"}, {"volcomp/scene", scene.file.string()}},
                           scene.look);
            frames.push_back({{"wall_seconds", wallSeconds() - wall},
                              {"cpu_seconds", cpuSeconds() - cpu},
                              {"tiles_made", tilesMade(volume) - before},
                              {"prepare_seconds", stats.prepare_seconds},
                              {"march_seconds", stats.march_seconds}});
            report(progress, double(n + 1) / double(cameras.size()));
        }
    });
    reportTiles(tool, volume);
}

} // namespace volcomp
