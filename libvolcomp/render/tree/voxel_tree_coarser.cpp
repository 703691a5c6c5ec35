// SPDX-License-Identifier: Apache-2.0
// How a VoxelTree is made from one of half its voxels' width: one level of the voxel pyramid (MODEL
// section 8).
#include <algorithm>
#include <cmath>
#include <map>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/principal_direction.h"
#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {
namespace {

using openvdb::Coord;

// From the first of eight voxels (offset() in its leaf) to each, in the order of coarserVoxel().
constexpr int kSteps[8] = {0, 1, 8, 9, 64, 65, 72, 73};

// The octant of a leaf that holds a voxel, and where the eight voxels that this one stands for
// begin in the finer leaf.
int octantOf(int voxel) { return (voxel >> 8) << 2 | (voxel >> 5 & 1) << 1 | (voxel >> 2 & 1); }
int firstOf(int voxel)
{
    return VoxelTree::offset(2 * (voxel >> 6), 2 * (voxel >> 3 & 7), 2 * (voxel & 7));
}

// What one part adds to a coarser voxel.
struct PartSum {
    explicit PartSum(int p) : part(p) { }

    void add(const VoxelContent& c)
    {
        density += c.density;
        colour += c.density * c.colour;
        squares += c.own_share * c.density * c.density;
        if (!c.directed) return;
        // t tᵀ of the directions that the voxel stands for: one along, the square of the spread
        // across.
        const double s2 = spreadOf(c.spread_code) * spreadOf(c.spread_code),
                     w = c.density / (1 + 2 * s2);
        directions.add(w * (1 - s2), c.direction);
        around += w * s2;
    }
    Vec3f direction() const // as VolumePart::direction
    {
        SymmetricTensor t = directions;
        t.xx += around;
        t.yy += around;
        t.zz += around;
        return Vec3f(principalDirection(t).stored());
    }

    // As box_source.cpp's appendSum(): in a full coarser voxel are four times as many strands.
    float ownShare() const { return float(std::min(1.0, 2 * squares / (density * density))); }

    int part;
    double squares = 0;             // own share times density^2
    double density = 0, around = 0; // `around` is the same in all directions
    SymmetricTensor directions;
    Vec3d colour{0.0}; // times density
};

} // namespace

class VoxelTree::Coarsener {
public:
    Coarsener(VoxelTree& tree, const VoxelTree& fine, double tau)
        : m_tree(tree), m_fine(fine), m_extinction(tau * fine.m_voxel)
    {
    }

    void run()
    {
        m_tree.m_voxel = 2 * m_fine.m_voxel;
        m_tree.m_origin = m_fine.m_origin;
        m_tree.m_rotation = m_fine.m_rotation;
        m_tree.m_parts = m_fine.m_parts;
        addPlaces();
        m_tree.m_leaves.resize(m_leaves.size());
        constexpr std::size_t kBatch = 4096; // leaves that wait to be put behind the others
        std::vector<Filled> filled;
        for (std::size_t start = 0; start < m_leaves.size(); start += kBatch) {
            filled.assign(std::min(kBatch, m_leaves.size() - start), {});
            tbb::parallel_for(tbb::blocked_range<std::size_t>(0, filled.size(), 32),
                              [&](const auto& range) {
                                  for (std::size_t i = range.begin(); i < range.end(); ++i)
                                      filled[i] = fillLeaf(start + i);
                              });
            for (std::size_t i = 0; i < filled.size(); ++i) append(start + i, filled[i]);
        }
        m_tree.finish(m_uses);
    }

private:
    using Octants = std::array<int, 8>; // leaves of the finer tree, 4 x + 2 y + z
    struct Entry {                      // one part in one voxel, before it is packed
        int voxel, part;
        float density, own_share;
        Vec3f direction, colour;
    };
    struct Filled { // what a leaf adds to the tables; its lists are counted from its first entry
        std::vector<VoxelRecord> records;
        std::vector<float> density;
        std::vector<ScatterRatio> scatter_ratio;
        std::vector<ListedRecord> shared;
    };
    struct LeafSums {
        std::array<float, kLeafSize> density;
        std::array<ScatterRatio, kLeafSize> ratios;
    };

    // Leaf after leaf in the order of their places. If eight places have the same leaf, which only
    // tiles have, so has the coarser place.
    void addPlaces()
    {
        std::vector<Coord> places, nodes;
        m_fine.forEachCell([&](const Coord& o, int) {
            places.emplace_back((o[0] >> 1) & ~7, (o[1] >> 1) & ~7, (o[2] >> 1) & ~7);
        });
        sortAndKeepOneOfEach(places);
        for (const Coord& place : places) nodes.push_back(place & ~(kNodeDim - 1));
        sortAndKeepOneOfEach(nodes);
        m_tree.m_places = NodeTable(nodes.size());
        for (const Coord& node : nodes) m_tree.m_places.insert(node, m_tree.m_places.addTable());
        std::map<int, int> tiles;
        for (const Coord& place : places) {
            Octants octants;
            for (int k = 0; k < 8; ++k)
                octants[k] =
                    m_fine.leafAt(2 * place[0] + 8 * (k >> 2), 2 * place[1] + 8 * (k >> 1 & 1),
                                  2 * place[2] + 8 * (k & 1));
            int leaf = int(m_leaves.size());
            if (isTile(octants)) leaf = tiles.emplace(octants[0], leaf).first->second;
            if (leaf == int(m_leaves.size())) {
                m_leaves.push_back(octants);
                m_uses.push_back(0);
            }
            ++m_uses[leaf];
            m_tree.m_places.setLeaf(place, leaf);
            m_tree.m_bounds.expand(openvdb::CoordBBox(place, place.offsetBy(kLeafDim - 1)));
        }
    }

    static void sortAndKeepOneOfEach(std::vector<Coord>& coords)
    {
        std::sort(coords.begin(), coords.end());
        coords.erase(std::unique(coords.begin(), coords.end()), coords.end());
    }
    static bool isTile(const Octants& octants)
    {
        return std::all_of(octants.begin(), octants.end(),
                           [&](int leaf) { return leaf == octants[0]; });
    }

    Filled fillLeaf(std::size_t index)
    {
        Leaf& leaf = m_tree.m_leaves[index];
        const Octants& octants = m_leaves[index];
        leaf.uniform = isTile(octants);
        leaf.colour_scale = 0;
        LeafSums coarse;
        for (int octant = 0; octant < 8; ++octant)
            if (octants[octant] != kEmpty) fillOctant(index, octant, coarse);
        leaf.countBefore();
        Filled filled;
        std::vector<Entry> entries;
        std::vector<PartSum> sums;
        for (int n = 0; n < (leaf.uniform ? 1 : kLeafSize); ++n) {
            if (!leaf.holds(n)) continue;
            filled.density.push_back(coarse.density[n]);
            filled.scatter_ratio.push_back(coarse.ratios[n]);
            const double total = sumParts(octants[octantOf(n)], firstOf(n), sums);
            addEntries(n, coarse.density[n], total, sums, leaf, entries);
        }
        packEntries(entries, leaf, filled);
        return filled;
    }

    // Densities, mask and scatter ratios of a leaf's octant, from the leaf of the finer tree there.
    void fillOctant(std::size_t index, int octant, LeafSums& coarse)
    {
        const int child = m_leaves[index][octant];
        const VoxelMask& mask = m_fine.m_leaves[child].mask;
        Leaf& leaf = m_tree.m_leaves[index];
        const int corner = offset((octant >> 2) * 4, (octant >> 1 & 1) * 4, (octant & 1) * 4);
        for (int x = 0; x < 4; ++x) {
            // A bit for each coarser voxel, at the first of those that it stands for.
            std::uint64_t any = mask[2 * x] | mask[2 * x + 1];
            any |= any >> 8;
            any = (any | any >> 1) & 0x0055005500550055;
            for (; any; any &= any - 1) {
                const int at = __builtin_ctzll(any),
                          n = corner + (x << 6 | (at >> 4) << 3 | (at & 7) >> 1);
                const CoarserVoxel v = coarserOf(child, 2 * x << 6 | at);
                if (!(float(v.density) > 0)) continue;
                coarse.density[n] = float(v.density);
                coarse.ratios[n] = v.scatter_ratio;
                leaf.mask[n >> 6] |= std::uint64_t(1) << (n & 63);
            }
        }
    }

    // The voxel for the eight of a leaf that begin at `first`.
    CoarserVoxel coarserOf(int child, int first) const
    {
        const LeafDensities finer = m_fine.densities(child);
        EightVoxels eight;
        double sum = 0, squares = 0;
        for (int k = 0; k < 8; ++k) {
            const int voxel = first + kSteps[k];
            const double density = eight.densities[k] = finer[voxel];
            if (!(density > 0)) continue;
            eight.scatter_ratios[k] = m_fine.scatterRatio(child, voxel);
            double own = 0;
            m_fine.contents(child, voxel, [&](const VoxelContent& c) {
                own += c.own_share * c.density * c.density / (density * density);
            });
            eight.own_shares[k] = own;
            sum += density;
            squares += own * density * density;
        }
        const double own = sum > 0 ? std::min(1.0, 2 * squares / (sum * sum)) : 0;
        return coarserVoxel(eight, own, m_extinction);
    }

    // What each part has in the eight voxels of a leaf that begin at `first`. Returns the sum of
    // their densities.
    double sumParts(int child, int first, std::vector<PartSum>& sums) const
    {
        const Leaf& from = m_fine.m_leaves[child];
        double total = 0;
        sums.clear();
        for (const int step : kSteps) {
            const int voxel = first + step;
            if (!from.holds(voxel)) continue;
            m_fine.contents(child, voxel, [&](const VoxelContent& c) {
                auto sum = std::find_if(sums.begin(), sums.end(),
                                        [&](const PartSum& s) { return s.part == c.part; });
                if (sum == sums.end()) sum = sums.insert(sum, PartSum(c.part));
                sum->add(c);
                total += c.density;
            });
        }
        return total;
    }

    // Shares a voxel's density out to its parts, as they share `total`.
    static void addEntries(int voxel, float density, double total, const std::vector<PartSum>& sums,
                           Leaf& leaf, std::vector<Entry>& entries)
    {
        for (const PartSum& s : sums) {
            const Vec3d colour = s.colour / s.density;
            entries.push_back({voxel, s.part, float(density * s.density / total), s.ownShare(),
                               s.direction(), Vec3f(colour)});
            leaf.colour_scale =
                std::max(leaf.colour_scale, float(std::max({colour[0], colour[1], colour[2]})));
        }
    }

    void packEntries(const std::vector<Entry>& entries, Leaf& leaf, Filled& to) const
    {
        const bool lists_only = m_tree.m_parts.size() > VoxelRecord::kMostParts;
        for (std::size_t first = 0, end; first < entries.size(); first = end) {
            for (end = first + 1; end < entries.size(); ++end)
                if (entries[end].voxel != entries[first].voxel) break;
            const bool list = lists_only || end - first > 1;
            if (list)
                to.records.push_back(
                    VoxelRecord::list(std::uint32_t(to.shared.size()), std::uint32_t(end - first)));
            for (std::size_t i = first; i < end; ++i) {
                const Entry& e = entries[i];
                const VoxelRecord record(e.direction, e.colour, leaf.colour_scale, e.part,
                                         e.own_share);
                leaf.directed |= record.directed();
                if (list) to.shared.push_back({record, e.density, e.part});
                else to.records.push_back(record);
            }
        }
    }

    void append(std::size_t index, const Filled& filled)
    {
        m_tree.m_leaves[index].first = std::uint32_t(m_tree.m_records.size());
        const auto lists_before = std::uint32_t(m_tree.m_listed.size());
        for (const VoxelRecord record : filled.records)
            m_tree.m_records.push_back(record.isList() ? VoxelRecord::list(
                                           record.listStart() + lists_before, record.listCount())
                                                       : record);
        m_tree.m_density.insert(m_tree.m_density.end(), filled.density.begin(),
                                filled.density.end());
        m_tree.m_scatter_ratio.insert(m_tree.m_scatter_ratio.end(), filled.scatter_ratio.begin(),
                                      filled.scatter_ratio.end());
        m_tree.m_listed.insert(m_tree.m_listed.end(), filled.shared.begin(), filled.shared.end());
    }

    VoxelTree& m_tree;
    const VoxelTree& m_fine;
    const double m_extinction; // optical depth of density 1 over a finer voxel
    std::vector<Octants> m_leaves;
    std::vector<std::uint64_t> m_uses; // by leaf: the places that have it
};

VoxelTree VoxelTree::coarser(const VoxelTree& fine, double tau)
{
    VoxelTree tree;
    Coarsener(tree, fine, tau).run();
    return tree;
}

} // namespace volcomp
