// SPDX-License-Identifier: Apache-2.0
// How true a baked box is: the light that passes it against the light that passes the exact tapered
// cylinders and leaves.
//
// Parallel rays; a cone's or leaf's shadow in their direction is a convex shape (the hull of two
// discs, a quadrilateral), so that whether a ray is blocked is decided exactly and in float64,
// without the library's code.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "volcomp/grow/grow.h"
#include "volcomp/render/march/march.h"
#include "volcomp/base/random.h"
#include "volcomp/bake/rasterise.h"
#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {

struct StudyView {
    Vec3d direction, right, up; ///< orthonormal
    double left = 0, bottom = 0, width = 0, height = 0;
    int columns = 0, rows = 0; ///< rays, jittered in their cells

    StudyView(const std::vector<Segment>& segments, const Vec3d& d, int resolution)
        : direction(d / d.length())
    {
        right = direction.cross(std::abs(direction[1]) < 0.9 ? Vec3d(0, 1, 0) : Vec3d(1, 0, 0));
        right.normalize();
        up = right.cross(direction);
        double low[2] = {1e30, 1e30}, high[2] = {-1e30, -1e30};
        for (const Segment& s : segments)
            for (const Vec3f& p : {s.a, s.b}) {
                const double q[2] = {Vec3d(p).dot(right), Vec3d(p).dot(up)};
                for (int k = 0; k < 2; ++k) {
                    low[k] = std::min(low[k], q[k]);
                    high[k] = std::max(high[k], q[k]);
                }
            }
        left = low[0];
        bottom = low[1];
        width = high[0] - low[0];
        height = high[1] - low[1];
        const double step = std::max(width, height) / resolution;
        columns = std::max(8, static_cast<int>(width / step));
        rows = std::max(8, static_cast<int>(height / step));
    }

    /// Image-plane position of a ray.
    void ray(int x, int y, double& u, double& v) const
    {
        Random random(hashKey(static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y)));
        u = left + width * (x + random.uniform()) / columns;
        v = bottom + height * (y + random.uniform()) / rows;
    }
};

/// 1 where the ray passes, 0 where something blocks it.
inline std::vector<float> exactTransmittance(const std::vector<Segment>& segments,
                                             const StudyView& view)
{
    std::vector<double> us(static_cast<std::size_t>(view.columns * view.rows)), vs(us.size());
    for (int y = 0; y < view.rows; ++y)
        for (int x = 0; x < view.columns; ++x)
            view.ray(x, y, us[y * view.columns + x], vs[y * view.columns + x]);
    std::vector<float> passes(us.size(), 1.0f);
    for (const Segment& s : segments) {
        const double a[2] = {Vec3d(s.a).dot(view.right), Vec3d(s.a).dot(view.up)},
                     b[2] = {Vec3d(s.b).dot(view.right), Vec3d(s.b).dot(view.up)};
        const double side[2] = {Vec3d(s.side).dot(view.right), Vec3d(s.side).dot(view.up)};
        const double ra = s.size_a, rb = s.size_b;
        const auto cell = [](double p, double low, double extent, int count) {
            return static_cast<int>(std::floor((p - low) / extent * count));
        };
        const int x0 =
            std::max(0, cell(std::min(a[0] - ra, b[0] - rb), view.left, view.width, view.columns));
        const int x1 =
            std::min(view.columns - 1,
                     cell(std::max(a[0] + ra, b[0] + rb), view.left, view.width, view.columns));
        const int y0 =
            std::max(0, cell(std::min(a[1] - ra, b[1] - rb), view.bottom, view.height, view.rows));
        const int y1 =
            std::min(view.rows - 1,
                     cell(std::max(a[1] + ra, b[1] + rb), view.bottom, view.height, view.rows));
        const double du = b[0] - a[0], dv = b[1] - a[1], length = std::hypot(du, dv);
        double corner[4][2];
        for (int k = 0; k < 2; ++k) {
            corner[0][k] = a[k] - side[k] * ra;
            corner[1][k] = b[k] - side[k] * rb;
            corner[2][k] = b[k] + side[k] * rb;
            corner[3][k] = a[k] + side[k] * ra;
        }
        const auto blocked = [&](double u, double v) {
            if (s.flat()) {
                bool left = false, right = false;
                for (int k = 0; k < 4; ++k) {
                    const double* p = corner[k];
                    const double* q = corner[(k + 1) % 4];
                    const double cross = (q[0] - p[0]) * (v - p[1]) - (q[1] - p[1]) * (u - p[0]);
                    left = left || cross > 0;
                    right = right || cross < 0;
                }
                return !(left && right);
            }
            const double pu = u - a[0], pv = v - a[1];
            if (length <= std::abs(ra - rb))
                return pu * pu + pv * pv <= ra * ra
                    || (u - b[0]) * (u - b[0]) + (v - b[1]) * (v - b[1]) <= rb * rb;
            // hull of two discs: along the axis, moved by the slope of the tangent
            const double sine = (ra - rb) / length, cosine = std::sqrt(1 - sine * sine);
            const double along = (pu * du + pv * dv) / length,
                         across = std::abs(pu * dv - pv * du) / length;
            const double at = (along - across * sine / cosine)
                / length; // of the axis point whose disc reaches farthest here
            if (at <= 0) return pu * pu + pv * pv <= ra * ra;
            if (at >= 1) return (u - b[0]) * (u - b[0]) + (v - b[1]) * (v - b[1]) <= rb * rb;
            return across * cosine + along * sine <= ra;
        };
        for (int y = y0; y <= y1; ++y)
            for (int x = x0; x <= x1; ++x) {
                const std::size_t i = static_cast<std::size_t>(y * view.columns + x);
                if (passes[i] > 0 && blocked(us[i], vs[i])) passes[i] = 0;
            }
    }
    return passes;
}

/// Transmittance of the same rays through the baked volume, tau = 1.
inline std::vector<float> bakedTransmittance(const Volume& volume, const StudyView& view,
                                             bool fibre)
{
    const VoxelTree tree(volume);
    std::vector<float> result(static_cast<std::size_t>(view.columns * view.rows));
    for (int y = 0; y < view.rows; ++y)
        for (int x = 0; x < view.columns; ++x) {
            double u, v;
            view.ray(x, y, u, v);
            const Vec3d p = view.right * u + view.up * v;
            const double middle = p.dot(view.direction);
            const MarchRay ray(
                tree, tree.toCorner(p - view.direction * (middle + 1000 * tree.voxelSize())),
                view.direction,
                1e9); // boxes are not rotated
            const double depth = !ray.hits ? 0
                : fibre                    ? lineIntegral<true>(tree, ray, view.direction, 1e9)
                                           : lineIntegral<false>(tree, ray, view.direction, 1e9);
            result[static_cast<std::size_t>(y * view.columns + x)] =
                static_cast<float>(std::exp(-depth * tree.voxelSize()));
        }
    return result;
}

struct StudyError {
    double mean = 0; ///< baked minus exact, mean over the picture
    double local =
        0; ///< mean of |baked - exact| over the blocks of a grid, each block's mean transmittance
    double exact = 0; ///< mean transmittance
};

/// Blocks of the grid are `block` wide; those where nothing stands in either picture are not
/// counted, neither here nor there.
inline StudyError compare(const std::vector<float>& exact, const std::vector<float>& baked,
                          const StudyView& view, double block)
{
    const int n = std::max(1, static_cast<int>(std::round(view.width / block))),
              m = std::max(1, static_cast<int>(std::round(view.height / block)));
    std::vector<double> e(static_cast<std::size_t>(n * m)), b(e.size());
    std::vector<int> count(e.size());
    for (int y = 0; y < view.rows; ++y)
        for (int x = 0; x < view.columns; ++x) {
            const std::size_t at = static_cast<std::size_t>((y * m / view.rows) * n
                                                            + x * n / view.columns),
                              i = static_cast<std::size_t>(y * view.columns + x);
            e[at] += exact[i];
            b[at] += baked[i];
            ++count[at];
        }
    StudyError result;
    double rays = 0;
    int blocks = 0;
    for (std::size_t k = 0; k < e.size(); ++k) {
        if (count[k] == 0 || (e[k] > 0.999 * count[k] && b[k] > 0.999 * count[k])) continue;
        result.mean += b[k] - e[k];
        result.exact += e[k];
        rays += count[k];
        result.local += std::abs(b[k] - e[k]) / count[k];
        ++blocks;
    }
    result.mean /= std::max(1.0, rays);
    result.exact /= std::max(1.0, rays);
    result.local /= std::max(1, blocks);
    return result;
}

} // namespace volcomp
