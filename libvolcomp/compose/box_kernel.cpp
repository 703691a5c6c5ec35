// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/box_kernel.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "volcomp/compose/placed_box.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "volcomp/compose/box_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// Compiled once for each instruction set. Nothing here may instantiate a template of a header: the
// linker could take this copy, with its instructions, for all of the program. Sums are written as
// products and sums, never as fused ones, so that the bytes do not depend on the machine.
HWY_BEFORE_NAMESPACE();
namespace volcomp {
namespace HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 16>;
using Words = hn::RebindToUnsigned<Floats>;
using Vec = hn::Vec<Floats>;
constexpr std::uint32_t kLanes = hn::MaxLanes(Floats());
constexpr std::uint32_t kRun = SourcePart::kRun, kTogether = BoundsList::kTogether;
constexpr int kBatch = CubeBatch::kSize;
constexpr float kTile = TileCells::kSize;
static_assert(kRun % kLanes == 0 && kTogether % kLanes == 0);

HWY_INLINE Vec set(float x) { return hn::Set(Floats(), x); }
HWY_INLINE Vec load(const float* p) { return hn::LoadU(Floats(), p); }

/// The coordinate along one of the tile's axes of places in the box, less `from`.
HWY_INLINE Vec along(const BoxInTile& box, int axis, float from, Vec x, Vec y, Vec z)
{
    return set(from)
        + (x * set(box.axes[0][axis]) + y * set(box.axes[1][axis]) + z * set(box.axes[2][axis]));
}

/// Rounds to the nearest multiple of 1 / kSnap for |x| < 1024. Beyond, digits are lost, but those
/// places are not in the tile.
HWY_INLINE Vec snapped(Vec x)
{
    const Vec shift = set(1.5f * (1 << 23) / kSnap);
    return (x + shift) - shift;
}

/// What the box's voxel adds where a cube of it covers a cell fully.
HWY_INLINE void makeSum(const BoxInTile& box, std::uint32_t voxel, VoxelSum& sum)
{
    const hn::CappedTag<float, 4> f;
    const float* const v = box.voxels[voxel].values;
    const auto x = hn::Set(f, v[SourceVoxel::kDirection]),
               y = hn::Set(f, v[SourceVoxel::kDirection + 1]),
               z = hn::Set(f, v[SourceVoxel::kDirection + 2]),
               iso = hn::Set(f, v[SourceVoxel::kIso]), factor = hn::Set(f, box.direction);
    for (std::size_t i = 0; i < 4; i += hn::Lanes(f)) {
        const auto t = x * hn::Load(f, box.turn[0] + i) + y * hn::Load(f, box.turn[1] + i)
            + z * hn::Load(f, box.turn[2] + i);
        const auto next = x * hn::Load(f, box.turn_next[0] + i)
            + y * hn::Load(f, box.turn_next[1] + i) + z * hn::Load(f, box.turn_next[2] + i);
        hn::Store((t * t + iso) * factor, f, sum.values + VoxelSum::kDiagonal + i);
        hn::Store(t * next * factor, f, sum.values + VoxelSum::kMixed + i);
        hn::Store(hn::Load(f, v + SourceVoxel::kColour + i) * hn::Load(f, box.colour + i), f,
                  sum.values + VoxelSum::kColour + i);
    }
    for (int i = 0; i < 3; ++i)
        sum.values[VoxelSum::kScatter + i] = sum.values[VoxelSum::kDensity]
            * (box.scatter_ratios ? box.scatter_ratios[voxel].data()[i] : 1);
    sum.values[VoxelSum::kSquares] = box.squares ? box.squares[voxel] * box.square : 0;
    if (box.tint) box.tint->apply(voxel, sum);
}

/// Collects cubes in the tile's batch and adds them.
class Adder {
public:
    Adder(const BoxInTile& box, TileAccumulator& tile)
        : m_box(box), m_tile(tile), m_batch(tile.batch())
    {
    }

    /// Queues what lies in the bounds [16 group, 16 group + 16) of a level and reaches into the
    /// tile.
    void addGroup(int level, std::uint32_t group)
    {
        const Floats f;
        constexpr float kHalf = 0.5f * kTile;
        const BoxInTile::Level& list = m_box.levels[level];
        for (std::uint32_t first = group * kTogether; first < (group + 1) * kTogether;
             first += kLanes) {
            const Vec centre[3] = {load(list.values[0] + first), load(list.values[1] + first),
                                   load(list.values[2] + first)};
            const Vec half[3] = {load(list.values[3] + first), load(list.values[4] + first),
                                 load(list.values[5] + first)};
            auto outside = hn::MaskFromVec(set(0)); // nothing
            for (int i = 0; i < 3; ++i) {
                const Vec from_middle =
                    along(m_box, i, m_box.root[i] - kHalf, centre[0], centre[1], centre[2]);
                const Vec reach = set(0.5f * m_box.width + 1e-3f + kHalf)
                    + hn::Abs(set(m_box.axes[0][i])) * half[0]
                    + hn::Abs(set(m_box.axes[1][i])) * half[1]
                    + hn::Abs(set(m_box.axes[2][i])) * half[2];
                outside = hn::Or(outside, hn::Abs(from_middle) > reach);
            }
            std::uint8_t bits[2] = {0, 0};
            hn::StoreMaskBits(f, hn::Not(outside), bits);
            for (unsigned left = bits[0] | bits[1] << 8; left; left &= left - 1) {
                const std::uint32_t i = first + static_cast<std::uint32_t>(__builtin_ctz(left));
                if (level == 0) addRun(i * kRun);
                else addGroup(level - 1, i);
            }
        }
    }

    /// Adds the cubes that are queued.
    void flush()
    {
        for (int k = 0; k < m_queued; ++k)
            if (m_divided_sums) m_batch.sum[k] = m_divided_sums[m_voxel_of[k] % kRun];
            else makeSum(m_box, m_voxel_of[k], m_batch.sum[k]);
        m_tile.add(m_queued, m_box.width);
        m_queued = 0;
    }

private:
    void addRun(std::uint32_t begin)
    {
        const int divisions = m_box.divisions;
        if (divisions == 1) {
            const float middle[3] = {0, 0, 0};
            queue(begin, middle);
            return;
        }
        // A voxel may have a million parts, of which few reach into the tile.
        const ReachedParts reached = reachedParts(m_box, begin);
        if (reached.count[0] == 0) return;
        VoxelSum sums[kRun] = {};
        for (std::uint32_t k = 0; k < kRun && begin + k < m_box.voxel_count; ++k)
            makeSum(m_box, begin + k, sums[k]);
        m_divided_sums = sums;
        const float step = 1 / static_cast<float>(divisions), first = 0.5f * step - 0.5f;
        const auto each = [&](int axis, const auto& visit) {
            for (int r = 0; r < reached.count[axis]; ++r)
                for (int k = reached.ranges[axis][r].begin; k < reached.ranges[axis][r].end; ++k)
                    visit(first + step * static_cast<float>(k));
        };
        each(0, [&](float x) {
            each(1, [&](float y) {
                each(2, [&](float z) {
                    const float middle[3] = {x, y, z};
                    queue(begin, middle);
                });
            });
        });
        flush();
        m_divided_sums = nullptr;
    }

    /// Queues the cubes of a run that reach into the tile. `middle` of the cubes, from the middle
    /// of their voxels, in voxels of the box.
    void queue(std::uint32_t begin, const float (&middle)[3])
    {
        const Floats f;
        const Words u;
        for (std::uint32_t first = begin; first < begin + kRun; first += kLanes) {
            const Vec x = load(m_box.place[0] + first), y = load(m_box.place[1] + first),
                      z = load(m_box.place[2] + first);
            Vec low[3];
            auto outside = hn::MaskFromVec(set(0)); // nothing
            for (int i = 0; i < 3; ++i) {
                const float shift = middle[0] * m_box.axes[0][i] + middle[1] * m_box.axes[1][i]
                    + middle[2] * m_box.axes[2][i];
                low[i] =
                    snapped(along(m_box, i, m_box.root[i] + shift - 0.5f * m_box.width, x, y, z));
                outside = hn::Or(outside, // see TileAccumulator::reaches()
                                 hn::Or(low[i] + set(m_box.width) <= set(0), low[i] >= set(kTile)));
            }
            const auto inside = hn::Not(outside);
            if (hn::AllFalse(f, inside)) continue;
            if (m_queued + static_cast<int>(kLanes) > kBatch) flush();
            for (int i = 0; i < 3; ++i)
                hn::StoreU(hn::Compress(low[i], inside), f, &m_batch.low[i][m_queued]);
            const auto voxel = hn::Iota(u, 0) + hn::Set(u, first);
            hn::StoreU(hn::Compress(voxel, hn::RebindMask(u, inside)), u, &m_voxel_of[m_queued]);
            m_queued += static_cast<int>(hn::CountTrue(f, inside));
        }
    }

    const BoxInTile& m_box;
    TileAccumulator& m_tile;
    CubeBatch& m_batch;
    int m_queued = 0;                         ///< cubes in the batch
    std::uint32_t m_voxel_of[kBatch];         ///< their voxels
    const VoxelSum* m_divided_sums = nullptr; ///< of a run's voxels while they are divided
};

void addBox(const BoxInTile& box, TileAccumulator& tile)
{
    Adder adder(box, tile);
    adder.addGroup(box.level_count - 1, 0);
    adder.flush();
}

} // namespace
} // namespace HWY_NAMESPACE
} // namespace volcomp
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace volcomp {

namespace {

/// Sorts ranges by their begin and joins those that touch. Returns how many are left.
int joinRanges(ReachedParts::Range* ranges, int count)
{
    std::sort(ranges, ranges + count,
              [](const auto& a, const auto& b) { return a.begin < b.begin; });
    int kept = 0;
    for (int i = 0; i < count; ++i)
        if (kept > 0 && ranges[i].begin <= ranges[kept - 1].end)
            ranges[kept - 1].end = std::max(ranges[kept - 1].end, ranges[i].end);
        else ranges[kept++] = ranges[i];
    return kept;
}

} // namespace

// A cube reaches into the tile if its middle is not farther from the tile's than half the edges of
// both, along each of the tile's axes. Then it is so along the box's axes for the tile's bounds.
ReachedParts reachedParts(const BoxInTile& box, std::uint32_t begin)
{
    constexpr double kHalf = 0.5 * TileCells::kSize;
    double middle[3], bounds[3], step[3], size = 0; // the tile's along the box's axes
    for (int a = 0; a < 3; ++a) {
        middle[a] = bounds[a] = step[a] = 0;
        for (int i = 0; i < 3; ++i) {
            middle[a] += double(box.turn[a][i]) * (kHalf - double(box.root[i]));
            bounds[a] += std::abs(double(box.turn[a][i]));
            step[a] += double(box.axes[a][i]) * double(box.axes[a][i]);
        }
        step[a] = std::sqrt(step[a]);
        size += std::abs(double(box.root[a]));
    }
    ReachedParts reached{};
    for (std::uint32_t k = 0; k < SourcePart::kRun && begin + k < box.voxel_count; ++k) {
        double p[3], far = size;
        for (int a = 0; a < 3; ++a) {
            p[a] = double(box.place[a][begin + k]);
            far += step[a] * std::abs(p[a]);
        }
        const double margin = 1e-3 + 1e-6 * far; // places are sums of floats
        ReachedParts::Range range[3];
        bool empty = false;
        for (int a = 0; a < 3; ++a) {
            const double reach = (kHalf + 0.5 * double(box.width) + margin) * bounds[a];
            const auto part = [&](double x) { // of the place x, along this axis from the root
                return std::clamp((x / step[a] - p[a] + 0.5) * box.divisions, -1.0,
                                  box.divisions + 1.0);
            };
            range[a].begin = std::max(0, static_cast<int>(part(middle[a] - reach) - 1));
            range[a].end = std::min(box.divisions, static_cast<int>(part(middle[a] + reach)) + 1);
            empty = empty || range[a].begin >= range[a].end;
        }
        if (empty) continue;
        for (int a = 0; a < 3; ++a) reached.ranges[a][reached.count[a]++] = range[a];
    }
    for (int a = 0; a < 3; ++a) reached.count[a] = joinRanges(reached.ranges[a], reached.count[a]);
    return reached;
}

HWY_EXPORT(addBox);

void addBox(const BoxInTile& box, TileAccumulator& tile)
{
    HWY_DYNAMIC_DISPATCH(addBox)(box, tile);
}

} // namespace volcomp
#endif
