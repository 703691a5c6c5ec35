// SPDX-License-Identifier: Apache-2.0
#include "tools/volcomp/layout_stage.h"

#include <algorithm>
#include <sstream>
#include <vector>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/inspect/layout.h"
#include "volcomp/inspect/placement_sheet.h"
#include "volcomp/scene/scene_inputs.h"
#include "volcomp/view/image.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

bool hasMaps(const Scene& scene)
{
    return std::any_of(scene.layers.begin(), scene.layers.end(),
                       [](const Layer& l) { return !l.where.empty() || !l.colour.empty(); });
}

} // namespace

Camera readCamera(const std::string& text, const Camera& camera)
{
    std::string words = text;
    std::replace(words.begin(), words.end(), ',', ' ');
    std::istringstream stream(words);
    std::vector<double> x;
    for (double value = 0; stream >> value;) x.push_back(value);
    if (!stream.eof() || (x.size() != 6 && x.size() != 7))
        throw Error("--camera: expected eye and target, three numbers each, and at most a field of "
                    "view in degrees, such as 0,1,3,0,0.5,0,35, found '"
                    + text + "'");
    Camera result = camera;
    result.eye = {x[0], x[1], x[2]};
    result.target = {x[3], x[4], x[5]};
    if (x.size() == 7) result.field_of_view = x[6] * kDegree;
    try {
        result.validate();
    } catch (const Error& e) {
        throw Error(std::string("--camera: ") + e.what());
    }
    return result;
}

void layoutStage(Tool& tool, const Scene& scene, const fs::path& directory)
{
    const std::string name = scene.file.stem().string();
    const fs::path layout = directory / (name + ".layout.png"),
                   maps = directory / (name + ".maps.png");
    fs::create_directories(directory);
    tool.requireFiles(inputsOf(scene), {{"the layout", layout}, {"the maps", maps}});
    const LayoutPlaces places =
        tool.stage("place", [&](const Progress&) { return placeForLayout(scene); });
    tool.stage("layout",
               [&](const Progress&) { writeImage(layout, layoutPicture(scene, places)); });
    for (std::size_t i = 0; i < places.placed.layers.size(); ++i) {
        const PlacedLayer& l = places.placed.layers[i];
        tool.stats["layers"].push_back(
            {{"name", l.layer.name}, {"placements", l.boxes}, {"part", places.parts[i]}});
    }
    for (const std::string& warning : places.placed.warnings) tool.warn(warning);
    if (places.placed.boxes.size() > kLayoutStrokes
        || std::any_of(places.parts.begin(), places.parts.end(), [](double p) { return p < 1; }))
        tool.say("there are more boxes than a layout can show: a part is drawn");
    tool.say("wrote " + layout.string());
    if (!hasMaps(scene)) return;
    tool.stage("maps", [&](const Progress&) {
        writeImage(maps,
                   placementSheet(places.placed, scene.camera, scene.render.width / 2 + 1,
                                  scene.render.height / 2 + 1));
    });
    tool.say("wrote " + maps.string());
}

} // namespace volcomp
