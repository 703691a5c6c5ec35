// SPDX-License-Identifier: Apache-2.0
#include "volcomp/inspect/placement_sheet.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/surface/second_density.h"

namespace volcomp {
namespace {

/// A point on the picture, pixels from its top left corner, and its depth along the view.
struct Projected {
    double x, y, depth;
};

/// Projects points of the world onto a picture.
class Screen {
public:
    Screen(const Camera& c, int width, int height)
        : m_camera(c), m_frame(c), m_width(width), m_height(height)
    {
    }
    /// Returns nothing for a point behind the eye.
    std::optional<Projected> project(const Vec3d& p) const
    {
        const Vec3d d = p - m_camera.eye;
        const double depth = d.dot(m_frame.forward);
        if (depth <= 1e-9) return std::nullopt;
        const double f = m_camera.projection == Projection::orthographic
            ? m_width / m_camera.width
            : m_width / (2 * depth * std::tan(m_camera.field_of_view / 2));
        return Projected{0.5 * m_width + d.dot(m_frame.right) * f,
                         0.5 * m_height - d.dot(m_frame.up) * f, depth};
    }
    /// Depth of a point along the view; negative behind the eye.
    double depth(const Vec3d& p) const { return (p - m_camera.eye).dot(m_frame.forward); }
    const Vec3d& eye() const { return m_camera.eye; }
    bool perspective() const { return m_camera.projection != Projection::orthographic; }

private:
    const Camera& m_camera;
    CameraFrame m_frame;
    int m_width, m_height;
};

const Vec3f kColours[6] = {{0.9f, 0.1f, 0.08f},  {0.1f, 0.7f, 0.15f}, {0.12f, 0.25f, 1.0f},
                           {0.9f, 0.75f, 0.05f}, {0.8f, 0.1f, 0.8f},  {0.05f, 0.75f, 0.8f}};

/// One picture of the sheet with its depth buffer.
struct Panel {
    int width, height;
    std::vector<float> depth; ///< along the view
    std::vector<Vec3f> colour;
    Panel(int w, int h)
        : width(w), height(h), depth(std::size_t(w) * h, std::numeric_limits<float>::infinity()),
          colour(std::size_t(w) * h, Vec3f(0.02f))
    {
    }
    std::size_t index(int x, int y) const { return std::size_t(y) * width + x; }
};

using Paint = std::function<Vec3f(const SurfacePoint&)>;

/// The whole pixels from `low` to `high`, as far as they lie in [0, size).
std::pair<int, int> pixelsBetween(double low, double high, int size)
{
    return {int(std::clamp(std::floor(low), 0.0, double(size))),
            int(std::clamp(std::ceil(high), -1.0, double(size - 1)))};
}

/// A corner of what is left of a triangle in front of the eye.
struct Corner {
    double b1, b2;  ///< weights of the triangle's second and third corner
    Projected at{}; ///< on the picture
};

/// The part of a triangle in front of a plane just before the eye: 0, 3 or 4 corners. Further in,
/// places on the picture would have no bounds.
std::vector<Corner> inFront(const Screen& screen, const Vec3d (&points)[3])
{
    double depth[3], furthest = 0;
    for (int i = 0; i < 3; ++i) {
        depth[i] = screen.depth(points[i]);
        furthest = std::max(furthest, (points[i] - screen.eye()).length());
    }
    const double near_by = std::max(1e-8, 1e-7 * furthest);
    const auto weights = [](int i) { return Corner{double(i == 1), double(i == 2)}; };
    std::vector<Corner> corners;
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        const Corner from = weights(i), to = weights(j);
        if (depth[i] >= near_by) corners.push_back(from);
        if ((depth[i] >= near_by) != (depth[j] >= near_by)) {
            const double f = (near_by - depth[i]) / (depth[j] - depth[i]);
            corners.push_back({from.b1 + (to.b1 - from.b1) * f, from.b2 + (to.b2 - from.b2) * f});
        }
    }
    for (Corner& c : corners) {
        const auto at =
            screen.project(points[0] * (1 - c.b1 - c.b2) + points[1] * c.b1 + points[2] * c.b2);
        if (!at) return {};
        c.at = *at;
    }
    return corners;
}

/// Draws the part of a triangle of the surface that lies between three of its corners in front.
void drawPiece(Panel& panel, const Screen& screen, const Surface& surface, std::int32_t triangle,
               const Corner& a, const Corner& b, const Corner& c, const Paint& paint)
{
    const double area =
        (b.at.x - a.at.x) * (c.at.y - a.at.y) - (c.at.x - a.at.x) * (b.at.y - a.at.y);
    if (!(std::abs(area) > 1e-12 && std::isfinite(area))) return;
    const auto [left, right] = pixelsBetween(std::min({a.at.x, b.at.x, c.at.x}),
                                             std::max({a.at.x, b.at.x, c.at.x}), panel.width);
    const auto [top, bottom] = pixelsBetween(std::min({a.at.y, b.at.y, c.at.y}),
                                             std::max({a.at.y, b.at.y, c.at.y}), panel.height);
    // Weights on the screen become weights in the world by the depth, in a perspective.
    const auto by_depth = [&](const Corner& corner) {
        return screen.perspective() ? 1 / corner.at.depth : 1.0;
    };
    for (int y = top; y <= bottom; ++y)
        for (int x = left; x <= right; ++x) {
            const double dx = x + 0.5 - a.at.x, dy = y + 0.5 - a.at.y;
            const double b1 = (dx * (c.at.y - a.at.y) - (c.at.x - a.at.x) * dy) / area;
            const double b2 = ((b.at.x - a.at.x) * dy - dx * (b.at.y - a.at.y)) / area;
            const double b0 = 1 - b1 - b2;
            if (!(b0 >= 0 && b1 >= 0 && b2 >= 0)) continue;
            double w0 = b0 * by_depth(a), w1 = b1 * by_depth(b), w2 = b2 * by_depth(c);
            const double sum = w0 + w1 + w2;
            w0 /= sum, w1 /= sum, w2 /= sum;
            const auto depth =
                static_cast<float>(w0 * a.at.depth + w1 * b.at.depth + w2 * c.at.depth);
            const std::size_t i = panel.index(x, y);
            if (depth >= panel.depth[i]) continue;
            panel.depth[i] = depth;
            const SurfacePoint s = surface.at(triangle, w0 * a.b1 + w1 * b.b1 + w2 * c.b1,
                                              w0 * a.b2 + w1 * b.b2 + w2 * c.b2);
            const double facing = std::abs(s.normal.dot((s.position - screen.eye()).unit()));
            panel.colour[i] = paint(s) * float(0.25 + 0.75 * facing);
        }
}

void drawTriangle(Panel& panel, const Screen& screen, const Surface& surface, std::int32_t triangle,
                  const Paint& paint)
{
    const auto& c = surface.mesh().triangles[triangle];
    const Vec3d points[3] = {surface.mesh().points[c[0]], surface.mesh().points[c[1]],
                             surface.mesh().points[c[2]]};
    const std::vector<Corner> corners = inFront(screen, points);
    for (std::size_t k = 2; k < corners.size(); ++k)
        drawPiece(panel, screen, surface, triangle, corners[0], corners[k - 1], corners[k], paint);
}

void drawSurface(Panel& panel, const Screen& screen, const Surface& surface, const Paint& paint)
{
    for (std::size_t t = 0; t < surface.mesh().triangles.size(); ++t)
        drawTriangle(panel, screen, surface, static_cast<std::int32_t>(t), paint);
}

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
                if (at->depth < panel.depth[i] * 1.01f) panel.colour[i] = kColours[p.layer % 6];
            }
    }
}

/// A line of text and its colour.
struct Label {
    std::string text;
    Vec3f colour{0.85f};
};

/// Writes lines from the panel's upper left corner downwards, as far as they fit, each over a
/// shadow that keeps it readable on any map.
void writeLabels(Image& image, int left, int top, int height, const std::vector<Label>& labels)
{
    const int font = std::clamp(height / 24, 9, 20), step = font * 5 / 4;
    OIIO::ImageBuf canvas(OIIO::ImageSpec(image.width, image.height, 3, OIIO::TypeDesc::FLOAT),
                          image.pixels.data());
    for (std::size_t i = 0; i < labels.size(); ++i) {
        const int y = top + step * static_cast<int>(i + 1);
        if (y + step > top + height && i + 1 < labels.size()) break;
        const float shadow[3] = {0, 0, 0}, *ink = labels[i].colour.asPointer();
        if (!OIIO::ImageBufAlgo::render_text(canvas, left + font / 2 + 1, y + 1, labels[i].text,
                                             font, "DejaVuSans", shadow)
            || !OIIO::ImageBufAlgo::render_text(canvas, left + font / 2, y, labels[i].text, font,
                                                "DejaVuSans", {ink, 3}))
            throw Error(
                "a sheet's labels need the font DejaVu Sans (Debian's package fonts-dejavu-core): "
                + canvas.geterror());
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
            {fmt::format("{}: {}", scene.layers[i].layer.name, counts[i]), kColours[i % 6]});
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
