// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/skin/skin_tracer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <embree3/rtcore.h>
#include <openvdb/math/BBox.h>

#include "volcomp/render/skin/embree_buffer.h"
#include "volcomp/base/error.h"

namespace volcomp {
namespace {

constexpr float kOpaque = 0.5f; ///< alpha below this is no surface

/// Embree's filter of a skin that is cut out; the user's pointer is its SkinMesh.
void passCutOut(const RTCFilterFunctionNArguments* a)
{
    const auto& mesh = *static_cast<const SkinMesh*>(a->geometryUserPtr);
    for (unsigned i = 0; i < a->N; ++i) {
        if (a->valid[i] == 0) continue;
        const SurfacePoint at =
            pointOf(*mesh.mesh, mesh.projection, std::int32_t(RTCHitN_primID(a->hit, a->N, i)),
                    double(RTCHitN_u(a->hit, a->N, i)), double(RTCHitN_v(a->hit, a->N, i)));
        if (mesh.maps.alpha(at.uv) < kOpaque) a->valid[i] = 0;
    }
}

double largest(const Vec3d& v)
{
    return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
}

/// Across a triangle, twice its area long.
Vec3d normalOf(const Mesh& mesh, const std::array<std::int32_t, 3>& corners)
{
    const Vec3d a = mesh.points[corners[0]];
    return (mesh.points[corners[1]] - a).cross(mesh.points[corners[2]] - a);
}

/// The point of the round surface above a point of a triangle, on the side of `face`: between the
/// planes across the normals of its corners (after J. Hanika, Hacking the Shadow Terminator, Ray
/// Tracing Gems II, 2021). The point itself if the corners' normals do not tell of a surface that
/// is about as flat as the triangle.
Vec3d roundPoint(const Mesh& mesh, const SurfacePoint& at, const Vec3d& face)
{
    constexpr double kFlattest = 0.9; // cosine of the angle of a corner's normal and the triangle's
    const auto& corners = mesh.triangles[at.triangle];
    const double weights[3] = {1 - at.b1 - at.b2, at.b1, at.b2};
    Vec3d p = at.position;
    for (int k = 0; k < 3; ++k) {
        Vec3d n(mesh.normals[corners[k]]);
        const double cosine = n.dot(face);
        if (std::abs(cosine) < kFlattest) return at.position;
        if (cosine < 0) n = -n;
        const double below = -(at.position - mesh.points[corners[k]]).dot(n);
        p += n * (weights[k] * std::max(0.0, below));
    }
    return p;
}

} // namespace

struct SkinTracer::Impl {
    std::vector<SkinMesh> meshes;
    Vec3d centre{0.0}; ///< origin of Embree's coordinates: floats are finest around 0
    double radius = 0; ///< of a ball around it that holds all
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;

    ~Impl()
    {
        if (scene) rtcReleaseScene(scene);
        if (device) rtcReleaseDevice(device);
    }

    void check() const
    {
        if (const RTCError e = rtcGetDeviceError(device); e != RTC_ERROR_NONE)
            throw Error("Embree failed with its error " + std::to_string(int(e))
                        + (e == RTC_ERROR_OUT_OF_MEMORY ? ", out of memory" : ""));
    }

    void findBall()
    {
        openvdb::math::BBox<Vec3d> bounds;
        for (const SkinMesh& mesh : meshes)
            for (const Vec3d& p : mesh.mesh->points) bounds.expand(p);
        centre = (bounds.min() + bounds.max()) * 0.5;
        radius = (bounds.max() - centre).length() * 1.0001;
    }

    void add(SkinMesh& mesh)
    {
        std::vector<std::array<float, 3>> points;
        std::vector<std::array<unsigned, 3>> corners;
        for (const Vec3d& world : mesh.mesh->points) {
            const Vec3d p = world - centre;
            points.push_back({float(p[0]), float(p[1]), float(p[2])});
        }
        for (const auto& t : mesh.mesh->triangles) {
            corners.push_back({unsigned(t[0]), unsigned(t[1]), unsigned(t[2])});
            if (!(normalOf(*mesh.mesh, t).lengthSqr() > 0)) // one that nothing meets
                corners.back() = {unsigned(t[0]), unsigned(t[0]), unsigned(t[0])};
        }
        RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        setBuffer(g, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, points);
        setBuffer(g, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, corners);
        if (mesh.maps.hasAlpha()) {
            rtcSetGeometryUserData(g, &mesh);
            rtcSetGeometryIntersectFilterFunction(g, passCutOut);
            rtcSetGeometryOccludedFilterFunction(g, passCutOut);
        }
        rtcCommitGeometry(g);
        rtcAttachGeometry(scene, g); // its number is that of the mesh
        rtcReleaseGeometry(g);
    }

    void build()
    {
        findBall();
        device = rtcNewDevice(nullptr);
        if (!device) throw Error("Embree could not be started");
        scene = rtcNewScene(device);
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        for (SkinMesh& mesh : meshes) add(mesh);
        rtcCommitScene(scene);
        check();
    }

    /// A ray in floats, which begins where it enters the ball.
    struct Ray {
        RTCRay ray{};
        bool misses = false; ///< the ball
    };
    Ray rayOf(const Vec3d& origin, const Vec3d& direction, double from, double to) const
    {
        const Vec3d o = origin - centre;
        const double middle = -o.dot(direction), off = (o + direction * middle).length();
        Ray r;
        r.misses = !(off <= radius) || middle + radius < from || middle - radius > to;
        if (r.misses) return r;
        // Double precision takes the ray to the ball, so that floats are as fine as in it.
        const double begin = std::max(from, middle - radius);
        const Vec3d p = o + direction * begin;
        r.ray.org_x = float(p[0]), r.ray.org_y = float(p[1]), r.ray.org_z = float(p[2]);
        r.ray.dir_x = float(direction[0]), r.ray.dir_y = float(direction[1]),
        r.ray.dir_z = float(direction[2]);
        r.ray.tfar = float(std::min(to - begin, 3 * radius));
        r.ray.mask = ~0U;
        r.misses = !(r.ray.tfar > 0);
        return r;
    }

    struct Found {
        RTCHit hit;
        double distance;
        Vec3d across; ///< to the triangle: its normal times twice its area
        double b1, b2;
    };
    std::optional<Found> find(const Vec3d& origin, const Vec3d& direction, double from,
                              double to) const
    {
        const Ray r = rayOf(origin, direction, from, to);
        if (r.misses) return std::nullopt;
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        RTCRayHit found{};
        found.ray = r.ray;
        found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene, &context, &found);
        if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
        Found f{found.hit, 0, Vec3d(0.0), double(found.hit.u), double(found.hit.v)};
        refine(origin, direction, f);
        return f;
    }

    /// Finds in double precision where the ray meets the plane of the triangle that Embree found.
    void refine(const Vec3d& origin, const Vec3d& direction, Found& f) const
    {
        const Mesh& mesh = *meshes[f.hit.geomID].mesh;
        const auto& c = mesh.triangles[f.hit.primID];
        const Vec3d a = mesh.points[c[0]], e1 = mesh.points[c[1]] - a, e2 = mesh.points[c[2]] - a;
        f.across = e1.cross(e2);
        const double area = f.across.lengthSqr(), slant = f.across.dot(direction);
        if (std::abs(slant) > 1e-4 * std::sqrt(area)) {
            const Vec3d p = origin - a + direction * ((a - origin).dot(f.across) / slant);
            f.b1 = p.cross(e2).dot(f.across) / area, f.b2 = e1.cross(p).dot(f.across) / area;
        }
        f.b1 = std::max(0.0, f.b1), f.b2 = std::max(0.0, f.b2);
        if (const double over = f.b1 + f.b2; over > 1) f.b1 /= over, f.b2 /= over;
        f.distance = (a + e1 * f.b1 + e2 * f.b2 - origin).dot(direction);
    }

    /// How far above a triangle a ray has to start not to meet it by rounding: some of the last
    /// digits of floats at its corners.
    double lift(const Mesh& mesh, std::uint32_t triangle) const
    {
        double far = 0;
        for (const std::int32_t c : mesh.triangles[triangle])
            far = std::max(far, largest(mesh.points[c] - centre));
        return 1e-6 * far;
    }
};

SkinTracer::SkinTracer(std::vector<SkinMesh> meshes) : m(std::make_unique<Impl>())
{
    m->meshes = std::move(meshes);
    if (m->meshes.empty()) return;
    m->build();
}
SkinTracer::~SkinTracer() = default;

const std::vector<SkinMesh>& SkinTracer::meshes() const { return m->meshes; }

std::size_t SkinTracer::triangles() const
{
    std::size_t count = 0;
    for (const SkinMesh& mesh : m->meshes) count += mesh.mesh->triangles.size();
    return count;
}

std::optional<SkinHit> SkinTracer::hit(const Vec3d& origin, const Vec3d& direction, double from,
                                       double to) const
{
    if (empty()) return std::nullopt;
    const auto found = m->find(origin, direction, from, to);
    if (!found) return std::nullopt;
    const SkinMesh& mesh = m->meshes[found->hit.geomID];
    const SurfacePoint at =
        pointOf(*mesh.mesh, mesh.projection, std::int32_t(found->hit.primID), found->b1, found->b2);
    SkinHit hit;
    hit.skin = found->hit.geomID;
    hit.distance = found->distance;
    hit.position = at.position;
    const double side = found->across.dot(direction) > 0 ? -1 : 1;
    hit.face = found->across.unit() * side;
    hit.normal = at.normal * (at.normal.dot(hit.face) < 0 ? -1.0 : 1.0);
    // Near an outline an interpolated normal may turn away from the eye; it is bent until it is
    // seen from the edge, so that the far side's light does not come through.
    if (const double facing = -hit.normal.dot(direction); facing < 1e-3)
        hit.normal = (hit.normal - direction * (1e-3 - facing)).unit();
    const double lift = m->lift(*mesh.mesh, found->hit.primID);
    hit.start = roundPoint(*mesh.mesh, at, hit.face) + hit.face * lift;
    hit.back_start = roundPoint(*mesh.mesh, at, -hit.face) - hit.face * lift;
    hit.colour = Vec3d(skinColour(mesh.skin, mesh.maps, at));
    return hit;
}

std::optional<SkinTracer::Meeting> SkinTracer::meeting(const Vec3d& origin, const Vec3d& direction,
                                                       double from, double to) const
{
    if (empty()) return std::nullopt;
    const auto found = m->find(origin, direction, from, to);
    if (!found) return std::nullopt;
    return Meeting{found->distance,
                   found->across.unit() * (found->across.dot(direction) > 0 ? -1.0 : 1.0)};
}

bool SkinTracer::isOccluded(const Vec3d& p, const Vec3d& L, double distance) const
{
    if (empty()) return false;
    Impl::Ray r = m->rayOf(p, L, 0, distance);
    if (r.misses) return false;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(m->scene, &context, &r.ray);
    return r.ray.tfar < 0;
}

} // namespace volcomp
