// One level of the voxel pyramid (MODEL section 8).
#include <algorithm>
#include <cmath>
#include <map>

#include <tbb/parallel_for.h>

#include "volcomp/base/principal_direction.h"
#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {

namespace {

// -ln of the mean transmittance of the columns along an axis, where it is too little for 1 -
// opacity: log-sum-exp, as a column's depth may exceed 700.
double darkDepth(const double* depths, int axis)
{
    const int along = 4 >> axis;
    double columns[4];
    int count = 0;
    for (int k = 0; k < 8; ++k)
        if (!(k & along)) columns[count++] = depths[k] + depths[k | along];
    const double least = *std::min_element(columns, columns + 4);
    double sum = 0;
    for (const double depth : columns) sum += std::expm1(least - depth) / 4;
    return least - std::log1p(sum);
}

// Single scattering in a homogeneous cube of depth d and opacity 1 - e^-d across, for a beam
// through the whole of it: seen from the light, across it, against it.
VoxelTree::ScatterRatio homogeneous(double d, double opacity)
{
    return {float(opacity * (2 - opacity) / 2), float(opacity * opacity / d),
            float(d * (1 - opacity))};
}

} // namespace

CoarserVoxel coarserVoxel(const double* densities, const VoxelTree::ScatterRatio* scatter_ratio,
                          double extinction)
{
    double mean = 0;
    for (int k = 0; k < 8; ++k) mean += densities[k] / 8;
    if (!(extinction > 0) || !(mean > 0)) return {mean, {1, 1, 1}};
    double depths[8], opacity[8], pairs[3] = {0, 0, 0}, sum = 0;
    for (int k = 0; k < 8; ++k) {
        depths[k] = extinction * densities[k];
        opacity[k] = depths[k] > 0 ? -std::expm1(-depths[k]) : 0;
        sum += opacity[k];
    }
    for (int k = 0; k < 8; ++k)
        for (int axis = 0; axis < 3; ++axis)
            if (!(k & 4 >> axis)) pairs[axis] += opacity[k] * opacity[k | 4 >> axis];
    double closed[3], total = 0; // opacity along each axis
    for (int axis = 0; axis < 3; ++axis) closed[axis] = (sum - pairs[axis]) / 4;
    if (std::max({closed[0], closed[1], closed[2]}) < 0.999)
        total =
            -std::log1p(-(closed[0] + (1 - closed[0]) * (closed[1] + (1 - closed[1]) * closed[2])));
    else
        for (int axis = 0; axis < 3; ++axis) total += darkDepth(depths, axis);
    CoarserVoxel v{total / (6 * extinction), {1, 1, 1}};

    // A beam into each face, light by axes: what the voxels add, behind and beside each other.
    double fine[3] = {0, 0, 0};
    for (int k = 0; k < 8; ++k) {
        if (!(opacity[k] > 0)) continue;
        double passes[3], squares = 0, both = 0; // through the neighbour along each axis
        for (int axis = 0; axis < 3; ++axis) {
            passes[axis] = 1 - opacity[k ^ 4 >> axis];
            both += passes[axis];
            squares += passes[axis] * passes[axis];
        }
        const VoxelTree::ScatterRatio own = homogeneous(depths[k], opacity[k]);
        const double a = 1 + passes[0], b = 1 + passes[1], c = 1 + passes[2];
        fine[0] += double(scatter_ratio[k][0]) * own[0] * (3 + squares) / 24;
        fine[1] += double(scatter_ratio[k][1]) * own[1] * (a * b + a * c + b * c) / 48;
        fine[2] += double(scatter_ratio[k][2]) * own[2] * both / 12;
    }
    const VoxelTree::ScatterRatio even = homogeneous(total / 3, -std::expm1(-total / 3));
    for (int i = 0; i < 3; ++i)
        if (even[i] > 1e-6f * float(sum)) v.scatter_ratio[i] = float(fine[i] / double(even[i]));
    return v;
}

namespace {

constexpr int kSteps[8] = {
    0, 1, 8, 9, 64, 65, 72, 73}; // from a voxel's first part to all, in the order of coarserVoxel()

} // namespace

// One leaf into the octant (4 x + 2 y + z) of a coarser one: densities, mask, and what they show.
void VoxelTree::coarsenLeaf(const VoxelTree& fine, int child, int octant, double extinction,
                            float* density, Leaf& leaf,
                            std::array<ScatterRatio, 512>& scatter_ratio)
{
    const Leaf& from = fine.m_leaves[child];
    const float* finer = fine.densities(child);
    const int corner = offset((octant >> 2) * 4, (octant >> 1 & 1) * 4, (octant & 1) * 4);
    std::array<ScatterRatio, 8> own;
    own.fill({1, 1, 1});
    for (int x = 0; x < 4; ++x) {
        std::uint64_t any = from.mask[2 * x] | from.mask[2 * x + 1];
        any |= any >> 8;
        any = (any | any >> 1) & 0x0055005500550055;
        for (; any; any &= any - 1) {
            const int at = __builtin_ctzll(any), first = 2 * x << 6 | at,
                      n = corner + (x << 6 | (at >> 4) << 3 | (at & 7) >> 1);
            double densities[8];
            for (int k = 0; k < 8; ++k) {
                densities[k] = finer[first + kSteps[k]];
                if (!fine.m_scatter_ratio.empty() && densities[k] > 0)
                    own[k] = fine.m_scatter_ratio[fine.recordIndex(from, first + kSteps[k])];
            }
            const CoarserVoxel v = coarserVoxel(densities, own.data(), extinction);
            if (!(float(v.density) > 0)) continue;
            density[n] = float(v.density);
            scatter_ratio[n] = v.scatter_ratio;
            leaf.mask[n >> 6] |= std::uint64_t(1) << (n & 63);
        }
    }
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
    fine.forEachCell([&](const Coord& o, int) {
        origins.emplace_back((o[0] >> 1) & ~7, (o[1] >> 1) & ~7, (o[2] >> 1) & ~7);
    });
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
            leaves[k] = fine.leafAt(2 * o[0] + 8 * (k >> 2), 2 * o[1] + 8 * (k >> 1 & 1),
                                    2 * o[2] + 8 * (k & 1));
            same &= leaves[k] == leaves[0];
        }
        int leaf = int(sources.size());
        if (same) { // eight places share a leaf only if it is a tile
            const auto [at, fresh] = tiles.emplace(leaves[0], leaf);
            leaf = at->second;
            if (fresh) sources.push_back(leaves);
        } else sources.push_back(leaves);
        const auto [block, fresh] =
            blocks.emplace(Coord(o[0] >> 7, o[1] >> 7, o[2] >> 7), int(blocks.size()));
        if (fresh) t.m_children.resize(t.m_children.size() + 4096, kEmpty);
        t.m_children[std::size_t(block->second) * 4096
                     + ((o[0] >> 3 & 15) << 8 | (o[1] >> 3 & 15) << 4 | (o[2] >> 3 & 15))] = leaf;
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

    struct Filled { // what a leaf adds to the tables; list entries are counted from the leaf's
                    // first
        std::vector<std::uint64_t> records;
        std::vector<ScatterRatio> scatter_ratio;
        std::vector<Shared> shared;
    };
    t.m_leaves.resize(sources.size());
    t.m_density.resize(sources.size() * 512);
    constexpr std::size_t kBatch = 4096; // leaves that wait to be put behind the others
    std::vector<Filled> filled;
    const auto fill = [&](std::size_t start) {
        filled.assign(std::min(kBatch, sources.size() - start), {});
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(start, start + filled.size(), 32),
            [&](const auto& range) {
                struct Sum {
                    explicit Sum(int p) : part(p) { }
                    int part;
                    double density = 0, around = 0;
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
                std::array<ScatterRatio, 512> scatter_ratio;
                for (std::size_t i = range.begin(); i < range.end(); ++i) {
                    Leaf& leaf = t.m_leaves[i];
                    const std::array<int, 8>& leaves = sources[i];
                    leaf.uniform = std::all_of(leaves.begin(), leaves.end(),
                                               [&](int l) { return l == leaves[0]; });
                    leaf.colour_scale = 0;
                    entries.clear();
                    for (int octant = 0; octant < 8; ++octant)
                        if (leaves[octant] != kEmpty)
                            coarsenLeaf(fine, leaves[octant], octant, extinction,
                                        &t.m_density[i * 512], leaf, scatter_ratio);
                    for (int n = 0; n < 512; ++n) {
                        if (!(leaf.mask[n >> 6] >> (n & 63) & 1) || (leaf.uniform && n > 0))
                            continue;
                        filled[i - start].scatter_ratio.push_back(scatter_ratio[n]);
                        const int child = leaves[(n >> 8) << 2 | (n >> 5 & 1) << 1 | (n >> 2 & 1)];
                        const Leaf& from = fine.m_leaves[child];
                        const int first = offset(2 * (n >> 6), 2 * (n >> 3 & 7), 2 * (n & 7));
                        sums.clear();
                        double total = 0;
                        for (const int step : kSteps) {
                            const int voxel = first + step;
                            if (!(from.mask[voxel >> 6] >> (voxel & 63) & 1)) continue;
                            fine.contents(child, voxel, [&](const VoxelContent& c) {
                                auto sum =
                                    std::find_if(sums.begin(), sums.end(),
                                                 [&](const Sum& s) { return s.part == c.part; });
                                if (sum == sums.end()) sum = sums.insert(sum, Sum(c.part));
                                sum->density += c.density;
                                sum->colour += c.density * c.colour;
                                total += c.density;
                                if (!c.directed) return;
                                // t tᵀ of the directions that the voxel stands for: one along, the
                                // square of the spread across.
                                const double s2 = spreadOf(c.spread_code) * spreadOf(c.spread_code),
                                             w = c.density / (1 + 2 * s2);
                                sum->directions.add(w * (1 - s2), c.direction);
                                sum->around += w * s2;
                            });
                        }
                        const float density = t.m_density[i * 512 + n];
                        for (Sum& s : sums) {
                            s.directions.xx += s.around;
                            s.directions.yy += s.around;
                            s.directions.zz += s.around;
                            const Vec3d direction = principalDirection(s.directions).stored(),
                                        colour = s.colour / s.density;
                            entries.push_back({n, s.part, float(density * s.density / total),
                                               Vec3f(direction), Vec3f(colour)});
                            leaf.colour_scale =
                                std::max(leaf.colour_scale,
                                         float(std::max({colour[0], colour[1], colour[2]})));
                        }
                    }
                    for (int w = 1; w < 8; ++w)
                        leaf.before[w] = std::uint16_t(leaf.before[w - 1]
                                                       + __builtin_popcountll(leaf.mask[w - 1]));
                    Filled& out = filled[i - start];
                    for (std::size_t e = 0; e < entries.size();) {
                        std::size_t end = e + 1;
                        while (end < entries.size() && entries[end].voxel == entries[e].voxel)
                            ++end;
                        for (std::size_t k = e; k < end; ++k) {
                            const std::uint64_t record =
                                pack(entries[k].direction, entries[k].colour, leaf.colour_scale,
                                     entries[k].part);
                            leaf.directed_fibres |= t.m_is_fibre[entries[k].part]
                                && int(record >> 24 & 63) != kSpreadCodes;
                            if (end - e == 1 && t.m_parts.size() <= kMostParts)
                                out.records.push_back(record);
                            else
                                out.shared.push_back({record, entries[k].density, entries[k].part});
                        }
                        if (end - e > 1 || t.m_parts.size() > kMostParts)
                            out.records.push_back(kShared << 60 | std::uint64_t(end - e) << 32
                                                  | (out.shared.size() - (end - e)));
                        e = end;
                    }
                }
            });
    };
    for (std::size_t start = 0; start < sources.size(); start += kBatch) {
        fill(start);
        for (std::size_t i = start; i < start + filled.size(); ++i) {
            const Filled& more = filled[i - start];
            Leaf& l = t.m_leaves[i];
            l.first = std::uint32_t(t.m_records.size());
            for (const std::uint64_t record : more.records)
                t.m_records.push_back(record >> 60 == kShared ? record + t.m_shared.size()
                                                              : record);
            t.m_scatter_ratio.insert(t.m_scatter_ratio.end(), more.scatter_ratio.begin(),
                                     more.scatter_ratio.end());
            t.m_shared.insert(t.m_shared.end(), more.shared.begin(), more.shared.end());
            t.m_voxels += l.uniform ? 0 : l.before[7] + __builtin_popcountll(l.mask[7]);
            t.m_directed_fibres |= l.directed_fibres;
        }
    }
    for (const float density : t.m_density) t.m_max_density = std::max(t.m_max_density, density);
    return t;
}

} // namespace volcomp
