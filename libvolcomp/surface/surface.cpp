// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/surface.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/surface/surface_tree.h"

namespace volcomp {
namespace {

/// Sorts triangles so that neighbours in the list are neighbours on the surface: halves the list
/// across its longest extent, and each half again. Every second half is sorted backwards, so that
/// the list goes on where the first half ends.
void kdOrder(std::vector<std::int32_t>::iterator first, std::vector<std::int32_t>::iterator last,
             const std::vector<Vec3d>& centres, bool backward)
{
    if (last - first <= 2) return;
    Vec3d low = centres[*first], high = low;
    for (auto it = first; it != last; ++it) {
        low = openvdb::math::minComponent(low, centres[*it]);
        high = openvdb::math::maxComponent(high, centres[*it]);
    }
    const Vec3d extent = high - low;
    const int axis = largestAxis(extent);
    const auto middle = first + (last - first) / 2;
    std::nth_element(first, middle, last, [&](std::int32_t a, std::int32_t b) {
        if (centres[a][axis] != centres[b][axis])
            return (centres[a][axis] < centres[b][axis]) != backward;
        return a < b;
    });
    kdOrder(first, middle, centres, false);
    kdOrder(middle, last, centres, true);
}

/// Shrinks the triangle `b` (entry, apex, exit) to the piece of Sierpinski's curve that has the
/// fraction `f` of the area before it. Each level halves the triangle at the middle of the side
/// from entry to exit, so equal intervals of f are equal areas, and the curve is continuous.
void sierpinski(double f, double b[3][2])
{
    for (int level = 0; level < 44; ++level) {
        const double middle[2] = {(b[0][0] + b[2][0]) / 2, (b[0][1] + b[2][1]) / 2};
        f *= 2;
        if (f < 1) { // entry, middle, apex
            b[2][0] = b[1][0], b[2][1] = b[1][1];
            b[1][0] = middle[0], b[1][1] = middle[1];
        } else { // apex, middle, exit
            f -= 1;
            b[0][0] = b[1][0], b[0][1] = b[1][1];
            b[1][0] = middle[0], b[1][1] = middle[1];
        }
    }
}

double perpendicular(const Vec2d& a, const Vec2d& b) { return a[0] * b[1] - a[1] * b[0]; }

} // namespace

void SurfaceSpec::validate() const
{
    const std::string place = "surface '" + name + "': ";
    if (!(scale > 0 && std::isfinite(scale))) throw Error(place + "expected a scale > 0");
    if (!std::isfinite(move.lengthSqr())) throw Error(place + "expected a finite 'translate'");
    if (!(skin.transmittance > 0 && skin.transmittance < 1))
        throw Error(place + "expected a skin transmittance between 0 and 1");
    projection.validate();
}

Surface::Surface(Mesh mesh, const MapProjection& projection, const std::string& place)
    : m_mesh(std::move(mesh)), m_projection(projection)
{
    const std::size_t count = m_mesh.triangles.size();
    std::vector<Vec3d> centres(count);
    std::vector<double> areas(count);
    for (std::size_t t = 0; t < count; ++t) {
        const auto& c = m_mesh.triangles[t];
        const Vec3d &a = m_mesh.points[c[0]], &b = m_mesh.points[c[1]], &d = m_mesh.points[c[2]];
        centres[t] = (a + b + d) / 3;
        areas[t] = (b - a).cross(d - a).length() / 2;
        if (areas[t] > 0 && std::isfinite(areas[t]))
            m_order.push_back(static_cast<std::int32_t>(t));
    }
    if (m_order.empty()) throw Error(place + ": expected triangles with an area, found none");
    kdOrder(m_order.begin(), m_order.end(), centres, false);
    double sum = 0;
    for (const std::int32_t t : m_order) m_area.push_back(sum += areas[t]);
    m_tree = std::make_unique<SurfaceTree>(m_mesh.points, m_mesh.triangles);
    if (projection.kind == ProjectionKind::uv && !m_mesh.uv.empty()) {
        std::vector<Vec3d> flat;
        std::vector<std::array<std::int32_t, 3>> corners;
        for (const auto& uv : m_mesh.uv) {
            const auto first = static_cast<std::int32_t>(flat.size());
            for (const Vec2f& x : uv) flat.emplace_back(x[0], x[1], 0);
            corners.push_back({first, first + 1, first + 2});
        }
        m_uv_tree = std::make_unique<SurfaceTree>(flat, corners);
        m_walk = SurfaceWalk(m_mesh);
    }
}

Surface::~Surface() = default;
Surface::Surface(Surface&&) noexcept = default;
Surface& Surface::operator=(Surface&&) noexcept = default;

SurfacePoint pointOf(const Mesh& mesh, const MapProjection& projection, std::int32_t triangle,
                     double b1, double b2)
{
    SurfacePoint s;
    s.triangle = triangle;
    s.b1 = b1;
    s.b2 = b2;
    const auto& c = mesh.triangles[triangle];
    const double b0 = 1 - b1 - b2;
    const Vec3d &p0 = mesh.points[c[0]], &p1 = mesh.points[c[1]], &p2 = mesh.points[c[2]];
    s.position = p0 * b0 + p1 * b1 + p2 * b2;
    s.normal = Vec3d(mesh.normals[c[0]]) * b0 + Vec3d(mesh.normals[c[1]]) * b1
        + Vec3d(mesh.normals[c[2]]) * b2;
    double length = s.normal.length();
    if (!(length > 1e-3)) {
        s.normal = (p1 - p0).cross(p2 - p0);
        length = s.normal.length();
    }
    s.normal /= length;
    if (projection.kind != ProjectionKind::uv) s.uv = projection.project(s.position);
    else if (!mesh.uv.empty()) {
        const auto& uv = mesh.uv[triangle];
        s.uv = Vec2d(uv[0]) * b0 + Vec2d(uv[1]) * b1 + Vec2d(uv[2]) * b2;
    } else s.uv = Vec2d(0.0);
    return s;
}

SurfacePoint Surface::at(std::int32_t triangle, double b1, double b2) const
{
    return pointOf(m_mesh, m_projection, triangle, b1, b2);
}

SurfacePoint Surface::atFraction(double f) const
{
    const double wanted = std::clamp(f, 0.0, 1.0) * m_area.back();
    const std::size_t k = std::min<std::size_t>(
        std::upper_bound(m_area.begin(), m_area.end(), wanted) - m_area.begin(), m_area.size() - 1);
    const double before = k ? m_area[k - 1] : 0;
    const double inside = std::clamp((wanted - before) / (m_area[k] - before), 0.0, 1.0);
    double b[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    // The longest side goes from entry to exit, so that the halves do not grow thin.
    const auto& c = m_mesh.triangles[m_order[k]];
    double longest = 0;
    int apex = 1;
    for (int i = 0; i < 3; ++i)
        if (const double side =
                (m_mesh.points[c[(i + 1) % 3]] - m_mesh.points[c[(i + 2) % 3]]).lengthSqr();
            side > longest)
            longest = side, apex = i;
    const double corner[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 2; ++j) b[i][j] = corner[(apex + 2 + i) % 3][j];
    sierpinski(inside, b);
    return at(m_order[k], (b[0][0] + b[1][0] + b[2][0]) / 3, (b[0][1] + b[1][1] + b[2][1]) / 3);
}

SurfacePoint Surface::inTriangle(std::int32_t triangle, const Vec3d& position) const
{
    const auto& c = m_mesh.triangles[triangle];
    const Vec3d e1 = m_mesh.points[c[1]] - m_mesh.points[c[0]],
                e2 = m_mesh.points[c[2]] - m_mesh.points[c[0]], d = position - m_mesh.points[c[0]];
    const Vec3d n = e1.cross(e2);
    const double area = n.lengthSqr();
    double b1 = std::max(0.0, d.cross(e2).dot(n) / area),
           b2 = std::max(0.0, e1.cross(d).dot(n) / area);
    if (const double over = b1 + b2; over > 1) b1 /= over, b2 /= over;
    return at(triangle, b1, b2);
}

std::vector<SurfacePoint> Surface::sheets(const Vec2d& uv) const
{
    if (m_projection.kind == ProjectionKind::uv) return sheetsByMesh(uv);
    std::vector<SurfacePoint> result;
    const MapProjection::Line line = m_projection.line(uv);
    for (const SurfaceTree::Hit& hit : m_tree->crossings(line.origin, line.direction, line.ray)) {
        result.push_back(inTriangle(hit.triangle, line.origin + line.direction * hit.t));
        result.back().uv = uv;
    }
    return result;
}

std::vector<SurfacePoint> Surface::sheetsByMesh(const Vec2d& uv) const
{
    std::vector<SurfacePoint> result;
    if (!m_uv_tree) return result;
    for (const std::int32_t t : m_uv_tree->covering(uv[0], uv[1])) {
        const auto& corners = m_mesh.uv[t];
        const Vec2d a(corners[0]), e1 = Vec2d(corners[1]) - a, e2 = Vec2d(corners[2]) - a,
                                   d = uv - a;
        const double twice = perpendicular(e1, e2);
        const auto& c = m_mesh.triangles[t];
        const bool has_area = (m_mesh.points[c[1]] - m_mesh.points[c[0]])
                                  .cross(m_mesh.points[c[2]] - m_mesh.points[c[0]])
                                  .lengthSqr()
            > 0;
        if (twice == 0 || !has_area) continue;
        double b1 = std::max(0.0, perpendicular(d, e2) / twice),
               b2 = std::max(0.0, perpendicular(e1, d) / twice);
        if (const double over = b1 + b2; over > 1) b1 /= over, b2 /= over;
        SurfacePoint s = at(t, b1, b2);
        const bool known =
            std::any_of(result.begin(), result.end(), [&](const SurfacePoint& other) {
                return (other.position - s.position).lengthSqr() < 1e-18 * area();
            });
        if (!known) result.push_back(s);
    }
    return result;
}

Vec2d Surface::uvNear(const Vec3d& p, std::int32_t& triangle) const
{
    if (triangle < 0) triangle = m_tree->nearest(p).triangle;
    const SurfaceWalk::Foot foot = m_walk.nearest(m_mesh, p, triangle);
    triangle = foot.triangle;
    const auto& corners = m_mesh.uv[triangle];
    return Vec2d(corners[0]) * (1 - foot.b1 - foot.b2) + Vec2d(corners[1]) * foot.b1
        + Vec2d(corners[2]) * foot.b2;
}

bool Surface::hides(const Vec3d& eye, const Vec3d& p) const
{
    for (const SurfaceTree::Hit& hit : m_tree->crossings(eye, p - eye, true))
        if (hit.t > 0 && hit.t < 0.999) return true;
    return false;
}

SurfacePoint Surface::nearest(const Vec3d& p) const
{
    const SurfaceTree::Nearest found = m_tree->nearest(p);
    return inTriangle(found.triangle, found.position);
}

Surface::UvGradient Surface::uvGradient(std::int32_t triangle) const
{
    const auto& c = m_mesh.triangles[triangle];
    const Vec3d e1 = m_mesh.points[c[1]] - m_mesh.points[c[0]],
                e2 = m_mesh.points[c[2]] - m_mesh.points[c[0]];
    const Vec3d n = e1.cross(e2);
    const double area = n.lengthSqr();
    if (!(area > 0) || m_mesh.uv.empty()) return {Vec3d(0.0), Vec3d(0.0)};
    const Vec3d g1 = e2.cross(n) / area,
                g2 = n.cross(e1) / area; // gradients of the weights b1 and b2
    const auto& uv = m_mesh.uv[triangle];
    return {g1 * double(uv[1][0] - uv[0][0]) + g2 * double(uv[2][0] - uv[0][0]),
            g1 * double(uv[1][1] - uv[0][1]) + g2 * double(uv[2][1] - uv[0][1])};
}

Surface::UvGradient Surface::uvGradientAt(const SurfacePoint& s) const
{
    if (m_projection.kind == ProjectionKind::uv) return uvGradient(s.triangle);
    UvGradient g{Vec3d(0.0), Vec3d(0.0)};
    const double h = 1e-5 * std::sqrt(area());
    for (int i = 0; i < 3; ++i) {
        Vec3d e(0.0);
        e[i] = h;
        const Vec2d a = m_projection.project(s.position - e),
                    b = m_projection.project(s.position + e);
        double du = b[0] - a[0];
        if (m_projection.kind != ProjectionKind::plane) du -= std::round(du); // at the seam
        g.du[i] = du / (2 * h);
        g.dv[i] = (b[1] - a[1]) / (2 * h);
    }
    g.du -= s.normal * s.normal.dot(g.du);
    g.dv -= s.normal * s.normal.dot(g.dv);
    return g;
}

Mesh loadMesh(const SurfaceSpec& spec)
{
    spec.validate();
    Mesh mesh = spec.mesh.empty() ? makeTerrain(spec.terrain) : readMesh(spec.mesh);
    prepareMesh(mesh, spec.scale, spec.move, spec.orientation);
    return mesh;
}

Surface loadSurface(const SurfaceSpec& spec)
{
    return Surface(loadMesh(spec), spec.projection,
                   spec.mesh.empty() ? "surface '" + spec.name + "'" : spec.mesh.string());
}

SecondDensity loadSkinMaps(const SurfaceSpec& spec, const Mesh& mesh)
{
    if (spec.skin.material.empty()) return {};
    SecondDensity maps(spec.skin.maps, true);
    if (maps.usesUv() && spec.projection.kind == ProjectionKind::uv && mesh.uv.empty())
        throw Error(
            "surface '" + spec.name
            + "': its skin_map is looked up by texture coordinates, but the mesh has none; set the surface's 'projection' to sphere, cylinder or plane");
    return maps;
}

Vec3f skinColour(const SkinSpec& skin, const SecondDensity& maps, const SurfacePoint& at)
{
    const Vec3f c(skin.colour), map = maps.colour(at.uv, at.position);
    return {c[0] * map[0], c[1] * map[1], c[2] * map[2]};
}

} // namespace volcomp
