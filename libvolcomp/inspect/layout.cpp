// SPDX-License-Identifier: Apache-2.0
#include "volcomp/inspect/layout.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "volcomp/inspect/panel.h"
#include "volcomp/scene/place_scene.h"
#include "volcomp/surface/mesh.h"

namespace volcomp {
namespace {

const Vec3f kPaper(0.10f, 0.11f, 0.12f), kInk(0.85f), kFrame(0.95f);

/// Sets a pixel if the picture has it.
void dot(Image& image, int x, int y, const Vec3f& colour)
{
    if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
    for (int i = 0; i < 3; ++i) image.pixel(x, y)[i] = colour[i];
}

/// A line of two pixels' width.
void line(Image& image, double x0, double y0, double x1, double y1, const Vec3f& colour)
{
    const int steps = std::max(1, int(std::ceil(std::max(std::abs(x1 - x0), std::abs(y1 - y0)))));
    for (int i = 0; i <= steps; ++i) {
        const int x = int(std::floor(x0 + (x1 - x0) * i / steps)),
                  y = int(std::floor(y0 + (y1 - y0) * i / steps));
        for (const int dx : {0, 1})
            for (const int dy : {0, 1}) dot(image, x + dx, y + dy, colour);
    }
}

void disc(Image& image, double x, double y, double radius, const Vec3f& colour)
{
    for (int j = int(y - radius); j <= int(y + radius) + 1; ++j)
        for (int i = int(x - radius); i <= int(x + radius) + 1; ++i)
            if (std::hypot(i - x, j - y) <= radius) dot(image, i, j, colour);
}

/// How high a mesh stands above its box's root, metres.
double heightOf(const MeshBox& box)
{
    double height = 0;
    for (const Vec3d& p : readMesh(box.file).points)
        height = std::max(height, turnedUp(box.axes.up.value_or(UpAxis::y), p)[1]);
    return height * (box.axes.scale > 0 ? box.axes.scale : 1) + box.move[1];
}

/// The length of the strands on a box's ground, or the height of its mesh, world units in a box of
/// scale 1.
double reachOf(const Scene& scene, const std::string& box)
{
    constexpr double kUnknown = 0.05;
    double reach = 0;
    for (const GrowthRule& rule : scene.boxes) {
        if (rule.name != box) continue;
        if (!rule.mesh.file.empty()) reach = std::max(reach, heightOf(rule.mesh));
        for (const GrowthLevel& level : rule.levels)
            if (level.parent == "ground") reach = std::max(reach, level.length);
    }
    return reach > 0 ? reach : kUnknown;
}

/// Draws a stroke from one point to another, paler towards its end, where no surface hides it.
void drawStroke(Panel& panel, const Projected& from, const Projected& to, const Vec3f& colour)
{
    constexpr float kTolerance = 1.01f; // roots lie on the surface
    const double length = std::max(std::abs(to.x - from.x), std::abs(to.y - from.y));
    const int steps = std::clamp(int(std::ceil(length)), 1, 4000);
    for (int i = 0; i <= steps; ++i) {
        const double f = double(i) / steps, x = from.x + (to.x - from.x) * f,
                     y = from.y + (to.y - from.y) * f;
        if (!(x >= 0 && y >= 0 && x < panel.width && y < panel.height)) continue;
        const std::size_t at = panel.index(int(x), int(y));
        const auto depth = float(from.depth + (to.depth - from.depth) * f);
        if (depth < panel.depth[at] * kTolerance)
            panel.colour[at] = colour * float(0.45 + 0.55 * f);
    }
}

/// A point at least kShortest pixels from the root's on the way to the tip, so that the lean of
/// short fur is seen; the tip itself if it is further.
Projected lengthened(const Projected& root, const Projected& tip)
{
    constexpr double kShortest = 5;
    const double length = std::hypot(tip.x - root.x, tip.y - root.y);
    if (length >= kShortest || length < 1e-3) return tip;
    const double f = kShortest / length;
    return {root.x + (tip.x - root.x) * f, root.y + (tip.y - root.y) * f, tip.depth};
}

void drawStrokes(Panel& panel, const Screen& screen, const Scene& scene, const PlacedScene& placed,
                 std::size_t every)
{
    std::vector<double> reach;
    reach.reserve(placed.layers.size());
    for (const PlacedLayer& l : placed.layers) reach.push_back(reachOf(scene, l.layer.box));
    const auto& placements = placed.boxes.placements;
    for (std::size_t i = 0; i < placements.size(); i += every) {
        const Placement& p = placements[i];
        const auto root = screen.project(p.position),
                   tip = screen.project(p.position + Vec3d(p.y_axis) * (p.scale * reach[p.layer]));
        constexpr double kFar = 1e5; // pixels
        if (!root || !tip || !(std::abs(root->x) + std::abs(root->y) < kFar)
            || !(std::abs(tip->x) + std::abs(tip->y) < kFar))
            continue;
        drawStroke(panel, *root, lengthened(*root, *tip), layerColour(p.layer));
    }
}

/// The colour of a surface: its skin's, or grey.
Paint paintOf(const PlacedSurface& s)
{
    if (s.skin.material.empty()) return [](const SurfacePoint&) { return Vec3f(0.3f); };
    const auto dim = Vec3f(s.skin.colour) * 0.8f;
    return [&s, dim](const SurfacePoint& p) {
        const Vec3f c = s.skin_colour.colour(p.uv, p.position);
        return Vec3f(std::min(1.0f, dim[0] * c[0]), std::min(1.0f, dim[1] * c[1]),
                     std::min(1.0f, dim[2] * c[2]));
    };
}

/// A light's colour at full brightness.
Vec3f hueOf(const Light& light)
{
    const double most = std::max({light.strength[0], light.strength[1], light.strength[2], 1e-9});
    return Vec3f(light.strength / most);
}

/// An arrow of the globe: where it begins, on the picture.
struct Arrow {
    double x, y;
    Label label;
};

/// Draws the lights without a place as arrows onto a globe in the lower left corner, each with its
/// name in a column beside it, in the order of their heights.
void drawGlobe(Image& image, const CameraFrame& frame, const std::vector<Light>& lights, int font)
{
    const double radius = 3 * font, x0 = 2 * radius, y0 = image.height - 2 * radius;
    std::vector<Arrow> arrows;
    for (const Light& light : lights) {
        if (light.kind != LightKind::directional) continue;
        const Vec3d from = -light.direction; // to the light
        const double dx = from.dot(frame.right), dy = -from.dot(frame.up);
        const bool behind = from.dot(frame.forward) > 0; // the light stands beyond the scene
        const Vec3f hue = hueOf(light) * (behind ? 0.6f : 1.0f);
        arrows.push_back({x0 + 1.6 * radius * dx,
                          y0 + 1.6 * radius * dy,
                          {light.name + (behind ? " (from behind)" : ""), hue}});
        line(image, arrows.back().x, arrows.back().y, x0 + 0.35 * radius * dx,
             y0 + 0.35 * radius * dy, hue);
        disc(image, x0 + 0.35 * radius * dx, y0 + 0.35 * radius * dy, 3, hue);
        disc(image, arrows.back().x, arrows.back().y, 5, hue);
    }
    if (arrows.empty()) return;
    for (int i = 0; i < 360; ++i)
        dot(image, int(x0 + radius * std::cos(i * kDegree)),
            int(y0 + radius * std::sin(i * kDegree)), kInk);
    std::sort(arrows.begin(), arrows.end(),
              [](const Arrow& a, const Arrow& b) { return a.y < b.y; });
    const double step = 1.3 * font, column = x0 + 2 * radius,
                 lowest = image.height - 0.6 * font - step * double(arrows.size() - 1);
    double y = std::min(arrows[0].y, lowest);
    for (const Arrow& arrow : arrows) {
        y = std::max(y, std::min(arrow.y, lowest));
        for (double x = arrow.x; x < column - 6; x += 4) // dots that lead to the name
            dot(image, int(x), int(arrow.y + (y - arrow.y) * (x - arrow.x) / (column - arrow.x)),
                arrow.label.colour);
        writeText(image, int(column), int(y) + font / 3, font, arrow.label);
        y += step;
    }
}

/// The lights at a place; returns labels of those that are outside.
std::vector<Label> drawPlacedLights(Image& image, const Screen& screen, const Scene& scene,
                                    int font)
{
    std::vector<Label> outside;
    for (const Light& light : scene.lights) {
        if (light.kind == LightKind::directional) continue;
        const auto at = screen.project(light.position);
        if (!at || !(at->x >= 0 && at->y >= 0 && at->x < image.width && at->y < image.height)) {
            outside.push_back({fmt::format("light {}: {}", light.name,
                                           at ? "outside the picture" : "behind the camera"),
                               hueOf(light)});
            continue;
        }
        const auto aim =
            screen.project(light.position + light.direction * (40 * screen.pixelAt(at->depth)));
        if (light.kind != LightKind::point && aim)
            line(image, at->x, at->y, aim->x, aim->y, hueOf(light));
        disc(image, at->x, at->y, 6, Vec3f(0.0f));
        disc(image, at->x, at->y, 5, hueOf(light));
        writeText(image, int(at->x) + 9, int(at->y) + font / 3, font, {light.name, hueOf(light)});
    }
    return outside;
}

/// Darkens what is outside of the picture and draws its frame.
void drawFrame(Image& image, int margin)
{
    const int right = image.width - margin, bottom = image.height - margin;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            if (x >= margin && x < right && y >= margin && y < bottom) continue;
            for (int i = 0; i < 3; ++i) image.pixel(x, y)[i] *= 0.35f;
        }
    for (int x = margin - 1; x <= right; ++x)
        for (const int y : {margin - 1, bottom}) dot(image, x, y, kFrame);
    for (int y = margin - 1; y <= bottom; ++y)
        for (const int x : {margin - 1, right}) dot(image, x, y, kFrame);
}

std::vector<Label> layerLabels(const LayoutPlaces& places, std::size_t every)
{
    std::vector<Label> labels;
    for (std::size_t i = 0; i < places.placed.layers.size(); ++i) {
        const PlacedLayer& l = places.placed.layers[i];
        const double part = places.parts[i] / double(every);
        std::string text = fmt::format("{}: {} boxes", l.layer.name, l.boxes);
        if (places.parts[i] < 1)
            text = fmt::format("{}: about {:.2g} boxes", l.layer.name,
                               double(l.boxes) / places.parts[i]);
        if (part < 1) text += fmt::format(", 1 in {:.3g} is drawn", 1 / part);
        labels.push_back({std::move(text), layerColour(i)});
    }
    return labels;
}

} // namespace

LayoutPlaces placeForLayout(const Scene& scene)
{
    constexpr double kMost = 1e6; // boxes that are placed in a moment
    std::vector<Layer> layers = scene.layers;
    const PlacedScene bare = place(scene.surfaces, {}, {});
    double all = 0;
    for (const Layer& l : layers)
        for (const PlacedSurface& s : bare.surfaces)
            if (s.name == l.surface && l.sampling == Sampling::area)
                all += l.density * s.surface.area();
    LayoutPlaces places;
    for (Layer& l : layers) {
        const double part =
            l.sampling == Sampling::area && all > kMost ? double(kLayoutStrokes) / all : 1;
        l.density *= part;
        places.parts.push_back(part);
    }
    places.placed = place(scene.surfaces, layers, usedBoxes(scene));
    return places;
}

int layoutMargin(int width, int height) { return std::max(16, std::min(width, height) / 8); }

Image layoutPicture(const Scene& scene, const LayoutPlaces& places)
{
    const int width = scene.render.width, height = scene.render.height,
              margin = layoutMargin(width, height);
    const Screen screen(scene.camera, width, height, margin);
    Panel panel(width + 2 * margin, height + 2 * margin);
    std::fill(panel.colour.begin(), panel.colour.end(), kPaper);
    for (const PlacedSurface& s : places.placed.surfaces)
        drawSurface(panel, screen, s.surface, paintOf(s));
    const std::size_t every =
        (std::max<std::size_t>(places.placed.boxes.size(), 1) - 1) / kLayoutStrokes + 1;
    drawStrokes(panel, screen, scene, places.placed, every);
    Image image = imageOf(panel);
    drawFrame(image, margin);
    const int font = std::clamp(image.height / 40, 10, 20);
    std::vector<Label> labels = layerLabels(places, every);
    const std::vector<Label> outside = drawPlacedLights(image, screen, scene, font);
    labels.insert(labels.end(), outside.begin(), outside.end());
    drawGlobe(image, screen.frame(), scene.lights, font);
    for (std::size_t i = 0; i < labels.size(); ++i)
        writeText(image, font / 2, int(1.4 * font * double(i + 1)), font, labels[i]);
    return image;
}

} // namespace volcomp
