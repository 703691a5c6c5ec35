// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/tile_accumulator.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <new>

#include <sys/mman.h>

#include "volcomp/base/principal_direction.h"
#include "volcomp/volume/half_floats.h"

namespace volcomp {
namespace {

constexpr int kSize = TileCells::kSize, kMargin = TileCells::kMargin, kAcross = TileCells::kAcross;
constexpr std::size_t kLargePage = std::size_t(1) << 21;

/// Touched voxels of a tile as the bytes of PackedBlock::mask: eight z of a row of voxels.
struct Marks {
    std::uint8_t of_z[kSize / 8][kSize][kSize]; ///< by z / 8, x, y
};

/// Takes the bits of `touched` and clears them.
Marks takeMarks(std::int32_t (&touched)[kAcross * kAcross])
{
    Marks marks;
    for (int half = 0; half < kSize / 8; ++half)
        for (int x = 0; x < kSize; ++x) {
            const std::int32_t* const row = &touched[(x + kMargin) * kAcross + kMargin];
            for (int y = 0; y < kSize; ++y)
                marks.of_z[half][x][y] = static_cast<std::uint8_t>(row[y] >> (kMargin + 8 * half));
        }
    std::memset(touched, 0, sizeof(touched));
    return marks;
}

/// Cells from a block's first voxel of one x to those of the mask's bits.
constexpr std::array<std::int32_t, 64> kCellOfBit = [] {
    std::array<std::int32_t, 64> cells{};
    for (int bit = 0; bit < 64; ++bit) cells[bit] = (bit >> 3) * kAcross + (bit & 7);
    return cells;
}();

} // namespace

/// The tile's voxels above the minimum, block after block.
struct TileAccumulator::Channels : TileChannels {
    Half3 vectors[3][kMost]; ///< directions, colours and scatter ratios
    openvdb::math::half own_share[kMost];
    std::vector<PackedBlock> blocks;
};

void TileAccumulator::Free::operator()(void* p) const { std::free(p); }

TileAccumulator::TileAccumulator() : m_batch(new CubeBatch()), m_channels(new Channels())
{
    constexpr std::size_t bytes =
        (sizeof(VoxelSum) * (TileCells::kCount + 1) + kLargePage - 1) / kLargePage * kLargePage;
    void* const memory = std::aligned_alloc(kLargePage, bytes);
    if (!memory) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
    ::madvise(memory, bytes,
              MADV_HUGEPAGE); // rows are far apart: with small pages each has its own
#endif
    m_sums.reset(new (memory) VoxelSum[TileCells::kCount + 1]());
    VoxelSum& last = m_sums[TileCells::kCount]; // what gatherCells() fills vectors with
    last.values[VoxelSum::kDiagonal] = last.values[VoxelSum::kDensity] = 1;
}

TileAccumulator::~TileAccumulator() = default;

void TileAccumulator::add(int count, float width) { addCubes(*m_batch, count, width, cells()); }

void TileAccumulator::finish(const openvdb::Coord& origin, float minimum, const VoxelValues& values,
                             VoxelStore& store, std::vector<PackedBlock>& blocks)
{
    Channels& c = *m_channels;
    const int count = findVoxels(origin, minimum);
    if (count == 0) return;
    gatherCells(count, cells(), values.scatter_ratio, c);
    const auto n = static_cast<std::size_t>(count);
    if (values.direction) {
        findDirections(count);
        toHalf3(c.direction[0], c.direction[1], c.direction[2], c.vectors[0], n);
    }
    if (values.colour) {
        divideByDensity(count, c, c.colour);
        toHalf3(c.colour[0], c.colour[1], c.colour[2], c.vectors[1], n);
    }
    if (values.scatter_ratio) {
        divideByDensity(count, c, c.scatter_ratio);
        toHalf3(c.scatter_ratio[0], c.scatter_ratio[1], c.scatter_ratio[2], c.vectors[2], n);
    }
    if (values.own_share) {
        for (std::size_t k = 0; k < n; ++k)
            c.squares[k] = std::min(1.0f, c.squares[k] / (c.density[k] * c.density[k]));
        toHalf(c.squares, c.own_share, n);
    }
    writeBlocks(count, values, store);
    blocks.insert(blocks.end(), c.blocks.begin(), c.blocks.end());
}

/// Lists the blocks of the tile and the cells of their voxels, and clears the cells of voxels that
/// are not above the minimum. Returns how many voxels there are.
int TileAccumulator::findVoxels(const openvdb::Coord& origin, float minimum)
{
    const Marks marks = takeMarks(m_touched);
    m_channels->blocks.clear();
    int count = 0;
    for (int bx = 0; bx < kSize; bx += 8)
        for (int by = 0; by < kSize; by += 8)
            for (int bz = 0; bz < kSize; bz += 8) {
                std::uint64_t touched[8];
                for (int x = 0; x < 8; ++x)
                    std::memcpy(&touched[x], &marks.of_z[bz / 8][bx + x][by], 8);
                const int first =
                    ((bx + kMargin) * kAcross + by + kMargin) * kAcross + bz + kMargin;
                findInBlock(touched, first, minimum, origin.offsetBy(bx, by, bz), count);
            }
    return count;
}

/// findVoxels() for one block, whose first voxel's cell is `first`.
void TileAccumulator::findInBlock(const std::uint64_t (&touched)[8], int first, float minimum,
                                  const openvdb::Coord& origin, int& count)
{
    PackedBlock block;
    std::int32_t* const cell = m_channels->cell;
    const int before = count;
    for (int x = 0; x < 8; ++x) {
        block.mask[x] = touched[x];
        for (std::uint64_t left = touched[x]; left; left &= left - 1) {
            const int bit = __builtin_ctzll(left);
            cell[count] = first + x * kAcross * kAcross + kCellOfBit[bit];
            if (m_sums[cell[count]].density() > minimum) ++count;
            else {
                block.mask[x] &= ~(std::uint64_t(1) << bit);
                m_sums[cell[count]] = {};
            }
        }
    }
    if (count == before) return;
    block.origin = origin;
    block.count = static_cast<std::uint32_t>(count - before);
    m_channels->blocks.push_back(block);
}

/// Fills the channels' directions; in double where single precision is not enough.
void TileAccumulator::findDirections(int count)
{
    Channels& c = *m_channels;
    const int unsure = volcomp::findDirections(count, c);
    for (int i = 0; i < unsure; ++i) {
        const int k = c.unsure[i];
        const auto& t = c.tensor;
        const SymmetricTensor s{t[0][k], t[1][k], t[2][k], t[3][k], t[5][k], t[4][k]};
        const Vec3d d = principalDirection(s).stored();
        for (int a = 0; a < 3; ++a) c.direction[a][k] = static_cast<float>(d[a]);
    }
}

/// Writes the voxels of the listed blocks to the store.
void TileAccumulator::writeBlocks(int count, const VoxelValues& values, VoxelStore& store)
{
    constexpr std::size_t kAlignment = alignof(std::uint64_t); // of a block's values
    const auto padded = [](std::size_t bytes) {
        return (bytes + kAlignment - 1) / kAlignment * kAlignment;
    };
    Channels& c = *m_channels;
    const std::size_t voxel_bytes = PackedPart::voxelBytes(values.direction, values.colour,
                                                           values.scatter_ratio, values.own_share);
    std::byte* to = store.allocate(static_cast<std::size_t>(count) * voxel_bytes
                                   + c.blocks.size() * (kAlignment - 1));
    std::size_t first = 0;
    for (PackedBlock& block : c.blocks) {
        const std::size_t n = block.count;
        block.values = to;
        std::byte* next = to;
        const auto put = [&](const void* from, std::size_t bytes) {
            std::memcpy(next, from, bytes);
            next += bytes;
        };
        put(c.density + first, n * sizeof(float));
        if (values.direction) put(c.vectors[0] + first, n * sizeof(Half3));
        if (values.colour) put(c.vectors[1] + first, n * sizeof(Half3));
        if (values.scatter_ratio) put(c.vectors[2] + first, n * sizeof(Half3));
        if (values.own_share) put(c.own_share + first, n * sizeof(openvdb::math::half));
        to += padded(n * voxel_bytes);
        first += n;
    }
}

} // namespace volcomp
