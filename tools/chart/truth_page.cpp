// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/truth_page.h"

#include <fmt/format.h>

#include "tools/chart/gnuplot.h"
#include "tools/chart/truth_chart.h"
#include "tools/chart/truth_report.h"
#include "volcomp/base/atomic_file.h"

namespace volcomp {
namespace {

std::string baseName(const std::string& light)
{
    return light.empty() ? "truth" : "truth_" + light;
}

} // namespace

std::vector<std::string> truthChartFiles(const std::string& light)
{
    const std::string name = baseName(light);
    return {name + ".svg", name + ".png", name + ".gnuplot"};
}

void writeTruth(Tool& tool, const std::filesystem::path& directory, const std::string& scene,
                const TruthSetup& setup, const std::vector<TruthOfLight>& lights)
{
    std::string page, said;
    for (const TruthOfLight& l : lights) {
        const std::string
            title = truthTitle(l.light.own() ? scene : scene + ", " + l.light.name, l.results),
            about = fmt::format(
                "Error: root mean square against the strands, leaves and skins themselves{}, of "
                "the mean brightness, {}x{} pixels.\nTime: bake + compose + load + render; of "
                "curves Embree's tree + tracing. Points of a line: 1, 4, 16 samples a pixel.",
                l.light.own() ? "" : " in this light", setup.width, setup.height);
        tool.stage("draw", [&](const Progress&) {
            drawWithGnuplot(directory, baseName(l.light.name), [&](const std::string& output) {
                return truthScript(title, about, l.results, output);
            });
        });
        const std::string sentences = truthSentences(l.results);
        page += fmt::format("{}# {}\n\n{}\n\n{}\n{}", page.empty() ? "" : "\n", title, about,
                            sentences, truthTable(l.results));
        said += (l.light.own() ? "" : l.light.name + ":\n") + sentences;
    }
    tool.stats["truth"] = truthJson(lights, setup, directory);
    writeTextAtomically(directory / "truth.json", tool.stats["truth"].dump(2) + '\n');
    writeTextAtomically(directory / "truth.md", page);
    tool.say("wrote truth.svg, truth.png, truth.md and truth.json in " + directory.string() + "\n"
             + said);
}

} // namespace volcomp
