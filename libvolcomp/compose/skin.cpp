// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/skin.h"

#include <algorithm>
#include <cmath>

namespace volcomp {
namespace {

constexpr double kSpacing = 0.5; ///< of the points, voxels

struct Corner {
    Vec3d p;       ///< in voxels from the lowest corner of the tile
    double b1, b2; ///< barycentric coordinates: weights of the triangle's second and third corner
};

Corner middle(const Corner& a, const Corner& b)
{
    return {(a.p + b.p) * 0.5, (a.b1 + b.b1) / 2, (a.b2 + b.b2) / 2};
}

/// Halves the triangle at its longest side until no side is longer than kSpacing, and calls `emit`
/// with the middle and the share of each part. Leaves out parts that are far from the tile.
template <class Emit>
void divide(const Corner& a, const Corner& b, const Corner& c, double share, const Emit& emit)
{
    for (int i = 0; i < 3; ++i) {
        const double low = std::min({a.p[i], b.p[i], c.p[i]}),
                     high = std::max({a.p[i], b.p[i], c.p[i]});
        if (high < -2 || low > TileAccumulator::kSize + 2) return;
    }
    const double ab = (a.p - b.p).lengthSqr(), bc = (b.p - c.p).lengthSqr(),
                 ca = (c.p - a.p).lengthSqr();
    const double longest = std::max({ab, bc, ca});
    if (longest <= kSpacing * kSpacing) {
        emit(Corner{(a.p + b.p + c.p) / 3, (a.b1 + b.b1 + c.b1) / 3, (a.b2 + b.b2 + c.b2) / 3},
             share);
        return;
    }
    if (longest == ab) {
        const Corner m = middle(a, b);
        divide(a, m, c, share / 2, emit), divide(m, b, c, share / 2, emit);
    } else if (longest == bc) {
        const Corner m = middle(b, c);
        divide(a, b, m, share / 2, emit), divide(a, m, c, share / 2, emit);
    } else {
        const Corner m = middle(c, a);
        divide(a, b, m, share / 2, emit), divide(m, b, c, share / 2, emit);
    }
}

} // namespace

std::vector<Skin> skinsOf(const PlacedScene& scene)
{
    std::vector<Skin> skins;
    for (const PlacedSurface& s : scene.surfaces)
        if (!s.skin.material.empty() && s.skin.as == SkinAs::voxels) skins.emplace_back(s);
    return skins;
}

double Skin::reach() const { return 1 + std::abs(m_spec.depth); }

openvdb::BBoxd Skin::bounds(std::int32_t triangle, double voxel) const
{
    openvdb::BBoxd bounds;
    for (const std::int32_t c : m_surface->mesh().triangles[triangle])
        bounds.expand(m_surface->mesh().points[c] / voxel);
    const Vec3d margin(reach());
    return {bounds.min() - margin, bounds.max() + margin};
}

void Skin::add(std::int32_t triangle, double voxel, const openvdb::Coord& origin,
               TileAccumulator& tile) const
{
    const auto& corners = m_surface->mesh().triangles[triangle];
    const Vec3d first(origin[0] - 0.5, origin[1] - 0.5,
                      origin[2] - 0.5); // a voxel's cube reaches half a voxel around its centre
    Corner c[3];
    for (int i = 0; i < 3; ++i) {
        Vec3d p = m_surface->mesh().points[corners[i]];
        if (m_spec.depth != 0)
            p -= m_surface->at(triangle, i == 1, i == 2).normal * (m_spec.depth * voxel);
        c[i] = {p / voxel - first, double(i == 1), double(i == 2)};
    }
    const double area = (c[1].p - c[0].p).cross(c[2].p - c[0].p).length() / 2; // voxels
    if (!(area > 0)) return;
    // Directed extinction takes a sheet that is seen face on for twice its density (MODEL section
    // 3).
    const double density = -0.5 * std::log(m_spec.transmittance) * area / voxel;
    CubeBatch& batch = tile.batch();
    int count = 0;
    divide(c[0], c[1], c[2], 1.0, [&](const Corner& p, double share) {
        for (int i = 0; i < 3; ++i) {
            batch.low[i][count] = float(p.p[i] - 0.5);
            if (!TileAccumulator::reaches(batch.low[i][count], 1)) return;
        }
        const SurfacePoint s = m_surface->at(triangle, p.b1, p.b2);
        VoxelSum& sum = batch.sum[count];
        const auto w = static_cast<float>(density * share);
        const Vec3f n(s.normal), rgb = colour(s);
        sum = {};
        sum.values[VoxelSum::kDensity] = w;
        sum.values[VoxelSum::kSquares] = w * static_cast<float>(density / area); // one sheet
        for (int i = 0; i < 3; ++i) {
            sum.values[VoxelSum::kDiagonal + i] = w * n[i] * n[i];
            sum.values[VoxelSum::kMixed + i] = w * n[i] * n[(i + 1) % 3];
            sum.values[VoxelSum::kColour + i] = w * rgb[i];
            sum.values[VoxelSum::kScatter + i] = w;
        }
        if (++count == CubeBatch::kSize) {
            tile.add(count, 1);
            count = 0;
        }
    });
    tile.add(count, 1);
}

} // namespace volcomp
