#include "volcomp/place/scatter.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/error.h"
#include "volcomp/base/hash.h"
#include "volcomp/base/random.h"

namespace volcomp {
namespace {

constexpr double kMostSamples = 5e8;

/// A unit vector perpendicular to n that changes with it steadily, but at n = -z (Duff and others,
/// Building an orthonormal basis, revisited, JCGT 2017).
Vec3d anyTangent(const Vec3d& n)
{
    const double sign = std::copysign(1.0, n[2]), a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
    return {1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]};
}

/// Everything of a layer that is looked up, loaded once.
struct Maps {
    SecondDensity where, size, colour;
    std::optional<Texture> comb;
};

class Placer {
public:
    Placer(const Surface& surface, const Layer& layer, const LayerBoxes& boxes, int layer_index,
           const Maps& maps)
        : m_surface(surface), m_layer(layer), m_boxes(boxes), m_index(layer_index), m_maps(maps),
          // The stream follows the layer's name, so that a layer put before it changes nothing.
          m_key(hashKey(layer.seed, fnv1a(layer.name)))
    {
    }

    /// `chance` multiplies the second density.
    void sample(std::uint64_t index, double chance, std::vector<Placement>& out) const
    {
        Random random(hashKey(m_key, index));
        if (m_layer.sampling == Sampling::area) {
            const SurfacePoint s =
                m_surface.atFraction((double(index) + random.uniform()) / m_strata);
            if (m_layer.sheets == Sheets::all || isFirst(s)) place(s, chance, random, out);
            return;
        }
        const std::uint64_t cell = index % (std::uint64_t(m_layer.cells_u) * m_layer.cells_v);
        const double u = (double(cell % m_layer.cells_u) + random.uniform()) / m_layer.cells_u;
        const double v = (double(cell / m_layer.cells_u) + random.uniform()) / m_layer.cells_v;
        // Without any chance there nothing is projected; a map with noise depends on the place.
        std::uint64_t sheet = 0;
        for (const SurfacePoint& s : m_surface.sheets({u, v})) {
            Random own(hashKey(hashKey(m_key, index), sheet + 1));
            place(s, chance, own, out);
            ++sheet;
            if (m_layer.sheets == Sheets::first) break;
        }
    }

    double m_strata = 1;

private:
    bool isFirst(const SurfacePoint& s) const
    {
        const std::vector<SurfacePoint> all = m_surface.sheets(s.uv);
        return all.empty() || all.front().triangle == s.triangle
            || (all.front().position - s.position).lengthSqr() < 1e-12 * m_surface.area();
    }

    Vec3d combDirection(const SurfacePoint& s) const
    {
        if (!m_maps.comb) return m_layer.comb;
        Vec3d c;
        for (int i = 0; i < 3; ++i)
            c[i] = 2 * m_maps.comb->sample(s.uv[0], s.uv[1], i, Wrap::repeat) - 1;
        if (m_layer.comb_space == CombSpace::world) return c;
        const Surface::UvGradient g = m_surface.uvGradientAt(s);
        const double u = g.du.length(), v = g.dv.length();
        return u > 0 && v > 0 ? g.du * (c[0] / u) + g.dv * (c[1] / v) : Vec3d(0.0);
    }

    void place(const SurfacePoint& s, double chance, Random& random,
               std::vector<Placement>& out) const
    {
        // Every number is drawn whether it is used or not, so that one decision does not move the
        // next.
        const double keep = random.uniform(), variant = random.uniform(), size = random.uniform(),
                     turn = random.uniform(), tilt = random.uniform(), side = random.uniform();
        if (!(keep < chance * std::clamp(double(m_maps.where.value(s.uv, s.position)), 0.0, 1.0)))
            return;
        const double scale =
            (m_layer.scale.first + (m_layer.scale.second - m_layer.scale.first) * size)
            * m_maps.size.value(s.uv, s.position);
        if (!(scale > 1e-9 && scale < 1e9)) return; // a size map of 0 leaves no box

        Vec3d axis = s.normal;
        if (m_layer.upright > 0) {
            const Vec3d raised = axis * (1 - m_layer.upright) + Vec3d(0, m_layer.upright, 0);
            if (const double length = raised.length(); length > 1e-6)
                axis = raised / length; // 0: half upright on a ceiling
        }
        Vec3d y = axis, x = anyTangent(y);
        if (m_layer.combed) {
            Vec3d along = combDirection(s);
            along -= y * along.dot(y);
            if (const double length = along.length(); length > 1e-6) {
                along /= length;
                const double c = std::cos(m_layer.comb_angle), sine = std::sin(m_layer.comb_angle);
                x = along * c - axis * sine;
                y = axis * c + along * sine;
            }
        }
        if (m_layer.tilt.second > 0) {
            const double angle =
                m_layer.tilt.first + (m_layer.tilt.second - m_layer.tilt.first) * tilt;
            const Vec3d sideways =
                x * std::cos(2 * kPi * side) + y.cross(x) * std::sin(2 * kPi * side);
            const Vec3d leaned = y * std::cos(angle) + sideways * std::sin(angle);
            // The smallest rotation from y to the leaned axis takes x along.
            x -= (y + leaned) * (x.dot(leaned) / std::max(1e-9, 1 + y.dot(leaned)));
            x -= leaned * x.dot(leaned);
            x /= std::max(1e-9, x.length());
            y = leaned;
        }
        const double angle = m_layer.turn.first + (m_layer.turn.second - m_layer.turn.first) * turn;
        const Vec3d turned = x * std::cos(angle) + y.cross(x) * std::sin(angle);

        Placement p;
        p.x_axis = Vec3f(turned);
        p.y_axis = Vec3f(y);
        p.z_axis = Vec3f(turned.cross(y));
        p.position = s.position + s.normal * m_layer.offset;
        p.scale = static_cast<float>(scale);
        if (m_layer.tint == TintAt::root) p.tint = m_maps.colour.colour(s.uv, s.position);
        p.box = m_boxes.first
            + std::min(m_boxes.count - 1, static_cast<std::int32_t>(variant * m_boxes.count));
        p.layer = m_index;
        p.uv = Vec2f(s.uv);
        p.triangle = s.triangle;
        out.push_back(p);
    }

    const Surface& m_surface;
    const Layer& m_layer;
    LayerBoxes m_boxes;
    int m_index;
    const Maps& m_maps;
    std::uint64_t m_key;
};

} // namespace

std::vector<Placement> scatter(const Surface& surface, const Layer& layer, const LayerBoxes& boxes,
                               int layer_index, const Progress& progress)
{
    layer.validate();
    const std::string place = "layer '" + layer.name + "': ";
    Maps maps{SecondDensity(layer.where, false), SecondDensity(layer.size, false),
              SecondDensity(layer.colour, true), std::nullopt};
    if (!layer.comb_map.empty()) maps.comb = readTexture(layer.comb_map, false);
    const bool uses_uv = layer.sampling == Sampling::uv || maps.where.usesUv() || maps.size.usesUv()
        || maps.colour.usesUv() || maps.comb;
    if (uses_uv && !surface.hasUv())
        throw Error(
            place + "its maps are looked up by texture coordinates, but the mesh of surface '"
            + layer.surface
            + "' has none; give the mesh some, or set the surface's 'projection' to sphere, cylinder or plane");

    // A density of 2.5 becomes 3 samples, each kept with the chance 2.5 / 3.
    const double cells = layer.sampling == Sampling::uv ? double(layer.cells_u) * layer.cells_v : 1;
    const double wanted =
        layer.sampling == Sampling::uv ? layer.density : layer.density * surface.area();
    const double rounded = std::ceil(wanted), total = rounded * cells;
    if (!(total <= kMostSamples))
        throw Error(place
                    + fmt::format("expected at most {:g} samples, found {:g}; lower its density",
                                  kMostSamples, total));
    std::vector<Placement> result;
    if (total < 1) return result;
    Placer placer(surface, layer, boxes, layer_index, maps);
    placer.m_strata = rounded;

    constexpr std::uint64_t kChunk = 4096;
    const auto count = static_cast<std::uint64_t>(total), chunks = (count + kChunk - 1) / kChunk;
    std::vector<std::vector<Placement>> parts(chunks);
    SharedProgress done(progress, chunks);
    tbb::parallel_for(std::uint64_t(0), chunks, [&](std::uint64_t chunk) {
        for (std::uint64_t i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); ++i)
            placer.sample(i, wanted / rounded, parts[chunk]);
        done.add();
    });
    std::size_t size = 0;
    for (const auto& part : parts) size += part.size();
    result.reserve(size);
    for (auto& part : parts) {
        result.insert(result.end(), part.begin(), part.end());
        std::vector<Placement>().swap(part);
    }
    report(progress, 1);
    return result;
}

} // namespace volcomp
