// SPDX-License-Identifier: Apache-2.0
// The rays of ShadowSweep once more, in doubles and one by one, as its headers describe them; its
// test alone uses this.
#pragma once

#include <algorithm>
#include <cmath>

#include "volcomp/view/light.h"
#include "volcomp/render/march/march.h"
#include "volcomp/render/shadow/shadow_sweep.h"
#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {

/// A light's rays as shadow_sweep.h and light_lattice.h describe them: where they cross the planes,
/// what is kept of them and what is read between them.
class SweptRays {
public:
    /// The rays of a directional light, or of the pyramid of a point light that holds the direction
    /// L to it. If `directed`, densities count as under directed extinction.
    SweptRays(const VoxelTree& tree, const Light& light, const Vec3d& L, bool directed)
        : m_tree(tree), m_directed(directed), m_fans(light.kind != LightKind::directional), m_L(L),
          m_light(tree.toCorner(light.position))
    {
        for (int axis = 1; axis < 3; ++axis)
            if (std::abs(L[axis]) > std::abs(L[m_a])) m_a = axis;
        m_b = m_a == 0 ? 1 : 0;
        m_c = m_a == 2 ? 1 : 2;
        m_sign = L[m_a] < 0 ? 1 : -1;
        if (!m_fans) {
            const int low = tree.bounds().min()[m_a], size = tree.bounds().dim()[m_a];
            m_s0 = m_sign * (low + 0.5 * size);
            for (const int axis : {m_b, m_c})
                m_in_columns[axis] = std::abs(L[axis] / L[m_a]) * 0.5 * size < 1.0 / 6;
            return;
        }
        m_s0 = m_sign * m_light[m_a];
        // The plane behind the last leaf that the pyramid reaches. There the rays are as far apart
        // as they may be.
        double farthest = m_s0 + 1;
        tree.forEachCell([&](const openvdb::Coord& origin, int) {
            const double s = planeBefore(origin[m_a]), reach = s + 8 - m_s0;
            for (const int axis : {m_b, m_c})
                if (origin[axis] - m_light[axis] > reach
                    || origin[axis] + 8 - m_light[axis] < -reach)
                    return;
            if (s > m_s0 + 1e-3) farthest = std::max(farthest, s + 8);
        });
        m_widening = ShadowSweep::kSpacing / (farthest - m_s0);
    }
    /// s of the plane by which the light enters the leaf of a voxel, given along the light's axis.
    double planeBefore(int voxel) const { return m_sign > 0 ? voxel & ~7 : -((voxel & ~7) + 8.0); }
    double planeBefore(const int* cell) const { return planeBefore(cell[m_a]); }
    /// Voxels from p to the plane at s, against the light.
    double way(const Vec3d& p, double s) const
    {
        return (m_sign * p[m_a] - s) / std::abs(m_L[m_a]);
    }
    bool startsBefore(double s) const { return !m_fans || s > m_s0 + 1e-3; }
    /// 255 times the root of the transmittance where the way from p to the light crosses the plane
    /// at s, interpolated between every `stride`-th ray.
    double code(const Vec3d& p, double s, int stride) const
    {
        const Vec3d q = p + way(p, s) * m_L;
        const double spacing = stride * (m_fans ? m_widening * (s - m_s0) : ShadowSweep::kSpacing);
        const auto slope = [&](int axis) { return m_fans ? 0 : -m_L[axis] / std::abs(m_L[m_a]); };
        // The plane on which they keep off the faces: the volume's middle, if they stay in columns.
        const auto start = [&](int axis) { return m_in_columns[axis] ? m_s0 : 0; };
        const double u = (q[m_b] - zero(m_b) - slope(m_b) * (s - start(m_b))) / spacing,
                     v = (q[m_c] - zero(m_c) - slope(m_c) * (s - start(m_c))) / spacing;
        const auto position = [&](int axis, double number) {
            return zero(axis) + slope(axis) * (s - start(axis)) + number * spacing;
        };
        // If rays stay in their columns, one in another column does not count.
        const auto weight = [&](int axis, double number, double ray) {
            const auto isIn = [&](double r) {
                return stride > 1 || !m_in_columns[axis]
                    || std::floor(position(axis, r)) == std::floor(q[axis]);
            };
            const double other = 2 * std::floor(number) + 1 - ray;
            return !isIn(ray) ? 0 : !isIn(other) ? 1 : 1 - std::abs(number - ray);
        };
        double sum = 0;
        for (int k = 0; k < 4; ++k) {
            const double i = std::floor(u) + (k >> 1), j = std::floor(v) + (k & 1);
            Vec3d x;
            x[m_a] = m_sign * s;
            x[m_b] = position(m_b, i);
            x[m_c] = position(m_c, j);
            sum += weight(m_b, u, i) * weight(m_c, v, j) * 255 * std::exp(-0.5 * depth(x));
        }
        return sum;
    }

private:
    double zero(int axis) const { return m_fans ? m_light[axis] : 1.0 / 6; }
    // The optical depth from x to the light. The light's direction at a leaf is that at its middle.
    double depth(const Vec3d& x) const
    {
        const double distance = m_fans ? (m_light - x).length() : MarchRay::kFar;
        const Vec3d L = m_fans ? (m_light - x) / distance : m_L;
        const MarchRay r(m_tree, x, L, distance);
        double sum = 0;
        forEachLeaf(m_tree, r, [&](const LeafSpan& span) {
            const Vec3d middle(span.cell[0] + 4, span.cell[1] + 4, span.cell[2] + 4),
                seen = m_fans ? (m_light - middle).unit() : L;
            sum += m_directed
                ? leafIntegral<true>(m_tree, r, span.leaf, *span.start, span.t_end, true, seen)
                : leafIntegral<false>(m_tree, r, span.leaf, *span.start, span.t_end, true, seen);
            return true;
        });
        return sum;
    }

    const VoxelTree& m_tree;
    const bool m_directed, m_fans;
    const Vec3d m_L, m_light;
    int m_a = 0, m_b = 1, m_c = 2, m_sign = 1;
    bool m_in_columns[3] = {};
    double m_s0 = 0, m_widening = 0;
};

} // namespace volcomp
