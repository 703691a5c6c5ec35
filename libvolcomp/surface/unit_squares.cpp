// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/unit_squares.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

constexpr std::size_t kMostSquares = 65536;
constexpr double kMostVisits = 1e8, kFurthest = 1e9, kSliver = 1e-5;

using Square = std::array<std::int64_t, 2>;

struct Span {
    std::int64_t first, last;
};

/// The whole numbers whose unit intervals meet [low, high].
Span squaresBetween(double low, double high)
{
    const auto first = static_cast<std::int64_t>(std::floor(low + kSliver));
    const auto last = static_cast<std::int64_t>(std::ceil(high - kSliver)) - 1;
    // A triangle that is smaller than a sliver and lies on a border has one.
    return last < first ? Span{static_cast<std::int64_t>(std::floor(low)),
                               static_cast<std::int64_t>(std::floor(low))}
                        : Span{first, last};
}

/// (u,v) of a triangle's corner. On spheres and cylinders all longitudes lie in one square, so
/// their seam does not matter.
Vec2d cornerOf(const Surface& surface, std::size_t triangle, int corner)
{
    const Mesh& mesh = surface.mesh();
    const ProjectionKind kind = surface.projection().kind;
    if (kind == ProjectionKind::uv)
        return Vec2d(mesh.uv[triangle][static_cast<std::size_t>(corner)]);
    const Vec2d uv = surface.projection().project(mesh.points[static_cast<std::size_t>(
        mesh.triangles[triangle][static_cast<std::size_t>(corner)])]);
    return {kind == ProjectionKind::plane ? uv[0] : 0.5,
            kind == ProjectionKind::sphere ? 0.5 : uv[1]};
}

} // namespace

std::vector<Square> unitSquares(const Surface& surface, const std::string& place)
{
    const auto too_many = [&] {
        return Error(place
                     + "its surface's (u,v) reach over more than 65536 unit squares, which is too "
                       "much for sampling = \"uv\"; write sampling = \"area\", or give the mesh "
                       "texture coordinates near 0 to 1");
    };
    if (!surface.hasUv()) return {};
    if (surface.projection().kind == ProjectionKind::sphere) return {{0, 0}};
    std::set<Square> found; // by v, then u
    Square last{1 << 30, 1 << 30};
    double visits = 0;
    for (std::size_t t = 0; t < surface.mesh().triangles.size(); ++t) {
        Vec2d low(kFurthest * 2), high(-kFurthest * 2);
        bool finite = true;
        for (int corner = 0; corner < 3; ++corner) {
            const Vec2d uv = cornerOf(surface, t, corner);
            finite = finite && std::isfinite(uv[0] + uv[1]);
            for (int i = 0; i < 2; ++i)
                low[i] = std::min(low[i], uv[i]), high[i] = std::max(high[i], uv[i]);
        }
        if (!finite) continue;
        if (std::min(low[0], low[1]) < -kFurthest || std::max(high[0], high[1]) > kFurthest)
            throw too_many();
        const Span u = squaresBetween(low[0], high[0]), v = squaresBetween(low[1], high[1]);
        const double count = double(u.last - u.first + 1) * double(v.last - v.first + 1);
        if (count > double(kMostSquares) || (visits += count) > kMostVisits) throw too_many();
        for (std::int64_t j = v.first; j <= v.last; ++j)
            for (std::int64_t i = u.first; i <= u.last; ++i)
                if (const Square square{j, i}; square != last) found.insert(last = square);
        if (found.size() > kMostSquares) throw too_many();
    }
    std::vector<Square> squares;
    squares.reserve(found.size());
    for (const Square& square : found) squares.push_back({square[1], square[0]});
    return squares;
}

} // namespace volcomp
