// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/march/sky_light.h"

#include <algorithm>
#include <cmath>

#include "volcomp/render/sky/neighbour_directions.h"

namespace volcomp {
namespace {

constexpr std::size_t kRow = SkyTable::Row().size();

/// A place counts as open to at least so much of each direction: so deep inside, where nothing
/// arrives, the closed form of all bounces stays finite for an albedo of 1.
constexpr float kLeastOpen = 1e-4F;

/// What the lit side and the other one take from each direction, and what that comes to.
struct Taken {
    double all = 0;      ///< in the open, of a dome of 1
    double open = 0;     ///< at the place, of a dome of 1
    Vec3d radiance{0.0}; ///< at the place
    void normalise()
    {
        if (!(all > 0)) return;
        open /= all;
        radiance /= all;
    }
};

Taken take(const SkyTable& sky, const SkyAtPlace& place, const SkyTable::Row& response)
{
    float all = 0, open = 0, red = 0, green = 0, blue = 0;
    for (std::size_t d = 0; d < kRow; ++d) {
        const float passes = place.passes[d] * response[d];
        all += sky.weight[d] * response[d];
        open += passes;
        red += passes * sky.radiance[0][d];
        green += passes * sky.radiance[1][d];
        blue += passes * sky.radiance[2][d];
    }
    Taken result{all, open, {red, green, blue}};
    result.normalise();
    return result;
}

using Row = SkyTable::Row;

Row cosines(const SkyTable& sky, const Vec3d& v)
{
    Row c;
    const float x = float(v[0]), y = float(v[1]), z = float(v[2]);
    for (std::size_t d = 0; d < kRow; ++d) c[d] = x * sky.x[d] + y * sky.y[d] + z * sky.z[d];
    return c;
}

// What surfaces whose normals lie evenly show of diffuse light at this cosine of eye and light:
// reflectSurface()'s, whose odd part is x / 3, with a parabola for the even one (off by 0.004).
float evenDiffuse(float x) { return 0.2122F + x / 3 + 0.1211F * x * x; }

// The response of one side of a surface, as reflectSurface() has it; side is 1 for that of the eye,
// -1 for the other.
Row surfaceResponse(const SkyTable& sky, const SkyResponse& r, const Vec3d& V, float side)
{
    const double even = 3 * r.spread_square / (1 + 2 * r.spread_square), seen = r.direction.dot(V);
    const float agree = float((1 - even) * std::abs(seen)), any = float(0.5 * even);
    const Row normal = cosines(sky, seen < 0 ? -r.direction : r.direction), eye = cosines(sky, V);
    Row result;
    for (std::size_t d = 0; d < kRow; ++d)
        result[d] = agree * std::max(0.0F, side * normal[d]) + any * evenDiffuse(side * eye[d]);
    return result;
}

Row fibreResponse(const SkyTable& sky, const SkyResponse& r)
{
    const float s2 = float(r.spread_square);
    const Row along = cosines(sky, r.direction);
    Row result;
    for (std::size_t d = 0; d < kRow; ++d)
        result[d] = std::sqrt(std::max(0.0F, (1 - along[d] * along[d]) * (1 - s2) + 2 * s2));
    return result;
}

Row sidedResponse(const SkyTable& sky, const SkyResponse& r)
{
    Row result = cosines(sky, r.direction);
    for (float& value : result) value = std::max(0.0F, value);
    return result;
}

// Light that was scattered once and meets something again, per colour: what it brings, over what a
// first scattering brings of it. It is as if each scattering sent the share P on to the next.
Vec3d meanOfBounces(const Vec3d& albedo, double open, const Vec3d& arrives)
{
    Vec3d result;
    for (int c = 0; c < 3; ++c) {
        const double a = std::min(1.0, albedo[c]);
        result[c] = a * arrives[c] / (1 - a * (1 - open));
    }
    return result;
}

} // namespace

SkyTable makeSkyTable(const RenderParams& params, const VoxelTree& tree)
{
    constexpr int kRows = 128, kTurns = 256; // 4 x 4 places in each texel of softRadiance()
    SkyTable sky;
    for (int d = 0; d < Openness::kDirections; ++d) {
        const NeighbourStep step = neighbourStep(d);
        const Vec3d w = tree.directionToWorld(Vec3d(step[0], step[1], step[2]).unit());
        sky.x[d] = float(w[0]);
        sky.y[d] = float(w[1]);
        sky.z[d] = float(w[2]);
        sky.weight[d] = float(Openness::weights()[d]);
    }
    std::array<Vec3d, Openness::kDirections> sums{};
    std::array<double, Openness::kDirections> sizes{};
    for (int i = 0; i < kRows; ++i) {
        const double row = kPi / kRows, size = std::cos(i * row) - std::cos((i + 1) * row),
                     y = std::cos((i + 0.5) * row), s = std::sin((i + 0.5) * row);
        for (int k = 0; k < kTurns; ++k) {
            const double turn = 2 * kPi * (k + 0.5) / kTurns;
            const Vec3d direction(s * std::cos(turn), y, s * std::sin(turn));
            const int d = nearestNeighbour(tree.directionToCorner(direction));
            sums[d] += size * (params.ambient + params.dome.softRadiance(direction));
            sizes[d] += size;
        }
    }
    for (int d = 0; d < Openness::kDirections; ++d)
        for (int c = 0; c < 3; ++c) sky.radiance[c][d] = float(sums[d][c] / sizes[d]);
    return sky;
}

SkyAtPlace skyAt(const SkyTable& sky, const Openness* openness, const Vec3d& p)
{
    SkyAtPlace place;
    place.passes = sky.weight;
    if (openness) {
        const Openness::ByDirection open = openness->open(p);
        for (std::size_t d = 0; d < kRow; ++d) place.passes[d] *= std::max(kLeastOpen, open[d]);
    }
    Row even;
    even.fill(1);
    const Taken taken = take(sky, place, even);
    place.open = taken.open;
    place.radiance = taken.radiance;
    return place;
}

Vec3d showSky(const SkyTable& sky, const SkyAtPlace& place, const SkyResponse& response,
              const Vec3d& albedo, const Vec3d& transmitted, const Vec3d& V, bool bounces)
{
    using Kind = SkyResponse::Kind;
    Taken lit, other;
    switch (response.kind) {
    case Kind::even:
        lit = {1, place.open, place.radiance};
        break;
    case Kind::fibre:
        lit = take(sky, place, fibreResponse(sky, response));
        break;
    case Kind::surface:
        lit = take(sky, place, surfaceResponse(sky, response, V, 1));
        if (transmitted != Vec3d(0.0))
            other = take(sky, place, surfaceResponse(sky, response, V, -1));
        break;
    case Kind::sided:
        lit = take(sky, place, sidedResponse(sky, response));
        break;
    }
    const Vec3d shown = lit.radiance * albedo + other.radiance * transmitted;
    if (!bounces) return shown;
    const Vec3d again = (1 - lit.open) * albedo + (1 - other.open) * transmitted;
    return shown + again * meanOfBounces(albedo + transmitted, place.open, place.radiance);
}

} // namespace volcomp
