// SPDX-License-Identifier: Apache-2.0
#include "volcomp/inspect/panel.h"

#include <algorithm>
#include <utility>

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

const Vec3f kColours[6] = {{0.9f, 0.1f, 0.08f},  {0.1f, 0.7f, 0.15f}, {0.12f, 0.25f, 1.0f},
                           {0.9f, 0.75f, 0.05f}, {0.8f, 0.1f, 0.8f},  {0.05f, 0.75f, 0.8f}};

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

} // namespace

Vec3f layerColour(std::size_t layer) { return kColours[layer % 6]; }

void drawSurface(Panel& panel, const Screen& screen, const Surface& surface, const Paint& paint)
{
    for (std::size_t t = 0; t < surface.mesh().triangles.size(); ++t)
        drawTriangle(panel, screen, surface, static_cast<std::int32_t>(t), paint);
}

void writeText(Image& image, int x, int y, int size, const Label& label)
{
    OIIO::ImageBuf canvas(OIIO::ImageSpec(image.width, image.height, 3, OIIO::TypeDesc::FLOAT),
                          image.pixels.data());
    const float shadow[3] = {0, 0, 0}, *ink = label.colour.asPointer();
    if (!OIIO::ImageBufAlgo::render_text(canvas, x + 1, y + 1, label.text, size, "DejaVuSans",
                                         shadow)
        || !OIIO::ImageBufAlgo::render_text(canvas, x, y, label.text, size, "DejaVuSans", {ink, 3}))
        throw Error(
            "a sheet's labels need the font DejaVu Sans (Debian's package fonts-dejavu-core): "
            + canvas.geterror());
}

void writeLabels(Image& image, int left, int top, int height, const std::vector<Label>& labels)
{
    const int font = std::clamp(height / 24, 9, 20), step = font * 5 / 4;
    for (std::size_t i = 0; i < labels.size(); ++i) {
        const int y = top + step * static_cast<int>(i + 1);
        if (y + step > top + height && i + 1 < labels.size()) break;
        writeText(image, left + font / 2, y, font, labels[i]);
    }
}

Image imageOf(const Panel& panel)
{
    Image image;
    image.width = panel.width;
    image.height = panel.height;
    image.channels = {"R", "G", "B"};
    image.pixels.reserve(panel.colour.size() * 3);
    for (const Vec3f& c : panel.colour) image.pixels.insert(image.pixels.end(), {c[0], c[1], c[2]});
    return image;
}

} // namespace volcomp
