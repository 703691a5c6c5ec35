// SPDX-License-Identifier: Apache-2.0
// Pictures of surfaces as a camera sees them, drawn triangle by triangle with a depth buffer, for
// sheets and layouts. Private to inspect.
#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/surface/surface.h"
#include "volcomp/view/camera.h"
#include "volcomp/view/image.h"

namespace volcomp {

/// A point on the picture, pixels from its top left corner, and its depth along the view.
struct Projected {
    double x, y, depth;
};

/// Projects points of the world onto a picture.
class Screen {
public:
    /// Of width x height pixels, with a margin on each side that it shows as well.
    Screen(const Camera& c, int width, int height, int margin = 0)
        : m_camera(c), m_frame(c), m_width(width), m_height(height), m_margin(margin)
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
        return Projected{m_margin + 0.5 * m_width + d.dot(m_frame.right) * f,
                         m_margin + 0.5 * m_height - d.dot(m_frame.up) * f, depth};
    }
    /// Depth of a point along the view; negative behind the eye.
    double depth(const Vec3d& p) const { return (p - m_camera.eye).dot(m_frame.forward); }
    const CameraFrame& frame() const { return m_frame; }
    const Vec3d& eye() const { return m_camera.eye; }
    /// World units that a pixel shows at a depth in front of the eye.
    double pixelAt(double depth) const
    {
        return m_camera.projection == Projection::orthographic
            ? m_camera.width / m_width
            : 2 * depth * std::tan(m_camera.field_of_view / 2) / m_width;
    }
    bool perspective() const { return m_camera.projection != Projection::orthographic; }

private:
    Camera m_camera;
    CameraFrame m_frame;
    int m_width, m_height, m_margin;
};

/// The colours of layers: red, green, blue, yellow, magenta and cyan in turn.
Vec3f layerColour(std::size_t layer);

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

/// Draws a surface, each point in the colour that `paint` gives, darker where it is seen at a
/// slant.
void drawSurface(Panel& panel, const Screen& screen, const Surface& surface, const Paint& paint);

/// A line of text and its colour.
struct Label {
    std::string text;
    Vec3f colour{0.85f};
};

/// Writes lines from the upper left corner of a part of a picture of three channels downwards, as
/// far as they fit into its height, each over a shadow that keeps it readable on anything. Throws
/// Error if the font DejaVu Sans is not installed.
void writeLabels(Image& image, int left, int top, int height, const std::vector<Label>& labels);

/// Writes one line with its left lower corner at a pixel, in letters of so many pixels. Throws
/// Error likewise.
void writeText(Image& image, int x, int y, int size, const Label& label);

/// The panel as a picture of R, G and B.
Image imageOf(const Panel& panel);

} // namespace volcomp
