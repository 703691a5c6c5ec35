// SPDX-License-Identifier: Apache-2.0
// Rays through a VoxelTree (or DualTree): each voxel with particles once, in order, with the exact
// length inside.
//
// Three nested walks, over nodes, leaves and voxels (after Amanatides and Woo, A Fast Voxel
// Traversal Algorithm, 1987). The inner ones start anew from the ray's equation in every node and
// leaf, so rounding errors do not add up. Lengths and positions are in voxels, in the tree's corner
// coordinates, in double precision: a million voxels from the origin a position is still known to
// 1e-10. The caller may pass directions along axes and -0. A ray exactly in a face belongs to the
// voxel above the face.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {

/// Returns std::floor(x) as an int, without a call of the C library. x must fit into an int.
inline int floorToInt(double x)
{
    const int truncated = int(x);
    return truncated - int(x < truncated);
}

/// A voxel of a leaf and how many faces of each axis the ray has crossed to it, in one number, so
/// that a step is one addition.
///
/// Bits 0 to 8 are the voxel's offset (VoxelTree::offset()). Bit 9 is set, so that a step to below
/// offset 0, which leaves the leaf, borrows from it. The three fields of 4 bits from bit 12 on
/// count the voxels from the leaf's face where the ray comes in along that axis: 8 is outside.
struct LeafPlace {
    static constexpr unsigned kOffset = 0x1ff, kBorrow = 0x200;
    static constexpr int kStride[3] = {64, 8, 1}; ///< of the offset
    static constexpr unsigned kFace[3] = {0x1000, 0x10000, 0x100000};
    static constexpr unsigned kLeft = 8 * (kFace[0] + kFace[1] + kFace[2]);
};

/// A ray, and what is worked out once of it for its way through cells of any size.
class MarchRay {
public:
    /// The ray from `origin` along `direction` (unit length), in the tree's coordinates, for t in
    /// [start, length]; `length` may be infinite. It is clipped to the tree's bounds.
    template <class Tree>
    MarchRay(const Tree& tree, const Vec3d& origin, const Vec3d& direction, double length,
             double start = 0)
    {
        const openvdb::CoordBBox& box = tree.bounds();
        t0 = start;
        t1 = length;
        for (int a = 0; a < 3; ++a) {
            o[a] = origin[a];
            d[a] = std::abs(direction[a]) < 1e-18 ? 0 : direction[a];
            inverse[a] = d[a] == 0 ? kFar : 1 / d[a];
            sign[a] = d[a] < 0 ? -1 : 1;
            upper[a] = d[a] < 0 ? 0 : 1;
            const double low = (box.min()[a] - o[a]) * inverse[a],
                         high = (box.max()[a] + 1.0 - o[a]) * inverse[a];
            t0 = std::max(t0, std::min(low, high));
            t1 = std::min(t1, std::max(low, high));
        }
        hits = !tree.empty() && t0 < t1;
        for (int set = 0; set < 8; ++set)
            for (int a = 0; a < 3; ++a)
                if (set >> a & 1)
                    step[set] += LeafPlace::kFace[a] + unsigned(sign[a] * LeafPlace::kStride[a]);
    }

    /// Returns the ray with the same direction from another origin, for t in [0, length], without
    /// clipping it: the whole of it must lie in the tree's bounds.
    MarchRay from(const Vec3d& origin, double length) const
    {
        MarchRay r = *this;
        for (int a = 0; a < 3; ++a) r.o[a] = origin[a];
        r.t0 = 0;
        r.t1 = length;
        return r;
    }

    /// The point at t.
    Vec3d at(double t) const { return {o[0] + d[0] * t, o[1] + d[1] * t, o[2] + d[2] * t}; }

    /// Stands for infinity, so that 0 times it is 0: the inverse of a direction of 0, and a length
    /// without end.
    static constexpr double kFar = 1e30;
    double o[3], d[3], inverse[3]; ///< origin, direction, 1 / direction
    double t0, t1;                 ///< where the ray enters the tree's bounds and leaves them
    int sign[3];                   ///< of the direction: 1 or -1
    int upper[3];                  ///< 1 if the ray leaves a cell through its upper face, or 0
    unsigned step[8] = {}; ///< what a LeafPlace gains when the ray crosses the faces of these axes
                           ///< (bit a: axis a)
    bool hits;             ///< the ray meets the tree's bounds
};

/// Steps from cell to cell along a ray. A cell is a cube of kDim^3 voxels (a power of 2).
template <int kDim>
struct CellWalk {
    double t;        ///< where the ray enters the cell
    double next[3];  ///< where it crosses the next face of each axis
    double delta[3]; ///< from one face of each axis to the next
    int cell[3];     ///< lowest voxel of the cell

    explicit CellWalk(const MarchRay& r)
    {
        for (int a = 0; a < 3; ++a) delta[a] = std::abs(r.inverse[a]) * kDim;
    }
    void start(const MarchRay& r, double t_start)
    {
        t = t_start;
        for (int a = 0; a < 3; ++a) place(r, a, floorToInt(r.o[a] + r.d[a] * t));
    }
    /// Starts at t = 0, in the cell that holds a voxel.
    void startAt(const MarchRay& r, const int* voxel)
    {
        t = 0;
        for (int a = 0; a < 3; ++a) place(r, a, voxel[a]);
    }
    /// Starts where the parent is, inside the parent's cell even if rounding says otherwise.
    template <int kParent>
    void startInside(const MarchRay& r, const CellWalk<kParent>& parent)
    {
        t = parent.t;
        for (int a = 0; a < 3; ++a) {
            const int voxel = floorToInt(r.o[a] + r.d[a] * t);
            place(r, a, std::min(std::max(voxel, parent.cell[a]), parent.cell[a] + kParent - 1));
        }
    }
    template <int kParent>
    bool inside(const CellWalk<kParent>& parent) const
    {
        return !(
            ((cell[0] ^ parent.cell[0]) | (cell[1] ^ parent.cell[1]) | (cell[2] ^ parent.cell[2]))
            & ~(kParent - 1));
    }
    double end() const { return std::min(next[0], std::min(next[1], next[2])); }
    void advance(const MarchRay& r)
    {
        const int a = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
        t = next[a];
        next[a] += delta[a];
        cell[a] += r.sign[a] * kDim;
    }

private:
    void place(const MarchRay& r, int a, int voxel)
    {
        cell[a] = voxel & ~(kDim - 1);
        next[a] = (cell[a] + r.upper[a] * kDim - r.o[a]) * r.inverse[a];
    }
};

/// A leaf on the ray. The ray is in it from t to t_end.
struct LeafSpan {
    int node, leaf;
    const int* cell; ///< lowest voxel of the leaf
    double t, t_end;
    const CellWalk<1>* start; ///< the walk at the first voxel
};

/// Calls f(const LeafSpan&) -> bool for the leaves along the ray in order, until it returns false.
template <class Tree, class F>
void forEachLeaf(const Tree& tree, const MarchRay& r, F&& f)
{
    if (!r.hits) return;
    CellWalk<kNodeDim> a(r);
    CellWalk<kLeafDim> b(r);
    CellWalk<1> c(r);
    for (a.start(r, r.t0); a.t < r.t1; a.advance(r)) {
        const int node = tree.node(a.cell[0], a.cell[1], a.cell[2]);
        if (node == VoxelTree::kEmpty) continue;
        const double end = std::min(a.end(), r.t1);
        for (b.startInside(r, a); b.t < end && b.inside(a); b.advance(r)) {
            const int leaf = tree.leafIn(node, b.cell[0], b.cell[1], b.cell[2]);
            if (leaf == VoxelTree::kEmpty) continue;
            c.startInside(r, b);
            if (!f(LeafSpan{node, leaf, b.cell, b.t, std::min(b.end(), end), &c})) return;
        }
    }
}

/// Returns the place of a walk's first voxel in its leaf.
inline unsigned leafPlace(const MarchRay& r, const CellWalk<1>& start)
{
    unsigned place = LeafPlace::kBorrow;
    for (int a = 0; a < 3; ++a) {
        const int at = start.cell[a] & (kLeafDim - 1);
        place += unsigned(at * LeafPlace::kStride[a])
            + LeafPlace::kFace[a] * unsigned(r.upper[a] ? at : kLeafDim - 1 - at);
    }
    return place;
}

/// Steps from voxel to voxel of a leaf, in plain C++. fast_walk-inl.h has the same in vectors.
struct PlainWalk {
    /// Calls f(voxel offset in the leaf, t, t_end) for the voxels of a leaf along the ray, empty
    /// ones too. t_end of the last voxel may lie behind the ray's t1.
    template <class F>
    static void forEachVoxel(const MarchRay& r, const CellWalk<1>& start, F&& f)
    {
        double next[3] = {start.next[0], start.next[1], start.next[2]}, t = start.t;
        unsigned place = leafPlace(r, start);
        do {
            const double end = std::min(next[0], std::min(next[1], next[2]));
            f(int(place & LeafPlace::kOffset), t, end);
            t = end;
            unsigned crossed = 0;
            for (int a = 0; a < 3; ++a)
                if (next[a] <= end) {
                    next[a] += start.delta[a];
                    crossed |= 1u << a;
                }
            place += r.step[crossed];
        } while (!(place & LeafPlace::kLeft));
    }
};
template <class F>
void forEachVoxel(const MarchRay& r, const CellWalk<1>& start, F&& f)
{
    PlainWalk::forEachVoxel(r, start, f);
}

/// A ray's way through a leaf: its voxels, and the times between them.
struct LeafWay {
    int voxels[32]; ///< offsets; a ray crosses at most 22
    double times[33];
    int count = 0;

    template <class Walk>
    LeafWay(const MarchRay& r, const CellWalk<1>& start, Walk) // NOLINT(*-member-init): written
                                                               // as far as they are used
    {
        times[0] = start.t;
        Walk::forEachVoxel(r, start, [this](int voxel, double, double end) {
            voxels[count] = voxel;
            times[++count] = end;
        });
    }
};

/// Returns the density's integral over the ray's way through one leaf, in density x voxels. `clip`
/// says that the ray may end in the leaf; `d_world` is as in lineIntegral(). `Walk` steps through
/// the voxels: PlainWalk or a FastWalk.
template <bool kDirected, class Walk = PlainWalk>
double leafIntegral(const VoxelTree& tree, const MarchRay& r, int leaf, const CellWalk<1>& start,
                    double t_end, bool clip, const Vec3d& d_world)
{
    const LeafDensities density = tree.densities(leaf);
    const bool directed = kDirected && tree.leaf(leaf).directed;
    double part = 0;
    if (tree.leaf(leaf).uniform) {
        part = double(density[0]) * (t_end - start.t);
        if (directed) part *= tree.directionFactor(leaf, 0, d_world);
    } else if (directed)
        Walk::forEachVoxel(r, start, [&](int voxel, double t, double end) {
            if (density[voxel] > 0)
                part += double(density[voxel]) * std::max(0.0, std::min(end, r.t1) - t)
                    * tree.directionFactor(leaf, voxel, d_world);
        });
    else if (clip)
        Walk::forEachVoxel(r, start, [&](int voxel, double t, double end) {
            part += double(density[voxel]) * std::max(0.0, std::min(end, r.t1) - t);
        });
    else
        Walk::forEachVoxel(r, start, [&](int voxel, double t, double end) {
            part += double(density[voxel]) * (end - t);
        });
    return part;
}

/// Returns the density's integral along the ray, with the box filter, in density x voxels. With
/// kDirected densities are multiplied by VoxelTree::directionFactor() for `d_world`, the ray's
/// direction in world axes. As soon as the integral exceeds `stop`, returns what it has.
template <bool kDirected, class Walk = PlainWalk>
double lineIntegral(const VoxelTree& tree, const MarchRay& r, const Vec3d& d_world, double stop)
{
    double sum = 0;
    forEachLeaf(tree, r, [&](const LeafSpan& span) {
        sum += leafIntegral<kDirected, Walk>(tree, r, span.leaf, *span.start, span.t_end,
                                             span.t_end >= r.t1, d_world);
        return sum < stop;
    });
    return sum;
}

/// Returns the same, to the ray's end, for a ray that MarchRay::from() made, begins in voxel `cell`
/// or on its faces, and crosses a few leaves at most.
template <bool kDirected, class Walk = PlainWalk>
double shortIntegral(const VoxelTree& tree, const MarchRay& r, const int* cell,
                     const Vec3d& d_world)
{
    double sum = 0;
    CellWalk<kLeafDim> leaves(r);
    CellWalk<1> voxels(r);
    for (leaves.startAt(r, cell); leaves.t < r.t1 - 1e-9; leaves.advance(r)) {
        const double end = std::min(leaves.end(), r.t1);
        if (end <= leaves.t + 1e-9) continue;
        const int leaf = tree.leafAt(leaves.cell[0], leaves.cell[1], leaves.cell[2]);
        if (leaf == VoxelTree::kEmpty) continue;
        voxels.startInside(r, leaves);
        sum += leafIntegral<kDirected, Walk>(tree, r, leaf, voxels, end, true, d_world);
    }
    return sum;
}

} // namespace volcomp
