// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/surface_tree.h"

#include <algorithm>
#include <iterator>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

namespace volcomp {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangle = Kernel::Triangle_3;
using Iterator = std::vector<Triangle>::const_iterator;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

} // namespace

struct SurfaceTree::Impl {
    std::vector<Triangle> triangles;
    std::vector<std::int32_t> original;
    Tree tree;
    double size = 0;
};

SurfaceTree::SurfaceTree(const std::vector<Vec3d>& points,
                         const std::vector<std::array<std::int32_t, 3>>& triangles)
    : m_impl(std::make_unique<Impl>())
{
    const auto point = [&](std::int32_t i) {
        return Kernel::Point_3(points[i][0], points[i][1], points[i][2]);
    };
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const Triangle triangle(point(triangles[t][0]), point(triangles[t][1]),
                                point(triangles[t][2]));
        if (triangle.is_degenerate()) continue;
        m_impl->triangles.push_back(triangle);
        m_impl->original.push_back(static_cast<std::int32_t>(t));
    }
    m_impl->tree.insert(m_impl->triangles.begin(), m_impl->triangles.end());
    if (m_impl->triangles.empty()) return;
    m_impl->tree.build();
    m_impl->tree.accelerate_distance_queries(); // here, so that later calls change nothing
    const auto box = m_impl->tree.bbox();
    m_impl->size =
        std::max({box.xmax() - box.xmin(), box.ymax() - box.ymin(), box.zmax() - box.zmin()});
}

SurfaceTree::~SurfaceTree() = default;
SurfaceTree::SurfaceTree(SurfaceTree&&) noexcept = default;

SurfaceTree::Nearest SurfaceTree::nearest(const Vec3d& p) const
{
    if (m_impl->triangles.empty()) return {p, -1};
    const auto found = m_impl->tree.closest_point_and_primitive(Kernel::Point_3(p[0], p[1], p[2]));
    return {Vec3d(found.first.x(), found.first.y(), found.first.z()),
            m_impl->original[found.second - m_impl->triangles.cbegin()]};
}

std::vector<SurfaceTree::Hit> SurfaceTree::crossings(const Vec3d& origin, const Vec3d& direction,
                                                     bool ray) const
{
    std::vector<Hit> hits;
    if (m_impl->triangles.empty()) return hits;
    const Kernel::Point_3 o(origin[0], origin[1], origin[2]);
    const Kernel::Vector_3 d(direction[0], direction[1], direction[2]);
    std::vector<Iterator> ids;
    if (ray) m_impl->tree.all_intersected_primitives(Kernel::Ray_3(o, d), std::back_inserter(ids));
    else m_impl->tree.all_intersected_primitives(Kernel::Line_3(o, d), std::back_inserter(ids));
    for (const Iterator id : ids) {
        const Kernel::Vector_3 ab = id->vertex(1) - id->vertex(0),
                               ac = id->vertex(2) - id->vertex(0), n = CGAL::cross_product(ab, ac);
        if (n.squared_length() < 1e-24 * ab.squared_length() * ac.squared_length())
            continue; // its area is rounding
        const double across = n * d;
        if (across * across < 1e-24 * n.squared_length() * d.squared_length()) continue;
        hits.push_back(
            {(n * (id->vertex(0) - o)) / across, m_impl->original[id - m_impl->triangles.begin()]});
    }
    std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
        return a.t != b.t ? a.t > b.t : a.triangle < b.triangle;
    });
    const double same = 1e-9 * m_impl->size / direction.length();
    hits.erase(std::unique(hits.begin(), hits.end(),
                           [&](const Hit& a, const Hit& b) { return a.t - b.t < same; }),
               hits.end());
    return hits;
}

std::vector<std::int32_t> SurfaceTree::covering(double x, double y) const
{
    std::vector<std::int32_t> result;
    if (m_impl->triangles.empty()) return result;
    std::vector<Iterator> ids;
    m_impl->tree.all_intersected_primitives(
        Kernel::Line_3(Kernel::Point_3(x, y, 0), Kernel::Vector_3(0, 0, 1)),
        std::back_inserter(ids));
    for (const Iterator id : ids)
        result.push_back(m_impl->original[id - m_impl->triangles.begin()]);
    std::sort(result.begin(), result.end());
    return result;
}

} // namespace volcomp
