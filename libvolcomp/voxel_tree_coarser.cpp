// One level of the voxel pyramid (MODEL section 8).
#include <algorithm>
#include <cmath>
#include <map>

#include <tbb/parallel_for.h>

#include "eigen3.h"
#include "voxel_tree.h"

namespace volcomp {

double coarserDensity(const double* densities, double extinction)
{
    double mean = 0, axes = 0;
    for (int k = 0; k < 8; ++k) mean += densities[k] / 8;
    if (!(extinction > 0) || !(mean > 0)) return mean;
    for (int axis = 0; axis < 3; ++axis) {
        const int along = 4 >> axis, across = axis == 0 ? 2 : 4, other = axis == 2 ? 2 : 1;
        double columns[4];
        for (int k = 0; k < 4; ++k) {
            const int first = (k & 1) * across + (k >> 1) * other;
            columns[k] = extinction * (densities[first] + densities[first + along]);
        }
        const double least = *std::min_element(columns, columns + 4);
        double sum = 0; // log-sum-exp: a column's depth may exceed 700
        for (const double depth : columns) sum += std::expm1(least - depth) / 4;
        axes += (least - std::log1p(sum)) / (2 * extinction);
    }
    return axes / 3;
}

VoxelTree VoxelTree::coarser(const VoxelTree& fine, double tau)
{
    VoxelTree t;
    t.m_voxel = 2 * fine.m_voxel;
    t.m_origin = fine.m_origin;
    t.m_rotation = fine.m_rotation;
    t.m_parts = fine.m_parts;
    t.m_is_fibre = fine.m_is_fibre;
    t.m_factor_a = fine.m_factor_a;
    t.m_factor_b = fine.m_factor_b;
    const double extinction = tau * fine.m_voxel;

    using openvdb::Coord;
    std::vector<Coord> origins;
    fine.forEachCell([&](const Coord& o, int) { origins.emplace_back((o[0] >> 1) & ~7, (o[1] >> 1) & ~7, (o[2] >> 1) & ~7); });
    std::sort(origins.begin(), origins.end());
    origins.erase(std::unique(origins.begin(), origins.end()), origins.end());

    // Places; where eight places have the same tile, so has the coarser one.
    std::map<Coord, int> blocks;
    std::map<int, int> tiles;
    std::vector<std::array<int, 8>> sources; // leaves of `fine`
    for (const Coord& o : origins) {
        std::array<int, 8> leaves;
        bool same = true;
        for (int k = 0; k < 8; ++k) {
            leaves[k] = fine.leafAt(2 * o[0] + 8 * (k >> 2), 2 * o[1] + 8 * (k >> 1 & 1), 2 * o[2] + 8 * (k & 1));
            same &= leaves[k] == leaves[0];
        }
        int leaf = int(sources.size());
        if (same) { // eight places share a leaf only if it is a tile
            const auto [at, fresh] = tiles.emplace(leaves[0], leaf);
            leaf = at->second;
            if (fresh) sources.push_back(leaves);
        } else sources.push_back(leaves);
        const auto [block, fresh] = blocks.emplace(Coord(o[0] >> 7, o[1] >> 7, o[2] >> 7), int(blocks.size()));
        if (fresh) t.m_children.resize(t.m_children.size() + 4096, kEmpty);
        t.m_children[std::size_t(block->second) * 4096 + ((o[0] >> 3 & 15) << 8 | (o[1] >> 3 & 15) << 4 | (o[2] >> 3 & 15))] = leaf;
        t.m_bounds.expand(openvdb::CoordBBox(o, o.offsetBy(kLeafDim - 1)));
        t.m_voxels += same ? 512 : 0;
    }
    std::size_t size = 16;
    while (size < 2 * blocks.size()) size *= 2;
    t.m_slots.resize(size);
    t.m_slot_mask = size - 1;
    for (const auto& [b, number] : blocks) {
        const std::uint64_t key = blockKey(b[0], b[1], b[2]);
        std::size_t slot = hash(key);
        while (t.m_slots[slot & t.m_slot_mask].block != kEmpty) ++slot;
        t.m_slots[slot & t.m_slot_mask] = {key, number};
    }

    struct Filled { // what a leaf adds to the tables; list entries are counted from the leaf's first
        std::vector<std::uint64_t> records;
        std::vector<Shared> shared;
    };
    std::vector<Filled> filled(sources.size());
    t.m_leaves.resize(sources.size());
    t.m_density.resize(sources.size() * 512);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, sources.size(), 32), [&](const auto& range) {
        struct Sum {
            explicit Sum(int p) : part(p) { }
            int part;
            double density = 0;
            SymmetricTensor directions;
            Vec3d colour{0.0};
        };
        struct Entry {
            int voxel, part;
            float density;
            Vec3f direction, colour;
        };
        std::vector<Sum> sums;
        std::vector<Entry> entries;
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            Leaf& leaf = t.m_leaves[i];
            const std::array<int, 8>& leaves = sources[i];
            leaf.uniform = std::all_of(leaves.begin(), leaves.end(), [&](int l) { return l == leaves[0]; });
            leaf.colour_scale = 0;
            entries.clear();
            for (int n = 0; n < 512; ++n) {
                double densities[8];
                int child[8], voxel[8];
                bool any = false;
                for (int k = 0; k < 8; ++k) {
                    const int x = 2 * (n >> 6) + (k >> 2), y = 2 * (n >> 3 & 7) + (k >> 1 & 1), z = 2 * (n & 7) + (k & 1);
                    child[k] = leaves[(x >> 3) << 2 | (y >> 3) << 1 | z >> 3];
                    voxel[k] = offset(x, y, z);
                    densities[k] = child[k] == kEmpty ? 0 : fine.densities(child[k])[voxel[k]];
                    any |= densities[k] > 0;
                }
                if (!any) continue;
                const float density = float(coarserDensity(densities, extinction));
                if (!(density > 0)) continue;
                t.m_density[i * 512 + n] = density;
                leaf.mask[n >> 6] |= std::uint64_t(1) << (n & 63);
                if (leaf.uniform && n > 0) continue;
                sums.clear();
                double total = 0;
                for (int k = 0; k < 8; ++k) {
                    if (!(densities[k] > 0)) continue;
                    fine.contents(child[k], voxel[k], [&](const VoxelContent& c) {
                        auto sum = std::find_if(sums.begin(), sums.end(), [&](const Sum& s) { return s.part == c.part; });
                        if (sum == sums.end()) sum = sums.insert(sum, Sum(c.part));
                        sum->density += c.density;
                        sum->colour += c.density * c.colour;
                        total += c.density;
                        if (!c.directed) return;
                        // t tᵀ of the directions that the voxel stands for: one along, the square of the spread across.
                        const double s2 = spreadOf(c.spread_code) * spreadOf(c.spread_code), w = c.density / (1 + 2 * s2);
                        sum->directions.add(w * (1 - s2), c.direction);
                        for (const Vec3d& e : {Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1)}) sum->directions.add(w * s2, e);
                    });
                }
                for (const Sum& s : sums) {
                    const Vec3d direction = principalDirection(s.directions).stored(), colour = s.colour / s.density;
                    entries.push_back({n, s.part, float(density * s.density / total), Vec3f(direction), Vec3f(colour)});
                    leaf.colour_scale = std::max(leaf.colour_scale, float(std::max({colour[0], colour[1], colour[2]})));
                }
            }
            for (int w = 1; w < 8; ++w) leaf.before[w] = std::uint16_t(leaf.before[w - 1] + __builtin_popcountll(leaf.mask[w - 1]));
            Filled& out = filled[i];
            for (std::size_t e = 0; e < entries.size();) {
                std::size_t end = e + 1;
                while (end < entries.size() && entries[end].voxel == entries[e].voxel) ++end;
                for (std::size_t k = e; k < end; ++k) {
                    const std::uint64_t record = pack(entries[k].direction, entries[k].colour, leaf.colour_scale, entries[k].part);
                    leaf.directed_fibres |= t.m_is_fibre[entries[k].part] && int(record >> 24 & 63) != kSpreadCodes;
                    if (end - e == 1 && t.m_parts.size() <= kMostParts) out.records.push_back(record);
                    else out.shared.push_back({record, entries[k].density, entries[k].part});
                }
                if (end - e > 1 || t.m_parts.size() > kMostParts)
                    out.records.push_back(kShared << 60 | std::uint64_t(end - e) << 32 | (out.shared.size() - (end - e)));
                e = end;
            }
        }
    });
    for (std::size_t i = 0; i < filled.size(); ++i) {
        t.m_leaves[i].first = std::uint32_t(t.m_records.size());
        for (const std::uint64_t record : filled[i].records)
            t.m_records.push_back(record >> 60 == kShared ? record + t.m_shared.size() : record);
        t.m_shared.insert(t.m_shared.end(), filled[i].shared.begin(), filled[i].shared.end());
        const Leaf& l = t.m_leaves[i];
        t.m_voxels += l.uniform ? 0 : l.before[7] + __builtin_popcountll(l.mask[7]);
        t.m_directed_fibres |= l.directed_fibres;
        filled[i] = {};
    }
    for (const float density : t.m_density) t.m_max_density = std::max(t.m_max_density, density);
    return t;
}

} // namespace volcomp
