// SPDX-License-Identifier: Apache-2.0
#include "volcomp/bake/mesh_pieces.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <unordered_map>

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

constexpr double kLongestSide = 0.25; ///< of a piece, voxels
constexpr double kMostPieces = 2e10;
constexpr std::size_t kChunk = 512; ///< triangles that one thread takes at a time

/// A piece of a triangle, in cells and (u,v).
struct Piece {
    std::array<Vec3d, 3> p;
    std::array<Vec2d, 3> uv;
};

/// Cuts triangles into pieces and adds these to voxels.
class Cutter {
public:
    Cutter(const MeshModel& model, double voxel, std::uint32_t order)
        : m_model(model), m_voxel(voxel), m_order(order)
    {
    }

    void add(const ModelTriangle& t)
    {
        if (t.sheet != m_sheet) m_places.clear();
        m_sheet = t.sheet;
        Piece piece;
        for (std::size_t k = 0; k < 3; ++k) {
            piece.p[k] = t.corners[k] / m_voxel + Vec3d(0.5);
            piece.uv[k] = Vec2d(t.uv[k]);
        }
        const Vec3d normal = (piece.p[1] - piece.p[0]).cross(piece.p[2] - piece.p[0]);
        m_area = 0.5 * normal.length();
        if (!(m_area > 0)) return;
        m_normal = normal / (2 * m_area);
        const Vec2d a = piece.uv[1] - piece.uv[0], b = piece.uv[2] - piece.uv[0];
        m_uv_area = 0.5 * std::abs(a[0] * b[1] - a[1] * b[0]);
        m_look = &m_model.looks[std::size_t(t.look)];
        cut(piece, 1, 0);
    }

    std::vector<SheetInVoxel> take() { return std::move(m_found); }

private:
    /// `share` is the piece's part of the triangle.
    void cut(const Piece& piece, double share, int depth)
    {
        std::size_t longest = 0;
        double length = -1;
        for (std::size_t k = 0; k < 3; ++k) {
            const double l = (piece.p[(k + 1) % 3] - piece.p[k]).lengthSqr();
            if (l > length) length = l, longest = k;
        }
        if (length <= kLongestSide * kLongestSide || depth > 60) {
            count(piece, share);
            return;
        }
        const std::size_t a = longest, b = (longest + 1) % 3;
        Piece half = piece;
        half.p[b] = 0.5 * (piece.p[a] + piece.p[b]);
        half.uv[b] = 0.5 * (piece.uv[a] + piece.uv[b]);
        cut(half, share / 2, depth + 1);
        std::swap(half.p[a], half.p[b]);
        std::swap(half.uv[a], half.uv[b]);
        half.p[b] = piece.p[b];
        half.uv[b] = piece.uv[b];
        cut(half, share / 2, depth + 1);
    }

    void count(const Piece& piece, double share)
    {
        const Vec3d middle = (piece.p[0] + piece.p[1] + piece.p[2]) / 3.0;
        PicturePyramid::Mean seen{1, m_look->colour};
        if (m_look->hasPicture())
            seen = m_look->mean((piece.uv[0] + piece.uv[1] + piece.uv[2]) / 3.0, m_uv_area * share);
        const auto area = static_cast<float>(m_area * share * seen.share);
        if (!(area > 0)) return;
        SheetInVoxel& to = placeOf(packedVoxel(openvdb::Coord::floor(middle)));
        to.area += area;
        for (std::size_t k = 0; k < 3; ++k) to.colour[k] += area * seen.colour[int(k)];
        const Vec3f n(m_normal);
        const std::array<float, 6> tensor{n[0] * n[0], n[1] * n[1], n[2] * n[2],
                                          n[0] * n[1], n[0] * n[2], n[1] * n[2]};
        for (std::size_t k = 0; k < 6; ++k) to.tensor[k] += area * tensor[k];
    }

    SheetInVoxel& placeOf(std::uint64_t voxel)
    {
        if (m_last < m_found.size() && m_found[m_last].voxel == voxel
            && m_found[m_last].sheet == m_sheet)
            return m_found[m_last];
        const auto [at, is_new] = m_places.emplace(voxel, m_found.size());
        if (is_new) m_found.push_back({voxel, m_sheet, m_order});
        m_last = at->second;
        return m_found[m_last];
    }

    const MeshModel& m_model;
    double m_voxel;
    std::uint32_t m_order, m_sheet = ~0U;
    const MeshLook* m_look = nullptr;
    double m_area = 0,
           m_uv_area = 0; ///< of the triangle, in squares of a voxel's side and of (u,v)
    Vec3d m_normal;
    std::vector<SheetInVoxel> m_found;
    std::size_t m_last = ~std::size_t(0);
    std::unordered_map<std::uint64_t, std::size_t> m_places; ///< in m_found, of the current sheet
};

/// Throws Error if the triangles reach too far out, or would be cut into too many pieces.
void check(const MeshModelPart& part, double voxel)
{
    double pieces = 0, farthest = 0;
    for (const ModelTriangle& t : part.triangles) {
        for (const Vec3d& p : t.corners)
            farthest = std::max({farthest, std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
        const double area =
            (t.corners[1] - t.corners[0]).cross(t.corners[2] - t.corners[0]).length();
        double around = 0;
        for (std::size_t k = 0; k < 3; ++k)
            around += (t.corners[(k + 1) % 3] - t.corners[k]).length();
        pieces +=
            1 + 16 * area / (voxel * voxel) / kLongestSide + 2 * around / voxel / kLongestSide;
    }
    if (!(farthest / voxel < kMostVoxelsAcross / 2 - 16))
        throw Error(fmt::format(
            "a box reaches {:.4g} m from its root, more than {} voxels of {:.4g} m; a larger voxel, "
            "or another 'scale' of the mesh, is needed",
            farthest, kMostVoxelsAcross / 2 - 16, voxel));
    if (pieces > kMostPieces)
        throw Error(fmt::format("the voxel of a box: its triangles have about {:.2g} voxels of "
                                "{:.4g} m, too many; a larger voxel is needed",
                                pieces / 64, voxel));
}

} // namespace

void SheetInVoxel::add(const SheetInVoxel& o)
{
    area += o.area;
    for (std::size_t k = 0; k < colour.size(); ++k) colour[k] += o.colour[k];
    for (std::size_t k = 0; k < tensor.size(); ++k) tensor[k] += o.tensor[k];
}

std::uint64_t packedVoxel(const openvdb::Coord& at)
{
    std::uint64_t leaf = 0, inside = 0;
    for (int k = 0; k < 3; ++k) {
        const auto c = static_cast<std::uint64_t>(std::int64_t(at[k]) + kMostVoxelsAcross / 2);
        leaf = leaf << 18 | (c >> 3 & 0x3ffff);
        inside = inside << 3 | (c & 7);
    }
    return leaf << 9 | inside;
}

openvdb::Coord unpackedVoxel(std::uint64_t key)
{
    openvdb::Coord at;
    for (int k = 0; k < 3; ++k) {
        const std::uint64_t leaf = key >> (9 + 18 * (2 - k)) & 0x3ffff,
                            inside = key >> (3 * (2 - k)) & 7;
        at[k] = static_cast<int>(leaf << 3 | inside) - kMostVoxelsAcross / 2;
    }
    return at;
}

std::vector<SheetInVoxel> cutIntoVoxels(const MeshModel& model, const MeshModelPart& part,
                                        double voxel)
{
    check(part, voxel);
    std::vector<std::vector<SheetInVoxel>> found((part.triangles.size() + kChunk - 1) / kChunk);
    tbb::parallel_for(std::size_t(0), found.size(), [&](std::size_t chunk) {
        Cutter cutter(model, voxel, static_cast<std::uint32_t>(chunk));
        const std::size_t end = std::min(part.triangles.size(), (chunk + 1) * kChunk);
        for (std::size_t i = chunk * kChunk; i < end; ++i) cutter.add(part.triangles[i]);
        found[chunk] = cutter.take();
    });
    std::vector<SheetInVoxel> all;
    for (std::vector<SheetInVoxel>& some : found) {
        all.insert(all.end(), some.begin(), some.end());
        some = {};
    }
    tbb::parallel_sort(all.begin(), all.end(), [](const SheetInVoxel& a, const SheetInVoxel& b) {
        return std::tie(a.voxel, a.sheet, a.order) < std::tie(b.voxel, b.sheet, b.order);
    });
    std::size_t last = 0;
    for (std::size_t i = 1; i < all.size(); ++i) {
        if (all[i].voxel == all[last].voxel && all[i].sheet == all[last].sheet)
            all[last].add(all[i]);
        else all[++last] = all[i];
    }
    if (!all.empty()) all.resize(last + 1);
    return all;
}

} // namespace volcomp
