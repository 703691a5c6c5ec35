// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/voxel_tree_io.h"

#include <algorithm>
#include <new>
#include <vector>

#include "volcomp/base/error.h"
#include "volcomp/volume/file_source.h"

namespace volcomp {
namespace {

using openvdb::Coord;

struct Place {
    Coord origin;
    int leaf;
};

std::vector<Place> placesInTreeOrder(const VoxelTree& tree)
{
    std::vector<Place> places;
    tree.forEachCell([&](const Coord& origin, int leaf) { places.push_back({origin, leaf}); });
    std::sort(places.begin(), places.end(),
              [](const Place& a, const Place& b) { return inTreeOrder(a.origin, b.origin); });
    return places;
}

// One part's voxel of a block.
struct PackedVoxel {
    int n; // VoxelTree::offset()
    float density;
    openvdb::math::half own_share;
    Half3 direction, colour, scatter_ratio;
};

using Wanted = std::function<bool(const Coord& voxel)>;

// The voxels of a leaf that are wanted, by part; adds to lists that are empty.
void addVoxels(const VoxelTree& tree, const Place& place, const Wanted& wanted,
               std::vector<std::vector<PackedVoxel>>& by_part)
{
    const int leaf = place.leaf;
    for (int n = 0; n < kLeafSize; ++n) {
        if (!tree.leaf(leaf).holds(n)) continue;
        if (wanted && !wanted(place.origin + voxelInLeaf(n))) continue;
        const ScatterRatio s = tree.scatterRatio(leaf, n);
        tree.contents(leaf, n, [&](const VoxelContent& c) {
            const Vec3d direction =
                c.directed ? c.direction * (1 - spreadOf(c.spread_code)) : Vec3d(0.0);
            by_part[c.part].push_back({n, c.density, openvdb::math::half(float(c.own_share)),
                                       toHalves(Vec3f(direction)), toHalves(Vec3f(c.colour)),
                                       toHalves(Vec3f(s[0], s[1], s[2]))});
        });
    }
}

void addBlock(PackedPart& part, const Coord& origin, const std::vector<PackedVoxel>& voxels)
{
    PackedBlock block{origin, std::uint32_t(voxels.size()), {}, nullptr};
    block.values = part.stores[0].allocate(block.count * part.voxelBytes());
    for (std::size_t i = 0; i < voxels.size(); ++i) {
        const PackedVoxel& v = voxels[i];
        block.mask[v.n >> 6] |= std::uint64_t(1) << (v.n & 63);
        part.density(block)[i] = v.density;
        part.direction(block)[i] = v.direction;
        part.colour(block)[i] = v.colour;
        part.scatterRatio(block)[i] = v.scatter_ratio;
        part.ownShare(block)[i] = v.own_share;
    }
    part.blocks.push_back(block);
}

} // namespace

VoxelTree readVoxelTree(const std::filesystem::path& file, const Progress& progress,
                        const std::string& grid)
{
    const FileSource source(file, grid);
    try {
        return VoxelTree(source, progress);
    } catch (const std::bad_alloc&) {
        throw;
    } catch (const std::exception& e) {
        throw Error(file.string() + ": " + e.what());
    }
}

PackedVolume packedVolume(const VoxelTree& tree, const Wanted& wanted)
{
    PackedVolume volume;
    volume.transform = openvdb::math::Transform::createLinearTransform(tree.voxelSize());
    volume.transform->postTranslate(tree.origin() + Vec3d(tree.voxelSize() / 2));
    for (const VoxelTree::Part& p : tree.parts()) {
        PackedPart& part = volume.parts.emplace_back();
        part.material = p.material;
        part.kind = p.kind;
        part.has_direction = part.has_colour = part.has_scatter_ratio = part.has_own_share = true;
        part.stores.emplace_back();
    }
    std::vector<std::vector<PackedVoxel>> voxels(tree.parts().size());
    for (const Place& place : placesInTreeOrder(tree)) {
        addVoxels(tree, place, wanted, voxels);
        for (std::size_t p = 0; p < voxels.size(); ++p) {
            if (!voxels[p].empty()) addBlock(volume.parts[p], place.origin, voxels[p]);
            voxels[p].clear();
        }
    }
    return volume;
}

} // namespace volcomp
