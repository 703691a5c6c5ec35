// SPDX-License-Identifier: Apache-2.0
// How ShadowSweep's light is pushed through the volume; shadow_sweep.cpp alone uses it.
#pragma once

#include <memory>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <tbb/enumerable_thread_specific.h>

#include "volcomp/render/shadow/ray_bundle.h"
#include "volcomp/render/shadow/shadow_sweep.h"

namespace volcomp {

/// Fills one field: finds what is asked for (shadow_sweeper.cpp), then, layer by layer, keeps it
/// and pushes the light on (shadow_sweeper_push.cpp). All references must outlive this.
class ShadowSweep::Sweeper {
public:
    Sweeper(const ShadowSweep& sweep, Field& field, const Light& light,
            const std::vector<float>& seen)
        : m_sweep(sweep), m_tree(sweep.m_tree), m_field(field), m_lattice(field.lattice),
          m_light(light), m_seen(seen)
    {
    }

    /// Finds what is asked for. Returns false, with nothing in the field, if no leaf asks for its
    /// light. Otherwise the field is filled by pass() for one layer after another.
    bool begin();
    int layers() const { return int(m_field.planes.size()); }
    /// Of a tree that is made on the way: whether light comes to nodes that begin at this layer.
    bool waitsForNodes(int layer) const;
    /// Makes the tiles of these nodes that bundles pass, and lists their leaves. All nodes of the
    /// layers before are done with then, so that their tiles may be let go of before that.
    void makeWay(int layer);
    /// Keeps what is asked for of the light that comes to a layer, and pushes it on.
    void pass(int layer);

private:
    /// A leaf at its place.
    struct Cell {
        int leaf, b, c;    ///< b and c: of its lowest voxel; leaf: kEmpty if it is not made yet
        float seen;        ///< its greatest weight in a pixel
        Rectangle bundles; ///< whose rays pass it, or between whose rays its points lie
        bool asks = false; ///< for light
        bool far = false;  ///< its densities are those of the coarser voxels beyond
    };
    struct Bundle {
        std::unique_ptr<RaySums> sums; ///< null before the first particle and in the dark
        int pushed_layer = -1;         ///< the last that it was pushed through
        bool dark = false;             ///< every ray has met more than the darkest depth
        float least = 0;               ///< of the sums
    };
    struct BundleAt {
        int b, c;
    };
    /// Leaves under a bundle in one layer: lowest leaf and count, along b and c.
    struct LeafRange {
        int low[2], count[2];
    };
    /// A patch that is to be written.
    struct Patch {
        BundleAt bundle;
        PatchPlace* at; ///< in Field::patches
        bool fine;
    };
    /// A thread's copy of the densities under a bundle.
    using StripBuffer = std::vector<float>;

    static int floorDivide(int x, int y) { return x >= 0 ? x / y : -((y - 1 - x) / y); }
    double planeAt(int plane) const { return m_field.first_s + double(kLeafDim) * plane; }

    void sortLeaves();
    void findWay();
    void addNodesToLight(const openvdb::Coord& node, std::set<openvdb::Coord>& nearby,
                         std::set<openvdb::Coord>& nodes) const;
    void makeTiles(const openvdb::Coord& node, int layer) const;
    std::vector<openvdb::Coord> farLeaves(const openvdb::Coord& node, int first_layer) const;
    template <class F>
    void forAskedTiles(const openvdb::Coord& node, int first_layer, const F& f) const;
    bool isFar(const openvdb::Coord& voxel) const;
    openvdb::Coord beyondOf(const openvdb::Coord& voxel) const;
    bool anyLeafBeyond(const openvdb::Coord& tile) const;
    bool anyBeyond(const openvdb::Coord& leaf) const;
    void takeBeyond(const openvdb::Coord& leaf, const Vec3d& to_light, float* to) const;
    openvdb::Coord originOf(const Cell& cell, int layer) const;
    int firstLayerOf(const openvdb::Coord& node) const;
    void addCell(const openvdb::Coord& origin, int leaf, float seen, bool far = false);
    bool asksForLight(const Cell& cell, int layer) const;
    bool mayBeInCone(const Vec3d& from_light) const;
    void setSpacing();
    /// The bundles of the rays that pass a cube of so many voxels whose lowest is b, c, behind the
    /// plane of a layer, or between whose rays its points lie.
    Rectangle bundlesThrough(int b, int c, int width, int layer) const;
    void visitCells();
    void markNeeded();

    void keep(int layer);
    std::vector<Patch> patchesToWrite(int layer);
    void write(const Patch& patch);

    void push(int layer);
    std::vector<BundleAt> bundlesToPush(int layer, std::vector<Cell>& directed_cells);
    void makeEffective(const Cell& cell, int layer, float* to) const;
    RayBundle raysAt(const BundleAt& at, double s) const;
    LeafRange leavesUnder(const BundleAt& at, double s, double end) const;
    void pushBundle(const BundleAt& at, int layer, double s, double end);
    bool fill(int layer, const LeafRange& range, float* strip) const;

    const ShadowSweep& m_sweep;
    const VoxelTree& m_tree;
    Field& m_field;
    LightLattice m_lattice;
    const Light& m_light;
    const std::vector<float>& m_seen;       ///< by VoxelTree::place()
    std::vector<std::vector<Cell>> m_cells; ///< by layer, in the order in which the light comes
    /// With a tree that is made on the way: the nodes that light passes, and the first layer of
    /// each, in the order of these.
    std::vector<std::pair<int, openvdb::Coord>> m_way;
    std::size_t m_next_of_way = 0;
    int m_beyond_shift = 0;                  ///< voxels beyond are 2^this times as wide
    std::unordered_set<std::uint64_t> m_far; ///< nodes of the way, by NodeTable::keyOf()
    /// By place in the layer, b and c in leaves: the number in m_effective of a far leaf.
    std::unordered_map<std::uint64_t, int> m_far_leaves;
    Rectangle m_all;              ///< bundles that are asked for on some plane
    std::vector<int> m_last;      ///< by bundle: the last plane that asks for it
    std::vector<float> m_weights; ///< by patch: the greatest `seen` of the leaves behind it
    std::vector<Bundle> m_bundles;
    /// Densities of the layer's leaves under directed extinction: by leaf the number of its 512
    /// floats in m_effective, or -1.
    std::vector<int> m_effective_of;
    std::vector<float> m_effective;
    tbb::enumerable_thread_specific<StripBuffer> m_strips{
        StripBuffer(Strip::kSize + 2 * Strip::kMargin)};
};

} // namespace volcomp
