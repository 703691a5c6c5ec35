// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/mesh_triangulate.h"

#include <cmath>
#include <set>
#include <utility>

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Spatial_sort_traits_adapter_2.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/property_map.h>
#include <CGAL/spatial_sort.h>

namespace volcomp {
namespace {

using Triangles = std::vector<std::array<std::int32_t, 3>>;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
enum class Side : signed char { unknown, outside, inside };
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::int32_t, Kernel>;
using FaceBase =
    CGAL::Triangulation_face_base_with_info_2<Side, Kernel,
                                              CGAL::Constrained_triangulation_face_base_2<Kernel>>;
using Delaunay = CGAL::Constrained_Delaunay_triangulation_2<
    Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
    CGAL::No_constraint_intersection_requiring_constructions_tag>;
using Vertex = Delaunay::Vertex_handle;

/// The polygon's normal by Newell's formula (Graphics Gems III, V.5), as long as twice its area.
Vec3d newellNormal(const std::vector<Vec3d>& p)
{
    Vec3d sum(0.0);
    for (std::size_t i = 2; i < p.size(); ++i) sum += (p[i - 1] - p[0]).cross(p[i] - p[0]);
    return sum;
}

void fan(std::size_t count, Triangles& triangles)
{
    for (std::size_t i = 2; i < count; ++i)
        triangles.push_back({0, static_cast<std::int32_t>(i) - 1, static_cast<std::int32_t>(i)});
}

/// Two triangles, cut along the diagonal that does not fold a dent over.
void cutQuad(const std::vector<Vec3d>& p, Triangles& triangles)
{
    const auto normal = [&](int a, int b, int c) { return (p[b] - p[a]).cross(p[c] - p[a]); };
    if (normal(0, 1, 2).dot(normal(0, 2, 3)) >= 0) {
        triangles.push_back({0, 1, 2});
        triangles.push_back({0, 2, 3});
    } else {
        triangles.push_back({1, 2, 3});
        triangles.push_back({1, 3, 0});
    }
}

using Edge = std::pair<Vertex, Vertex>;
Edge edgeOf(const Vertex& a, const Vertex& b) { return a < b ? Edge(a, b) : Edge(b, a); }

/// The flat polygon's edges that bound it. An edge that it runs along twice, which a hole that is
/// cut open has, does not.
std::set<Edge> boundary(const Delaunay& flat, const std::vector<Vertex>& vertices)
{
    std::set<Edge> edges;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        const Vertex to = vertices[(i + 1) % vertices.size()];
        for (Vertex at = vertices[i]; at != to;) { // through the vertices that lie on the edge
            Vertex next;
            Delaunay::Face_handle face;
            int side = 0;
            if (!flat.includes_edge(at, to, next, face, side)) break;
            const Edge edge = edgeOf(at, next);
            if (const auto [known, is_new] = edges.insert(edge); !is_new) edges.erase(known);
            at = next;
        }
    }
    return edges;
}

/// Marks each face of the triangulation: an odd number of boundaries lies between it and infinity,
/// or an even one.
void markSides(Delaunay& flat, const std::set<Edge>& boundary)
{
    std::vector<Delaunay::Face_handle> waiting{flat.infinite_face()};
    waiting[0]->info() = Side::outside;
    while (!waiting.empty()) {
        const Delaunay::Face_handle face = waiting.back();
        waiting.pop_back();
        for (int i = 0; i < 3; ++i) {
            const Delaunay::Face_handle next = face->neighbor(i);
            if (next->info() != Side::unknown) continue;
            const Edge edge = edgeOf(face->vertex(Delaunay::cw(i)), face->vertex(Delaunay::ccw(i)));
            const bool crosses = boundary.count(edge) > 0;
            next->info() = (face->info() == Side::inside) != crosses ? Side::inside : Side::outside;
            waiting.push_back(next);
        }
    }
}

/// Inserts the polygon's points as `x` and `y` of them show it, in an order that is quick for any
/// polygon. Returns the vertex of each corner; corners at one place have one, with the first's
/// number.
std::vector<Vertex> insertPoints(const std::vector<Vec3d>& polygon, int x, int y, Delaunay& flat)
{
    using Item = std::pair<Kernel::Point_2, std::int32_t>;
    using Order =
        CGAL::Spatial_sort_traits_adapter_2<Kernel, CGAL::First_of_pair_property_map<Item>>;
    std::vector<Item> items;
    items.reserve(polygon.size());
    for (const Vec3d& p : polygon)
        items.emplace_back(Kernel::Point_2(p[x], p[y]), static_cast<std::int32_t>(items.size()));
    CGAL::spatial_sort(items.begin(), items.end(), Order());
    std::vector<Vertex> vertices(polygon.size());
    Delaunay::Face_handle hint;
    for (const auto& [point, corner] : items) {
        const std::size_t before = flat.number_of_vertices();
        const Vertex vertex = flat.insert(point, hint);
        if (flat.number_of_vertices() > before || corner < vertex->info()) vertex->info() = corner;
        hint = vertex->face();
        vertices[corner] = vertex;
    }
    return vertices;
}

/// By a constrained Delaunay triangulation of the polygon as `x` and `y` of its points show it,
/// counter-clockwise. Returns false if it crosses itself.
bool cutConcave(const std::vector<Vec3d>& polygon, int x, int y, Triangles& triangles)
{
    Delaunay flat;
    const std::vector<Vertex> vertices = insertPoints(polygon, x, y, flat);
    if (flat.dimension() < 2) return false;
    try {
        for (std::size_t i = 0; i < vertices.size(); ++i)
            if (const Vertex to = vertices[(i + 1) % vertices.size()]; to != vertices[i])
                flat.insert_constraint(vertices[i], to);
    } catch (const Delaunay::Intersection_of_constraints_exception&) {
        return false;
    }
    for (const auto face : flat.all_face_handles()) face->info() = Side::unknown;
    markSides(flat, boundary(flat, vertices));
    const std::size_t before = triangles.size();
    for (const auto face : flat.finite_face_handles())
        if (face->info() == Side::inside)
            triangles.push_back(
                {face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info()});
    return triangles.size() > before; // none if it goes round twice
}

/// True if the polygon turns to one side everywhere, and round once.
bool isConvex(const std::vector<Vec3d>& p, const Vec3d& normal)
{
    const std::size_t n = p.size();
    double turned = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const Vec3d a = p[(i + 1) % n] - p[i], b = p[(i + 2) % n] - p[(i + 1) % n];
        const Vec3d cross = a.cross(b);
        const double up = cross.dot(normal);
        if (!(up >= 0)) return false;
        turned += std::atan2(cross.length(), a.dot(b));
    }
    return turned < 3 * kPi;
}

} // namespace

Cut triangulate(const std::vector<Vec3d>& polygon, Triangles& triangles)
{
    if (polygon.size() == 3) return fan(3, triangles), Cut::whole;
    if (polygon.size() == 4) return cutQuad(polygon, triangles), Cut::whole;
    const Vec3d normal = newellNormal(polygon);
    if (!(normal.length() > 0 && std::isfinite(normal.length())) || isConvex(polygon, normal))
        return fan(polygon.size(), triangles), Cut::whole;
    if (polygon.size() > kMostConcaveCorners) return Cut::too_many;
    const int axis = largestAxis(normal);
    int x = (axis + 1) % 3, y = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(x, y);
    if (cutConcave(polygon, x, y, triangles)) return Cut::whole;
    fan(polygon.size(), triangles);
    return Cut::crossed;
}

} // namespace volcomp
