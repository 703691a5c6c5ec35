// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/mesh.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "volcomp/surface/mesh_topology.h"

namespace volcomp {
namespace {

/// Perpendicular to the triangle, by the right hand; its length is twice the area.
Vec3d faceNormal(const Mesh& m, std::size_t t)
{
    const auto& c = m.triangles[t];
    return (m.points[c[1]] - m.points[c[0]]).cross(m.points[c[2]] - m.points[c[0]]);
}

/// Which triangles share a manifold edge.
struct Neighbours {
    struct Link {
        std::int32_t triangle;
        bool agrees; ///< both are wound the same way
    };
    std::vector<std::vector<Link>> of; ///< of each triangle
    std::vector<char> at_border; ///< 1: an edge of it belongs to one triangle or more than two
};

/// Finds the neighbours, and counts the edges that are not manifold.
Neighbours findNeighbours(Mesh& m, const std::vector<std::int32_t>& welded)
{
    Neighbours n;
    n.of.resize(m.triangles.size());
    n.at_border.assign(m.triangles.size(), 0);
    std::vector<char> bad(m.triangles.size(), 0);
    forEachEdge(edgeUses(m, welded), [&](auto first, auto last) {
        if (last - first == 2) {
            const EdgeUse &a = first[0], &b = first[1];
            const bool agrees = a.forward != b.forward;
            n.of[a.triangle].push_back({b.triangle, agrees});
            n.of[b.triangle].push_back({a.triangle, agrees});
            return;
        }
        ++(last - first == 1 ? m.report.boundary_edges : m.report.non_manifold_edges);
        for (auto use = first; use != last; ++use) {
            n.at_border[use->triangle] = 1;
            if (last - first > 2) bad[use->triangle] = 1;
        }
    });
    m.report.non_manifold_faces = static_cast<std::size_t>(std::count(bad.begin(), bad.end(), 1));
    return n;
}

/// Which triangles must be turned round. -1: not yet known.
using Turns = std::vector<signed char>;

/// The triangles connected with `seed`, each marked so that it is wound as the seed is.
std::vector<std::int32_t> collectPart(const Neighbours& neighbours, std::int32_t seed, Turns& turn)
{
    std::vector<std::int32_t> part{seed};
    turn[seed] = 0;
    for (std::size_t k = 0; k < part.size(); ++k)
        for (const Neighbours::Link& link : neighbours.of[part[k]])
            if (turn[link.triangle] < 0) {
                const signed char own = turn[part[k]];
                turn[link.triangle] = static_cast<signed char>(link.agrees ? own : 1 - own);
                part.push_back(link.triangle);
            }
    return part;
}

/// Whether a part, wound as `turn` says, has its outside within: a closed part by the sign of its
/// volume, an open one by the winding of most of its triangles in the file.
bool isInsideOut(const Mesh& m, const Neighbours& neighbours, const std::vector<std::int32_t>& part,
                 const Turns& turn)
{
    bool closed = true;
    double volume = 0, magnitude = 0; // six times
    std::size_t turned = 0;
    const Vec3d reference = m.points[m.triangles[part[0]][0]];
    for (const std::int32_t t : part) {
        closed = closed && !neighbours.at_border[t];
        turned += turn[t];
        const double v =
            faceNormal(m, t).dot(m.points[m.triangles[t][0]] - reference) * (turn[t] ? -1 : 1);
        volume += v;
        magnitude += std::abs(v);
    }
    if (closed && std::abs(volume) > 1e-9 * magnitude) return volume < 0;
    return 2 * turned > part.size();
}

/// Turns the marked triangles round, and the file's normals that then point to the wrong side.
void turnTriangles(Mesh& m, const Turns& turn)
{
    std::vector<char> touched(m.points.size(), 0);
    for (std::size_t t = 0; t < m.triangles.size(); ++t) {
        if (turn[t] != 1) continue;
        ++m.report.turned;
        for (const std::int32_t p : m.triangles[t]) touched[p] = 1;
        std::swap(m.triangles[t][1], m.triangles[t][2]);
        if (!m.uv.empty()) std::swap(m.uv[t][1], m.uv[t][2]);
    }
    std::vector<Vec3d> around(m.points.size(), Vec3d(0.0));
    for (std::size_t t = 0; t < m.triangles.size(); ++t)
        for (const std::int32_t p : m.triangles[t]) around[p] += faceNormal(m, t);
    for (std::size_t p = 0; p < m.normals.size(); ++p)
        if (touched[p] && around[p].dot(Vec3d(m.normals[p])) < 0) m.normals[p] = -m.normals[p];
}

/// Counts edges and connected parts, and turns triangles round (unless `orientation` is file).
void orient(Mesh& m, const std::vector<std::int32_t>& welded, Orientation orientation)
{
    const Neighbours neighbours = findNeighbours(m, welded);
    Turns turn(m.triangles.size(), -1);
    for (std::size_t seed = 0; seed < m.triangles.size(); ++seed) {
        if (turn[seed] >= 0) continue;
        ++m.report.parts;
        const auto part = collectPart(neighbours, static_cast<std::int32_t>(seed), turn);
        const bool inside_out = isInsideOut(m, neighbours, part, turn);
        if (inside_out != (orientation == Orientation::inward))
            for (const std::int32_t t : part) turn[t] = static_cast<signed char>(1 - turn[t]);
    }
    if (orientation != Orientation::file) turnTriangles(m, turn);
}

/// The normals of points that have none, as means over their triangles, weighted by the angle there
/// (Thuermer and Wuethrich, Computing vertex normals from polygonal facets, JGT 1998). Welded
/// points share one.
void computeNormals(Mesh& m, const std::vector<std::int32_t>& welded)
{
    std::vector<Vec3d> sum(m.points.size(), Vec3d(0.0));
    for (std::size_t t = 0; t < m.triangles.size(); ++t) {
        Vec3d n = faceNormal(m, t);
        const double length = n.length();
        if (!(length > 0)) continue;
        n /= length;
        for (int i = 0; i < 3; ++i) {
            const auto& c = m.triangles[t];
            const Vec3d a = m.points[c[(i + 1) % 3]] - m.points[c[i]],
                        b = m.points[c[(i + 2) % 3]] - m.points[c[i]];
            sum[welded[c[i]]] += n * std::atan2(a.cross(b).length(), a.dot(b));
        }
    }
    m.normals.resize(m.points.size(), Vec3f(0.0f));
    for (std::size_t p = 0; p < m.points.size(); ++p) {
        const Vec3d& n = sum[welded[p]];
        const double length = n.length();
        if (length > 1e-6 && m.normals[p] == Vec3f(0.0f)) m.normals[p] = Vec3f(n / length);
    }
}

} // namespace

std::string MeshReport::text() const
{
    std::string s = fmt::format("{} points, {} triangles in {} part{}", vertices, triangles, parts,
                                parts == 1 ? "" : "s");
    if (boundary_edges) s += fmt::format(", {} open edges", boundary_edges);
    if (non_manifold_faces)
        s += fmt::format(", {} non-manifold faces at {} edges (kept)", non_manifold_faces,
                         non_manifold_edges);
    if (zero_area) s += fmt::format(", {} triangles without area", zero_area);
    if (turned) s += fmt::format(", {} triangles turned round", turned);
    if (normals_computed) s += ", normals computed";
    s += has_uv ? ", texture coordinates" : ", no texture coordinates";
    return s;
}

void prepareMesh(Mesh& m, double scale, const Vec3d& move, Orientation orientation)
{
    for (Vec3d& p : m.points) p = p * scale + move;
    const std::vector<std::int32_t> welded = weld(m.points);
    orient(m, welded, orientation);
    for (std::size_t t = 0; t < m.triangles.size(); ++t)
        m.report.zero_area += !(faceNormal(m, t).length() > 0);
    m.report.normals_computed = m.normals.empty();
    computeNormals(m, welded);
}

} // namespace volcomp
