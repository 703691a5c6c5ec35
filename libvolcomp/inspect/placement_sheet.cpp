#include "volcomp/inspect/placement_sheet.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/surface/second_density.h"

namespace volcomp {
namespace {

/// From the world to pixels and depth.
class Screen {
public:
    Screen(const Camera& c, int width, int height) : m_camera(c), m_width(width), m_height(height)
    {
        m_forward = (c.target - c.eye).unit();
        m_right = m_forward.cross(c.up).unit();
        m_up = m_right.cross(m_forward);
    }
    /// False behind the eye.
    bool project(const Vec3d& p, double& x, double& y, double& z) const
    {
        const Vec3d d = p - m_camera.eye;
        z = d.dot(m_forward);
        if (z <= 1e-9) return false;
        const double f = m_camera.projection == Projection::orthographic
            ? m_width / m_camera.width
            : m_width / (2 * z * std::tan(m_camera.field_of_view / 2));
        x = 0.5 * m_width + d.dot(m_right) * f;
        y = 0.5 * m_height - d.dot(m_up) * f;
        return true;
    }
    const Vec3d& forward() const { return m_forward; }
    const Vec3d& eye() const { return m_camera.eye; }

private:
    const Camera& m_camera;
    int m_width, m_height;
    Vec3d m_forward, m_right, m_up;
};

const Vec3f kColours[6] = {{0.9f, 0.1f, 0.08f},  {0.1f, 0.7f, 0.15f}, {0.12f, 0.25f, 1.0f},
                           {0.9f, 0.75f, 0.05f}, {0.8f, 0.1f, 0.8f},  {0.05f, 0.75f, 0.8f}};

struct Panel {
    int width, height;
    std::vector<float> depth;
    std::vector<Vec3f> colour;
    Panel(int w, int h)
        : width(w), height(h), depth(std::size_t(w) * h, std::numeric_limits<float>::infinity()),
          colour(std::size_t(w) * h, Vec3f(0.02f))
    {
    }
};

using Paint = std::function<Vec3f(const SurfacePoint&)>;

void drawSurface(Panel& panel, const Screen& screen, const Surface& surface, const Paint& paint)
{
    const Mesh& mesh = surface.mesh();
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        double x[3], y[3], z[3];
        bool ahead = true;
        for (int i = 0; i < 3; ++i)
            ahead = ahead && screen.project(mesh.points[mesh.triangles[t][i]], x[i], y[i], z[i]);
        const double area =
            ahead ? (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]) : 0;
        if (!(std::abs(area) > 1e-12)) continue;
        const int left = std::max(0, int(std::floor(std::min({x[0], x[1], x[2]})))),
                  right = std::min(panel.width - 1, int(std::ceil(std::max({x[0], x[1], x[2]}))));
        const int top = std::max(0, int(std::floor(std::min({y[0], y[1], y[2]})))),
                  bottom = std::min(panel.height - 1, int(std::ceil(std::max({y[0], y[1], y[2]}))));
        for (int py = top; py <= bottom; ++py)
            for (int px = left; px <= right; ++px) {
                const double cx = px + 0.5, cy = py + 0.5;
                double b1 = ((cx - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (cy - y[0])) / area;
                double b2 = ((x[1] - x[0]) * (cy - y[0]) - (cx - x[0]) * (y[1] - y[0])) / area;
                double b0 = 1 - b1 - b2;
                if (b0 < 0 || b1 < 0 || b2 < 0) continue;
                // Weights on the screen become weights in the world by the depth.
                const double w0 = b0 / z[0], w1 = b1 / z[1], w2 = b2 / z[2], sum = w0 + w1 + w2;
                const auto depth = static_cast<float>(1 / sum);
                const std::size_t i = std::size_t(py) * panel.width + px;
                if (depth >= panel.depth[i]) continue;
                panel.depth[i] = depth;
                const SurfacePoint s = surface.at(static_cast<std::int32_t>(t), w1 / sum, w2 / sum);
                const double facing = std::abs(s.normal.dot((s.position - screen.eye()).unit()));
                panel.colour[i] = paint(s) * float(0.25 + 0.75 * facing);
            }
    }
}

void drawDots(Panel& panel, const Screen& screen, const std::vector<Placement>& placements,
              int radius)
{
    for (const Placement& p : placements) {
        double x, y, z;
        if (!screen.project(p.position, x, y, z)) continue;
        for (int py = int(y) - radius; py <= int(y) + radius; ++py)
            for (int px = int(x) - radius; px <= int(x) + radius; ++px) {
                if (px < 0 || py < 0 || px >= panel.width || py >= panel.height) continue;
                const std::size_t i = std::size_t(py) * panel.width + px;
                if (z < panel.depth[i] * 1.01f) panel.colour[i] = kColours[p.layer % 6];
            }
    }
}

/// A line of text and its colour.
struct Label {
    std::string text;
    Vec3f colour{0.85f};
};

/// From the panel's upper left corner downwards, as far as they fit, over a shadow that keeps them
/// readable on any map.
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

} // namespace

Image placementSheet(const std::vector<const Surface*>& surfaces,
                     const std::vector<SheetLayer>& layers,
                     const std::vector<Placement>& placements, const Camera& camera, int width,
                     int height)
{
    const Screen screen(camera, width, height);
    std::vector<Panel> panels;
    std::vector<std::vector<Label>> labels(1);
    const auto panel = [&](const Surface* only, const Paint& paint) {
        panels.emplace_back(width, height);
        for (const Surface* s : surfaces) {
            if (!only || s == only) drawSurface(panels.back(), screen, *s, paint);
            else
                drawSurface(panels.back(), screen, *s,
                            [](const SurfacePoint&) { return Vec3f(0.06f); });
        }
    };
    panel(nullptr, [](const SurfacePoint&) { return Vec3f(0.3f); });
    drawDots(panels.back(), screen, placements,
             placements.size() > std::size_t(width) * height / 60 ? 0 : 1);
    std::vector<std::size_t> counts(layers.size());
    for (const Placement& p : placements)
        if (static_cast<std::size_t>(p.layer) < counts.size()) ++counts[p.layer];
    for (std::size_t i = 0; i < layers.size(); ++i)
        labels[0].push_back(
            {fmt::format("{}: {}", layers[i].layer->name, counts[i]), kColours[i % 6]});
    for (const SheetLayer& l : layers) {
        labels.push_back({{l.layer->name + ": where"}});
        const SecondDensity where(l.layer->where, false);
        panel(l.surface, [&](const SurfacePoint& s) {
            return Vec3f(std::clamp(where.value(s.uv, s.position), 0.0f, 1.0f));
        });
        if (l.layer->colour.empty()) continue;
        labels.push_back({{l.layer->name + ": colour"}});
        const SecondDensity colour(l.layer->colour, true);
        panel(l.surface, [&](const SurfacePoint& s) { return colour.colour(s.uv, s.position); });
    }
    const int columns = std::min<int>(4, static_cast<int>(panels.size())),
              rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
    Image image;
    image.width = columns * width;
    image.height = rows * height;
    image.channels = {"R", "G", "B"};
    image.pixels.assign(std::size_t(image.width) * image.height * 3, 0.0f);
    for (std::size_t k = 0; k < panels.size(); ++k)
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                for (int i = 0; i < 3; ++i)
                    image.pixel(int(k) % columns * width + x, int(k) / columns * height + y)[i] =
                        panels[k].colour[std::size_t(y) * width + x][i];
    for (std::size_t k = 0; k < panels.size(); ++k)
        writeLabels(image, int(k) % columns * width, int(k) / columns * height, height, labels[k]);
    return image;
}

} // namespace volcomp
