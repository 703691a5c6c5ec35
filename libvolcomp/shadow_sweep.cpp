#include "shadow_sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace volcomp {
namespace {

constexpr int kAxisRays = 3, kFineRays = kAxisRays * kAxisRays; // kept of a voxel

// The rays of a slice along one axis, as seen from a voxel: ray i is at voxel + offset.
struct Lattice {
    double offset = 0;        // of the first ray, -0.25 ... 0.25
    int parity[kAxisRays], step[kAxisRays];   // class and voxel of each
};

// Rays are half a voxel apart, classes by turns; `first` is where the first class is. Takes the three nearest to the voxel's middle.
Lattice latticeAt(double first)
{
    Lattice l;
    const double i0 = std::ceil(2 * (-0.25 - first)); // the first ray at -0.25 or above
    l.offset = first + 0.5 * i0;
    for (int k = 0; k < kAxisRays; ++k) {
        const int i = int(i0) + k;
        l.parity[k] = i & 1;
        // Ray i of voxel 0 is stored with the voxel it stands in.
        l.step[k] = int(std::floor(l.offset + 0.5 * k));
    }
    return l;
}

// Where the rays of the first class cross the middle plane of the n-th slice, in [0, 1) of their voxel.
double firstRay(double slope, int n)
{
    const double first = 0.25 + slope * (n + 0.5);
    return first - std::floor(first);
}

// How the rays of one class go on from a place in their voxel: through up to three voxels, with the extinction of density 1 in each.
struct Cut {
    float weight[3] = {0, 0, 0};
    int step_b[3] = {0, 0, 0}, step_c[3] = {0, 0, 0};
};

Cut cutOf(double fraction_b, double fraction_c, double slope_b, double slope_c, double way, double extinction)
{
    Cut cut;
    const auto crossing = [](double fraction, double slope) {
        return slope > 0 ? (1 - fraction) / slope : slope < 0 ? fraction / -slope : std::numeric_limits<double>::infinity();
    };
    const double tb = crossing(fraction_b, slope_b), tc = crossing(fraction_c, slope_c);
    double t = 0;
    int b = 0, c = 0;
    for (int i = 0; i < 3; ++i) {
        const double next_b = b == 0 ? tb : 2, next_c = c == 0 ? tc : 2, end = std::min({next_b, next_c, way});
        cut.weight[i] = float(extinction * std::max(0.0, end - t));
        cut.step_b[i] = b;
        cut.step_c[i] = c;
        t = end;
        if (end >= way) break;
        if (next_b <= next_c) b = slope_b > 0 ? 1 : -1;
        else c = slope_c > 0 ? 1 : -1;
    }
    return cut;
}

struct Cell { // a leaf where it stands
    int leaf, b, c;
};

// A plane of floats that is shifted against the grid by moving its origin.
struct Plane {
    std::vector<float> values;
    std::ptrdiff_t base = 0, stride = 0;
    float* at(int b, int c) { return values.data() + base + b * stride + c; }
};

// to += the density on the rays' way, for `count` voxels in a row.
template <int kCount>
inline void addWay(float* __restrict to, const float* from, Plane& density, const Cut& cut, int b, int c)
{
    const float* r0 = density.at(b + cut.step_b[0], c + cut.step_c[0]);
    const float* r1 = density.at(b + cut.step_b[1], c + cut.step_c[1]);
    const float* r2 = density.at(b + cut.step_b[2], c + cut.step_c[2]);
    for (int i = 0; i < kCount; ++i) to[i] = from[i] + cut.weight[0] * r0[i] + cut.weight[1] * r1[i] + cut.weight[2] * r2[i];
}

} // namespace

ShadowSweep::ShadowSweep(const VoxelTree& tree, const std::vector<Light>& lights, const std::vector<char>& wanted, double extinction, double darkest, bool fibre)
    : m_tree(tree), m_wanted(wanted), m_extinction(extinction), m_darkest(std::min(darkest, 16.0)), m_fibre(fibre && tree.hasDirectedFibres()), m_fields(lights.size())
{
    tbb::parallel_for(std::size_t(0), lights.size(), [&](std::size_t i) {
        if (lights[i].kind != LightKind::directional || tree.empty()) return;
        Field& f = m_fields[i];
        const Vec3d d = tree.directionToCorner(lights[i].direction);
        f.swept = true;
        f.a = std::abs(d[0]) >= std::abs(d[1]) && std::abs(d[0]) >= std::abs(d[2]) ? 0 : std::abs(d[1]) >= std::abs(d[2]) ? 1 : 2;
        f.b = f.a == 0 ? 1 : 0;
        f.c = f.a == 2 ? 1 : 2;
        f.sign = d[f.a] > 0 ? 1 : -1;
        f.length = 1 / std::abs(d[f.a]);
        f.slope_b = d[f.b] * f.length;
        f.slope_c = d[f.c] * f.length;
        f.first = f.sign > 0 ? tree.bounds().min()[f.a] : tree.bounds().max()[f.a];
        f.to_light_world = -lights[i].direction;
        sweep(f);
    });
}

void ShadowSweep::sweep(Field& f)
{
    const openvdb::CoordBBox& box = m_tree.bounds();
    // A ring of empty tiles all around: rays that come in from the side cut voxels before they stand in a tile of the volume.
    const int low_b = box.min()[f.b] - kLeafDim, low_c = box.min()[f.c] - kLeafDim;
    const int size_b = box.max()[f.b] - low_b + 1 + kLeafDim, size_c = box.max()[f.c] - low_c + 1 + kLeafDim;
    const int layers = (box.max()[f.a] - box.min()[f.a] + 1) / kLeafDim;
    const int tiles_b = size_b / kLeafDim, tiles_c = size_c / kLeafDim;
    const float code_scale = float(255 * 255 / m_darkest);
    const std::array<int, 3> strides{64, 8, 1};

    // Leaves by layer, in the order the light reaches them.
    std::vector<std::vector<Cell>> order(layers);
    m_tree.forEachCell([&](const openvdb::Coord& origin, int leaf) {
        const int layer = (origin[f.a] - box.min()[f.a]) / kLeafDim;
        order[f.sign > 0 ? layer : layers - 1 - layer].push_back({leaf, origin[f.b] - low_b, origin[f.c] - low_c});
    });

    f.starts.assign(m_tree.leafCount(), kUnknown);
    // Planes have a border of three voxels. The depths move by one voxel at a time as the rays drift, up to `drift` in all.
    const std::ptrdiff_t stride = size_c + 6;
    Plane density{std::vector<float>(std::size_t(stride) * (size_b + 6)), 3 * stride + 3, stride};
    std::array<Plane, 4> depth;
    const auto drift = [&](double slope) { return std::ptrdiff_t(std::ceil(std::abs(slope) * layers * kLeafDim)) + 2; };
    for (Plane& p : depth) {
        p.values.assign(std::size_t(stride) * (size_b + 6) + drift(f.slope_b) * stride + drift(f.slope_c), 0);
        p.stride = stride;
        // Moving along +b lowers the base; begin where the drift has room.
        p.base = 3 * stride + 3 + (f.slope_b > 0 ? drift(f.slope_b) * stride : 0) + (f.slope_c > 0 ? drift(f.slope_c) : 0);
    }
    std::array<std::array<int, 2>, 4> moved{}; // whole voxels, by class
    const auto startOf = [](int parity, double slope, double n) { return 0.25 + 0.5 * parity + slope * n; };
    const auto fraction = [](double x) { return x - std::floor(x); };

    std::vector<char> tile_state(std::size_t(tiles_b) * tiles_c); // bit 0: rays can meet a voxel of the layer; bit 1: dark
    std::vector<int> tiles;
    for (int layer = 0; layer < layers; ++layer) {
        const auto isDark = [&](int tb, int tc) {
            for (Plane& p : depth)
                for (int b = 0; b < kLeafDim; ++b) {
                    const float* row = p.at(tb * kLeafDim + b, tc * kLeafDim);
                    for (int c = 0; c < kLeafDim; ++c)
                        if (row[c] < m_darkest) return false;
                }
            return true;
        };
        // A tile is dark for the whole layer if it is, and those whose rays drift into it are.
        const auto staysDark = [&](int tb, int tc) {
            for (int db = 0; db <= (f.slope_b != 0); ++db)
                for (int dc = 0; dc <= (f.slope_c != 0); ++dc) {
                    const int b = tb - (f.slope_b > 0 ? db : -db), c = tc - (f.slope_c > 0 ? dc : -dc);
                    if (b < 0 || c < 0 || b >= tiles_b || c >= tiles_c || !(tile_state[b * tiles_c + c] & 2)) return false;
                }
            return true;
        };
        std::fill(tile_state.begin(), tile_state.end(), 0);
        tiles.clear();
        const auto reach = [&](const Cell& cell, auto&& g) {
            for (int db = -1; db <= 1; ++db)
                for (int dc = -1; dc <= 1; ++dc) {
                    const int tb = cell.b / kLeafDim + db, tc = cell.c / kLeafDim + dc;
                    if (tb >= 0 && tc >= 0 && tb < tiles_b && tc < tiles_c) g(tb, tc, tb * tiles_c + tc);
                }
        };
        for (const Cell& cell : order[layer])
            reach(cell, [&](int, int, int tile) {
                if (tile_state[tile] & 1) return;
                tile_state[tile] |= 1;
                tiles.push_back(tile);
            });
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tiles.size(), 64), [&](const auto& range) {
            for (std::size_t i = range.begin(); i < range.end(); ++i)
                if (isDark(tiles[i] / tiles_c, tiles[i] % tiles_c)) tile_state[tiles[i]] |= 2;
        });
        std::vector<Cell> cells; // that light reaches
        std::size_t end = f.codes.size();
        for (const Cell& cell : order[layer]) {
            const VoxelTree::Leaf& leaf = m_tree.leaf(cell.leaf);
            const char wanted = leaf.uniform ? char(unseen) : m_wanted[cell.leaf];
            if (staysDark(cell.b / kLeafDim, cell.c / kLeafDim)) {
                if (wanted) f.starts[cell.leaf] = kDark;
                continue;
            }
            cells.push_back(cell);
            if (!wanted) continue;
            f.starts[cell.leaf] = std::int64_t(end);
            end += (leaf.before[7] + __builtin_popcountll(leaf.mask[7])) * (wanted == fine ? kFineRays : 1);
        }
        f.codes.resize(end);
        tiles.erase(std::remove_if(tiles.begin(), tiles.end(), [&](int tile) { return tile_state[tile] & 2; }), tiles.end());

        for (int i = 0; i < kLeafDim; ++i) {
            const int n = layer * kLeafDim + i, slice = f.sign > 0 ? i : kLeafDim - 1 - i;
            std::array<Cut, 4> whole, half;
            for (int k = 0; k < 4; ++k) {
                const double b = startOf(k >> 1, f.slope_b, n), c = startOf(k & 1, f.slope_c, n);
                whole[k] = cutOf(fraction(b), fraction(c), f.slope_b, f.slope_c, 1, m_extinction * f.length);
                half[k] = cutOf(fraction(b), fraction(c), f.slope_b, f.slope_c, 0.5, m_extinction * f.length);
                // Rays drifted over a voxel's border: what was with voxel b is now with b + 1, and nothing has met the rays that come in.
                const int moved_b = int(std::floor(b)), moved_c = int(std::floor(c));
                depth[k].base -= (moved_b - moved[k][0]) * stride + (moved_c - moved[k][1]);
                if (moved_b != moved[k][0])
                    for (int row = -2; row <= 0; ++row) std::fill_n(depth[k].at(f.slope_b > 0 ? row : size_b - 1 - row, 0), size_c, 0.0f);
                if (moved_c != moved[k][1])
                    for (int row = 0; row < size_b; ++row) std::fill_n(depth[k].at(row, f.slope_c > 0 ? -2 : size_c - 1), 3, 0.0f);
                moved[k] = {moved_b, moved_c};
            }
            tbb::parallel_for(tbb::blocked_range<std::size_t>(0, cells.size(), 64), [&](const auto& range) {
                for (std::size_t at = range.begin(); at < range.end(); ++at) {
                    const Cell& cell = cells[at];
                    const float* values = m_tree.densities(cell.leaf) + slice * strides[f.a];
                    const bool fibres = m_fibre && m_tree.leaf(cell.leaf).directed_fibres;
                    for (int b = 0; b < kLeafDim; ++b) {
                        float* row = density.at(cell.b + b, cell.c);
                        for (int c = 0; c < kLeafDim; ++c) row[c] = values[b * strides[f.b] + c * strides[f.c]];
                        if (!fibres) continue;
                        for (int c = 0; c < kLeafDim; ++c)
                            if (row[c] > 0)
                                row[c] *= float(m_tree.fibreFactor(cell.leaf, b * strides[f.b] + c * strides[f.c] + slice * strides[f.a], f.to_light_world));
                    }
                }
            });
            // The rays in the slice's middle plane, with a border; each class lies with the voxel it entered the slice in.
            constexpr int kBorder = 2, kWidth = kLeafDim + 2 * kBorder;
            const Lattice lattice_b = latticeAt(firstRay(f.slope_b, n)), lattice_c = latticeAt(firstRay(f.slope_c, n));
            f.offset_b.push_back(float(lattice_b.offset));
            f.offset_c.push_back(float(lattice_c.offset));
            int ray_class[kFineRays], step_b[kFineRays], step_c[kFineRays]; // of the rays kept of a voxel: class, and where it lies
            for (int j = 0; j < kFineRays; ++j) {
                const int k = lattice_b.parity[j / kAxisRays] << 1 | lattice_c.parity[j % kAxisRays];
                ray_class[j] = k;
                step_b[j] = lattice_b.step[j / kAxisRays] - int(std::floor(startOf(k >> 1, f.slope_b, n + 0.5))) + moved[k][0];
                step_c[j] = lattice_c.step[j % kAxisRays] - int(std::floor(startOf(k & 1, f.slope_c, n + 0.5))) + moved[k][1];
            }
            tbb::parallel_for(tbb::blocked_range<std::size_t>(0, cells.size(), 64), [&](const auto& range) {
                float middle[4][kWidth][kWidth];
                // Fine where light is, coarse where it is nearly gone: depth = darkest (code / 255)^2.
                const auto encode = [&](float d) { return std::uint8_t(std::min(255.0f, std::sqrt(d * code_scale) + 0.5f)); };
                for (std::size_t at = range.begin(); at < range.end(); ++at) {
                    const Cell& cell = cells[at];
                    const std::int64_t start = f.starts[cell.leaf];
                    if (start < 0) continue;
                    const VoxelTree::Leaf& leaf = m_tree.leaf(cell.leaf);
                    const auto forVoxels = [&](auto&& g) {
                        for (int b = 0; b < kLeafDim; ++b)
                            for (int c = 0; c < kLeafDim; ++c) {
                                const int voxel = b * strides[f.b] + c * strides[f.c] + slice * strides[f.a];
                                if (leaf.mask[voxel >> 6] >> (voxel & 63) & 1) g(b, c, std::size_t(start), m_tree.recordIndex(leaf, voxel) - leaf.first);
                            }
                    };
                    if (m_wanted[cell.leaf] == fine) {
                        for (int k = 0; k < 4; ++k)
                            for (int b = 1; b < kWidth - 1; ++b)
                                addWay<kWidth>(middle[k][b], depth[k].at(cell.b + b - kBorder, cell.c - kBorder), density, half[k], cell.b + b - kBorder, cell.c - kBorder);
                        forVoxels([&](int b, int c, std::size_t first, std::size_t rank) {
                            float kept[kFineRays];
                            for (int j = 0; j < kFineRays; ++j) kept[j] = middle[ray_class[j]][b + kBorder + step_b[j]][c + kBorder + step_c[j]];
                            for (int j = 0; j < kFineRays; ++j) f.codes[first + rank * kFineRays + j] = encode(kept[j]);
                        });
                    } else {
                        constexpr int j = kFineRays / 2;
                        const int k = ray_class[j], db = step_b[j], dc = step_c[j];
                        for (int b = 0; b < kLeafDim; ++b)
                            addWay<kLeafDim>(middle[0][b], depth[k].at(cell.b + b + db, cell.c + dc), density, half[k], cell.b + b + db, cell.c + dc);
                        forVoxels([&](int b, int c, std::size_t first, std::size_t rank) { f.codes[first + rank] = encode(middle[0][b][c]); });
                    }
                }
            });
            tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tiles.size(), 64), [&](const auto& range) {
                for (std::size_t at = range.begin(); at < range.end(); ++at) {
                    const int b0 = tiles[at] / tiles_c * kLeafDim, c0 = tiles[at] % tiles_c * kLeafDim;
                    for (int k = 0; k < 4; ++k)
                        for (int b = b0; b < b0 + kLeafDim; ++b) addWay<kLeafDim>(depth[k].at(b, c0), depth[k].at(b, c0), density, whole[k], b, c0);
                }
            });
        }
        for (const Cell& cell : cells)
            for (int b = 0; b < kLeafDim; ++b) std::fill_n(density.at(cell.b + b, cell.c), kLeafDim, 0.0f);
    }
    f.codes.shrink_to_fit();
}

bool ShadowSweep::depths(std::size_t light, int leaf, int voxel, const int* cell, const Vec3d& p, const Vec3d& q, double& a, double& b) const
{
    const Field& f = m_fields[light];
    if (!f.swept) return false;
    const std::int64_t start = f.starts[leaf];
    if (start < 0) {
        a = b = 2 * m_darkest;
        return start == kDark;
    }
    const VoxelTree::Leaf& l = m_tree.leaf(leaf);
    const std::size_t rank = m_tree.recordIndex(l, voxel) - l.first;
    double own = m_extinction * f.length * m_tree.densities(leaf)[voxel]; // a slice's
    if (m_fibre && l.directed_fibres) own *= m_tree.fibreFactor(leaf, voxel, f.to_light_world);
    const double scale = m_darkest / (255 * 255);
    const auto way = [&](const Vec3d& x) { return f.sign * (x[f.a] - cell[f.a] - 0.5); }; // slices behind the middle plane
    const auto finish = [&](double sum, const Vec3d& x) { return std::max(0.0, std::min(2 * m_darkest, scale * sum + own * way(x))); };
    if (m_wanted[leaf] != fine) {
        const double code = f.codes[std::size_t(start) + rank];
        a = finish(code * code, p);
        b = finish(code * code, q);
        return true;
    }
    const std::uint8_t* codes = &f.codes[std::size_t(start) + rank * kFineRays];
    const int n = std::abs(cell[f.a] - f.first);
    const double offset_b = cell[f.b] + f.offset_b[n], offset_c = cell[f.c] + f.offset_c[n];
    const auto bilinear = [&](const Vec3d& x) {
        // In half voxels from the first ray, let out by a quarter of a voxel beyond the rays.
        const double w = way(x);
        const auto place = [](double g) { return std::min(kAxisRays - 0.5, std::max(-0.5, g)); };
        double u = place(2 * (x[f.b] - f.slope_b * w - offset_b)), v = place(2 * (x[f.c] - f.slope_c * w - offset_c));
        const int i = u >= 1, j = v >= 1;
        u -= i;
        v -= j;
        const std::uint8_t* c = codes + kAxisRays * i + j;
        const double c0 = c[0], c1 = c[1], c2 = c[kAxisRays], c3 = c[kAxisRays + 1];
        return (1 - u) * ((1 - v) * c0 * c0 + v * c1 * c1) + u * ((1 - v) * c2 * c2 + v * c3 * c3);
    };
    a = finish(bilinear(p), p);
    b = finish(bilinear(q), q);
    return true;
}

std::size_t ShadowSweep::memoryBytes() const
{
    std::size_t bytes = m_wanted.size();
    for (const Field& f : m_fields) bytes += f.starts.size() * sizeof(std::int64_t) + f.codes.capacity();
    return bytes;
}

} // namespace volcomp
