// The push: rays of a light through one layer of leaves.
#include "volcomp/render/shadow/shadow_sweeper.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include <tbb/parallel_for.h>

namespace volcomp {

void ShadowSweep::Sweeper::advance(int layer)
{
    double s = planeAt(layer);
    const double end = s + kLeafDim;
    if (m_lattice.fans) {
        if (end <= m_lattice.s0) return;
        s = std::max(s, m_lattice.s0);
    }
    struct Move {
        int b, c;
    };
    std::vector<Move> moves;
    std::vector<Cell> leaves; // whose extinction depends on the direction
    for (const Cell& cell : m_cells[layer]) {
        bool lit = false;
        const Rectangle& r = cell.under;
        for (int b = std::max(r.low[0], m_all.low[0]); b <= std::min(r.high[0], m_all.high[0]); ++b)
            for (int c = std::max(r.low[1], m_all.low[1]); c <= std::min(r.high[1], m_all.high[1]);
                 ++c) {
                const std::size_t at = m_all.index(b, c);
                Bundle& bundle = m_bundles[at];
                if (bundle.dark || m_last[at] <= layer) continue;
                lit = true;
                if (bundle.stamp == layer) continue;
                bundle.stamp = layer;
                moves.push_back({b, c});
            }
        if (lit && m_sweep.m_fibre && m_tree.leaf(cell.leaf).directed_fibres
            && m_effective_of[cell.leaf] < 0) {
            m_effective_of[cell.leaf] = int(leaves.size());
            leaves.push_back(cell);
        }
    }
    if (m_effective.size() < leaves.size() * 512) m_effective.resize(leaves.size() * 512);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16),
                      [&](const auto& range) {
                          for (std::size_t i = range.begin(); i < range.end(); ++i)
                              makeEffective(leaves[i], layer, &m_effective[i * 512]);
                      });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, moves.size(), 8), [&](const auto& range) {
        Scratch& scratch = m_scratch.local();
        for (std::size_t i = range.begin(); i < range.end(); ++i)
            move(moves[i].b, moves[i].c, layer, s, end, scratch);
    });
    for (const Cell& cell : leaves) m_effective_of[cell.leaf] = -1;
}

// Densities as they count on the way to the light. Of a point it is taken to be the same way in the
// whole leaf.
void ShadowSweep::Sweeper::makeEffective(const Cell& cell, int layer, float* to) const
{
    const float* density = m_tree.densities(cell.leaf);
    Vec3d to_light = -m_light.direction;
    if (m_lattice.fans) {
        to_light[m_lattice.a] = m_lattice.sign * (m_lattice.s0 - planeAt(layer) - kLeafDim / 2);
        to_light[m_lattice.b] = m_lattice.origin[0] - cell.b - kLeafDim / 2;
        to_light[m_lattice.c] = m_lattice.origin[1] - cell.c - kLeafDim / 2;
        const double length = to_light.length();
        to_light = m_tree.directionToWorld(length > 0 ? to_light / length : Vec3d(1, 0, 0));
    }
    for (int n = 0; n < 512; ++n)
        to[n] = density[n] > 0 ? float(density[n] * m_tree.fibreFactor(cell.leaf, n, to_light)) : 0;
}

// A row of rays through one slice, of voxels at `here` and, one row on, `there`: three voxels at
// most, two borders crossed in either order.
struct ShadowSweep::Sweeper::Row {
    float way, tc[kSide]; // until the border to k1
    std::int32_t k0[kSide], k1[kSide];

    void pass(float tb, const float* here, const float* there, float* sums) const
    {
#if defined(__AVX2__)
        for (int j = 0; j < kSide; j += 8) { // eight rays, 2/3 apart at most, see eight voxels
            const int first = k0[j] - 1;
            const __m256 h = _mm256_loadu_ps(here + first), t = _mm256_loadu_ps(there + first),
                         b = _mm256_set1_ps(tb), c = _mm256_loadu_ps(tc + j);
            const __m256i shift = _mm256_set1_epi32(first);
            const __m256i i0 =
                _mm256_sub_epi32(_mm256_loadu_si256((const __m256i*)(k0 + j)), shift);
            const __m256i i1 =
                _mm256_sub_epi32(_mm256_loadu_si256((const __m256i*)(k1 + j)), shift);
            const __m256 b_first = _mm256_cmp_ps(b, c, _CMP_LT_OQ), t1 = _mm256_min_ps(b, c),
                         t2 = _mm256_max_ps(b, c);
            const __m256 second = _mm256_blendv_ps(_mm256_permutevar8x32_ps(h, i1),
                                                   _mm256_permutevar8x32_ps(t, i0), b_first);
            __m256 sum = _mm256_loadu_ps(sums + j);
            sum = _mm256_add_ps(sum, _mm256_mul_ps(t1, _mm256_permutevar8x32_ps(h, i0)));
            sum = _mm256_add_ps(sum, _mm256_mul_ps(_mm256_sub_ps(t2, t1), second));
            sum = _mm256_add_ps(sum,
                                _mm256_mul_ps(_mm256_sub_ps(_mm256_set1_ps(way), t2),
                                              _mm256_permutevar8x32_ps(t, i1)));
            _mm256_storeu_ps(sums + j, sum);
        }
#else
        for (int j = 0; j < kSide; ++j) {
            const bool b_first = tb < tc[j];
            const float t1 = b_first ? tb : tc[j], t2 = b_first ? tc[j] : tb;
            sums[j] += t1 * here[k0[j]] + (t2 - t1) * (b_first ? there[k0[j]] : here[k1[j]])
                + (way - t2) * there[k1[j]];
        }
#endif
    }
};

// Takes one bundle from s to end, the far side of the layer.
void ShadowSweep::Sweeper::move(int bundle_b, int bundle_c, int layer, double s, double end,
                                Scratch& scratch)
{
    const int bundle[2] = {bundle_b, bundle_c};
    int low[2], count[2]; // leaves
    for (int axis = 0; axis < 2; ++axis) {
        const double u0 = double(bundle[axis]) * kBundle, u1 = u0 + kBundle;
        const double x[4] = {m_lattice.at(axis, u0, s), m_lattice.at(axis, u1, s),
                             m_lattice.at(axis, u0, end), m_lattice.at(axis, u1, end)};
        low[axis] = floorDivide(int(std::floor(*std::min_element(x, x + 4))), kLeafDim);
        count[axis] = std::min(kMaxLeaves,
                               floorDivide(int(std::floor(*std::max_element(x, x + 4))), kLeafDim)
                                   - low[axis] + 1);
    }
    const int row_stride = count[1] * kLeafDim,
              slice_stride = row_stride * count[0] * kLeafDim; // of the block: c runs fastest
    float* block = scratch.block.data() + kMargin;
    if (!fill(layer, low, count, row_stride, slice_stride, block)) return;
    Bundle& state = m_bundles[m_all.index(bundle_b, bundle_c)];
    if (!state.sums) state.sums.reset(new float[kRays]());

    double b_at[kSide], b_slope[kSide], c_at[kSide], c_slope[kSide];
    for (int i = 0; i < kSide; ++i) {
        const double u = double(bundle_b) * kBundle + i, v = double(bundle_c) * kBundle + i;
        b_slope[i] = m_lattice.slopeOf(0, u);
        c_slope[i] = m_lattice.slopeOf(1, v);
        b_at[i] = m_lattice.at(0, u, s) - low[0] * kLeafDim;
        c_at[i] = m_lattice.at(1, v, s) - low[1] * kLeafDim;
    }
    const auto crossing = [](double at, double slope, int voxel, float way) { // of the next border
        return std::abs(slope) < 1e-12
            ? way
            : std::min(way, float((slope < 0 ? at - voxel : 1 - (at - voxel)) / std::abs(slope)));
    };
    for (int slice = int(std::floor(s - planeAt(layer) + 1e-9)); slice < kLeafDim; ++slice) {
        const float way = float(planeAt(layer) + slice + 1 - std::max(s, planeAt(layer) + slice));
        Row row;
        row.way = way;
        for (int j = 0; j < kSide; ++j) {
            const int voxel = int(std::floor(c_at[j]));
            row.tc[j] = crossing(c_at[j], c_slope[j], voxel, way);
            row.k0[j] = voxel;
            row.k1[j] = voxel + (c_slope[j] < 0 ? -1 : 1);
            c_at[j] += c_slope[j] * way;
        }
        const float* plane =
            block + (m_lattice.sign > 0 ? slice : kLeafDim - 1 - slice) * slice_stride;
        for (int i = 0; i < kSide; ++i) {
            const int voxel = int(std::floor(b_at[i]));
            const float* here = plane + voxel * row_stride;
            row.pass(crossing(b_at[i], b_slope[i], voxel, way), here,
                     here + (b_slope[i] < 0 ? -row_stride : row_stride), &state.sums[i * kSide]);
            b_at[i] += b_slope[i] * way;
        }
    }
    state.least = state.sums[0];
    for (int i = 1; i < kRays; ++i) state.least = std::min(state.least, state.sums[i]);
    // Rays are at least as long as the slices they cross.
    state.dark = state.least * m_sweep.m_extinction > m_sweep.m_darkest;
    if (state.dark) state.sums.reset();
}

// Copies the densities under a bundle; false where there is no leaf.
bool ShadowSweep::Sweeper::fill(int layer, const int* low, const int* count, int row_stride,
                                int slice_stride, float* block) const
{
    const int a = m_lattice.a, b = m_lattice.b, c = m_lattice.c;
    int leaves[kMaxLeaves][kMaxLeaves];
    bool any = false;
    int cell[3];
    cell[a] = int(m_lattice.sign > 0 ? planeAt(layer) : -planeAt(layer + 1));
    for (int i = 0; i < count[0]; ++i)
        for (int j = 0; j < count[1]; ++j) {
            cell[b] = (low[0] + i) * kLeafDim;
            cell[c] = (low[1] + j) * kLeafDim;
            leaves[i][j] = m_tree.leafAt(cell[0], cell[1], cell[2]);
            any |= leaves[i][j] != VoxelTree::kEmpty;
        }
    if (!any) return false;
    for (int i = 0; i < count[0]; ++i)
        for (int j = 0; j < count[1]; ++j) {
            const int leaf = leaves[i][j];
            const float* from = nullptr;
            if (leaf != VoxelTree::kEmpty) {
                from = m_tree.densities(leaf);
                if (m_sweep.m_fibre && m_effective_of[leaf] >= 0)
                    from = &m_effective[std::size_t(m_effective_of[leaf]) * 512];
            }
            float* to = block + i * kLeafDim * row_stride + j * kLeafDim;
            const int slice_from = a == 0 ? 64 : a == 1 ? 8 : 1, b_from = a == 0 ? 8 : 64;
            for (int slice = 0; slice < kLeafDim; ++slice)
                for (int row = 0; row < kLeafDim; ++row) {
                    float* at = to + slice * slice_stride + row * row_stride;
                    if (!from) std::memset(at, 0, kLeafDim * sizeof(float));
                    else if (a < 2)
                        std::memcpy(at, from + slice * slice_from + row * b_from,
                                    kLeafDim * sizeof(float));
                    else
                        for (int n = 0; n < kLeafDim; ++n) at[n] = from[row * 64 + n * 8 + slice];
                }
        }
    return true;
}

} // namespace volcomp
