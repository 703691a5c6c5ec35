// The exact way with the trilinear filter: cell by cell between voxel centres, in closed form.
#include <algorithm>
#include <cmath>

#include "volcomp/render/march/dual_march.h"
#include "volcomp/render/march/integration.h"

namespace volcomp {
namespace {

// The densities at a cell's corners; false if all are 0.
bool cornerDensities(const float* gathered, int cell, float* corners)
{
    const float* v = gathered + gatheredOffset(cell);
    float sum = 0;
    for (int k = 0; k < 8; ++k) sum += corners[k] = v[gatheredCorner(k)];
    return sum > 0;
}

double effectiveDensity(const MarchScene& scene, const DualTree::Corner& c, float rho,
                        const Vec3d& d)
{
    return scene.fibre && rho > 0 ? rho * scene.tree.fibreFactor(c.leaf, c.voxel, d) : rho;
}

// The line integral with the extinction of fibres, whose factor differs from corner to corner.
double fibreIntegral(const MarchScene& scene, const MarchRay& r, const Vec3d& d)
{
    const DualTree& dual = *scene.dual;
    DualTree::Gathered& gathered = dual.gathered();
    double sum = 0;
    forEachLeaf(dual, r, [&](const LeafSpan& span) {
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
                        * effectiveDensity(scene, dual.corner(span.leaf, offset, k), rho[k], d);
        });
        return sum < scene.stop;
    });
    return sum;
}

// The piece of a ray in one cell of a leaf, and the optical depth that each corner adds.
struct CellPiece {
    int leaf, offset; ///< of the cell in the dual tree
    int cell[3];
    double t, end;
    double depths[8];
};

// Adds the segment. Each centre's particles are shaded with that centre's direction and colour; the
// cell shows their mean, weighted by the optical depth that each adds (exact, since the density is
// cubic along the ray).
void addCell(const MarchScene& scene, const MarchRay& r, const Vec3d& direction,
             const CellPiece& piece, double delta, RaySample& sample, RayScratch& scratch)
{
    const Vec3d half(0.5), middle = r.at(0.5 * (piece.t + piece.end)) + half;
    scratch.shading.start(scene.lights.size());
    for (int k = 0; k < 8; ++k) {
        if (!(piece.depths[k] > 0)) continue;
        const DualTree::Corner c = scene.dual->corner(piece.leaf, piece.offset, k);
        SeenVoxel seen{c.leaf, c.voxel, {}, piece.depths[k] / delta};
        cornerVoxel(piece.cell, k, seen.cell);
        shadeVoxel(scene, seen, middle, -direction, scratch.shading);
    }
    addSegment(
        scene,
        {delta,
         piece.t,
         piece.end,
         r.at(piece.t) + half,
         r.at(piece.end) + half,
         {int(std::floor(middle[0])), int(std::floor(middle[1])), int(std::floor(middle[2]))}},
        sample, scratch);
}

} // namespace

double trilinearDepth(const MarchScene& scene, const MarchRay& r, const Vec3d& direction)
{
    return scene.extinction
        * (scene.fibre ? fibreIntegral(scene, r, direction)
                       : lineIntegral(*scene.dual, r, scene.stop));
}

void traceTrilinear(const MarchScene& scene, const MarchRay& r, const Vec3d& direction,
                    RaySample& sample, RayScratch& scratch)
{
    const DualTree& dual = *scene.dual;
    DualTree::Gathered& gathered = dual.gathered();
    forEachLeaf(dual, r, [&](const LeafSpan& span) {
        const LeafWay way(r, *span.start);
        for (int i = 0; i < way.count; ++i) {
            const int offset = way.voxels[i];
            CellPiece piece{span.leaf,
                            offset,
                            {span.cell[0] + (offset >> 6), span.cell[1] + (offset >> 3 & 7),
                             span.cell[2] + (offset & 7)},
                            way.times[i],
                            std::min(way.times[i + 1], r.t1),
                            {}};
            float rho[8];
            // Rays to lights gather, too: the place may hold another block by now.
            if (!(piece.end > piece.t)
                || !cornerDensities(gathered.densities(span.leaf), offset, rho))
                continue;
            cornerWeights(r.o, r.d, piece.cell, piece.t, piece.end, piece.depths);
            double delta = 0;
            for (int k = 0; k < 8; ++k) {
                piece.depths[k] *= scene.extinction
                    * effectiveDensity(scene, dual.corner(span.leaf, offset, k), rho[k], direction);
                delta += piece.depths[k];
            }
            if (!(delta > 0)) continue;
            addCell(scene, r, direction, piece, delta, sample, scratch);
            if (sample.transmittance < scene.params.cutoff) return false;
        }
        return true;
    });
}

} // namespace volcomp
