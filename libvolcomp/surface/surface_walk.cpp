#include "volcomp/surface/surface_walk.h"

#include <algorithm>
#include <numeric>

namespace volcomp {
namespace {

/// Where the nearest point of a triangle lies.
struct Nearest {
    double b1 = 0, b2 = 0, distance2 = 0;
    int edge = -1; ///< on the edge from this corner to the next
    int corner = -1;
};

double part(double a, double whole) { return whole > 0 ? a / whole : 0; }

/// Ericson, Real-Time Collision Detection, 2005, section 5.1.5; for triangles without area too.
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
    else if (vc <= 0 && d1 >= 0 && d3 <= 0) n.edge = 0, n.b1 = part(d1, d1 - d3);
    else if (d6 >= 0 && d5 <= d6) n.corner = 2, n.b2 = 1;
    else if (vb <= 0 && d2 >= 0 && d6 <= 0) n.edge = 2, n.b2 = part(d2, d2 - d6);
    else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
        n.edge = 1, n.b2 = part(d4 - d3, (d4 - d3) + (d5 - d6)), n.b1 = 1 - n.b2;
    else n.b1 = part(vb, va + vb + vc), n.b2 = part(vc, va + vb + vc);
    n.distance2 = (ap - ab * n.b1 - ac * n.b2).lengthSqr();
    return n;
}

} // namespace

SurfaceWalk::SurfaceWalk(const Mesh& mesh)
{
    std::vector<std::int32_t> order(mesh.points.size()), vertex(mesh.points.size());
    std::iota(order.begin(), order.end(), 0);
    const auto place = [&](std::int32_t i) {
        return std::array<double, 3>{mesh.points[i][0], mesh.points[i][1], mesh.points[i][2]};
    };
    std::sort(order.begin(), order.end(),
              [&](std::int32_t a, std::int32_t b) { return place(a) < place(b); });
    for (std::size_t i = 0; i < order.size(); ++i)
        vertex[order[i]] =
            i > 0 && place(order[i]) == place(order[i - 1]) ? vertex[order[i - 1]] : order[i];
    struct Edge {
        std::int32_t low, high, triangle, corner;
    };
    std::vector<Edge> edges;
    m_neighbours.assign(mesh.triangles.size(), {-1, -1, -1});
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        auto& v = m_vertices.emplace_back();
        for (int i = 0; i < 3; ++i) v[i] = vertex[mesh.triangles[t][i]];
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
            continue; // between two neighbours without being one
        for (int i = 0; i < 3; ++i)
            edges.push_back({std::min(v[i], v[(i + 1) % 3]), std::max(v[i], v[(i + 1) % 3]),
                             static_cast<std::int32_t>(t), i});
    }
    std::stable_sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
        return a.low != b.low ? a.low < b.low : a.high < b.high;
    });
    for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
        const Edge &a = edges[i], &b = edges[i + 1];
        if (a.low != b.low || a.high != b.high) continue;
        m_neighbours[a.triangle][a.corner] = b.triangle;
        m_neighbours[b.triangle][b.corner] = a.triangle;
        while (i + 1 < edges.size() && edges[i + 1].low == a.low && edges[i + 1].high == a.high)
            ++i;
    }
}

SurfaceWalk::Foot SurfaceWalk::nearest(const Mesh& mesh, const Vec3d& p, std::int32_t start) const
{
    Foot foot{start, 0, 0, 0};
    Nearest here = nearestOf(mesh, start, p);
    for (std::size_t step = 0; step < m_neighbours.size(); ++step) {
        std::int32_t best = -1;
        Nearest there = here;
        there.distance2 *= 1 - 1e-12; // nearer than rounding
        const auto look = [&](std::int32_t t) {
            if (const Nearest n = nearestOf(mesh, t, p); n.distance2 < there.distance2)
                there = n, best = t;
        };
        bool border = false;
        if (here.edge >= 0) {
            const std::int32_t t = m_neighbours[foot.triangle][here.edge];
            border = t < 0;
            if (!border) look(t);
        } else if (here.corner
                   >= 0) { // round the corner, one way and, if that ends at a border, the other
            const std::int32_t vertex = m_vertices[foot.triangle][here.corner];
            for (int way = 0; way < 2; ++way) {
                std::int32_t t = foot.triangle;
                int corner = here.corner, turns = 0;
                bool forward = way
                    == 0; // across the edge that starts in the corner, or the one that ends there
                do {
                    const std::int32_t from = t;
                    t = m_neighbours[t][forward ? corner : (corner + 2) % 3];
                    border = border || t < 0;
                    if (t < 0 || t == foot.triangle) break;
                    corner = static_cast<int>(
                        std::find(m_vertices[t].begin(), m_vertices[t].end(), vertex)
                        - m_vertices[t].begin());
                    if (corner == 3) break;
                    forward = m_neighbours[t][corner] != from;
                    look(t);
                } while (++turns < 256);
                if (t == foot.triangle) break;
            }
        }
        if (best < 0 && border) // a triangle without area may have given any of its edges
            for (const std::int32_t t : m_neighbours[foot.triangle])
                if (t >= 0) look(t);
        if (best < 0) break;
        foot.triangle = best;
        here = there;
    }
    foot.b1 = here.b1;
    foot.b2 = here.b2;
    foot.distance2 = here.distance2;
    return foot;
}

} // namespace volcomp
