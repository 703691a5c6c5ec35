// What is asked of a light that was swept.
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
                         bool fibre)
    : m_tree(tree), m_extinction(extinction), m_darkest(std::min(darkest, 12.0)),
      m_fibre(fibre && tree.hasDirectedFibres())
{
    struct Job {
        std::size_t light;
        int side;
        Field field;
        bool asked = false;
    };
    std::vector<Job> jobs;
    for (const Light& light : lights) {
        const bool directional = light.kind == LightKind::directional;
        for (int side = 0; side < (directional ? 1 : 6) && !tree.empty(); ++side) {
            Job& job = jobs.emplace_back(Job{m_directional.size(), side, {}});
            job.field.lattice = directional
                ? LightLattice::parallel(tree.directionToCorner(light.direction), kSpacing)
                : LightLattice::fan(tree.toCorner(light.position), side / 2, side % 2 ? 1 : -1);
        }
        m_directional.push_back(directional);
        m_field_of.push_back({-1, -1, -1, -1, -1, -1});
    }
    // A light waits for its threads after every layer; meanwhile they work for another.
    tbb::parallel_for(std::size_t(0), jobs.size(), [&](std::size_t i) {
        jobs[i].asked = Sweeper(*this, jobs[i].field, lights[jobs[i].light], seen).run();
    });
    for (Job& job : jobs)
        if (job.asked) {
            m_field_of[job.light][job.side] = int(m_fields.size());
            m_fields.push_back(std::move(job.field));
        }
}

const ShadowSweep::Field* ShadowSweep::fieldOf(std::size_t light, const Vec3d& L) const
{
    int side = 0;
    if (!m_directional[light]) {
        const int a = largestAxis(L);
        side = 2 * a + (L[a] < 0); // the light goes the other way
    }
    return m_field_of[light][side] < 0 ? nullptr : &m_fields[m_field_of[light][side]];
}

std::int32_t ShadowSweep::Field::patch(int plane, int bundle_b, int bundle_c) const
{
    const Plane& at = planes[plane];
    return at.bundles.holds(bundle_b, bundle_c)
        ? patches[at.first + at.bundles.index(bundle_b, bundle_c)]
        : kUnknown;
}

namespace {

struct Place {   // between rays
    double u, v; // in the bundle
    int bundle_b, bundle_c;

    Place(const LightLattice& l, const Vec3d& p, const Vec3d& L, double way, double s, int bundle)
    {
        const double per_ray = 1 / l.spacing(s);
        locate(l.offsetFrom(0, p[l.b] + way * L[l.b], s) * per_ray, bundle, u, bundle_b);
        locate(l.offsetFrom(1, p[l.c] + way * L[l.c], s) * per_ray, bundle, v, bundle_c);
    }

private:
    static void locate(double ray, int bundle, double& inside, int& number)
    {
        const double whole = std::floor(ray * (1.0 / bundle));
        number = int(whole);
        inside = std::min(std::max(ray - whole * bundle, 0.0), bundle - 1e-9);
    }
};

double between(const std::uint8_t* codes, int stride_u, int stride_v, double u, double v)
{
    const int i = int(u), j = int(v);
    const std::uint8_t* c = codes + i * stride_u + j * stride_v;
    const double x = u - i, y = v - j;
    return (1 - x) * ((1 - y) * c[0] + y * c[stride_v])
        + x * ((1 - y) * c[stride_u] + y * c[stride_u + stride_v]);
}

} // namespace

// The code between rays kStride apart.
bool ShadowSweep::Field::roughCode(int plane, const Vec3d& p, const Vec3d& L, double to_plane,
                                   double darkest, double& code, bool& fine) const
{
    const Place place(lattice, p, L, to_plane, first_s + double(kLeafDim) * plane, kBundle);
    const std::int32_t at = patch(plane, place.bundle_b, place.bundle_c);
    if (at == kUnknown) return false;
    fine = at < 0 || (at & 1);
    if (at == kBright) code = 255;
    else if (at == kDark) code = 255 * std::exp(-darkest);
    else {
        const std::uint8_t* c = &codes[std::size_t(at >> 1) * kUnit];
        if (at & 1)
            code = between(c, kStride * kSide, kStride, place.u * (1.0 / kStride),
                           place.v * (1.0 / kStride));
        else code = between(c, kRoughSide, 1, place.u * (1.0 / kStride), place.v * (1.0 / kStride));
    }
    return true;
}

bool ShadowSweep::roughLight(std::size_t light, const int* cell, const Vec3d& p, const Vec3d& L,
                             double distance, double& passes, bool& fine) const
{
    const Field* f = fieldOf(light, L);
    if (!f) return false;
    const int a = f->lattice.a, low = cell[a] & ~(kLeafDim - 1);
    const double s = f->lattice.sign > 0 ? low : -(low + double(kLeafDim)),
                 slices = f->lattice.travel(p) - s, stretch = 1 / std::abs(L[a]);
    const int plane = int((s - f->first_s) * (1.0 / kLeafDim));
    if (s < f->first_s || plane + 1 >= int(f->planes.size()) || distance <= slices * stretch
        || (f->lattice.fans && s <= f->lattice.s0 + 1e-3))
        return false;
    double before, behind;
    bool behind_fine;
    if (!f->roughCode(plane, p, L, slices * stretch, m_darkest, before, fine)
        || !f->roughCode(plane + 1, p, L, (slices - kLeafDim) * stretch, m_darkest, behind,
                         behind_fine))
        return false;
    const double code = (before + (behind - before) * slices * (1.0 / kLeafDim)) * (1.0 / 255);
    passes = code * code;
    return true;
}

bool ShadowSweep::toLight(std::size_t light, const int* cell, const Vec3d& p, const Vec3d& L,
                          double distance, double& way, double& depth) const
{
    const Field* f = fieldOf(light, L);
    if (!f) return false;
    const int a = f->lattice.a, low = cell[a] & ~(kLeafDim - 1);
    // The plane where the light enters the cell's layer of leaves.
    const double s = f->lattice.sign > 0 ? low : -(low + double(kLeafDim));
    const int plane = int((s - f->first_s) * (1.0 / kLeafDim));
    if (s < f->first_s || plane >= int(f->planes.size())) return false;
    const double to_plane = std::max(0.0, (f->lattice.travel(p) - s) / std::abs(L[a]));
    if (to_plane >= distance || (f->lattice.fans && s <= f->lattice.s0 + 1e-3)) {
        way = distance;
        depth = 0;
        return true;
    }
    const Place place(f->lattice, p, L, to_plane, s, kBundle);
    const std::int32_t patch = f->patch(plane, place.bundle_b, place.bundle_c);
    if (patch == kUnknown || (patch >= 0 && !(patch & 1))) return false;
    way = to_plane;
    if (patch == kBright) depth = 0;
    else if (patch == kDark) depth = 2 * m_darkest;
    else
        depth = -2
            * std::log(std::max(between(&f->codes[std::size_t(patch >> 1) * kUnit], kSide, 1,
                                        place.u, place.v),
                                0.25)
                       * (1.0 / 255));
    return true;
}

std::size_t ShadowSweep::memoryBytes() const
{
    std::size_t bytes = 0;
    for (const Field& f : m_fields)
        bytes += f.planes.size() * sizeof(Plane) + f.patches.size() * sizeof(std::int32_t)
            + f.codes.size();
    return bytes;
}

} // namespace volcomp
