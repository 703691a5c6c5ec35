// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/surface_walk.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>
#include <vector>

#include <OpenMesh/Core/Mesh/TriConnectivity.hh>

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

constexpr int kMostTurns = 256; ///< triangles around a vertex

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

/// How triangles hang together: half-edges, in which face t is the mesh's triangle t, though it may
/// be turned round.
struct SurfaceWalk::Links {
    OpenMesh::TriConnectivity edges;
    std::vector<std::array<std::int32_t, 3>> vertices; ///< those of each triangle's corners

    explicit Links(const Mesh& mesh);
    /// The triangle across the edge from a corner to the next; -1: none.
    std::int32_t across(std::int32_t triangle, int corner) const
    {
        const auto [a, b, c] = vertices[triangle];
        const int opposite = corner == 0 ? c : corner == 1 ? a : b;
        auto edge = edges.halfedge_handle(OpenMesh::FaceHandle(triangle));
        while (edges.to_vertex_handle(edges.next_halfedge_handle(edge)).idx() != opposite)
            edge = edges.next_halfedge_handle(edge);
        return edges.opposite_face_handle(edge).idx();
    }

private:
    bool fits(const std::array<std::int32_t, 3>& triangle) const;
    void add(std::array<std::int32_t, 3>& triangle);
};

/// True if the half-edges of the triangle are free.
bool SurfaceWalk::Links::fits(const std::array<std::int32_t, 3>& triangle) const
{
    for (int i = 0; i < 3; ++i) {
        const OpenMesh::VertexHandle from(triangle[i]), to(triangle[(i + 1) % 3]);
        const auto edge = edges.find_halfedge(from, to);
        if (!edges.is_boundary(from) || (edge.is_valid() && !edges.is_boundary(edge))) return false;
    }
    return true;
}

/// Adds a triangle, turned round if it only fits so; one that does not fit gets its own vertices.
void SurfaceWalk::Links::add(std::array<std::int32_t, 3>& triangle)
{
    const auto addFace = [&](const std::array<std::int32_t, 3>& v) {
        return edges
            .add_face(OpenMesh::VertexHandle(v[0]), OpenMesh::VertexHandle(v[1]),
                      OpenMesh::VertexHandle(v[2]))
            .is_valid();
    };
    std::array<std::int32_t, 3> order = triangle;
    const bool degenerate = order[0] == order[1] || order[1] == order[2] || order[2] == order[0];
    if (!degenerate && !fits(order)) std::swap(order[1], order[2]);
    if (!degenerate && fits(order) && addFace(order)) return;
    for (std::int32_t& v : triangle) v = edges.new_vertex().idx();
    addFace(triangle);
}

SurfaceWalk::Links::Links(const Mesh& mesh)
{
    const std::vector<std::int32_t> welded = weld(mesh.points);
    const std::size_t count = mesh.triangles.size();
    const auto vertexOf = [&](std::int32_t t, int i) { return welded[mesh.triangles[t][i % 3]]; };
    const auto isDegenerate = [&](const EdgeUse& use) {
        const std::int32_t a = vertexOf(use.triangle, 0), b = vertexOf(use.triangle, 1),
                           c = vertexOf(use.triangle, 2);
        return a == b || b == c || c == a;
    };
    // A place where several sheets meet is a vertex for each of them: corners are one vertex only
    // if edges that two triangles share lead from one to the other.
    std::vector<std::int32_t> corner(3 * count); // a forest; a vertex is a root
    std::iota(corner.begin(), corner.end(), 0);
    const auto root = [&](std::int32_t c) {
        while (corner[c] != c) c = corner[c] = corner[corner[c]];
        return c;
    };
    forEachEdge(edgeUses(mesh, welded), [&](auto first, auto last) {
        const auto a = std::find_if_not(first, last, isDegenerate);
        const auto b = a == last ? last : std::find_if_not(a + 1, last, isDegenerate);
        if (b == last) return;
        for (int end = 0; end < 2; ++end) {
            const int same = a->forward == b->forward ? end : 1 - end;
            corner[root(3 * a->triangle + (a->corner + end) % 3)] =
                root(3 * b->triangle + (b->corner + same) % 3);
        }
    });
    edges.reserve(3 * count, 3 * count, count);
    std::vector<std::int32_t> number(3 * count, -1);
    // A vertex of very many triangles is several: the time per triangle grows with their number.
    std::vector<int> uses; // of each vertex
    vertices.resize(count);
    for (std::size_t t = 0; t < count; ++t) {
        for (std::size_t i = 0; i < 3; ++i) {
            std::int32_t& n = number[root(static_cast<std::int32_t>(3 * t + i))];
            if (n < 0 || ++uses[n] > kMostTurns) {
                n = edges.new_vertex().idx();
                uses.resize(edges.n_vertices(), 1);
            }
            vertices[t][i] = n;
        }
        add(vertices[t]);
    }
}

SurfaceWalk::SurfaceWalk(const Mesh& mesh) : m_links(std::make_shared<const Links>(mesh)) { }

bool SurfaceWalk::lookAround(Step& step, std::int32_t triangle, int corner) const
{
    const OpenMesh::VertexHandle vertex(m_links->vertices[triangle][corner]);
    int turns = 0;
    for (auto face = m_links->edges.cvf_iter(vertex); face.is_valid() && turns < kMostTurns;
         ++face, ++turns)
        if (face->idx() != triangle) step.look(face->idx());
    return m_links->edges.is_boundary(vertex);
}

SurfaceWalk::Foot SurfaceWalk::nearest(const Mesh& mesh, const Vec3d& p, std::int32_t start) const
{
    std::int32_t triangle = start;
    Nearest here = nearestOf(mesh, start, p);
    for (std::size_t k = 0; k < m_links->vertices.size(); ++k) {
        Step step(mesh, p, here);
        bool border = false;
        if (here.edge >= 0) {
            const std::int32_t t = m_links->across(triangle, here.edge);
            border = t < 0;
            if (!border) step.look(t);
        } else if (here.corner >= 0) border = lookAround(step, triangle, here.corner);
        if (step.best < 0 && border) // a triangle without area may have given any of its edges
            for (int i = 0; i < 3; ++i)
                if (const std::int32_t t = m_links->across(triangle, i); t >= 0) step.look(t);
        if (step.best < 0) break;
        triangle = step.best;
        here = step.found;
    }
    return {triangle, here.b1, here.b2, here.distance2};
}

} // namespace volcomp
