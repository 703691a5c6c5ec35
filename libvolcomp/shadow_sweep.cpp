#include "shadow_sweep.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#if defined(__AVX2__)
#include <immintrin.h>
#endif

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

namespace volcomp {
namespace {

int floorDivide(int x, int y) { return x >= 0 ? x / y : -((y - 1 - x) / y); }

// 255 e^(-x/2) for x >= 0, to a tenth of a unit.
inline float codeOf(float x)
{
    const float y = std::max(-x * 0.72134752f, -60.0f); // log2
    const int whole = int(y) - 1;                       // y < 0: at or below floor(y)
    const float f = y - float(whole);                   // 0 ... 2
    const float p = 1 + f * (0.69315f + f * (0.240227f + f * (0.0555041f + f * (0.00961813f + f * 0.00133336f))));
    const std::int32_t bits = (whole + 127) << 23;
    float scale;
    std::memcpy(&scale, &bits, sizeof scale);
    return 255 * p * scale;
}

} // namespace

void ShadowSweep::Rectangle::add(const Rectangle& r)
{
    if (r.empty()) return;
    if (empty()) {
        *this = r;
        return;
    }
    for (int a = 0; a < 2; ++a) {
        low[a] = std::min(low[a], r.low[a]);
        high[a] = std::max(high[a], r.high[a]);
    }
}

// Fills one field: what is asked for, then layer by layer.
class ShadowSweep::Sweeper {
public:
    Sweeper(const ShadowSweep& sweep, Field& field, const Light& light, const std::vector<float>& seen)
        : m_sweep(sweep), m_tree(sweep.m_tree), m_field(field), m_lattice(field.lattice), m_light(light), m_seen(seen)
    {
    }

    /// False where nothing is asked for.
    bool run()
    {
        sortLeaves();
        setSpacing();
        markNeeded();
        if (m_all.empty()) return false;
        m_bundles.resize(m_all.size());
        if (m_sweep.m_fibre) m_effective_of.assign(m_tree.leafCount(), -1);
        for (int layer = 0; layer < int(m_field.planes.size()); ++layer) {
            keep(layer);
            if (layer < int(m_cells.size())) advance(layer);
        }
        return true;
    }

private:
    struct Cell { // a leaf where it stands: its lowest b and c
        int leaf, b, c;
    };
    struct Bundle {
        std::unique_ptr<float[]> sums; ///< density x slices along each ray; none before the first particle
        int stamp = -1;                ///< layer it was last moved through
        bool dark = false;
        float least = 0; ///< of the sums
    };
    static constexpr int kMaxLeaves = 4; // under a bundle in a layer, along b or c
    static constexpr int kBlockDim3 = kMaxLeaves * kLeafDim, kBlockSize = kBlockDim3 * kBlockDim3 * kLeafDim;
    static constexpr int kMargin = kBlockDim3 * kLeafDim + kLeafDim; // around the block, read with weight 0
    struct Scratch {
        std::vector<float> block = std::vector<float>(kBlockSize + 2 * kMargin);
    };

    double planeAt(int plane) const { return m_field.first_s + double(kLeafDim) * plane; }

    void sortLeaves()
    {
        const openvdb::CoordBBox& box = m_tree.bounds();
        const int a = m_lattice.a, layers = (box.max()[a] - box.min()[a] + 1) / kLeafDim;
        m_field.first_s = m_lattice.sign > 0 ? box.min()[a] : -(box.max()[a] + 1.0);
        m_field.planes.resize(layers + 1);
        m_cells.resize(layers);
        m_tree.forEachCell([&](const openvdb::Coord& origin, int leaf) {
            const int layer = (origin[a] - box.min()[a]) / kLeafDim;
            m_cells[m_lattice.sign > 0 ? layer : layers - 1 - layer].push_back({leaf, origin[m_lattice.b], origin[m_lattice.c]});
        });
    }

    // Light is asked for there, from a plane behind the source.
    bool asks(const Cell& cell, int layer) const
    {
        if (!(m_seen[cell.leaf] > 0) || m_tree.leaf(cell.leaf).uniform) return false;
        if (!m_lattice.fans) return true;
        const double s = planeAt(layer);
        if (s <= m_lattice.s0 + 1e-3) return false;
        // Inside the pyramid, and inside the spot's cone.
        const double reach = s + kLeafDim - m_lattice.s0;
        const double b = cell.b - m_lattice.origin[0], c = cell.c - m_lattice.origin[1];
        if (b > reach || b + kLeafDim < -reach || c > reach || c + kLeafDim < -reach) return false;
        if (m_light.kind != LightKind::spot) return true;
        Vec3d middle(0.0);
        middle[m_lattice.a] = m_lattice.sign * (s + kLeafDim / 2 - m_lattice.s0);
        middle[m_lattice.b] = b + kLeafDim / 2;
        middle[m_lattice.c] = c + kLeafDim / 2;
        const double distance = middle.length(), radius = kLeafDim * 0.87;
        if (distance <= radius) return true;
        const double cosine = m_tree.directionToWorld(middle / distance).dot(m_light.direction);
        return std::acos(std::min(1.0, std::max(-1.0, cosine))) - std::asin(radius / distance) <= m_light.angle;
    }

    void setSpacing()
    {
        if (!m_lattice.fans) return;
        int farthest = 0;
        for (int layer = 0; layer < int(m_cells.size()); ++layer)
            if (std::any_of(m_cells[layer].begin(), m_cells[layer].end(), [&](const Cell& cell) { return asks(cell, layer); }))
                farthest = layer;
        m_lattice.setFanSpacing(kSpacing, planeAt(farthest));
        m_field.lattice = m_lattice;
    }

    // The bundles whose rays pass a leaf, or between whose rays its points lie.
    Rectangle under(const Cell& cell, int layer) const
    {
        Rectangle r;
        for (int axis = 0; axis < 2; ++axis) {
            const int x = axis == 0 ? cell.b : cell.c;
            double low, high;
            m_lattice.raysThrough(axis, x, x + kLeafDim, planeAt(layer), planeAt(layer + 1), low, high);
            if (m_lattice.fans) { // of the pyramid, with a border
                const double most = 1.02 / m_lattice.spacing1;
                low = std::max(low, -most);
                high = std::min(high, most);
                if (low > high) return {};
            }
            r.low[axis] = floorDivide(int(std::floor(low - 0.01)) - 1, kBundle);
            r.high[axis] = floorDivide(int(std::floor(high + 0.01)), kBundle);
        }
        return r;
    }

    // A leaf asks for the planes before and behind it.
    void markNeeded()
    {
        std::size_t size = 0;
        for (int layer = 0; layer < int(m_cells.size()); ++layer)
            for (const Cell& cell : m_cells[layer])
                if (asks(cell, layer))
                    for (int p = layer; p <= layer + 1; ++p) m_field.planes[p].bundles.add(under(cell, layer));
        for (Plane& plane : m_field.planes) {
            plane.first = size;
            size += plane.bundles.size();
            m_all.add(plane.bundles);
        }
        m_field.patches.assign(size, kUnknown);
        m_weights.assign(size, 0);
        m_last.assign(m_all.size(), -1);
        for (int layer = 0; layer < int(m_cells.size()); ++layer)
            for (const Cell& cell : m_cells[layer])
                if (asks(cell, layer))
                    for (int p = layer; p <= layer + 1; ++p)
                        forEachBundle(under(cell, layer), [&](int b, int c) {
                            const std::size_t at = m_field.planes[p].first + m_field.planes[p].bundles.index(b, c);
                            m_field.patches[at] = kBright;
                            if (p == layer) m_weights[at] = std::max(m_weights[at], m_seen[cell.leaf]);
                            m_last[m_all.index(b, c)] = p;
                        });
    }

    template <class F>
    static void forEachBundle(const Rectangle& r, const F& f)
    {
        for (int b = r.low[0]; b <= r.high[0]; ++b)
            for (int c = r.low[1]; c <= r.high[1]; ++c) f(b, c);
    }

    double rayLength(int b, int c) const { return std::sqrt(1 + square(m_lattice.slopeOf(0, b)) + square(m_lattice.slopeOf(1, c))); }
    static double square(double x) { return x * x; }

    // Writes what is asked for at a plane.
    void keep(int layer)
    {
        const Plane& plane = m_field.planes[layer];
        struct Patch {
            int b, c;
            std::int32_t* patch;
            bool fine;
        };
        std::vector<Patch> patches;
        forEachBundle(plane.bundles, [&](int b, int c) {
            const std::size_t at = plane.first + plane.bundles.index(b, c);
            const Bundle& bundle = m_bundles[m_all.index(b, c)];
            if (m_field.patches[at] == kUnknown || (!bundle.sums && !bundle.dark)) return;
            if (bundle.dark) {
                m_field.patches[at] = kDark;
                return;
            }
            const float brightest = std::exp(-float(m_sweep.m_extinction) * bundle.least);
            patches.push_back({b, c, &m_field.patches[at], m_weights[at] * brightest >= kFinePatch});
        });
        std::size_t next = m_field.codes.size() / kUnit;
        for (const Patch& p : patches) {
            *p.patch = std::int32_t(2 * next + p.fine);
            next += (p.fine ? kRays : kRoughRays) / kUnit;
        }
        m_field.codes.resize(next * kUnit);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, patches.size(), 16), [&](const auto& range) {
            for (std::size_t i = range.begin(); i < range.end(); ++i)
                write(patches[i].b, patches[i].c, patches[i].fine, &m_field.codes[std::size_t(*patches[i].patch >> 1) * kUnit]);
        });
    }

    void write(int b, int c, bool fine, std::uint8_t* codes) const
    {
        const float* sums = m_bundles[m_all.index(b, c)].sums.get();
        const int step = fine ? 1 : kStride;
        float scale[kSide];
        for (int row = 0; row < kSide; row += step) {
            if (row == 0 || m_lattice.fans)
                for (int j = 0; j < kSide; ++j) scale[j] = float(m_sweep.m_extinction * rayLength(b * kBundle + row, c * kBundle + j));
            float values[kSide];
            for (int j = 0; j < kSide; ++j) values[j] = codeOf(sums[row * kSide + j] * scale[j]) + 0.5f;
            for (int j = 0; j < kSide; j += step) *codes++ = std::uint8_t(values[j]);
        }
    }

    void advance(int layer)
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
            const Rectangle r = under(cell, layer);
            for (int b = std::max(r.low[0], m_all.low[0]); b <= std::min(r.high[0], m_all.high[0]); ++b)
                for (int c = std::max(r.low[1], m_all.low[1]); c <= std::min(r.high[1], m_all.high[1]); ++c) {
                    const std::size_t at = m_all.index(b, c);
                    Bundle& bundle = m_bundles[at];
                    if (bundle.dark || m_last[at] <= layer) continue;
                    lit = true;
                    if (bundle.stamp == layer) continue;
                    bundle.stamp = layer;
                    moves.push_back({b, c});
                }
            if (lit && m_sweep.m_fibre && m_tree.leaf(cell.leaf).directed_fibres && m_effective_of[cell.leaf] < 0) {
                m_effective_of[cell.leaf] = int(leaves.size());
                leaves.push_back(cell);
            }
        }
        if (m_effective.size() < leaves.size() * 512) m_effective.resize(leaves.size() * 512);
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 16), [&](const auto& range) {
            for (std::size_t i = range.begin(); i < range.end(); ++i) makeEffective(leaves[i], layer, &m_effective[i * 512]);
        });
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, moves.size(), 8), [&](const auto& range) {
            Scratch& scratch = m_scratch.local();
            for (std::size_t i = range.begin(); i < range.end(); ++i) move(moves[i].b, moves[i].c, layer, s, end, scratch);
        });
        for (const Cell& cell : leaves) m_effective_of[cell.leaf] = -1;
    }

    // Densities as they count on the way to the light. Of a point it is taken to be the same way in the whole leaf.
    void makeEffective(const Cell& cell, int layer, float* to) const
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
        for (int n = 0; n < 512; ++n) to[n] = density[n] > 0 ? float(density[n] * m_tree.fibreFactor(cell.leaf, n, to_light)) : 0;
    }

    // Takes one bundle from s to end, the far side of the layer.
    void move(int bundle_b, int bundle_c, int layer, double s, double end, Scratch& scratch)
    {
        const int bundle[2] = {bundle_b, bundle_c};
        int low[2], count[2]; // leaves
        for (int axis = 0; axis < 2; ++axis) {
            const double u0 = double(bundle[axis]) * kBundle, u1 = u0 + kBundle;
            const double x[4] = {m_lattice.at(axis, u0, s), m_lattice.at(axis, u1, s), m_lattice.at(axis, u0, end),
                                 m_lattice.at(axis, u1, end)};
            low[axis] = floorDivide(int(std::floor(*std::min_element(x, x + 4))), kLeafDim);
            count[axis] = std::min(kMaxLeaves, floorDivide(int(std::floor(*std::max_element(x, x + 4))), kLeafDim) - low[axis] + 1);
        }
        const int row_stride = count[1] * kLeafDim, slice_stride = row_stride * count[0] * kLeafDim; // of the block: c runs fastest
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
            return std::abs(slope) < 1e-12 ? way : std::min(way, float((slope < 0 ? at - voxel : 1 - (at - voxel)) / std::abs(slope)));
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
            const float* plane = block + (m_lattice.sign > 0 ? slice : kLeafDim - 1 - slice) * slice_stride;
            for (int i = 0; i < kSide; ++i) {
                const int voxel = int(std::floor(b_at[i]));
                const float* here = plane + voxel * row_stride;
                row.pass(crossing(b_at[i], b_slope[i], voxel, way), here, here + (b_slope[i] < 0 ? -row_stride : row_stride),
                         &state.sums[i * kSide]);
                b_at[i] += b_slope[i] * way;
            }
        }
        state.least = state.sums[0];
        for (int i = 1; i < kRays; ++i) state.least = std::min(state.least, state.sums[i]);
        // Rays are at least as long as the slices they cross.
        state.dark = state.least * m_sweep.m_extinction > m_sweep.m_darkest;
        if (state.dark) state.sums.reset();
    }

    // A row of rays through one slice, of voxels at `here` and, one row on, `there`: three voxels at most, two borders crossed in either order.
    struct Row {
        float way, tc[kSide]; // until the border to k1
        std::int32_t k0[kSide], k1[kSide];

        void pass(float tb, const float* here, const float* there, float* sums) const
        {
#if defined(__AVX2__)
            for (int j = 0; j < kSide; j += 8) { // eight rays, 2/3 apart at most, see eight voxels
                const int first = k0[j] - 1;
                const __m256 h = _mm256_loadu_ps(here + first), t = _mm256_loadu_ps(there + first), b = _mm256_set1_ps(tb),
                             c = _mm256_loadu_ps(tc + j);
                const __m256i shift = _mm256_set1_epi32(first);
                const __m256i i0 = _mm256_sub_epi32(_mm256_loadu_si256((const __m256i*)(k0 + j)), shift);
                const __m256i i1 = _mm256_sub_epi32(_mm256_loadu_si256((const __m256i*)(k1 + j)), shift);
                const __m256 b_first = _mm256_cmp_ps(b, c, _CMP_LT_OQ), t1 = _mm256_min_ps(b, c), t2 = _mm256_max_ps(b, c);
                const __m256 second = _mm256_blendv_ps(_mm256_permutevar8x32_ps(h, i1), _mm256_permutevar8x32_ps(t, i0), b_first);
                __m256 sum = _mm256_loadu_ps(sums + j);
                sum = _mm256_add_ps(sum, _mm256_mul_ps(t1, _mm256_permutevar8x32_ps(h, i0)));
                sum = _mm256_add_ps(sum, _mm256_mul_ps(_mm256_sub_ps(t2, t1), second));
                sum = _mm256_add_ps(sum, _mm256_mul_ps(_mm256_sub_ps(_mm256_set1_ps(way), t2), _mm256_permutevar8x32_ps(t, i1)));
                _mm256_storeu_ps(sums + j, sum);
            }
#else
            for (int j = 0; j < kSide; ++j) {
                const bool b_first = tb < tc[j];
                const float t1 = b_first ? tb : tc[j], t2 = b_first ? tc[j] : tb;
                sums[j] += t1 * here[k0[j]] + (t2 - t1) * (b_first ? there[k0[j]] : here[k1[j]]) + (way - t2) * there[k1[j]];
            }
#endif
        }
    };

    // Copies the densities under a bundle; false where there is no leaf.
    bool fill(int layer, const int* low, const int* count, int row_stride, int slice_stride, float* block) const
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
                    if (m_sweep.m_fibre && m_effective_of[leaf] >= 0) from = &m_effective[std::size_t(m_effective_of[leaf]) * 512];
                }
                float* to = block + i * kLeafDim * row_stride + j * kLeafDim;
                const int slice_from = a == 0 ? 64 : a == 1 ? 8 : 1, b_from = a == 0 ? 8 : 64;
                for (int slice = 0; slice < kLeafDim; ++slice)
                    for (int row = 0; row < kLeafDim; ++row) {
                        float* at = to + slice * slice_stride + row * row_stride;
                        if (!from) std::memset(at, 0, kLeafDim * sizeof(float));
                        else if (a < 2) std::memcpy(at, from + slice * slice_from + row * b_from, kLeafDim * sizeof(float));
                        else
                            for (int n = 0; n < kLeafDim; ++n) at[n] = from[row * 64 + n * 8 + slice];
                    }
            }
        return true;
    }

    const ShadowSweep& m_sweep;
    const VoxelTree& m_tree;
    Field& m_field;
    LightLattice m_lattice;
    const Light& m_light;
    const std::vector<float>& m_seen;
    std::vector<std::vector<Cell>> m_cells; // by layer, as the light comes
    Rectangle m_all;
    std::vector<int> m_last;      // plane that asks for a bundle last
    std::vector<float> m_weights; // by patch: the greatest of the leaves behind it
    std::vector<Bundle> m_bundles;
    std::vector<int> m_effective_of; // of the layer's leaves under fibre extinction
    std::vector<float> m_effective;
    tbb::enumerable_thread_specific<Scratch> m_scratch;
};

ShadowSweep::ShadowSweep(const VoxelTree& tree, const std::vector<Light>& lights, const std::vector<float>& seen, double extinction,
                         double darkest, bool fibre)
    : m_tree(tree), m_extinction(extinction), m_darkest(std::min(darkest, 12.0)), m_fibre(fibre && tree.hasDirectedFibres())
{
    for (const Light& light : lights) {
        m_directional.push_back(light.kind == LightKind::directional);
        m_field_of.push_back({-1, -1, -1, -1, -1, -1});
        if (tree.empty()) continue;
        const bool directional = light.kind == LightKind::directional;
        for (int side = 0; side < (directional ? 1 : 6); ++side) {
            Field field;
            field.lattice = directional ? LightLattice::parallel(tree.directionToCorner(light.direction), kSpacing)
                                        : LightLattice::fan(tree.toCorner(light.position), side / 2, side % 2 ? 1 : -1);
            if (!Sweeper(*this, field, light, seen).run()) continue;
            m_field_of.back()[side] = int(m_fields.size());
            m_fields.push_back(std::move(field));
        }
    }
}

const ShadowSweep::Field* ShadowSweep::fieldOf(std::size_t light, const Vec3d& L) const
{
    int side = 0;
    if (!m_directional[light]) {
        const int a = std::abs(L[0]) >= std::abs(L[1]) && std::abs(L[0]) >= std::abs(L[2]) ? 0 : std::abs(L[1]) >= std::abs(L[2]) ? 1 : 2;
        side = 2 * a + (L[a] < 0); // the light goes the other way
    }
    return m_field_of[light][side] < 0 ? nullptr : &m_fields[m_field_of[light][side]];
}

std::int32_t ShadowSweep::Field::patch(int plane, int bundle_b, int bundle_c) const
{
    const Plane& at = planes[plane];
    return at.bundles.holds(bundle_b, bundle_c) ? patches[at.first + at.bundles.index(bundle_b, bundle_c)] : kUnknown;
}

namespace {

struct Place {   // between rays
    double u, v; // in the bundle
    int bundle_b, bundle_c;

    Place(const LightLattice& l, const Vec3d& p, const Vec3d& L, double way, double s, int bundle)
    {
        const double per_ray = 1 / l.spacing(s);
        locate(l.offsetFrom(0, p[l.b] + way * L[l.b], s) * per_ray, bundle, u, bundle_b);
        locate(l.offsetFrom(1, p[l.c] + way * L[l.c], s) * per_ray, bundle, v, bundle_c);
    }

private:
    static void locate(double ray, int bundle, double& inside, int& number)
    {
        const double whole = std::floor(ray * (1.0 / bundle));
        number = int(whole);
        inside = std::min(std::max(ray - whole * bundle, 0.0), bundle - 1e-9);
    }
};

double between(const std::uint8_t* codes, int stride_u, int stride_v, double u, double v)
{
    const int i = int(u), j = int(v);
    const std::uint8_t* c = codes + i * stride_u + j * stride_v;
    const double x = u - i, y = v - j;
    return (1 - x) * ((1 - y) * c[0] + y * c[stride_v]) + x * ((1 - y) * c[stride_u] + y * c[stride_u + stride_v]);
}

} // namespace

// The code between rays kStride apart.
bool ShadowSweep::Field::roughCode(int plane, const Vec3d& p, const Vec3d& L, double to_plane, double darkest, double& code,
                                   bool& fine) const
{
    const Place place(lattice, p, L, to_plane, first_s + double(kLeafDim) * plane, kBundle);
    const std::int32_t at = patch(plane, place.bundle_b, place.bundle_c);
    if (at == kUnknown) return false;
    fine = at < 0 || (at & 1);
    if (at == kBright) code = 255;
    else if (at == kDark) code = 255 * std::exp(-darkest);
    else {
        const std::uint8_t* c = &codes[std::size_t(at >> 1) * kUnit];
        if (at & 1) code = between(c, kStride * kSide, kStride, place.u * (1.0 / kStride), place.v * (1.0 / kStride));
        else code = between(c, kRoughSide, 1, place.u * (1.0 / kStride), place.v * (1.0 / kStride));
    }
    return true;
}

bool ShadowSweep::roughLight(std::size_t light, const int* cell, const Vec3d& p, const Vec3d& L, double distance, double& passes,
                             bool& fine) const
{
    const Field* f = fieldOf(light, L);
    if (!f) return false;
    const int a = f->lattice.a, low = cell[a] & ~(kLeafDim - 1);
    const double s = f->lattice.sign > 0 ? low : -(low + double(kLeafDim)), slices = f->lattice.travel(p) - s, stretch = 1 / std::abs(L[a]);
    const int plane = int((s - f->first_s) * (1.0 / kLeafDim));
    if (s < f->first_s || plane + 1 >= int(f->planes.size()) || distance <= slices * stretch
        || (f->lattice.fans && s <= f->lattice.s0 + 1e-3))
        return false;
    double before, behind;
    bool behind_fine;
    if (!f->roughCode(plane, p, L, slices * stretch, m_darkest, before, fine)
        || !f->roughCode(plane + 1, p, L, (slices - kLeafDim) * stretch, m_darkest, behind, behind_fine))
        return false;
    const double code = (before + (behind - before) * slices * (1.0 / kLeafDim)) * (1.0 / 255);
    passes = code * code;
    return true;
}

bool ShadowSweep::toLight(std::size_t light, const int* cell, const Vec3d& p, const Vec3d& L, double distance, double& way,
                          double& depth) const
{
    const Field* f = fieldOf(light, L);
    if (!f) return false;
    const int a = f->lattice.a, low = cell[a] & ~(kLeafDim - 1);
    // The plane where the light enters the cell's layer of leaves.
    const double s = f->lattice.sign > 0 ? low : -(low + double(kLeafDim));
    const int plane = int((s - f->first_s) * (1.0 / kLeafDim));
    if (s < f->first_s || plane >= int(f->planes.size())) return false;
    const double to_plane = std::max(0.0, (f->lattice.travel(p) - s) / std::abs(L[a]));
    if (to_plane >= distance || (f->lattice.fans && s <= f->lattice.s0 + 1e-3)) {
        way = distance;
        depth = 0;
        return true;
    }
    const Place place(f->lattice, p, L, to_plane, s, kBundle);
    const std::int32_t patch = f->patch(plane, place.bundle_b, place.bundle_c);
    if (patch == kUnknown || (patch >= 0 && !(patch & 1))) return false;
    way = to_plane;
    if (patch == kBright) depth = 0;
    else if (patch == kDark) depth = 2 * m_darkest;
    else
        depth =
            -2 * std::log(std::max(between(&f->codes[std::size_t(patch >> 1) * kUnit], kSide, 1, place.u, place.v), 0.25) * (1.0 / 255));
    return true;
}

std::size_t ShadowSweep::memoryBytes() const
{
    std::size_t bytes = 0;
    for (const Field& f : m_fields) bytes += f.planes.size() * sizeof(Plane) + f.patches.size() * sizeof(std::int32_t) + f.codes.size();
    return bytes;
}

} // namespace volcomp
