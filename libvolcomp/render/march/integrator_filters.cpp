// The trilinear filter in closed form, and the paper's sums (3), (4) with either filter.
#include <algorithm>
#include <cmath>

#include "volcomp/render/march/dual_march.h"
#include "volcomp/render/march/integrator.h"

namespace volcomp {
namespace {

Vec3d along(const MarchRay& r, double t)
{
    return {r.o[0] + r.d[0] * t, r.o[1] + r.d[1] * t, r.o[2] + r.d[2] * t};
}

// The voxel at a cell's corner.
void cornerVoxel(const int* cell, int corner, int* voxel)
{
    voxel[0] = cell[0] + (corner >> 2);
    voxel[1] = cell[1] + (corner >> 1 & 1);
    voxel[2] = cell[2] + (corner & 1);
}

// Those of a cell's corners; false where all are 0.
bool cornerDensities(const float* gathered, int cell, float* corners)
{
    const float* v = gathered + gatheredOffset(cell);
    float sum = 0;
    for (int k = 0; k < 8; ++k) sum += corners[k] = v[gatheredCorner(k)];
    return sum > 0;
}

} // namespace

double Integrator::effectiveDensity(int x, int y, int z, const Vec3d& d) const
{
    const int leaf = m_tree.leafAt(x, y, z);
    if (leaf == VoxelTree::kEmpty) return 0;
    const int voxel = VoxelTree::offset(x, y, z);
    const double rho = m_tree.densities(leaf)[voxel];
    return m_fibre && rho > 0 ? rho * m_tree.fibreFactor(leaf, voxel, d) : rho;
}

double Integrator::effectiveDensity(const DualTree::Corner& c, float rho, const Vec3d& d) const
{
    return m_fibre && rho > 0 ? rho * m_tree.fibreFactor(c.leaf, c.voxel, d) : rho;
}

double Integrator::trilinearDepth(const MarchRay& r, const Vec3d& d) const
{
    if (!m_fibre) return m_extinction * lineIntegral(*m_dual, r, m_stop);
    DualTree::Gathered& gathered = m_dual->gathered();
    double sum = 0;
    forEachLeaf(*m_dual, r, [&](const LeafSpan& span) {
        const float* densities = gathered.densities(span.leaf);
        forEachVoxel(r, *span.start, [&](int offset, double t, double end) {
            end = std::min(end, r.t1);
            float rho[8];
            if (!(end > t) || !cornerDensities(densities, offset, rho)) return;
            const int cell[3] = {span.cell[0] + (offset >> 6), span.cell[1] + (offset >> 3 & 7),
                                 span.cell[2] + (offset & 7)};
            double weights[8];
            cornerWeights(r.o, r.d, cell, t, end, weights);
            for (int k = 0; k < 8; ++k)
                if (rho[k] > 0)
                    sum += weights[k]
                        * effectiveDensity(m_dual->corner(span.leaf, offset, k), rho[k], d);
        });
        return sum < m_stop;
    });
    return m_extinction * sum;
}

// As traceExact(), cell by cell between voxel centres. Each centre's particles are shaded with that
// centre's direction and colour; a cell's source is their mean, weighted by the optical depth that
// each adds (exact, being cubic along the ray).
void Integrator::traceTrilinear(RaySample& sample, const MarchRay& r, const Vec3d& direction,
                                Scratch& scratch) const
{
    const Vec3d half(0.5);
    DualTree::Gathered& gathered = m_dual->gathered();
    forEachLeaf(*m_dual, r, [&](const LeafSpan& span) {
        const LeafWay way(r, *span.start);
        for (int i = 0; i < way.count; ++i) {
            const int offset = way.voxels[i]; // of the cell in its block
            const double t = way.times[i], end = std::min(way.times[i + 1], r.t1);
            float rho[8];
            // Rays to lights gather, too: the place may hold another block by now.
            if (!(end > t) || !cornerDensities(gathered.densities(span.leaf), offset, rho))
                continue;
            const int cell[3] = {span.cell[0] + (offset >> 6), span.cell[1] + (offset >> 3 & 7),
                                 span.cell[2] + (offset & 7)};
            double depths[8], delta = 0;
            cornerWeights(r.o, r.d, cell, t, end, depths);
            for (int k = 0; k < 8; ++k) {
                depths[k] *= m_extinction
                    * effectiveDensity(m_dual->corner(span.leaf, offset, k), rho[k], direction);
                delta += depths[k];
            }
            if (!(delta > 0)) continue;
            Vec3d ambient;
            startShading(scratch, ambient);
            const Vec3d middle = along(r, 0.5 * (t + end)) + half;
            for (int k = 0; k < 8; ++k) {
                if (!(depths[k] > 0)) continue;
                const DualTree::Corner c = m_dual->corner(span.leaf, offset, k);
                int v[3];
                cornerVoxel(cell, k, v);
                shade(c.leaf, c.voxel, v, depths[k] / delta, middle, -direction, scratch, ambient);
            }
            const int at_middle[3] = {int(std::floor(middle[0])), int(std::floor(middle[1])),
                                      int(std::floor(middle[2]))};
            addSegment(sample, ambient, delta, at_middle, along(r, t) + half, along(r, end) + half,
                       t, end, scratch);
            if (sample.transmittance < m_params.cutoff) return false;
        }
        return true;
    });
}

namespace {

// f(weight, voxel) for what the filter sees at a point, in the tree's coordinates.
template <class F>
void filterAt(const VoxelTree&, const Vec3d& p, F&& f)
{
    const int v[3] = {int(std::floor(p[0])), int(std::floor(p[1])), int(std::floor(p[2]))};
    f(1.0, v);
}
template <class F>
void filterAt(const DualTree&, const Vec3d& p, F&& f)
{
    const int cell[3] = {int(std::floor(p[0])), int(std::floor(p[1])), int(std::floor(p[2]))};
    const double x = p[0] - cell[0], y = p[1] - cell[1], z = p[2] - cell[2];
    for (int k = 0; k < 8; ++k) {
        int v[3];
        cornerVoxel(cell, k, v);
        f((k >> 2 ? x : 1 - x) * (k >> 1 & 1 ? y : 1 - y) * (k & 1 ? z : 1 - z), v);
    }
}

// f(t) at the middles of steps inside the leaves of the ray, until it returns false.
template <class Tree, class F>
void forEachStep(const Tree& tree, const MarchRay& r, double step, F&& f)
{
    forEachLeaf(tree, r, [&](const LeafSpan& span) {
        for (double k = std::ceil(span.t / step - 0.5);; ++k) {
            const double t = (k + 0.5) * step;
            if (t >= span.t_end) return true;
            if (!f(t)) return false;
        }
    });
}

} // namespace

// Sum (3).
template <class Tree>
double Integrator::sumDepth(const Tree& tree, const MarchRay& r, const Vec3d& d) const
{
    double sum = 0;
    forEachStep(tree, r, m_params.step, [&](double t) {
        filterAt(tree, along(r, t), [&](double weight, const int* v) {
            sum += weight * m_params.step * effectiveDensity(v[0], v[1], v[2], d);
        });
        return sum < m_stop;
    });
    return m_extinction * sum;
}

// Sum (4), the current sample's own attenuation included, as printed. `shift` leads from the tree's
// coordinates to corner coordinates.
template <class Tree>
void Integrator::traceSums(RaySample& sample, const Tree& tree, const MarchRay& r, double shift,
                           const Vec3d& direction, Scratch& scratch) const
{
    forEachStep(tree, r, m_params.step, [&](double t) {
        const Vec3d at = along(r, t), p = at + Vec3d(shift);
        double delta = 0;
        filterAt(tree, at, [&](double weight, const int* v) {
            delta += weight * m_params.step * m_extinction
                * effectiveDensity(v[0], v[1], v[2], direction);
        });
        if (!(delta > 0)) return true;
        ++scratch.counts.shaded_voxels;
        Vec3d source;
        startShading(scratch, source);
        filterAt(tree, at, [&](double weight, const int* v) {
            const double share = weight * m_params.step * m_extinction
                * effectiveDensity(v[0], v[1], v[2], direction) / delta;
            if (share > 0)
                shade(m_tree.leafAt(v[0], v[1], v[2]), VoxelTree::offset(v[0], v[1], v[2]), v,
                      share, p, -direction, scratch, source);
        });
        sample.transmittance *= std::exp(-delta);
        if (m_params.aovs) addAovs(sample, sample.transmittance * delta, t, scratch);
        const int at_p[3] = {int(std::floor(p[0])), int(std::floor(p[1])), int(std::floor(p[2]))};
        for (std::size_t l = 0; l < m_lights.size(); ++l)
            if (scratch.lights[l].lit)
                addLight(sample, l,
                         scratch.lights[l].S
                             * (delta
                                * (m_params.shadows == Shadows::none
                                       ? 1
                                       : std::exp(-depthToLight(l, at_p, p, scratch.counts)))),
                         scratch);
        sample.radiance += sample.transmittance * delta * source;
        return sample.transmittance >= m_params.cutoff;
    });
}

template void Integrator::traceSums(RaySample&, const VoxelTree&, const MarchRay&, double,
                                    const Vec3d&, Scratch&) const;
template void Integrator::traceSums(RaySample&, const DualTree&, const MarchRay&, double,
                                    const Vec3d&, Scratch&) const;
template double Integrator::sumDepth(const VoxelTree&, const MarchRay&, const Vec3d&) const;
template double Integrator::sumDepth(const DualTree&, const MarchRay&, const Vec3d&) const;

} // namespace volcomp
