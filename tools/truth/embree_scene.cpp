// SPDX-License-Identifier: Apache-2.0
#include "tools/truth/embree_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <string>
#include <vector>

#include <embree3/rtcore.h>

#include "volcomp/render/skin/embree_buffer.h"
#include "volcomp/base/error.h"
#include "volcomp/base/interval.h"
#include "volcomp/render/skin/skin_tracer.h"

namespace volcomp {
namespace {

constexpr std::uint32_t kNone = RTC_INVALID_GEOMETRY_ID;

/// What the primitives of one Embree geometry are: the round or the flat segments of one part of a
/// box, or the triangles of one of a mesh.
struct Source {
    const std::vector<Segment>* segments = nullptr;        ///< null for triangles
    const std::vector<ModelTriangle>* triangles = nullptr; ///< by primitive
    const std::vector<MeshLook>* looks = nullptr;
    std::vector<std::uint32_t> index; ///< of the segment, by primitive
    const Material* material = nullptr;
    Lobe lobe{};
};

/// Embree's context of a ray that passes the primitives it starts on.
struct Context {
    RTCIntersectContext base; // first, so that Embree's pointer to it is one to all
    std::uint32_t instance = kNone, geometry = kNone, first = 1, last = 0;

    Context()
    {
        rtcInitIntersectContext(&base);
        base.filter = [](const RTCFilterFunctionNArguments* a) {
            const auto& own = *reinterpret_cast<const Context*>(a->context);
            const auto& hit = *reinterpret_cast<const RTCHit*>(a->hit); // single rays alone
            if (hit.geomID == own.geometry && hit.instID[0] == own.instance
                && hit.primID >= own.first && hit.primID <= own.last)
                a->valid[0] = 0;
        };
    }
    explicit Context(const ExactHit& from) : Context()
    {
        instance = from.instance;
        geometry = from.geometry;
        first = from.first_own;
        last = from.last_own;
    }
};

const Vec3d& startOf(const ExactHit& from, const Vec3d& d)
{
    return from.direction.dot(d) < 0 ? from.start_behind : from.start;
}

RTCRay rayOf(const Vec3d& origin, const Vec3d& direction, double far)
{
    RTCRay ray{};
    ray.org_x = float(origin[0]), ray.org_y = float(origin[1]), ray.org_z = float(origin[2]);
    ray.dir_x = float(direction[0]), ray.dir_y = float(direction[1]),
    ray.dir_z = float(direction[2]);
    ray.tfar = float(far);
    ray.mask = ~0U;
    return ray;
}

std::array<float, 3> asFloats(const Vec3d& v) { return {float(v[0]), float(v[1]), float(v[2])}; }

/// Flat pieces as quadrilaterals.
RTCGeometry flatPieces(RTCDevice device, const Source& source)
{
    std::vector<std::array<float, 3>> points;
    std::vector<std::array<unsigned, 4>> quads;
    for (const std::uint32_t i : source.index) {
        const Segment& s = (*source.segments)[i];
        const auto first = static_cast<unsigned>(points.size());
        for (const Vec3f& corner : {s.a - s.side * s.size_a, s.b - s.side * s.size_b,
                                    s.b + s.side * s.size_b, s.a + s.side * s.size_a})
            points.push_back(asFloats(Vec3d(corner)));
        quads.push_back({first, first + 1, first + 2, first + 3});
    }
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD);
    setBuffer(g, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, points);
    setBuffer(g, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT4, quads);
    return g;
}

/// Round pieces as Embree's linear curves: cones with balls at their ends, joined where one piece
/// of a strand ends as the next begins.
RTCGeometry roundPieces(RTCDevice device, const Source& source)
{
    std::vector<std::array<float, 4>> points;
    std::vector<std::array<unsigned, 1>> first;
    std::vector<std::array<unsigned char, 1>> flags;
    const Segment* before = nullptr;
    for (const std::uint32_t i : source.index) {
        const Segment& s = (*source.segments)[i];
        const bool joined =
            before && before->strand == s.strand && before->b == s.a && before->size_b == s.size_a;
        if (joined) flags.back()[0] |= RTC_CURVE_FLAG_NEIGHBOR_RIGHT;
        else points.push_back({s.a[0], s.a[1], s.a[2], s.size_a});
        flags.push_back({static_cast<unsigned char>(joined ? RTC_CURVE_FLAG_NEIGHBOR_LEFT : 0)});
        first.push_back({static_cast<unsigned>(points.size() - 1)});
        points.push_back({s.b[0], s.b[1], s.b[2], s.size_b});
        before = &s;
    }
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE);
    setBuffer(g, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, points);
    setBuffer(g, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT, first);
    setBuffer(g, RTC_BUFFER_TYPE_FLAGS, RTC_FORMAT_UCHAR, flags);
    return g;
}

/// The texture coordinates of a point of a triangle.
Vec2d uvAt(const ModelTriangle& t, float u, float v)
{
    const Vec2f at = t.uv[0] * (1 - u - v) + t.uv[1] * u + t.uv[2] * v;
    return {double(at[0]), double(at[1])};
}

/// Lets rays through where a picture cuts a triangle out.
void passWhereCut(const RTCFilterFunctionNArguments* a)
{
    const auto& source = *static_cast<const Source*>(a->geometryUserPtr);
    const auto& hit = *reinterpret_cast<const RTCHit*>(a->hit); // single rays alone
    const ModelTriangle& t = (*source.triangles)[hit.primID];
    if (!(*source.looks)[std::size_t(t.look)].isThere(uvAt(t, hit.u, hit.v))) a->valid[0] = 0;
}

/// The triangles of a mesh; `source` must stay where it is.
RTCGeometry meshTriangles(RTCDevice device, const Source& source)
{
    std::vector<std::array<float, 3>> points;
    std::vector<std::array<unsigned, 3>> corners;
    points.reserve(3 * source.triangles->size());
    corners.reserve(source.triangles->size());
    for (const ModelTriangle& t : *source.triangles) {
        const auto first = static_cast<unsigned>(points.size());
        for (const Vec3d& p : t.corners) points.push_back(asFloats(p));
        corners.push_back({first, first + 1, first + 2});
    }
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    setBuffer(g, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, points);
    setBuffer(g, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, corners);
    rtcSetGeometryUserData(g, const_cast<Source*>(&source)); // Embree's type; it is only read
    rtcSetGeometryIntersectFilterFunction(g, passWhereCut);
    rtcSetGeometryOccludedFilterFunction(g, passWhereCut);
    return g;
}

/// A piece of a strand at a point of it, in the world.
struct PieceAt {
    Vec3d axis; ///< unit
    double f;   ///< from its first end to its second, 0 to 1
};

PieceAt pieceAt(const Segment& s, const Placement& placement, const Vec3d& p)
{
    const Vec3d way = turnedBy(placement, s.b - s.a) * double(placement.scale),
                a = placement.position + turnedBy(placement, s.a) * double(placement.scale);
    const double length = way.length();
    return {way / length, std::clamp((p - a).dot(way) / (length * length), 0.0, 1.0)};
}

} // namespace

struct EmbreeScene::Impl {
    const ExactScene& exact;
    const double solid_radius;
    Vec3d origin{0.0}; ///< of Embree's coordinates: floats are finest around 0
    std::unique_ptr<const SkinTracer> skins; ///< of meshes and of voxels alike
    std::vector<Lobe> skin_lobes;
    RTCDevice device = nullptr;
    RTCScene top = nullptr;
    std::vector<RTCScene> boxes;
    std::vector<std::deque<Source>> box_sources; ///< by box, then by geometry

    Impl(const ExactScene& scene, double solid) : exact(scene), solid_radius(solid) { }
    ~Impl()
    {
        if (top) rtcReleaseScene(top);
        for (RTCScene s : boxes) rtcReleaseScene(s);
        if (device) rtcReleaseDevice(device);
    }

    void check() const
    {
        if (const RTCError e = rtcGetDeviceError(device); e != RTC_ERROR_NONE)
            throw Error("Embree failed with its error " + std::to_string(int(e))
                        + (e == RTC_ERROR_OUT_OF_MEMORY ? ", out of memory" : ""));
    }

    bool normalised() const { return exact.scene.render.scattering == Scattering::multiple; }

    RTCScene newScene() const
    {
        RTCScene scene = rtcNewScene(device);
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION);
        return scene;
    }

    static void attach(RTCScene to, RTCGeometry g)
    {
        rtcCommitGeometry(g);
        rtcAttachGeometry(to, g);
        rtcReleaseGeometry(g);
    }

    void build()
    {
        device = rtcNewDevice(nullptr);
        if (!device) throw Error("Embree could not be started");
        top = newScene();
        if (!exact.placed.boxes.empty()) origin = exact.placed.boxes.placements[0].position;
        for (std::size_t b = 0; b < exact.boxes.size(); ++b)
            addBox(exact.boxes[b], exact.meshes.empty() ? nullptr : exact.meshes[b].get());
        for (const Placement& p : exact.placed.boxes.placements) addInstance(p);
        rtcCommitScene(top);
        check();
        addSkins();
    }

    void addSkins()
    {
        std::vector<SkinMesh> meshes;
        for (const PlacedSurface& s : exact.placed.surfaces)
            if (!s.skin.material.empty())
                meshes.push_back(
                    {s.name,
                     std::shared_ptr<const Mesh>(std::shared_ptr<void>(), &s.surface.mesh()),
                     s.surface.projection(), s.skin, s.skin_colour,
                     exact.material(s.skin.material)});
        for (const SkinMesh& mesh : meshes) skin_lobes.push_back(makeLobe(mesh.material));
        skins = std::make_unique<const SkinTracer>(std::move(meshes));
    }

    void addBox(const Skeleton& box, const MeshModel* mesh)
    {
        boxes.push_back(newScene());
        std::deque<Source>& sources = box_sources.emplace_back(); // each stays at its address
        if (mesh)
            for (const MeshModelPart& part : mesh->parts) {
                Source& s = sources.emplace_back();
                s.triangles = &part.triangles;
                s.looks = &mesh->looks;
                s.material = &exact.material(part.material);
                s.lobe = makeLobe(*s.material, 0, normalised());
                attach(boxes.back(), meshTriangles(device, s));
            }
        for (const SkeletonPart& part : box)
            for (const bool flat : {false, true}) {
                Source s;
                s.segments = &part.segments;
                s.material = &exact.material(part.material);
                s.lobe = makeLobe(*s.material, 0, normalised());
                for (std::uint32_t i = 0; i < part.segments.size(); ++i)
                    if (part.segments[i].flat() == flat) s.index.push_back(i);
                if (s.index.empty()) continue;
                attach(boxes.back(), flat ? flatPieces(device, s) : roundPieces(device, s));
                sources.push_back(std::move(s));
            }
        rtcCommitScene(boxes.back());
    }

    void addInstance(const Placement& p)
    {
        const Vec3d at = p.position - origin;
        float columns[12];
        const Vec3f axes[3] = {p.x_axis, p.y_axis, p.z_axis};
        for (int k = 0; k < 3; ++k) {
            for (int a = 0; a < 3; ++a) columns[3 * a + k] = axes[a][k] * p.scale;
            columns[9 + k] = float(at[k]);
        }
        RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(g, boxes[p.box]);
        rtcSetGeometryTransform(g, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
        attach(top, g);
    }

    std::optional<ExactHit> hit(const Vec3d& from, const Vec3d& direction, Context& context) const;
    std::optional<ExactHit> hitPiece(const Vec3d& from, const Vec3d& direction, double distance,
                                     Context& context) const;

    void describePiece(const Source& source, const RTCHit& found, ExactHit& hit) const
    {
        const std::size_t placement_index = found.instID[0];
        const Placement& placement = exact.placed.boxes.placements[placement_index];
        const Vec3d outward = turnedBy(placement, Vec3f(found.Ng_x, found.Ng_y, found.Ng_z)).unit();
        Vec3d tint(placement.tint);
        if (const VoxelTint own = exact.tintOf(placement_index); own.colour)
            tint = Vec3d(TintWalk(own).at(hit.position));
        if (source.triangles) {
            const ModelTriangle& t = (*source.triangles)[found.primID];
            const MeshLook& look = (*source.looks)[std::size_t(t.look)];
            hit.colour = Vec3d(look.colourAt(uvAt(t, found.u, found.v))) * tint;
            hit.direction = outward;
            return;
        }
        const Segment& s = (*source.segments)[source.index[found.primID]];
        const PieceAt at = pieceAt(s, placement, hit.position);
        hit.colour = (Vec3d(s.colour_a) * (1 - at.f) + Vec3d(s.colour_b) * at.f) * tint;
        hit.fibre = source.material->kind == MaterialKind::fibre;
        if (!hit.fibre) {
            hit.direction = s.flat() ? at.axis.cross(turnedBy(placement, s.side)).unit() : outward;
            return;
        }
        hit.direction = at.axis;
        const double radius =
            (double(s.size_a) * (1 - at.f) + double(s.size_b) * at.f) * double(placement.scale);
        if (!s.flat() && radius >= solid_radius) {
            hit.start = hit.start_behind = hit.position + outward * (1e-4 * radius);
            hit.first_own = 1, hit.last_own = 0;
            return;
        }
        const auto sameStrand = [&](std::uint32_t primitive) {
            return primitive < source.index.size()
                && (*source.segments)[source.index[primitive]].strand == s.strand;
        };
        if (found.primID > 0 && sameStrand(found.primID - 1)) --hit.first_own;
        if (sameStrand(found.primID + 1)) ++hit.last_own;
    }
};

EmbreeScene::EmbreeScene(const ExactScene& scene, double solid_radius)
    : m(std::make_unique<Impl>(scene, solid_radius))
{
    m->build();
}
EmbreeScene::~EmbreeScene() = default;

std::optional<ExactHit> EmbreeScene::hit(const Vec3d& origin, const Vec3d& direction) const
{
    Context context;
    return m->hit(origin, direction, context);
}

std::optional<ExactHit> EmbreeScene::hitFrom(const ExactHit& from, const Vec3d& d) const
{
    Context context(from);
    return m->hit(startOf(from, d), d, context);
}

std::optional<ExactHit> EmbreeScene::Impl::hit(const Vec3d& from, const Vec3d& direction,
                                               Context& context) const
{
    const std::optional<SkinHit> skin = skins->hit(from, direction);
    std::optional<ExactHit> piece =
        hitPiece(from, direction, skin ? skin->distance : kInfinity, context);
    if (piece || !skin) return piece;
    ExactHit hit;
    hit.position = skin->position;
    hit.start = skin->start;
    hit.start_behind = skin->back_start;
    hit.direction = skin->normal;
    hit.colour = skin->colour;
    hit.material = &skins->meshes()[skin->skin].material;
    hit.lobe = &skin_lobes[skin->skin];
    hit.instance = hit.geometry = kNone;
    hit.first_own = 1, hit.last_own = 0;
    return hit;
}

std::optional<ExactHit> EmbreeScene::Impl::hitPiece(const Vec3d& from, const Vec3d& direction,
                                                    double distance, Context& context) const
{
    RTCRayHit found{};
    found.ray = rayOf(from - origin, direction, distance);
    found.hit.geomID = found.hit.instID[0] = kNone;
    rtcIntersect1(top, &context.base, &found);
    if (found.hit.geomID == kNone) return std::nullopt;
    ExactHit hit;
    hit.position = hit.start = hit.start_behind = from + direction * double(found.ray.tfar);
    hit.instance = found.hit.instID[0];
    hit.geometry = found.hit.geomID;
    hit.first_own = hit.last_own = found.hit.primID;
    const Source& source =
        box_sources[exact.placed.boxes.placements[hit.instance].box][hit.geometry];
    hit.material = source.material;
    hit.lobe = &source.lobe;
    describePiece(source, found.hit, hit);
    return hit;
}

bool EmbreeScene::isOccluded(const ExactHit& from, const Vec3d& L, double distance) const
{
    const Vec3d start = startOf(from, L);
    if (m->skins->isOccluded(start, L, distance)) return true;
    Context context(from);
    RTCRay ray = rayOf(start - m->origin, L, distance);
    rtcOccluded1(m->top, &context.base, &ray);
    return ray.tfar < 0;
}

} // namespace volcomp
