#include "volcomp/compose/tile_accumulator.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <new>

#include <sys/mman.h>

#include "volcomp/base/principal_direction.h"
#include "volcomp/base/lanes.h"

namespace volcomp {
namespace {

constexpr int kVoxels = TileAccumulator::kSize * TileAccumulator::kSize * TileAccumulator::kSize;
constexpr int kRow = kVoxels + 48; ///< of a channel: not a multiple of 4096 bytes, or the channels
                                   ///< would crowd each other out of the cache
constexpr std::size_t kLargePage = std::size_t(1) << 21;

/// Vectors of the used part of a cell.
constexpr int kVectors = (12 + kLanes - 1) / kLanes;

/// to += f * from
void addScaled(VoxelSum& to, const VoxelSum& from, float f)
{
    for (int i = 0; i < kVectors; ++i)
        lanesAt(to.diagonal + i * kLanes) += f * lanesAt(from.diagonal + i * kLanes);
}

void clear(VoxelSum& cell)
{
    for (int i = 0; i < kVectors; ++i) lanesAt(cell.diagonal + i * kLanes) = Lanes{};
}

/// Stored directions (VolumePart::direction) of many tensors at once. The largest eigenvalue in
/// closed form (Smith, Eigenvalues of a symmetric 3x3 matrix, CACM 1961), cos(acos(r) / 3) as a
/// polynomial in cos(acos(r) / 2), and a step of Newton's method. `sure` is 0 where the two largest
/// eigenvalues are too close for single precision. Returns whether that is so anywhere.
bool principalDirections(int count, const float (&t)[6][kRow], float (&d)[3][kRow],
                         std::int32_t (&sure)[kRow])
{
    IntLanes all_sure = IntLanes{} - 1;
    for (int i = 0; i < count; i += kLanes) {
        const Lanes scale = 1 / (lanesAt(&t[0][i]) + lanesAt(&t[1][i]) + lanesAt(&t[2][i]));
        const Lanes xx = lanesAt(&t[0][i]) * scale, yy = lanesAt(&t[1][i]) * scale,
                    zz = lanesAt(&t[2][i]) * scale, xy = lanesAt(&t[3][i]) * scale,
                    yz = lanesAt(&t[4][i]) * scale, xz = lanesAt(&t[5][i]) * scale;
        const Lanes c1 = (xx * yy - xy * xy) + (xx * zz - xz * xz) + (yy * zz - yz * yz);
        const Lanes c0 =
            xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
        const Lanes p2 = max(1.0f / 9 - c1 * (1.0f / 3), 1e-12f), p_root = reciprocalRoot(p2),
                    p = p2 * p_root;
        const Lanes r = (1.0f / 27 - c1 * (1.0f / 6) + c0 * 0.5f) * (p_root * p_root * p_root);
        const Lanes c2 = max(min(0.5f + 0.5f * r, 1), 1e-12f), c = c2 * reciprocalRoot(c2);
        Lanes m = 2.0f / 3
            - 2 * p
                * (0.500010608f
                   + c
                       * (0.576812483f
                          + c * (-0.106493994f + c * (0.038352907f - c * 0.008688346f)))); // 1 - l1
        const Lanes before = 1 - m,
                    slope_root = reciprocalRoot(max(before * before - 2 * m * before + c1, 1e-6f));
        m -= (m * before * before - c1 * before + c0) * (slope_root * slope_root);
        m = min(max(m, 0), 0.66f);
        const Lanes l = 1 - m;
        const Lanes a = xx - l, b = yy - l, e = zz - l;
        const Lanes p0 = xy * yz - xz * b, p1 = xz * xy - a * yz,
                    p2_ = a * b - xy * xy; // rows 0 and 1
        const Lanes q0 = xy * e - xz * yz, q1 = xz * xz - a * e,
                    q2 = a * yz - xy * xz; // rows 0 and 2
        const Lanes r0 = b * e - yz * yz, r1 = yz * xz - xy * e,
                    r2 = xy * yz - b * xz; // rows 1 and 2
        const Lanes np = p0 * p0 + p1 * p1 + p2_ * p2_, nq = q0 * q0 + q1 * q1 + q2 * q2,
                    nr = r0 * r0 + r1 * r1 + r2 * r2;
        const IntLanes use_q = nq > np;
        Lanes n = use_q ? nq : np, x = use_q ? q0 : p0, y = use_q ? q1 : p1, z = use_q ? q2 : p2_;
        const IntLanes use_r = nr > n;
        n = use_r ? nr : n, x = use_r ? r0 : x, y = use_r ? r1 : y, z = use_r ? r2 : z;
        const Lanes spread = m * reciprocalRoot(max(2 * l * m, 1e-30f)); // sqrt(m / 2 l)
        const Lanes f = (1 - min(spread, 1)) * reciprocalRoot(max(n, 1e-30f));
        // The slope at the root is (l1 - l2)(l1 - l3): small where the largest eigenvalue is not
        // alone.
        const IntLanes is_sure = l * l - 2 * m * l + c1 > 0.004f;
        lanesAt(&sure[i]) = is_sure;
        all_sure &= is_sure;
        lanesAt(&d[0][i]) = f * x;
        lanesAt(&d[1][i]) = f * y;
        lanesAt(&d[2][i]) = f * z;
    }
    return bitsOf(~all_sure) != 0;
}

} // namespace

/// Where each cube of a batch starts, and how much of it each cell has.
struct TileAccumulator::Shares {
    alignas(64) std::int32_t row[kBatch], z[kBatch]; ///< of its first cell
    alignas(64) std::int32_t
        touched[4][kBatch]; ///< cells of its first two rows in x and in y, as m_touched
    alignas(64) std::int32_t third[kBatch]; ///< whether it reaches into a third cell along an axis
    alignas(64) float along[3][3][kBatch];  ///< by axis and cell
    alignas(64) float part[8][kBatch];      ///< of the first two cells along each axis, z fastest
};

/// The voxels of a tile, channel by channel, block after block.
struct TileAccumulator::Channels {
    alignas(64) float density[kRow];
    alignas(64) float tensor[6][kRow]; ///< xx, yy, zz, xy, yz, zx
    alignas(64) float colour[3][kRow]; ///< times density
    alignas(64) float direction[3][kRow];
    alignas(64) std::int32_t sure[kRow];
    std::int32_t place[kRow]; ///< cell
    openvdb::math::half half[3][kRow];
    Half3 vectors[2][kRow];
    std::vector<PackedBlock> blocks;
};

void TileAccumulator::Free::operator()(void* p) const { std::free(p); }

TileAccumulator::TileAccumulator() : m_batch(new Batch()), m_channels(new Channels())
{
    constexpr std::size_t bytes =
        (sizeof(VoxelSum) * (kCells + 1) + kLargePage - 1) / kLargePage * kLargePage;
    void* const cells = std::aligned_alloc(kLargePage, bytes);
    if (!cells) throw std::bad_alloc();
#ifdef MADV_HUGEPAGE
    ::madvise(cells, bytes, MADV_HUGEPAGE); // rows are far apart: with small pages each has its own
#endif
    std::memset(cells, 0, bytes);
    m_cells.reset(static_cast<VoxelSum*>(cells));
    m_cells[kCells] = {
        {1, 0, 0}, 0, {0, 0, 0},   0,
        {0, 0, 0}, 1, {0, 0, 0, 0}}; // stands where a vector has more lanes than there are voxels
}

TileAccumulator::~TileAccumulator() = default;

void TileAccumulator::findShares(const Batch& batch, int count, float width, Shares& s)
{
    for (int k = 0; k < count; k += kLanes) {
        IntLanes cell[3], third = {};
        Lanes w[3][2];
        for (int i = 0; i < 3; ++i) {
            const Lanes p = lanesAt(&batch.low[i][k]) + float(kMargin); // > 0
            cell[i] = __builtin_convertvector(p, IntLanes);
            w[i][0] = min(1 - (p - __builtin_convertvector(cell[i], Lanes)), width);
            w[i][1] = min(width - w[i][0], 1);
            const Lanes w2 = max(width - w[i][0] - w[i][1], 0);
            third |= w2 > 0;
            lanesAt(&s.along[i][0][k]) = w[i][0];
            lanesAt(&s.along[i][1][k]) = w[i][1];
            lanesAt(&s.along[i][2][k]) = w2;
        }
        lanesAt(&s.row[k]) = cell[0] * kAcross + cell[1];
        lanesAt(&s.z[k]) = cell[2];
        lanesAt(&s.third[k]) = third;
        const IntLanes bits = (1 | ((w[2][1] > 0) & 2)) << cell[2], of_y = w[1][1] > 0,
                       of_x = w[0][1] > 0;
        lanesAt(&s.touched[0][k]) = bits;
        lanesAt(&s.touched[1][k]) = bits & of_y;
        lanesAt(&s.touched[2][k]) = bits & of_x;
        lanesAt(&s.touched[3][k]) = bits & of_x & of_y;
        for (int c = 0; c < 4; ++c) {
            const Lanes xy = w[0][c >> 1] * w[1][c & 1];
            lanesAt(&s.part[2 * c][k]) = xy * w[2][0];
            lanesAt(&s.part[2 * c + 1][k]) = xy * w[2][1];
        }
    }
}

void TileAccumulator::add(int count, float width)
{
    Shares s;
    findShares(*m_batch, count, width, s);
    for (int k = 0; k < count; ++k) {
        const VoxelSum& sum = m_batch->sum[k];
        if (s.third[k]) {
            addWide(sum, s, k);
            continue;
        }
        std::int32_t* const marks = &m_touched[s.row[k]];
        marks[0] |= s.touched[0][k];
        marks[1] |= s.touched[1][k];
        marks[kAcross] |= s.touched[2][k];
        marks[kAcross + 1] |= s.touched[3][k];
        VoxelSum* const to = &m_cells[s.row[k] * kAcross + s.z[k]];
        for (int c = 0; c < 8; ++c)
            addScaled(to[(c >> 2) * kAcross * kAcross + (c >> 1 & 1) * kAcross + (c & 1)], sum,
                      s.part[c][k]);
    }
}

/// Adds a cube that reaches into a third cell along an axis.
void TileAccumulator::addWide(const VoxelSum& sum, const Shares& s, int k)
{
    const bool three[3] = {s.along[0][2][k] > 0, s.along[1][2][k] > 0, s.along[2][2][k] > 0};
    const std::int32_t touched =
        (1 | std::int32_t(s.along[2][1][k] > 0) << 1 | std::int32_t(three[2]) << 2) << s.z[k];
    for (int x = 0; x < 2 + three[0]; ++x)
        for (int y = 0; y < 2 + three[1]; ++y) {
            const float f = s.along[0][x][k] * s.along[1][y][k];
            const int row = s.row[k] + x * kAcross + y;
            m_touched[row] |= f > 0 ? touched : 0;
            VoxelSum* const to = &m_cells[row * kAcross + s.z[k]];
            addScaled(to[0], sum, f * s.along[2][0][k]);
            addScaled(to[1], sum, f * s.along[2][1][k]);
            if (three[2]) addScaled(to[2], sum, f * s.along[2][2][k]);
        }
}

void TileAccumulator::finish(const openvdb::Coord& origin, float minimum, bool direction,
                             bool colour, VoxelStore& store, std::vector<PackedBlock>& blocks)
{
    Channels& c = *m_channels;
    const int count = findVoxels(origin, minimum);
    if (count == 0) return;
    gather(count);
    const auto toVectors = [&](const float(&v)[3][kRow], Half3* to) {
        for (int i = 0; i < 3; ++i) toHalf(v[i], c.half[i], (count + 7) / 8 * 8);
        interleave(c.half[0], c.half[1], c.half[2], to, count);
    };
    if (direction) {
        if (principalDirections(count, c.tensor, c.direction, c.sure))
            for (int k = 0; k < count; ++k)
                if (!c.sure[k]) {
                    const SymmetricTensor s{c.tensor[0][k], c.tensor[1][k], c.tensor[2][k],
                                            c.tensor[3][k], c.tensor[5][k], c.tensor[4][k]};
                    const Vec3d d = principalDirection(s).stored();
                    for (int i = 0; i < 3; ++i) c.direction[i][k] = static_cast<float>(d[i]);
                }
        toVectors(c.direction, c.vectors[0]);
    }
    if (colour) {
        for (int k = 0; k < count; k += kLanes) {
            const Lanes f = 1 / lanesAt(&c.density[k]);
            for (int i = 0; i < 3; ++i) lanesAt(&c.colour[i][k]) *= f;
        }
        toVectors(c.colour, c.vectors[1]);
    }
    std::byte* to =
        store.allocate(count * PackedPart::voxelBytes(direction, colour) + c.blocks.size() * 7);
    int first = 0;
    for (PackedBlock& block : c.blocks) {
        const auto n = static_cast<int>(block.count);
        block.values = to;
        const auto put = [&](const void* from, std::size_t bytes) {
            std::memcpy(to, from, bytes);
            to += bytes;
        };
        put(c.density + first, n * sizeof(float));
        if (direction) put(c.vectors[0] + first, n * sizeof(Half3));
        if (colour) put(c.vectors[1] + first, n * sizeof(Half3));
        to += -reinterpret_cast<std::uintptr_t>(to) & 7;
        first += n;
    }
    blocks.insert(blocks.end(), c.blocks.begin(), c.blocks.end());
}

/// Lists the tile's blocks and their voxels' cells, clears the cells of those not above the
/// minimum, and forgets which were touched. Returns how many.
int TileAccumulator::findVoxels(const openvdb::Coord& origin, float minimum)
{
    std::uint8_t marks[2][kSize][kSize]; // of eight z, as bytes of a block's mask
    for (int half = 0; half < 2; ++half)
        for (int x = 0; x < kSize; ++x) {
            const std::int32_t* row = &m_touched[(x + kMargin) * kAcross + kMargin];
            for (int y = 0; y < kSize; ++y)
                marks[half][x][y] = static_cast<std::uint8_t>(row[y] >> (kMargin + 8 * half));
        }
    std::memset(m_touched, 0, sizeof(m_touched));
    static constexpr auto kPlaces = [] { // of a word's bits
        std::array<std::int32_t, 64> p{};
        for (int bit = 0; bit < 64; ++bit) p[bit] = (bit >> 3) * kAcross + (bit & 7);
        return p;
    }();
    m_channels->blocks.clear();
    std::int32_t* const place = m_channels->place;
    int n = 0;
    for (int bx = 0; bx < kSize; bx += 8)
        for (int by = 0; by < kSize; by += 8)
            for (int bz = 0; bz < kSize; bz += 8) {
                PackedBlock block;
                const int before = n;
                for (int x = 0; x < 8; ++x) {
                    std::memcpy(&block.mask[x], &marks[bz / 8][bx + x][by], 8);
                    const int first =
                        ((bx + x + kMargin) * kAcross + by + kMargin) * kAcross + bz + kMargin;
                    for (std::uint64_t left = block.mask[x]; left; left &= left - 1) {
                        const int bit = __builtin_ctzll(left);
                        place[n] = first + kPlaces[bit];
                        if (m_cells[place[n]].density > minimum) ++n;
                        else {
                            block.mask[x] &= ~(std::uint64_t(1) << bit);
                            clear(m_cells[place[n]]);
                        }
                    }
                }
                if (n == before) continue;
                block.origin = origin.offsetBy(bx, by, bz);
                block.count = static_cast<std::uint32_t>(n - before);
                m_channels->blocks.push_back(block);
            }
    return n;
}

/// Moves the listed cells into channels and clears them.
void TileAccumulator::gather(int count)
{
    Channels& c = *m_channels;
    const int padded = (count + 15) / 16 * 16;
    for (int k = count; k < padded; ++k) c.place[k] = kCells;
    float* const channel[3][4] = {{c.tensor[0], c.tensor[1], c.tensor[2], nullptr},
                                  {c.tensor[3], c.tensor[4], c.tensor[5], nullptr},
                                  {c.colour[0], c.colour[1], c.colour[2], c.density}};
    for (int k = 0; k < padded; k += 4) { // four cells become four values of each channel
        VoxelSum* s[4];
        for (int i = 0; i < 4; ++i) s[i] = &m_cells[c.place[k + i]];
        for (int g = 0; g < 3; ++g) {
            const auto row = [&](int i) {
                return *reinterpret_cast<const Four*>(s[i]->diagonal + 4 * g);
            };
            const Four a = row(0), b = row(1), d = row(2), e = row(3);
            const Four ab = __builtin_shufflevector(a, b, 0, 4, 1, 5),
                       de = __builtin_shufflevector(d, e, 0, 4, 1, 5);
            const Four ab_ = __builtin_shufflevector(a, b, 2, 6, 3, 7),
                       de_ = __builtin_shufflevector(d, e, 2, 6, 3, 7);
            *reinterpret_cast<Four*>(channel[g][0] + k) =
                __builtin_shufflevector(ab, de, 0, 1, 4, 5);
            *reinterpret_cast<Four*>(channel[g][1] + k) =
                __builtin_shufflevector(ab, de, 2, 3, 6, 7);
            *reinterpret_cast<Four*>(channel[g][2] + k) =
                __builtin_shufflevector(ab_, de_, 0, 1, 4, 5);
            if (g == 2)
                *reinterpret_cast<Four*>(channel[g][3] + k) =
                    __builtin_shufflevector(ab_, de_, 2, 3, 6, 7);
        }
        for (int i = 0; i < std::min(4, count - k); ++i) clear(*s[i]);
    }
}

} // namespace volcomp
