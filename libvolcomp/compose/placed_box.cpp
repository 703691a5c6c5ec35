#include "volcomp/compose/placed_box.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/lanes.h"

namespace volcomp {
namespace {

constexpr int kTile = TileAccumulator::kSize, kBatch = TileAccumulator::kBatch;
constexpr double kFarthest = double(1 << 24); ///< voxels from the origin
constexpr float kSnap =
    4096; ///< positions are multiples of 1/4096 voxel, so that aligned boxes stay aligned

/// To the nearest multiple of 1/4096, for |x| < 1024; beyond it loses digits, and those voxels are
/// not of the tile.
Lanes snapped(Lanes x)
{
    constexpr float kShift = 1.5f * (1 << 23) / kSnap;
    return (x + kShift) - kShift;
}

Four four(const float (&v)[3]) { return Four{v[0], v[1], v[2], 0}; }

} // namespace

void forTilesBetween(const Vec3d& low, const Vec3d& high, const char* what,
                     const std::function<void(const openvdb::Coord&)>& visit)
{
    openvdb::Coord from, to;
    for (int i = 0; i < 3; ++i) {
        if (!(low[i] > -kFarthest && high[i] < kFarthest))
            throw Error(fmt::format(
                "{}: expected voxels at most 2^24 from the origin, found {:g}; use a larger voxel or move the scene to its origin",
                what, std::max(std::abs(low[i]), std::abs(high[i]))));
        from[i] = static_cast<int>(std::floor(low[i] / kTile));
        to[i] = static_cast<int>(std::floor(high[i] / kTile));
    }
    for (int x = from[0]; x <= to[0]; ++x)
        for (int y = from[1]; y <= to[1]; ++y)
            for (int z = from[2]; z <= to[2]; ++z) visit(openvdb::Coord(x, y, z));
}

PlacedBox::PlacedBox(const Placement& p, const SourcePart& part, double voxel)
    : m_placement(p), m_part(part), m_voxel(voxel)
{
    const double step = part.voxel * p.scale / voxel;
    const Vec3f* axes[3] = {&p.x_axis, &p.y_axis, &p.z_axis};
    for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) {
            m_turn[a][i] = (*axes[a])[i];
            m_axes[a][i] = static_cast<float>((*axes[a])[i] * step);
        }
    m_root = p.position / voxel + Vec3d(0.5);
    m_divisions = step <= 1.5 ? 1 : static_cast<int>(std::ceil(step));
    const double exact = step / m_divisions;
    m_width = std::max(1.0f, std::round(static_cast<float>(exact) * kSnap)) / kSnap;
    const double shrunk = exact / m_width; // what rounding the width took
    m_density = static_cast<float>(shrunk * shrunk * shrunk / p.scale);
}

Vec3d PlacedBox::mapped(const Vec3f& p) const
{
    Vec3d s(0.0);
    for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) s[i] += double(m_axes[a][i]) * p[a];
    return s;
}

Vec3d PlacedBox::span(const Vec3f& half) const
{
    Vec3d s(0.0);
    for (int a = 0; a < 3; ++a)
        for (int i = 0; i < 3; ++i) s[i] += std::abs(double(m_axes[a][i])) * half[a];
    return s;
}

Vec3d PlacedBox::worldOf(const Vec3f& p) const
{
    return m_placement.position + mapped(p) * m_voxel;
}

void PlacedBox::forTiles(const std::function<void(const openvdb::Coord&)>& visit) const
{
    const double margin = 0.5 * m_width + 1e-3;
    const Vec3d centre = m_root + mapped(m_part.bounds.centre),
                half = span(m_part.bounds.half) + Vec3d(margin);
    // A tile that the bounds reach may still pass the turned box by: the tile's bounds along the
    // box's axes say so.
    double reach[3];
    for (int a = 0; a < 3; ++a) {
        const double tile = 0.5 * kTile
            * (std::abs(double(m_turn[a][0])) + std::abs(double(m_turn[a][1]))
               + std::abs(double(m_turn[a][2])));
        const double step = Vec3d(m_axes[a][0], m_axes[a][1], m_axes[a][2]).length();
        reach[a] = tile + step * m_part.bounds.half[a] + margin * 1.7321;
    }
    forTilesBetween(centre - half, centre + half, "placement", [&](const openvdb::Coord& tile) {
        const Vec3d d = Vec3d(tile[0] + 0.5, tile[1] + 0.5, tile[2] + 0.5) * double(kTile) - centre;
        for (int a = 0; a < 3; ++a)
            if (std::abs(d[0] * m_turn[a][0] + d[1] * m_turn[a][1] + d[2] * m_turn[a][2])
                > reach[a])
                return;
        visit(tile);
    });
}

/// What adding to one tile needs at every voxel.
struct PlacedBox::InTile {
    const PlacedBox& box;
    TileAccumulator& tile;
    std::optional<TintWalk> walk;
    float directions; ///< factor of the sum of t tᵀ
    float root[3];    ///< in the tile's coordinates
    Four turn[3], tint;
    int waiting = 0;                     ///< cubes in the tile's batch
    std::uint32_t voxel_of[kBatch] = {}; ///< their voxels
    const VoxelSum* made =
        nullptr; ///< what divided voxels hold; of others it is found when the batch is full

    /// Adds what lies in those of a group of bounds that reach into the tile.
    void addGroup(std::size_t level, std::size_t group)
    {
        constexpr float kHalf = 0.5f * kTile;
        const BoundsList& list = box.m_part.bounds_of[level];
        for (std::size_t first = group * BoundsList::kTogether;
             first < (group + 1) * BoundsList::kTogether; first += kLanes) {
            const auto at = [&](int c) { return lanesFrom(&list.values[c][first]); };
            const Lanes c[3] = {at(0), at(1), at(2)}, h[3] = {at(3), at(4), at(5)};
            IntLanes reaches = IntLanes{} - 1;
            for (int i = 0; i < 3; ++i) {
                const float ax = box.m_axes[0][i], ay = box.m_axes[1][i], az = box.m_axes[2][i];
                const Lanes centre = (root[i] - kHalf) + ax * c[0] + ay * c[1] + az * c[2];
                const Lanes half = (0.5f * box.m_width + 1e-3f + kHalf) + std::abs(ax) * h[0]
                    + std::abs(ay) * h[1] + std::abs(az) * h[2];
                reaches &= (centre <= half) & (-centre <= half);
            }
            for (unsigned left = bitsOf(reaches); left; left &= left - 1) {
                const std::size_t i = first + static_cast<std::size_t>(__builtin_ctz(left));
                if (level == 0) addRun(static_cast<std::uint32_t>(i * SourcePart::kRun));
                else addGroup(level - 1, i);
            }
        }
    }

    void addRun(std::uint32_t begin)
    {
        const int divisions = box.m_divisions;
        if (divisions == 1) {
            findInside(begin, 0, 0, 0);
            return;
        }
        VoxelSum sums[SourcePart::kRun];
        const std::uint32_t end = std::min(begin + SourcePart::kRun,
                                           static_cast<std::uint32_t>(box.m_part.voxels.size()));
        for (std::uint32_t k = begin; k < end; ++k) makeSum(k, sums[k - begin]);
        made = sums;
        for (int x = 0; x < divisions; ++x)
            for (int y = 0; y < divisions; ++y)
                for (int z = 0; z < divisions; ++z) findInside(begin, float(x), float(y), float(z));
        flush();
        made = nullptr;
    }

    /// Puts the cubes of a run's voxels that reach into the tile into the batch; of divided voxels,
    /// those of one part.
    void findInside(std::uint32_t begin, float part_x, float part_y, float part_z)
    {
        const float width = box.m_width, scale = 1 / float(box.m_divisions);
        const float shift[3] = {(part_x + 0.5f) * scale - 0.5f, (part_y + 0.5f) * scale - 0.5f,
                                (part_z + 0.5f) * scale - 0.5f};
        TileAccumulator::Batch& batch = tile.batch();
        for (std::uint32_t first = begin; first < begin + SourcePart::kRun; first += kLanes) {
            const Lanes x = lanesFrom(&box.m_part.x[first]), y = lanesFrom(&box.m_part.y[first]),
                        z = lanesFrom(&box.m_part.z[first]);
            Lanes low[3];
            IntLanes inside = IntLanes{} - 1;
            for (int i = 0; i < 3; ++i) {
                const float ax = box.m_axes[0][i], ay = box.m_axes[1][i], az = box.m_axes[2][i];
                const float from =
                    root[i] + (shift[0] * ax + shift[1] * ay + shift[2] * az) - 0.5f * width;
                low[i] = snapped(from + (x * ax + y * ay + z * az));
                inside &= (low[i] + width > 0)
                    & (low[i] < float(TileAccumulator::kSize)); // TileAccumulator::reaches()
            }
            unsigned left = bitsOf(inside);
            if (left == 0) continue;
            if (waiting + kLanes > kBatch) flush();
#ifdef __AVX512F__
            const auto mask = static_cast<__mmask16>(left);
            const auto pressed = [&](Lanes v) {
                return _mm512_maskz_compress_ps(mask, reinterpret_cast<__m512>(v));
            };
            for (int i = 0; i < 3; ++i) _mm512_storeu_ps(&batch.low[i][waiting], pressed(low[i]));
            const __m512i counted =
                _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            _mm512_storeu_si512(
                &voxel_of[waiting],
                _mm512_maskz_compress_epi32(
                    mask, _mm512_add_epi32(_mm512_set1_epi32(static_cast<int>(first)), counted)));
            waiting += __builtin_popcount(left);
#else
            for (; left; left &= left - 1, ++waiting) {
                const int lane = __builtin_ctz(left);
                for (int i = 0; i < 3; ++i) batch.low[i][waiting] = low[i][lane];
                voxel_of[waiting] = first + static_cast<std::uint32_t>(lane);
            }
#endif
        }
    }

    void flush()
    {
        VoxelSum* const sum = tile.batch().sum;
        for (int k = 0; k < waiting; ++k)
            if (made) sum[k] = made[voxel_of[k] % SourcePart::kRun];
            else makeSum(voxel_of[k], sum[k]);
        tile.add(waiting, box.m_width);
        waiting = 0;
    }

    void makeSum(std::uint32_t voxel, VoxelSum& sum)
    {
        const SourceVoxel& v = box.m_part.voxels[voxel];
        const Four t = v.v[0] * turn[0] + v.v[1] * turn[1] + v.v[2] * turn[2];
        const Four next = __builtin_shufflevector(t, t, 1, 2, 0, 3);
        Four colour = *reinterpret_cast<const Four*>(v.colour) * tint; // with density
        if (walk) {
            const Vec3f c = walk->at(
                box.worldOf({box.m_part.x[voxel], box.m_part.y[voxel], box.m_part.z[voxel]}));
            colour *= Four{c[0], c[1], c[2], 1};
        }
        *reinterpret_cast<Four*>(sum.diagonal) = (t * t + v.iso) * directions;
        *reinterpret_cast<Four*>(sum.mixed) = t * next * directions;
        *reinterpret_cast<Four*>(sum.colour) = colour;
    }
};

void PlacedBox::add(const openvdb::Coord& tile_origin, float weight, const VoxelTint* tint,
                    TileAccumulator& tile) const
{
    if (m_part.voxels.empty()) return;
    InTile t{*this, tile, {}, m_density * weight, {}, {}, {}};
    for (int i = 0; i < 3; ++i) t.root[i] = static_cast<float>(m_root[i] - tile_origin[i]);
    for (int a = 0; a < 3; ++a) {
        t.turn[a] = four(m_turn[a]);
        t.tint[a] = m_placement.tint[a] * m_density;
    }
    t.tint[3] = m_density;
    if (tint) t.walk.emplace(*tint);
    t.addGroup(m_part.bounds_of.size() - 1, 0);
    t.flush();
}

} // namespace volcomp
