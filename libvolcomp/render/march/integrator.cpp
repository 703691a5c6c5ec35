#include "volcomp/render/march/integrator.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace volcomp {

double segmentLight(double a, double x)
{
    if (std::abs(x) < 1e-5) return std::exp(-a) * (1 - 0.5 * x);
    if (x > 0) return std::exp(-a) * -std::expm1(-x) / x;
    return std::exp(-a - x) * -std::expm1(x) / -x; // a + x >= 0: no overflow
}

Integrator::Integrator(const VoxelTree& tree, std::vector<Material> part_materials,
                       const std::vector<Light>& lights, const RenderParams& params)
    : m_tree(tree), m_materials(std::move(part_materials)), m_lights(lights),
      m_corner_lights(lights), m_params(params)
{
    for (const Material& m : m_materials)
        for (int code = 0; code < 64; ++code)
            m_lobes.push_back(
                makeLobe(m, VoxelTree::spreadOf(std::min(code, VoxelTree::kSpreadCodes - 1))));
    for (Light& l : m_corner_lights) {
        l.position = tree.toCorner(l.position);
        l.direction = tree.directionToCorner(l.direction);
    }
    for (const Light& l : m_corner_lights)
        m_light_rays.emplace_back(tree, Vec3d(0.0), -l.direction, 0);
    m_fibre = params.extinction == Extinction::fibre && tree.hasDirectedFibres();
    const auto black = [](const Vec3d& v) { return v == Vec3d(0.0); };
    m_transmits = !params.aovs && black(params.ambient)
        && std::all_of(lights.begin(), lights.end(),
                       [&](const Light& l) { return black(l.strength); });
    if (params.filter == Filter::trilinear) m_dual = std::make_shared<DualTree>(tree);
    m_extinction = params.tau * tree.voxelSize();
    m_stop = params.cutoff > 0 && m_extinction > 0 ? -std::log(params.cutoff) / m_extinction
                                                   : std::numeric_limits<double>::infinity();
}

// The way to a light and how long it is, voxels.
Vec3d Integrator::toLight(std::size_t light, const Vec3d& p, double& distance) const
{
    const Light& l = m_corner_lights[light];
    distance = std::numeric_limits<double>::infinity();
    if (l.kind == LightKind::directional) return -l.direction;
    const Vec3d L = l.position - p;
    distance = L.length();
    return distance > 0 ? L / distance : L;
}

double Integrator::depthToLight(std::size_t light, const int* cell, const Vec3d& p,
                                RayCounts& counts) const
{
    double way, beyond = 0;
    const Vec3d L = toLight(light, p, way);
    if (!(way > 0)) return 0;
    const bool swept = m_sweep && m_sweep->toLight(light, cell, p, L, way, way, beyond);
    if (!swept) ++counts.shadow_rays;
    else if (!(way > 0)) return beyond;
    const Vec3d d_world = m_tree.directionToWorld(L);
    if (m_dual) return beyond + depthAlong(MarchRay(*m_dual, p - Vec3d(0.5), L, way), d_world);
    if (swept && m_params.integration == Integration::exact) {
        const MarchRay r = m_lights[light].kind == LightKind::directional
            ? m_light_rays[light].from(p, way)
            : MarchRay(m_tree, p, L, way).from(p, way);
        return beyond
            + m_extinction
            * (m_fibre ? shortIntegral<true>(m_tree, r, cell, d_world)
                       : shortIntegral<false>(m_tree, r, cell, d_world));
    }
    return beyond + depthAlong(MarchRay(m_tree, p, L, way), d_world);
}

double Integrator::depthAlong(const MarchRay& r, const Vec3d& d_world) const
{
    const bool sums = m_params.integration == Integration::riemann;
    if (m_dual) return sums ? sumDepth(*m_dual, r, d_world) : trilinearDepth(r, d_world);
    if (sums) return sumDepth(m_tree, r, d_world);
    return m_extinction
        * (m_fibre ? lineIntegral<true>(m_tree, r, d_world, m_stop)
                   : lineIntegral<false>(m_tree, r, d_world, m_stop));
}

RaySample Integrator::trace(const Vec3d& origin, const Vec3d& direction, Scratch& scratch) const
{
    RaySample sample;
    ++scratch.counts.rays;
    if (m_params.aovs) scratch.light_radiance.assign(m_lights.size(), Vec3d(0.0));
    traceFurther(sample, origin, direction, 0, std::numeric_limits<double>::infinity(), scratch);
    return sample;
}

void Integrator::traceFurther(RaySample& sample, const Vec3d& origin, const Vec3d& direction,
                              double start, double end, Scratch& scratch) const
{
    if (!(std::abs(direction.length() - 1) < 1e-3)) return;
    const Vec3d o = m_tree.toCorner(origin), d = m_tree.directionToCorner(direction);
    start /= m_tree.voxelSize();
    end /= m_tree.voxelSize();
    scratch.lights.assign(m_lights.size(), {});
    const bool sums = m_params.integration == Integration::riemann;
    if (m_dual) {
        const MarchRay r(*m_dual, o - Vec3d(0.5), d, end, start);
        if (m_transmits) return void(sample.transmittance *= std::exp(-depthAlong(r, direction)));
        return sums ? traceSums(sample, *m_dual, r, 0.5, direction, scratch)
                    : traceTrilinear(sample, r, direction, scratch);
    }
    const MarchRay r(m_tree, o, d, end, start);
    if (m_transmits) return void(sample.transmittance *= std::exp(-depthAlong(r, direction)));
    if (sums) return traceSums(sample, m_tree, r, 0, direction, scratch);
    return m_fibre ? traceExact<true>(sample, r, direction, scratch)
                   : traceExact<false>(sample, r, direction, scratch);
}

void Integrator::markLeaves(const Vec3d& origin, const Vec3d& direction, double from, double to,
                            std::vector<float>& seen) const
{
    const MarchRay r(m_tree, m_tree.toCorner(origin), m_tree.directionToCorner(direction),
                     to / m_tree.voxelSize(), from / m_tree.voxelSize());
    double depth = 0;
    forEachLeaf(m_tree, r, [&](const LeafSpan& span) {
        const float* density = m_tree.densities(span.leaf);
        double greatest = 0;
        forEachVoxel(r, *span.start, [&](int voxel, double t, double end) {
            if (!(density[voxel] > 0)) return;
            const double delta = m_extinction * double(density[voxel]) * (end - t);
            greatest = std::max(greatest, std::exp(-depth) * -std::expm1(-delta));
            depth += delta;
        });
        seen[span.leaf] = std::max(seen[span.leaf], float(greatest));
        return depth
            < (m_fibre ? 1.5 : 1.0) * darkest(); // fibres may cover less than their density says
    });
}

template <bool kFibre>
void Integrator::traceExact(RaySample& sample, const MarchRay& r, const Vec3d& direction,
                            Scratch& scratch) const
{
    const Vec3d V = -direction;
    forEachLeaf(m_tree, r, [&](const LeafSpan& span) {
        const float* density = m_tree.densities(span.leaf);
        const bool fibres = kFibre && m_tree.leaf(span.leaf).directed_fibres;
        const LeafWay way(r, *span.start);
        for (int i = 0; i < way.count; ++i) {
            const int voxel = way.voxels[i];
            const float rho = density[voxel];
            if (!(rho > 0)) continue;
            const double t = way.times[i], end = std::min(way.times[i + 1], r.t1);
            if (!(end > t)) continue;
            double delta = m_extinction * rho * (end - t);
            if (fibres) delta *= m_tree.fibreFactor(span.leaf, voxel, direction);
            if (delta == 0) continue;
            const int cell[3] = {span.cell[0] + (voxel >> 6), span.cell[1] + (voxel >> 3 & 7),
                                 span.cell[2] + (voxel & 7)};
            const auto at = [&](double s) {
                return Vec3d(r.o[0] + r.d[0] * s, r.o[1] + r.d[1] * s, r.o[2] + r.d[2] * s);
            };
            Vec3d ambient;
            startShading(scratch, ambient);
            shade(span.leaf, voxel, cell, 1, at(0.5 * (t + end)), V, scratch, ambient);
            addSegment(sample, ambient, delta, cell, at(t), at(end), t, end, scratch);
            if (sample.transmittance < m_params.cutoff) return false;
        }
        return true;
    });
}

// A segment with the shading in scratch.lights, its light linear in optical depth from p (at t) to
// q (at end), both in `cell`.
void Integrator::addSegment(RaySample& sample, const Vec3d& ambient, double delta, const int* cell,
                            const Vec3d& p, const Vec3d& q, double t, double end,
                            Scratch& scratch) const
{
    ++scratch.counts.shaded_voxels;
    const double opacity = -std::expm1(-delta);
    if (m_params.aovs) addAovs(sample, sample.transmittance * opacity, 0.5 * (t + end), scratch);
    for (std::size_t l = 0; l < m_lights.size(); ++l) {
        LightState& light = scratch.lights[l];
        if (!light.lit) continue;
        if (m_params.shadows == Shadows::none) {
            addLight(sample, l, opacity * light.S, scratch);
            continue;
        }
        if (m_sweep && addRoughly(sample, l, opacity, cell, 0.5 * (p + q), t, scratch)) continue;
        const double a = light.t == t ? light.depth : depthToLight(l, cell, p, scratch.counts),
                     b = depthToLight(l, cell, q, scratch.counts);
        light.depth = b;
        light.t = end;
        addLight(sample, l, delta * segmentLight(a, delta + b - a) * light.S, scratch);
    }
    sample.radiance += sample.transmittance * opacity * ambient;
    sample.transmittance *= std::exp(-delta);
}

// Where little depends on it, or the sweep knows no better: light that is the same in the whole
// segment.
bool Integrator::addRoughly(RaySample& sample, std::size_t light, double opacity, const int* cell,
                            const Vec3d& middle, double t, Scratch& scratch) const
{
    constexpr double kTrace = 0.001, kReuse = 2; // of a voxel that is a trace, the light is that of
                                                 // another not farther than so many voxels
    LightState& state = scratch.lights[light];
    const double weight = sample.transmittance * opacity;
    if (weight >= kTrace || std::abs(t - state.rough_t) > kReuse) {
        double distance;
        const Vec3d L = toLight(light, middle, distance);
        if (!m_sweep->roughLight(light, cell, middle, L, distance, state.passes, state.fine))
            return false;
        state.rough_t = t;
    }
    if (state.fine && weight * state.passes >= ShadowSweep::kFineWeight) return false;
    addLight(sample, light, opacity * state.passes * state.S, scratch);
    return true;
}

void Integrator::addAovs(RaySample& sample, double weight, double t, Scratch& scratch) const
{
    sample.albedo += weight * scratch.albedo;
    sample.normal += weight * scratch.normal;
    sample.depth += weight * t * m_tree.voxelSize();
}

void Integrator::addLight(RaySample& sample, std::size_t light, const Vec3d& source,
                          Scratch& scratch) const
{
    const Vec3d radiance = sample.transmittance * source;
    sample.radiance += radiance;
    if (m_params.aovs) scratch.light_radiance[light] += radiance;
}

void Integrator::startShading(Scratch& scratch, Vec3d& ambient) const
{
    ambient = scratch.albedo = scratch.normal = Vec3d(0.0);
    for (LightState& light : scratch.lights) {
        light.S = Vec3d(0.0);
        light.lit = false;
    }
}

// Adds `share` times what the voxel reflects to S of each light, and to the ambient light.
void Integrator::shade(int leaf, int voxel, const int* cell, double voxel_share, const Vec3d& p,
                       const Vec3d& V, Scratch& scratch, Vec3d& ambient) const
{
    double total = 0;
    const bool fibres = m_fibre;
    m_tree.contents(leaf, voxel, [&](const VoxelContent& content) {
        total += content.density * (fibres ? m_tree.fibreFactor(content, V) : 1);
    });
    if (!(total > 0)) return;
    m_tree.contents(leaf, voxel, [&](const VoxelContent& content) {
        const Material& material = m_materials[content.part];
        const Lobe& lobe = m_lobes[content.part * 64 + content.spread_code];
        const double share =
            voxel_share * content.density * (fibres ? m_tree.fibreFactor(content, V) : 1) / total;
        Vec3d normal(0.0);
        if (!content.directed && m_params.undirected == Undirected::gradient)
            normal = gradientNormal(cell);
        if (m_params.aovs) {
            scratch.albedo += share * material.alpha * content.colour;
            scratch.normal += (content.direction.dot(V) < 0 ? -share : share)
                * (content.directed ? content.direction : normal);
        }
        ambient += share * material.alpha * content.colour * m_params.ambient;
        for (std::size_t l = 0; l < m_lights.size(); ++l) {
            // Distances are in voxels here; the weight of a point light needs them in world units.
            Illumination in = illuminate(m_corner_lights[l], p, 0.5);
            if (m_lights[l].kind != LightKind::directional)
                in.weight /= m_tree.voxelSize() * m_tree.voxelSize();
            if (!(in.weight > 0)) continue;
            const Vec3d L = m_tree.directionToWorld(in.L);
            if (m_params.shadows != Shadows::none)
                in.weight *= m_tree.scatterRatio(leaf, voxel, V, L);
            Reflection f;
            if (content.directed)
                f = material.kind == MaterialKind::fibre
                    ? reflectFibre(lobe, content.direction, V, L)
                    : reflectSurface(lobe, content.direction, V, L);
            else if (normal.lengthSqr() > 0) f = reflectSided(lobe, normal, V, L);
            else f = reflectIsotropic(lobe);
            const Vec3d I = (f.diffuse * content.colour + f.specular * material.specular_colour)
                * m_lights[l].strength * (in.weight * share);
            if (I[0] + I[1] + I[2] > 0) {
                scratch.lights[l].S += I;
                scratch.lights[l].lit = true;
            }
        }
    });
}

// Against the density's gradient (central differences), unit length, world; zero where the density
// is flat.
Vec3d Integrator::gradientNormal(const int* c) const
{
    Vec3d g(m_tree.density(c[0] - 1, c[1], c[2]) - m_tree.density(c[0] + 1, c[1], c[2]),
            m_tree.density(c[0], c[1] - 1, c[2]) - m_tree.density(c[0], c[1] + 1, c[2]),
            m_tree.density(c[0], c[1], c[2] - 1) - m_tree.density(c[0], c[1], c[2] + 1));
    const double length = g.length();
    return length > 0 ? m_tree.directionToWorld(g / length) : Vec3d(0.0);
}

} // namespace volcomp
