// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/shadow/shadow_sweep.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

#include "volcomp/render/shadow/shadow_sweeper.h"

namespace volcomp {

void ShadowSweep::Rectangle::add(const Rectangle& r)
{
    if (r.empty()) return;
    if (empty()) {
        *this = r;
        return;
    }
    for (int a = 0; a < 2; ++a) {
        low[a] = std::min(low[a], r.low[a]);
        high[a] = std::max(high[a], r.high[a]);
    }
}

ShadowSweep::ShadowSweep(const VoxelTree& tree, const std::vector<Light>& lights,
                         const std::vector<float>& seen, double extinction, double darkest,
                         bool directed, const VoxelTree* beyond)
    : m_tree(tree),
      m_beyond(tree.tiles() && beyond && beyond->voxelSize() > 1.5 * tree.voxelSize() ? beyond
                                                                                      : nullptr),
      m_extinction(extinction), m_darkest(std::min(darkest, 12.0)),
      m_directed(directed && tree.isDirected())
{
    struct Job {
        std::size_t light;
        int side; // of m_field_of
        Field field;
        bool asked = false; // whether some leaf asks for its light
    };
    std::vector<Job> jobs;
    for (const Light& light : lights) {
        const bool directional = light.kind == LightKind::directional;
        for (int side = 0; side < (directional ? 1 : 6) && !tree.empty(); ++side) {
            Job& job = jobs.emplace_back(Job{m_directional.size(), side, {}, false});
            job.field.lattice = directional
                ? LightLattice::parallel(tree.directionToCorner(light.direction), kSpacing)
                : LightLattice::fan(tree.toCorner(light.position), side / 2, side % 2 ? 1 : -1);
            if (directional) alignWithColumns(tree, job.field);
        }
        m_directional.push_back(directional);
        m_field_of.push_back({-1, -1, -1, -1, -1, -1});
    }
    // Each light waits for all its threads after every layer. Meanwhile they work for another
    // light.
    const auto run = [&](Job& job) {
        Sweeper sweeper(*this, job.field, lights[job.light], seen);
        job.asked = sweeper.begin();
        for (int layer = 0; job.asked && layer < sweeper.layers(); ++layer) sweeper.pass(layer);
    };
    if (!tree.tiles()) {
        tbb::parallel_for(std::size_t(0), jobs.size(), [&](std::size_t i) { run(jobs[i]); });
    } else
        for (int side = 0; side < 6; ++side) {
            // Lights that come from one side, as those of a soft light do, go through the layers
            // together: they need nearly the same tiles.
            std::vector<std::unique_ptr<Sweeper>> together;
            for (Job& job : jobs) {
                const LightLattice& lattice = job.field.lattice;
                if (2 * lattice.a + (lattice.sign > 0) != side) continue;
                auto sweeper = std::make_unique<Sweeper>(*this, job.field, lights[job.light], seen);
                job.asked = sweeper->begin();
                if (job.asked) together.push_back(std::move(sweeper));
            }
            sweepTogether(together);
        }
    for (Job& job : jobs)
        if (job.asked) {
            m_field_of[job.light][job.side] = int(m_fields.size());
            m_fields.push_back(std::move(job.field));
        }
}

void ShadowSweep::sweepTogether(const std::vector<std::unique_ptr<Sweeper>>& sweepers) const
{
    constexpr double kRoomForLayer = 0.75; // of the budget, for nodes that begin at one layer
    const int layers = sweepers.empty() ? 0 : sweepers[0]->layers(); // all have as many
    for (int layer = 0; layer < layers; ++layer) {
        if (std::any_of(sweepers.begin(), sweepers.end(),
                        [&](const auto& s) { return s->waitsForNodes(layer); }))
            m_tree.tiles()->budget().relieve(1 - kRoomForLayer);
        for (const auto& s : sweepers) s->makeWay(layer);
        for (const auto& s : sweepers) s->pass(layer);
    }
}

void ShadowSweep::alignWithColumns(const VoxelTree& tree, Field& field)
{
    LightLattice& l = field.lattice;
    const openvdb::CoordBBox& box = tree.bounds();
    const double extent = box.dim()[l.a];
    l.keepOffFaces();
    for (int axis = 0; axis < 2; ++axis) {
        // Rays that stray this far on their way through the volume stay in their column.
        field.in_columns[axis] = std::abs(l.slope[axis]) * 0.5 * extent < 0.25 * l.spacing0;
        if (field.in_columns[axis]) l.keepOffFaces(axis, l.sign * (box.min()[l.a] + 0.5 * extent));
    }
}

const ShadowSweep::Field* ShadowSweep::fieldOf(std::size_t light, const Vec3d& L) const
{
    int side = 0;
    if (!m_directional[light]) {
        const int a = largestAxis(L);
        side = 2 * a + (L[a] < 0); // the light goes against L
    }
    return m_field_of[light][side] < 0 ? nullptr : &m_fields[m_field_of[light][side]];
}

ShadowSweep::PatchPlace ShadowSweep::Field::patch(int plane, int bundle_b, int bundle_c) const
{
    const Plane& at = planes[plane];
    return at.bundles.holds(bundle_b, bundle_c)
        ? patches[at.first + at.bundles.index(bundle_b, bundle_c)]
        : kUnknown;
}

double ShadowSweep::Field::planeBefore(const int* cell) const
{
    const int low = cell[lattice.a] & ~(kLeafDim - 1);
    return lattice.sign > 0 ? low : -(low + double(kLeafDim));
}

namespace {

/// Where the way from p to the light crosses a plane: in which bundle, and between which rays.
struct Place {
    double u, v; ///< rays from the bundle's first, 0 to RayBundle::kStep (exclusive)
    int bundle_b, bundle_c;

    /// The plane at s lies `way` voxels from p along L.
    Place(const LightLattice& l, const Vec3d& p, const Vec3d& L, double way, double s)
    {
        const double per_ray = 1 / l.spacing(s);
        locate(l.offsetFrom(0, p[l.b] + way * L[l.b], s) * per_ray, u, bundle_b);
        locate(l.offsetFrom(1, p[l.c] + way * L[l.c], s) * per_ray, v, bundle_c);
    }

private:
    static void locate(double ray, double& inside, int& bundle)
    {
        constexpr int kStep = RayBundle::kStep;
        const double whole = std::floor(ray * (1.0 / kStep));
        bundle = int(whole);
        inside = std::min(std::max(ray - whole * kStep, 0.0), kStep - 1e-9);
    }
};

/// Two rays of a patch along one axis, by number, and how much the second counts.
struct RayPair {
    int first, second;
    double part;
};

/// The rays before and behind a place.
RayPair raysAround(double number)
{
    const int first = int(number);
    return {first, first + 1, number - first};
}

/// If the rays stay in their columns of voxels, those whose light is that of a place x, which lies
/// at ray `number`. With the box filter a ray in another column does not count. With the trilinear
/// filter the columns whose centres are around x count, each as one ray in it has it; at a patch's
/// border a ray of the patch has to do for one outside of it.
RayPair raysOfColumns(double number, double x, double spacing, bool trilinear)
{
    if (trilinear) {
        const double before = std::floor(x - 0.5) + 0.5; // a centre
        const auto nearest = [&](double centre) {
            return std::clamp(int(std::lround(number + (centre - x) / spacing)), 0,
                              RayBundle::kSide - 1);
        };
        return {nearest(before), nearest(before + 1), x - before};
    }
    RayPair rays = raysAround(number);
    const auto isInColumn = [&](int ray) {
        return std::floor(x + (ray - number) * spacing) == std::floor(x);
    };
    if (!isInColumn(rays.first)) rays.first = rays.second;
    else if (!isInColumn(rays.second)) rays.second = rays.first;
    return rays;
}

double codeItself(std::uint8_t code) { return code; }

/// The optical depth of a code.
double depthOf(double code)
{
    constexpr double kLeastCode = 0.25; // for code 0, which is anything below 0.5
    return -2 * std::log(std::max(code, kLeastCode) * (1.0 / 255));
}

/// What `value` makes of a code, between those of two rays along each axis; the strides lead to the
/// next code.
template <class F>
double interpolate(const std::uint8_t* codes, int stride_u, int stride_v, const RayPair& u,
                   const RayPair& v, F&& value)
{
    const auto code = [&](int i, int j) { return value(codes[i * stride_u + j * stride_v]); };
    return (1 - u.part) * ((1 - v.part) * code(u.first, v.first) + v.part * code(u.first, v.second))
        + u.part * ((1 - v.part) * code(u.second, v.first) + v.part * code(u.second, v.second));
}

} // namespace

std::optional<ShadowSweep::Field::RoughCode>
ShadowSweep::Field::roughCode(int plane, const Vec3d& p, const Vec3d& L, double to_plane,
                              double darkest) const
{
    const Place place(lattice, p, L, to_plane, first_s + double(kLeafDim) * plane);
    const PatchPlace at = patch(plane, place.bundle_b, place.bundle_c);
    if (at == kUnknown) return std::nullopt;
    if (at == kBright) return RoughCode{255, true};
    if (at == kDark) return RoughCode{255 * std::exp(-darkest), true};
    const std::uint8_t* c = &codes[std::size_t(at >> 1) * kUnit];
    const double u = place.u * (1.0 / kStride), v = place.v * (1.0 / kStride);
    const bool fine = at & 1;
    return RoughCode{
        fine ? interpolate(c, kStride * kSide, kStride, raysAround(u), raysAround(v), codeItself)
             : interpolate(c, kRoughSide, 1, raysAround(u), raysAround(v), codeItself),
        fine};
}

std::optional<ShadowSweep::CoarseTransmittance>
ShadowSweep::approximateTransmittance(std::size_t light, const int* cell, const Vec3d& p,
                                      const Vec3d& L, double distance) const
{
    const Field* f = fieldOf(light, L);
    if (!f) return std::nullopt;
    const double s = f->planeBefore(cell), slices = f->lattice.travel(p) - s,
                 stretch = 1 / std::abs(L[f->lattice.a]);
    const int plane = int((s - f->first_s) * (1.0 / kLeafDim));
    if (s < f->first_s || plane + 1 >= int(f->planes.size()) || distance <= slices * stretch
        || !f->lattice.hasRaysAt(s))
        return std::nullopt;
    const auto before = f->roughCode(plane, p, L, slices * stretch, m_darkest);
    if (!before) return std::nullopt;
    const auto behind = f->roughCode(plane + 1, p, L, (slices - kLeafDim) * stretch, m_darkest);
    if (!behind) return std::nullopt;
    const double root =
        (before->value + (behind->value - before->value) * slices * (1.0 / kLeafDim)) * (1.0 / 255);
    return CoarseTransmittance{root * root, before->fine};
}

std::optional<ShadowSweep::Path> ShadowSweep::pathToLight(std::size_t light, const int* cell,
                                                          const Vec3d& p, const Vec3d& L,
                                                          double distance, bool trilinear) const
{
    const Field* f = fieldOf(light, L);
    if (!f) return std::nullopt;
    const double s = f->planeBefore(cell);
    const int plane = int((s - f->first_s) * (1.0 / kLeafDim));
    if (s < f->first_s || plane >= int(f->planes.size())) return std::nullopt;
    const double to_plane = std::max(0.0, (f->lattice.travel(p) - s) / std::abs(L[f->lattice.a]));
    if (to_plane >= distance || !f->lattice.hasRaysAt(s)) return Path{distance, 0};
    const Place place(f->lattice, p, L, to_plane, s);
    const PatchPlace patch = f->patch(plane, place.bundle_b, place.bundle_c);
    if (patch == kUnknown || (patch >= 0 && !(patch & 1))) return std::nullopt;
    if (patch == kBright) return Path{to_plane, 0};
    if (patch == kDark) return Path{to_plane, 2 * m_darkest};
    const LightLattice& l = f->lattice;
    const auto rays = [&](int axis, int a, double number) {
        return f->in_columns[axis]
            ? raysOfColumns(number, p[a] + to_plane * L[a], l.spacing(s), trilinear)
            : raysAround(number);
    };
    const std::uint8_t* codes = &f->codes[std::size_t(patch >> 1) * kUnit];
    const RayPair u = rays(0, l.b, place.u), v = rays(1, l.c, place.v);
    // Between columns the trilinear filter interpolates densities, so also their sums.
    if (trilinear && (f->in_columns[0] || f->in_columns[1]))
        return Path{to_plane, interpolate(codes, kSide, 1, u, v, depthOf)};
    return Path{to_plane, depthOf(interpolate(codes, kSide, 1, u, v, codeItself))};
}

std::size_t ShadowSweep::memoryBytes() const
{
    std::size_t bytes = 0;
    for (const Field& f : m_fields)
        bytes += f.planes.size() * sizeof(Plane) + f.patches.size() * sizeof(PatchPlace)
            + f.codes.size();
    return bytes;
}

} // namespace volcomp
