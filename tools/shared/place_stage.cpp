// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/place_stage.h"

#include <fmt/format.h>

namespace volcomp {
namespace {

/// Says what place() has found, and adds it to the statistics.
void reportPlaced(Tool& tool, const Scene& scene, const PlacedScene& placed)
{
    for (std::size_t i = 0; i < placed.surfaces.size(); ++i) {
        const PlacedSurface& s = placed.surfaces[i];
        const MeshReport& r = s.surface.mesh().report;
        tool.say(fmt::format("surface '{}': {}, {:.4g} m^2", s.name, r.text(), s.surface.area()));
        for (const std::string& warning : r.warnings) tool.warn(warning);
        if (r.non_manifold_faces)
            tool.warn(fmt::format(
                "{}: {} non-manifold faces at {} edges that more than two faces share; they are kept",
                scene.surfaces[i].mesh.string(), r.non_manifold_faces, r.non_manifold_edges));
        tool.stats["surfaces"][s.name] = {{"triangles", r.triangles},
                                          {"area_m2", s.surface.area()},
                                          {"non_manifold_faces", r.non_manifold_faces},
                                          {"open_edges", r.boundary_edges},
                                          {"zero_area", r.zero_area},
                                          {"turned", r.turned},
                                          {"parts", r.parts}};
    }
    for (const PlacedLayer& l : placed.layers) {
        tool.say(l.surface < 0 ? fmt::format("groom '{}': {} pieces", l.layer.name, l.boxes)
                               : fmt::format("layer '{}': {} boxes", l.layer.name, l.boxes));
        tool.stats["layers"].push_back({{"name", l.layer.name}, {"placements", l.boxes}});
    }
    for (const std::string& warning : placed.warnings) tool.warn(warning);
}

} // namespace

PlacedScene placeStage(Tool& tool, const Scene& scene, const PlaceOptions& options)
{
    PlacedScene placed =
        tool.stage("place", [&](const Progress& p) { return place(scene, options, p); });
    reportPlaced(tool, scene, placed);
    return placed;
}

} // namespace volcomp
