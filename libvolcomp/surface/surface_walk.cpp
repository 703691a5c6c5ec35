// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/surface_walk.h"

#include <algorithm>

#include "volcomp/surface/mesh_topology.h"

namespace volcomp {
namespace {

/// The nearest point of one triangle.
struct Nearest {
    double b1 = 0, b2 = 0, distance2 = 0;
    int edge = -1;   ///< on the edge from this corner to the next
    int corner = -1; ///< on this corner
};

double partOf(double a, double whole) { return whole > 0 ? a / whole : 0; }

/// By Ericson, Real-Time Collision Detection, 2005, section 5.1.5; for triangles without area too.
Nearest nearestOf(const Mesh& mesh, std::int32_t triangle, const Vec3d& p)
{
    const auto& corners = mesh.triangles[triangle];
    const Vec3d &a = mesh.points[corners[0]], ab = mesh.points[corners[1]] - a,
                ac = mesh.points[corners[2]] - a, ap = p - a;
    Nearest n;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap);
    const double d3 = d1 - ab.dot(ab), d4 = d2 - ac.dot(ab), d5 = d1 - ab.dot(ac),
                 d6 = d2 - ac.dot(ac);
    const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    if (d1 <= 0 && d2 <= 0) n.corner = 0;
    else if (d3 >= 0 && d4 <= d3) n.corner = 1, n.b1 = 1;
    else if (vc <= 0 && d1 >= 0 && d3 <= 0) n.edge = 0, n.b1 = partOf(d1, d1 - d3);
    else if (d6 >= 0 && d5 <= d6) n.corner = 2, n.b2 = 1;
    else if (vb <= 0 && d2 >= 0 && d6 <= 0) n.edge = 2, n.b2 = partOf(d2, d2 - d6);
    else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
        n.edge = 1, n.b2 = partOf(d4 - d3, (d4 - d3) + (d5 - d6)), n.b1 = 1 - n.b2;
    else n.b1 = partOf(vb, va + vb + vc), n.b2 = partOf(vc, va + vb + vc);
    n.distance2 = (ap - ab * n.b1 - ac * n.b2).lengthSqr();
    return n;
}

constexpr int kMostTurns = 256; ///< triangles around one corner that are looked at

} // namespace

/// The search for a place nearer to `p` in the triangles around the current one.
class SurfaceWalk::Step {
public:
    Step(const Mesh& mesh, const Vec3d& p, const Nearest& here) : m_mesh(mesh), m_p(p), found(here)
    {
        found.distance2 *= 1 - 1e-12; // nearer by more than rounding
    }
    void look(std::int32_t triangle)
    {
        if (const Nearest n = nearestOf(m_mesh, triangle, m_p); n.distance2 < found.distance2)
            found = n, best = triangle;
    }

private:
    const Mesh& m_mesh;
    const Vec3d& m_p;

public:
    Nearest found;
    std::int32_t best = -1; ///< -1: no triangle is nearer
};

SurfaceWalk::SurfaceWalk(const Mesh& mesh)
{
    const std::vector<std::int32_t> welded = weld(mesh.points);
    for (const auto& corners : mesh.triangles)
        m_vertices.push_back({welded[corners[0]], welded[corners[1]], welded[corners[2]]});
    const auto isDegenerate = [&](const EdgeUse& use) {
        const auto& v = m_vertices[use.triangle];
        return v[0] == v[1] || v[1] == v[2] || v[2] == v[0];
    };
    m_neighbours.assign(mesh.triangles.size(), {-1, -1, -1});
    forEachEdge(edgeUses(mesh, welded), [&](auto first, auto last) {
        const auto a = std::find_if_not(first, last, isDegenerate);
        if (a == last) return;
        const auto b = std::find_if_not(a + 1, last, isDegenerate);
        if (b == last) return;
        m_neighbours[a->triangle][a->corner] = b->triangle;
        m_neighbours[b->triangle][b->corner] = a->triangle;
    });
}

bool SurfaceWalk::lookAround(Step& step, std::int32_t triangle, int corner) const
{
    bool border = false;
    const std::int32_t vertex = m_vertices[triangle][corner];
    for (bool forward_first : {true, false}) { // one way and, if that ends at a border, the other
        std::int32_t t = triangle;
        int at = corner, turns = 0;
        bool forward = forward_first; // across the edge that starts in the corner, or ends there
        do {
            const std::int32_t from = t;
            t = m_neighbours[t][forward ? at : (at + 2) % 3];
            border = border || t < 0;
            if (t < 0 || t == triangle) break;
            at = static_cast<int>(std::find(m_vertices[t].begin(), m_vertices[t].end(), vertex)
                                  - m_vertices[t].begin());
            if (at == 3) break;
            forward = m_neighbours[t][at] != from;
            step.look(t);
        } while (++turns < kMostTurns);
        if (t == triangle) break;
    }
    return border;
}

SurfaceWalk::Foot SurfaceWalk::nearest(const Mesh& mesh, const Vec3d& p, std::int32_t start) const
{
    std::int32_t triangle = start;
    Nearest here = nearestOf(mesh, start, p);
    for (std::size_t k = 0; k < m_neighbours.size(); ++k) {
        Step step(mesh, p, here);
        bool border = false;
        if (here.edge >= 0) {
            const std::int32_t t = m_neighbours[triangle][here.edge];
            border = t < 0;
            if (!border) step.look(t);
        } else if (here.corner >= 0) border = lookAround(step, triangle, here.corner);
        if (step.best < 0 && border) // a triangle without area may have given any of its edges
            for (const std::int32_t t : m_neighbours[triangle])
                if (t >= 0) step.look(t);
        if (step.best < 0) break;
        triangle = step.best;
        here = step.found;
    }
    return {triangle, here.b1, here.b2, here.distance2};
}

} // namespace volcomp
