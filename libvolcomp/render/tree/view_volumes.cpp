// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/view_volumes.h"

#include <cmath>

#include "volcomp/base/interval.h"
#include "volcomp/render/tree/voxel_tree_io.h"

namespace volcomp {
namespace {

using openvdb::Coord;

class View {
public:
    View(const std::vector<VoxelLevel>& levels, const Vec3d& eye) : m_levels(levels), m_eye(eye) { }

    bool takes(std::size_t n, Coord voxel) const
    {
        if (distance(n, voxel) < m_levels[n].start) return false;
        while (++n < m_levels.size()) {
            voxel = coarser(voxel);
            if (distance(n, voxel) >= m_levels[n].start) return false;
        }
        return true;
    }
    // Whether takes() may be true for a voxel of a tile.
    bool mayTake(std::size_t n, const Coord& tile) const
    {
        const VoxelTree& tree = *m_levels[n].tree;
        const double width = tree.voxelSize(), across = std::sqrt(3.0) * width;
        const Vec3d middle = tree.toWorld(tile.asVec3d() + Vec3d(kTileDim / 2.0));
        const double away = (middle - m_eye).length(), half = kTileDim / 2.0 * across;
        // The middle of a coarser voxel is half a voxel beside the voxel's at most, along each
        // axis.
        return away + half >= m_levels[n].start && away - half - across <= m_levels[n].end;
    }

private:
    double distance(std::size_t n, const Coord& voxel) const
    {
        return (m_levels[n].tree->toWorld(voxel.asVec3d() + Vec3d(0.5)) - m_eye).length();
    }
    // The voxel of the next level that stands for one.
    static Coord coarser(const Coord& v)
    {
        return {(v[0] + 1) >> 1, (v[1] + 1) >> 1, (v[2] + 1) >> 1};
    }

    const std::vector<VoxelLevel>& m_levels;
    const Vec3d m_eye;
};

// The voxels of a level that are at most so far away from a point, and some more.
openvdb::CoordBBox within(const VoxelTree& tree, const Vec3d& eye, double distance)
{
    openvdb::CoordBBox box = tree.bounds();
    if (!(distance < kInfinity)) return box;
    const Vec3d middle = tree.toCorner(eye);
    const double reach = distance / tree.voxelSize() + 2 * kTileDim;
    for (int a = 0; a < 3; ++a) {
        box.min()[a] = int(std::max(double(box.min()[a]), std::floor(middle[a] - reach)));
        box.max()[a] = int(std::min(double(box.max()[a]), std::ceil(middle[a] + reach)));
    }
    return box;
}

} // namespace

PackedVolume viewVolume(const std::vector<VoxelLevel>& levels, std::size_t n, const Vec3d& eye)
{
    const VoxelTree& tree = *levels.at(n).tree;
    const View view(levels, eye);
    const openvdb::CoordBBox box = within(tree, eye, levels[n].end);
    if (tree.tiles() && !box.empty())
        tree.tiles()->make(box, [&](const Coord& tile) { return view.mayTake(n, tile); });
    return packedVolume(tree, [&](const Coord& voxel) { return view.takes(n, voxel); });
}

} // namespace volcomp
