#include "tile_accumulator.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <new>

#include <sys/mman.h>

#include "eigen3.h"

namespace volcomp {
namespace {

// Portable: GCC and Clang lower them to what the target has.
using Four = float __attribute__((vector_size(16)));
using Eight = float __attribute__((vector_size(32)));

constexpr int kLeaf = 512;
constexpr std::size_t kLargePage = std::size_t(1) << 21;

/// Stored directions (VolumePart::direction) of many tensors at once; written so that compilers vectorise it. The largest eigenvalue in closed form
/// (Smith, Eigenvalues of a symmetric 3x3 matrix, CACM 1961), cos(acos(r) / 3) as a polynomial in cos(acos(r) / 2), and a step of Newton's method.
/// `sure` is 0 where the two largest eigenvalues are too close for single precision. Returns how many those are.
int principalDirections(int count, const float (&t)[6][kLeaf], float (&d)[3][kLeaf], std::int32_t (&sure)[kLeaf])
{
    int unsure = 0;
    for (int i = 0; i < count; ++i) {
        const float scale = 1 / (t[0][i] + t[1][i] + t[2][i]);
        const float xx = t[0][i] * scale, yy = t[1][i] * scale, zz = t[2][i] * scale, xy = t[3][i] * scale, yz = t[4][i] * scale,
                    xz = t[5][i] * scale;
        const float c1 = (xx * yy - xy * xy) + (xx * zz - xz * xz) + (yy * zz - yz * yz);
        const float c0 = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
        const float p2 = std::max(1.0f / 9 - c1 / 3, 1e-12f), p = std::sqrt(p2);
        const float r = (1.0f / 27 - c1 / 6 + c0 / 2) / (p2 * p);
        const float c = std::sqrt((1 + std::min(std::max(r, -1.0f), 1.0f)) * 0.5f);
        float m =
            2.0f / 3 - 2 * p * (0.500010608f + c * (0.576812483f + c * (-0.106493994f + c * (0.038352907f - c * 0.008688346f)))); // 1 - l1
        const float before = 1 - m;
        m -= (m * before * before - c1 * before + c0) / std::max(before * before - 2 * m * before + c1, 1e-6f);
        m = std::min(std::max(m, 0.0f), 0.66f);
        const float l = 1 - m;
        const float a = xx - l, b = yy - l, e = zz - l;
        const float p0 = xy * yz - xz * b, p1 = xz * xy - a * yz, p2_ = a * b - xy * xy; // rows 0 and 1
        const float q0 = xy * e - xz * yz, q1 = xz * xz - a * e, q2 = a * yz - xy * xz;  // rows 0 and 2
        const float r0 = b * e - yz * yz, r1 = yz * xz - xy * e, r2 = xy * yz - b * xz;  // rows 1 and 2
        const float np = p0 * p0 + p1 * p1 + p2_ * p2_, nq = q0 * q0 + q1 * q1 + q2 * q2, nr = r0 * r0 + r1 * r1 + r2 * r2;
        const bool use_q = nq > np;
        float n = use_q ? nq : np, x = use_q ? q0 : p0, y = use_q ? q1 : p1, z = use_q ? q2 : p2_;
        const bool use_r = nr > n;
        n = use_r ? nr : n, x = use_r ? r0 : x, y = use_r ? r1 : y, z = use_r ? r2 : z;
        const float spread = std::sqrt(m / (2 * l));
        const float f = (1 - std::min(spread, 1.0f)) / std::sqrt(std::max(n, 1e-30f));
        // The slope at the root is (l1 - l2)(l1 - l3): small where the largest eigenvalue is not alone.
        const float slope = l * l - 2 * m * l + c1;
        sure[i] = slope > 0.004f;
        unsure += !(slope > 0.004f);
        d[0][i] = f * x, d[1][i] = f * y, d[2][i] = f * z;
    }
    return unsure;
}

} // namespace

/// A block's kept voxels, channel by channel.
struct TileAccumulator::Channels {
    alignas(64) float density[kLeaf];
    alignas(64) float tensor[6][kLeaf]; ///< xx, yy, zz, xy, yz, zx
    alignas(64) float colour[3][kLeaf]; ///< times density
    float direction[3][kLeaf];
    std::int32_t sure[kLeaf];
    openvdb::math::half half[3][kLeaf];
};

void TileAccumulator::Free::operator()(void* p) const { std::free(p); }

TileAccumulator::TileAccumulator() : m_channels(new Channels)
{
    const std::size_t bytes = (sizeof(VoxelSum) * kAcross * kAcross * kAcross + kLargePage - 1) / kLargePage * kLargePage;
    void* const cells = std::aligned_alloc(kLargePage, bytes);
    if (!cells) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
    ::madvise(cells, bytes, MADV_HUGEPAGE); // rows are far apart: with small pages each has its own
#endif
    std::memset(cells, 0, bytes);
    m_cells.reset(static_cast<VoxelSum*>(cells));
}

TileAccumulator::~TileAccumulator() = default;

void TileAccumulator::add(const Batch& batch, int count, float width)
{
    // Where each cube starts and how much of it each cell has, for all cubes first: that vectorises.
    std::int32_t start[kBatch], z_of[kBatch], third[kBatch];
    float w[3][3][kBatch];
    for (int k = 0; k < count; ++k) start[k] = third[k] = 0;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < count; ++k) {
            const float p = batch.low[i][batch.index[k]] + kMargin; // > 0
            const auto cell = static_cast<std::int32_t>(p);
            const float w0 = std::min(1 - (p - float(cell)), width), w1 = std::min(1.0f, width - w0), w2 = width - w0 - w1;
            w[i][0][k] = w0, w[i][1][k] = w1, w[i][2][k] = w2;
            start[k] = start[k] * kAcross + cell;
            z_of[k] = cell;
            third[k] |= std::int32_t(w2 > 0) << i;
        }
    for (int k = 0; k < count; ++k) {
        const int j = batch.index[k], z = z_of[k], row = (start[k] - z) / kAcross;
        const Eight a = *reinterpret_cast<const Eight*>(batch.sum[j].diagonal);
        const Four c = *reinterpret_cast<const Four*>(batch.sum[j].colour);
        const std::uint64_t touched = (std::uint64_t(1) | std::uint64_t(w[2][1][k] > 0) << 1 | std::uint64_t(w[2][2][k] > 0) << 2) << z;
        // Two cells along each axis, the second perhaps with nothing; a third is rare: branches that are seldom wrong.
        const int nx = 2 + (third[k] & 1), ny = 2 + (third[k] >> 1 & 1);
        for (int x = 0; x < nx; ++x)
            for (int y = 0; y < ny; ++y) {
                const float weight = w[0][x][k] * w[1][y][k];
                const int at = row + x * kAcross + y;
                m_touched[at] |= weight > 0 ? touched : 0;
                VoxelSum* to = &m_cells[at * kAcross + z];
                const auto addTo = [&](VoxelSum& cell, float f) {
                    *reinterpret_cast<Eight*>(cell.diagonal) += f * a;
                    *reinterpret_cast<Four*>(cell.colour) += f * c;
                };
                addTo(to[0], weight * w[2][0][k]);
                addTo(to[1], weight * w[2][1][k]);
                if (third[k] & 4) addTo(to[2], weight * w[2][2][k]);
            }
    }
}

void TileAccumulator::finish(const openvdb::Coord& origin, float minimum, bool direction, bool colour, VoxelStore& store,
                             std::vector<PackedBlock>& blocks)
{
    Channels& c = *m_channels;
    for (int bx = 0; bx < kSize; bx += 8)
        for (int by = 0; by < kSize; by += 8)
            for (int bz = 0; bz < kSize; bz += 8) {
                PackedBlock block;
                std::uint64_t any = 0;
                for (int x = 0; x < 8; ++x) {
                    const std::uint64_t* rows = &m_touched[(bx + x + kMargin) * kAcross + by + kMargin];
                    std::uint64_t word = 0;
                    for (int y = 0; y < 8; ++y) word |= (rows[y] >> (bz + kMargin) & 0xff) << (8 * y);
                    block.mask[x] = word;
                    any |= word;
                }
                if (!any) continue;
                const int first = ((bx + kMargin) * kAcross + by + kMargin) * kAcross + bz + kMargin;
                const int count = gatherBlock(&m_cells[first], minimum, block.mask, c);
                if (count == 0) continue;
                block.origin = origin.offsetBy(bx, by, bz);
                block.count = static_cast<std::uint32_t>(count);
                block.values = store.allocate(count * PackedPart::voxelBytes(direction, colour));
                std::memcpy(block.values, c.density, count * sizeof(float));
                auto* vectors = reinterpret_cast<Half3*>(block.values + count * sizeof(float));
                const auto put = [&](const float(&v)[3][kLeaf]) {
                    for (int i = 0; i < 3; ++i) toHalf(v[i], c.half[i], count);
                    interleave(c.half[0], c.half[1], c.half[2], vectors, count);
                    vectors += count;
                };
                if (direction) {
                    if (principalDirections(count, c.tensor, c.direction, c.sure) > 0)
                        for (int k = 0; k < count; ++k)
                            if (!c.sure[k]) {
                                const SymmetricTensor s{c.tensor[0][k], c.tensor[1][k], c.tensor[2][k],
                                                        c.tensor[3][k], c.tensor[5][k], c.tensor[4][k]};
                                const Vec3d d = principalDirection(s).stored();
                                for (int i = 0; i < 3; ++i) c.direction[i][k] = static_cast<float>(d[i]);
                            }
                    put(c.direction);
                }
                if (colour) {
                    for (int k = 0; k < count; ++k) {
                        const float f = 1 / c.density[k];
                        for (int i = 0; i < 3; ++i) c.colour[i][k] *= f;
                    }
                    put(c.colour);
                }
                blocks.push_back(block);
            }
    std::memset(m_touched, 0, sizeof(m_touched));
}

/// Moves a block's cells into channels, drops those not above the minimum from the mask, and clears the cells. Returns how many were kept.
int TileAccumulator::gatherBlock(VoxelSum* cells, float minimum, std::array<std::uint64_t, 8>& mask, Channels& c) const
{
    int n = 0;
    std::int32_t place[kLeaf];
    for (int x = 0; x < 8; ++x)
        for (std::uint64_t left = mask[x]; left; left &= left - 1) {
            const int bit = __builtin_ctzll(left);
            place[n] = (x * kAcross + (bit >> 3)) * kAcross + (bit & 7);
            if (cells[place[n]].density > minimum) ++n;
            else {
                mask[x] &= ~(std::uint64_t(1) << bit);
                cells[place[n]] = VoxelSum{};
            }
        }
    for (int k = n; k % 4; ++k) place[k] = place[n - 1];
    for (int k = 0; k < n; k += 4) { // four cells become four values of each channel
        VoxelSum* s[4];
        for (int i = 0; i < 4; ++i) s[i] = &cells[place[k + i]];
        float* const channel[3][4] = {{c.tensor[0], c.tensor[1], c.tensor[2], c.density},
                                      {c.tensor[3], c.tensor[4], c.tensor[5], nullptr},
                                      {c.colour[0], c.colour[1], c.colour[2], nullptr}};
        for (int g = 0; g < 3; ++g) {
            const auto row = [&](int i) { return *reinterpret_cast<const Four*>(s[i]->diagonal + 4 * g); };
            const Four a = row(0), b = row(1), d = row(2), e = row(3);
            const Four ab = __builtin_shufflevector(a, b, 0, 4, 1, 5), de = __builtin_shufflevector(d, e, 0, 4, 1, 5);
            const Four ab_ = __builtin_shufflevector(a, b, 2, 6, 3, 7), de_ = __builtin_shufflevector(d, e, 2, 6, 3, 7);
            *reinterpret_cast<Four*>(channel[g][0] + k) = __builtin_shufflevector(ab, de, 0, 1, 4, 5);
            *reinterpret_cast<Four*>(channel[g][1] + k) = __builtin_shufflevector(ab, de, 2, 3, 6, 7);
            *reinterpret_cast<Four*>(channel[g][2] + k) = __builtin_shufflevector(ab_, de_, 0, 1, 4, 5);
            if (g == 0) *reinterpret_cast<Four*>(channel[g][3] + k) = __builtin_shufflevector(ab_, de_, 2, 3, 6, 7);
        }
        for (int i = 0; i < 4; ++i) *s[i] = VoxelSum{};
    }
    return n;
}

} // namespace volcomp
