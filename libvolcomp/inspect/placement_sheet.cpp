// SPDX-License-Identifier: Apache-2.0
#include "volcomp/inspect/placement_sheet.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "volcomp/inspect/panel.h"
#include "volcomp/surface/second_density.h"

namespace volcomp {
namespace {

void drawDots(Panel& panel, const Screen& screen, const std::vector<Placement>& placements,
              int radius)
{
    for (const Placement& p : placements) {
        const auto at = screen.project(p.position);
        if (!at || !(std::abs(at->x) < 1e6 && std::abs(at->y) < 1e6)) continue;
        for (int y = int(at->y) - radius; y <= int(at->y) + radius; ++y)
            for (int x = int(at->x) - radius; x <= int(at->x) + radius; ++x) {
                if (x < 0 || y < 0 || x >= panel.width || y >= panel.height) continue;
                const std::size_t i = panel.index(x, y);
                if (at->depth < panel.depth[i] * 1.01f) panel.colour[i] = layerColour(p.layer);
            }
    }
}

/// A panel and the labels in it.
struct LabelledPanel {
    Panel panel;
    std::vector<Label> labels;
};

/// All surfaces, with a dot for each placement.
LabelledPanel placementPanel(const PlacedScene& scene, const Screen& screen, int width, int height)
{
    LabelledPanel result{Panel(width, height), {}};
    for (const PlacedSurface& s : scene.surfaces)
        drawSurface(result.panel, screen, s.surface,
                    [](const SurfacePoint&) { return Vec3f(0.3f); });
    const bool crowded = scene.boxes.size() > std::size_t(width) * height / 60;
    drawDots(result.panel, screen, scene.boxes.placements, crowded ? 0 : 1);
    std::vector<std::size_t> counts(scene.layers.size());
    for (const Placement& p : scene.boxes.placements)
        if (p.layer < counts.size()) ++counts[p.layer];
    for (std::size_t i = 0; i < scene.layers.size(); ++i)
        result.labels.push_back(
            {fmt::format("{}: {}", scene.layers[i].layer.name, counts[i]), layerColour(i)});
    return result;
}

/// A map of one layer on its surface; the other surfaces are dark.
LabelledPanel mapPanel(const PlacedScene& scene, const PlacedLayer& layer, const char* what,
                       const Paint& paint, const Screen& screen, int width, int height)
{
    LabelledPanel result{Panel(width, height), {{layer.layer.name + ": " + what}}};
    for (std::size_t i = 0; i < scene.surfaces.size(); ++i) {
        const bool own = static_cast<std::size_t>(layer.surface) == i;
        drawSurface(
            result.panel, screen, scene.surfaces[i].surface,
            own ? paint : [](const SurfacePoint&) { return Vec3f(0.06f); });
    }
    return result;
}

/// Puts the panels side by side, at most four in a row.
Image arranged(const std::vector<LabelledPanel>& panels, int width, int height)
{
    const int count = static_cast<int>(panels.size()), columns = std::min(4, count),
              rows = (count + columns - 1) / columns;
    Image image;
    image.width = columns * width;
    image.height = rows * height;
    image.channels = {"R", "G", "B"};
    image.pixels.assign(std::size_t(image.width) * image.height * 3, 0.0f);
    for (int k = 0; k < count; ++k) {
        const int left = k % columns * width, top = k / columns * height;
        const Panel& panel = panels[static_cast<std::size_t>(k)].panel;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                for (int i = 0; i < 3; ++i)
                    image.pixel(left + x, top + y)[i] = panel.colour[panel.index(x, y)][i];
        writeLabels(image, left, top, height, panels[static_cast<std::size_t>(k)].labels);
    }
    return image;
}

} // namespace

Image placementSheet(const PlacedScene& scene, const Camera& camera, int width, int height)
{
    const Screen screen(camera, width, height);
    std::vector<LabelledPanel> panels;
    panels.push_back(placementPanel(scene, screen, width, height));
    for (const PlacedLayer& l : scene.layers) {
        if (l.surface < 0) continue; // a groom has no maps
        const SecondDensity where(l.layer.where, false), colour(l.layer.colour, true);
        const auto grey = [&](const SurfacePoint& s) {
            return Vec3f(std::clamp(where.value(s.uv, s.position), 0.0f, 1.0f));
        };
        panels.push_back(mapPanel(scene, l, "where", grey, screen, width, height));
        if (l.layer.colour.empty()) continue;
        const auto painted = [&](const SurfacePoint& s) { return colour.colour(s.uv, s.position); };
        panels.push_back(mapPanel(scene, l, "colour", painted, screen, width, height));
    }
    return arranged(panels, width, height);
}

} // namespace volcomp
