#include "tile_accumulator.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>

#include "eigen3.h"

namespace volcomp {
namespace {

using Four = float __attribute__((vector_size(16))); // portable: GCC and Clang lower it to what the target has

constexpr int kCells = TileAccumulator::kSize * TileAccumulator::kSize * TileAccumulator::kSize;
constexpr int kLeaf = 512;

/// Largest eigenvectors of many tensors of trace 1 at once; written so that compilers vectorise it. Newton's method from 0 finds the
/// smallest root m = 1 - l1 of the characteristic polynomial from below. `sure` is 0 where the two largest eigenvalues are too close for it.
void principalDirections(int count, const float (&t)[6][kLeaf], float (&d)[3][kLeaf], float (&sure)[kLeaf])
{
    for (int i = 0; i < count; ++i) {
        const float xx = t[0][i], yy = t[1][i], zz = t[2][i], xy = t[3][i], xz = t[4][i], yz = t[5][i];
        const float c1 = (xx * yy - xy * xy) + (xx * zz - xz * xz) + (yy * zz - yz * yz);
        const float c0 = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
        float m = 0;
        for (int k = 0; k < 7; ++k) {
            const float l = 1 - m;
            const float f = m * l * l - c1 * l + c0, slope = l * l - 2 * m * l + c1;
            m -= f / std::max(slope, 1e-6f);
        }
        m = std::min(std::max(m, 0.0f), 0.66f);
        const float l = 1 - m;
        const float a = xx - l, b = yy - l, c = zz - l;
        const float p0 = xy * yz - xz * b, p1 = xz * xy - a * yz, p2 = a * b - xy * xy;   // rows 0 and 1
        const float q0 = xy * c - xz * yz, q1 = xz * xz - a * c, q2 = a * yz - xy * xz;   // rows 0 and 2
        const float r0 = b * c - yz * yz, r1 = yz * xz - xy * c, r2 = xy * yz - b * xz;   // rows 1 and 2
        const float np = p0 * p0 + p1 * p1 + p2 * p2, nq = q0 * q0 + q1 * q1 + q2 * q2, nr = r0 * r0 + r1 * r1 + r2 * r2;
        const bool use_q = nq > np;
        float n = use_q ? nq : np, x = use_q ? q0 : p0, y = use_q ? q1 : p1, z = use_q ? q2 : p2;
        const bool use_r = nr > n;
        n = use_r ? nr : n, x = use_r ? r0 : x, y = use_r ? r1 : y, z = use_r ? r2 : z;
        const float spread = std::sqrt(m / (2 * l));
        const float f = (1 - std::min(spread, 1.0f)) / std::sqrt(std::max(n, 1e-30f));
        // The slope at the root is (l1 - l2)(l1 - l3): small where the largest eigenvalue is not alone.
        const float slope = l * l - 2 * m * l + c1;
        sure[i] = slope > 0.02f && n > 1e-8f ? 1.0f : 0.0f;
        d[0][i] = f * x, d[1][i] = f * y, d[2][i] = f * z;
    }
}

} // namespace

TileAccumulator::TileAccumulator()
    : m_sums(static_cast<VoxelSum*>(::operator new[](sizeof(VoxelSum) * kCells, std::align_val_t(64))))
{
    std::memset(static_cast<void*>(m_sums.get()), 0, sizeof(VoxelSum) * kCells);
    constexpr int kAcross = kSize / 8;
    for (int i = 0; i < kSize; ++i) {
        m_x[i] = (i >> 3) * kAcross * kAcross * kLeaf + (i & 7) * 64;
        m_y[i] = (i >> 3) * kAcross * kLeaf + (i & 7) * 8;
        m_z[i] = (i >> 3) * kLeaf + (i & 7);
    }
}

void TileAccumulator::add(const float low[3], float width, const VoxelSum& what)
{
    int first[3], last[3];
    float w[3][3];
    for (int i = 0; i < 3; ++i) {
        const float cell = std::floor(low[i]);
        first[i] = static_cast<int>(cell);
        const float w0 = std::min(1 - (low[i] - cell), width), w1 = std::min(1.0f, width - w0);
        w[i][0] = w0, w[i][1] = w1, w[i][2] = width - w0 - w1;
        last[i] = first[i] + (w[i][2] > 0 ? 2 : w1 > 0 ? 1 : 0);
    }
    const int from[3] = {std::max(first[0], 0), std::max(first[1], 0), std::max(first[2], 0)};
    const int to[3] = {std::min(last[0], kSize - 1), std::min(last[1], kSize - 1), std::min(last[2], kSize - 1)};
    if (from[0] > to[0] || from[1] > to[1] || from[2] > to[2]) return;
    const Four a = *reinterpret_cast<const Four*>(&what.density), b = *reinterpret_cast<const Four*>(&what.tensor[3]),
               c = *reinterpret_cast<const Four*>(&what.colour[1]);
    for (int x = from[0]; x <= to[0]; ++x)
        for (int y = from[1]; y <= to[1]; ++y) {
            const int row = m_x[x] + m_y[y];
            const float wxy = w[0][x - first[0]] * w[1][y - first[1]];
            for (int z = from[2]; z <= to[2]; ++z) {
                const float weight = wxy * w[2][z - first[2]];
                const int cell = row + m_z[z];
                m_touched[cell >> 9] = true;
                Four* sum = reinterpret_cast<Four*>(&m_sums[cell]);
                sum[0] += weight * a;
                sum[1] += weight * b;
                sum[2] += weight * c;
            }
        }
}

std::vector<TileAccumulator::Leaves> TileAccumulator::finish(const openvdb::Coord& origin, float minimum, bool direction, bool colour)
{
    std::vector<Leaves> result;
    constexpr int kAcross = kSize / 8;
    for (int block = 0; block < kBlocks; ++block) {
        if (!m_touched[block]) continue;
        m_touched[block] = false;
        const openvdb::Coord corner = origin.offsetBy(block / (kAcross * kAcross) * 8, block / kAcross % kAcross * 8, block % kAcross * 8);
        VoxelSum* sums = &m_sums[block * kLeaf];
        if (const Leaves leaves = finishBlock(sums, corner, minimum, direction, colour); leaves.density) result.push_back(leaves);
        std::memset(static_cast<void*>(sums), 0, sizeof(VoxelSum) * kLeaf);
    }
    return result;
}

TileAccumulator::Leaves TileAccumulator::finishBlock(VoxelSum* sums, const openvdb::Coord& origin, float minimum, bool direction, bool colour)
{
    int place[kLeaf], count = 0;
    for (int i = 0; i < kLeaf; ++i) {
        place[count] = i;
        count += sums[i].density > minimum;
    }
    Leaves leaves;
    if (count == 0) return leaves;
    using Scalar = openvdb::FloatTree::LeafNodeType;
    using Vector = openvdb::Vec3STree::LeafNodeType;
    Scalar::NodeMaskType mask;
    for (int k = 0; k < count; ++k) mask.setOn(static_cast<openvdb::Index32>(place[k]));
    leaves.density = new Scalar(origin, 0.0f);
    leaves.density->setValueMask(mask);
    float* density = leaves.density->buffer().data();
    for (int k = 0; k < count; ++k) density[place[k]] = sums[place[k]].density;
    if (colour) {
        leaves.colour = new Vector(origin, openvdb::Vec3s(0.0f));
        leaves.colour->setValueMask(mask);
        openvdb::Vec3s* out = leaves.colour->buffer().data();
        for (int k = 0; k < count; ++k) {
            const VoxelSum& s = sums[place[k]];
            const float f = 1 / s.density;
            out[place[k]] = openvdb::Vec3s(s.colour[0] * f, s.colour[1] * f, s.colour[2] * f);
        }
    }
    if (direction) {
        alignas(64) float t[6][kLeaf], d[3][kLeaf], sure[kLeaf];
        for (int k = 0; k < count; ++k) {
            const VoxelSum& s = sums[place[k]];
            const float f = 1 / (s.tensor[0] + s.tensor[1] + s.tensor[2]);
            for (int i = 0; i < 6; ++i) t[i][k] = s.tensor[i] * f;
        }
        principalDirections(count, t, d, sure);
        leaves.direction = new Vector(origin, openvdb::Vec3s(0.0f));
        leaves.direction->setValueMask(mask);
        openvdb::Vec3s* out = leaves.direction->buffer().data();
        for (int k = 0; k < count; ++k) {
            if (sure[k] != 0) out[place[k]] = openvdb::Vec3s(d[0][k], d[1][k], d[2][k]);
            else {
                const SymmetricTensor s{t[0][k], t[1][k], t[2][k], t[3][k], t[4][k], t[5][k]};
                out[place[k]] = openvdb::Vec3s(principalDirection(s).stored());
            }
        }
    }
    return leaves;
}

} // namespace volcomp
