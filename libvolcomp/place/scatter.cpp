// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/scatter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/error.h"
#include "volcomp/base/hash.h"
#include "volcomp/base/random.h"
#include "volcomp/surface/unit_squares.h"

namespace volcomp {
namespace {

constexpr double kMostSamples = 5e8;
constexpr std::uint64_t kChunk = 4096; ///< samples that one thread takes at a time
constexpr std::uint64_t kBatch = 128;  ///< chunks that are placed before they are collected
/// A painted direction along the surface that is shorter means none. Neutral grey of 8 bits is 127
/// or 128 of 255, which is 1/255 away from 0 in each of three components.
constexpr double kNoDirection = 2.0 / 255;

/// A unit vector perpendicular to n. Continuous in n, except at n = -z (Duff and others, Building
/// an orthonormal basis, revisited, JCGT 2017).
Vec3d anyTangent(const Vec3d& n)
{
    const double sign = std::copysign(1.0, n[2]), a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
    return {1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]};
}

double between(const std::pair<double, double>& span, double fraction)
{
    return span.first + (span.second - span.first) * fraction;
}

/// The number below which the standard normal distribution has the part `f`, 0 < f < 1.
double normalQuantile(double f)
{
    double low = -10, high = 10;
    for (int i = 0; i < 48; ++i) {
        const double middle = 0.5 * (low + high);
        (0.5 * std::erfc(-middle / std::sqrt(2.0)) < f ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

/// The scale that has the part `f` of all scales below it.
double scaleAt(const Layer& layer, double f)
{
    const auto [low, high] = layer.scale;
    if (layer.sizes == SizeDistribution::normal) {
        const double cut = 0.5 * std::erfc(std::sqrt(2.0)); // below two standard deviations
        const double x = normalQuantile(cut + f * (1 - 2 * cut));
        return std::clamp(0.5 * (low + high) + 0.25 * (high - low) * x, low, high);
    }
    if (layer.sizes == SizeDistribution::power && low < high) {
        const double e = layer.size_power + 1;
        if (std::abs(e) < 1e-9) return low * std::pow(high / low, f);
        // Relative to `low`, so that no power overflows.
        return std::clamp(low * std::pow(1 + f * (std::pow(high / low, e) - 1), 1 / e), low, high);
    }
    return between(layer.scale, f);
}

/// Everything that a layer looks up, loaded once.
struct Maps {
    SecondDensity where, size, colour, tilt, comb_angle;
    std::optional<Texture> comb;

    explicit Maps(const Layer& layer)
        : where(layer.where, false), size(layer.size, false), colour(layer.colour, true),
          tilt(layer.tilt_map, false), comb_angle(layer.comb_angle_map, false)
    {
        if (!layer.comb_map.empty()) comb = readTexture(layer.comb_map, false);
    }
    bool useUv() const
    {
        return where.usesUv() || size.usesUv() || colour.usesUv() || tilt.usesUv()
            || comb_angle.usesUv() || comb.has_value();
    }
};

using Squares = std::vector<std::array<std::int64_t, 2>>;

/// The unit squares of (u,v) that get cells; none for Sampling::area.
Squares squaresOf(const Surface& surface, const Layer& layer)
{
    return layer.sampling == Sampling::uv ? unitSquares(surface, "layer '" + layer.name + "': ")
                                          : Squares{};
}

/// How many samples a layer takes, and the chance of each where the second density is 1: a density
/// of 2.5 becomes 3 samples, each kept with the chance 2.5 / 3.
struct SampleCount {
    double strata; ///< samples in all (area) or for each cell (uv), a whole number
    double chance;
    double total;
};

SampleCount countSamples(const Surface& surface, const Layer& layer, const Squares& squares)
{
    const bool by_uv = layer.sampling == Sampling::uv;
    const double wanted = by_uv ? layer.density : layer.density * surface.area();
    const double cells = by_uv ? double(layer.cells_u) * layer.cells_v * double(squares.size()) : 1;
    // Rounding of the area does not make 1.0000000001 boxes of one two samples of half a chance.
    const double strata = std::ceil(wanted * (1 - 1e-9));
    if (strata == 0) return {0, 0, 0};
    return {strata, std::min(1.0, wanted / strata), strata * cells};
}

/// Two axes of a box's frame; the third is their product.
struct Frame {
    Vec3d x, y;
};

/// Places the samples of one layer.
class Placer {
public:
    /// The arguments must outlive it.
    Placer(const Surface& surface, const Layer& layer, const LayerBoxes& boxes, int layer_index,
           const KeptPlaces& kept, const Maps& maps, const Squares& squares)
        : m_surface(surface), m_layer(layer), m_boxes(boxes), m_index(layer_index), m_kept(kept),
          m_maps(maps), m_squares(squares), m_samples(countSamples(surface, layer, squares)),
          // The stream follows the layer's name, so that a layer put before it changes nothing.
          m_key(hashKey(layer.seed, fnv1a(layer.name)))
    {
        if (layer.hasPlaces()) m_samples.chance = 1;
    }

    /// A place that is given. Its random numbers are those of a sample of that index.
    void given(std::uint64_t index, const GivenPlace& place_given, PlacementList& out) const
    {
        Random random(hashKey(m_key, index));
        random.uniform(); // where a sample would stand
        SurfacePoint s = m_surface.nearest(place_given.position);
        s.position = place_given.position;
        if (place_given.normal) s.normal = *place_given.normal;
        place(s, random, out, &place_given);
    }

    void sample(std::uint64_t index, PlacementList& out) const
    {
        if (m_layer.sampling == Sampling::uv) {
            sampleCell(index, out);
            return;
        }
        Random random(hashKey(m_key, index));
        const SurfacePoint s =
            m_surface.atFraction((double(index) + random.uniform()) / m_samples.strata);
        if (m_layer.sheets == Sheets::all || isFirst(s)) place(s, random, out);
    }

private:
    /// Cells count through a unit square, then through the next. A square's random numbers depend
    /// on its place alone, so another square changes nothing.
    void sampleCell(std::uint64_t index, PlacementList& out) const
    {
        const std::uint64_t cells = std::uint64_t(m_layer.cells_u) * m_layer.cells_v;
        const std::uint64_t in_square = cells * static_cast<std::uint64_t>(m_samples.strata);
        const auto& square = m_squares[index / in_square];
        const std::uint64_t sample = index % in_square, cell = sample % cells;
        const std::uint64_t square_key = square[0] == 0 && square[1] == 0
            ? m_key
            : hashKey(hashKey(~m_key, std::uint64_t(square[0])), std::uint64_t(square[1]));
        const std::uint64_t key = hashKey(square_key, sample);
        Random random(key);
        const double u = double(square[0])
            + (double(cell % m_layer.cells_u) + random.uniform()) / m_layer.cells_u;
        const double v = double(square[1])
            + (double(cell / m_layer.cells_u) + random.uniform()) / m_layer.cells_v;
        std::uint64_t sheet = 0;
        for (const SurfacePoint& s : m_surface.sheets({u, v})) {
            Random own(hashKey(key, sheet + 1));
            place(s, own, out);
            ++sheet;
            if (m_layer.sheets == Sheets::first) break;
        }
    }

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

    /// The frame along the normal or upright, then combed.
    Frame standingFrame(const SurfacePoint& s) const
    {
        Vec3d axis = s.normal;
        if (m_layer.upright > 0) {
            const Vec3d raised = axis * (1 - m_layer.upright) + Vec3d(0, m_layer.upright, 0);
            if (const double length = raised.length(); length > 1e-6)
                axis = raised / length; // length 0: half upright on a ceiling
        }
        if (m_layer.combed) {
            Vec3d along = combDirection(s);
            along -= axis * along.dot(axis);
            if (const double length = along.length();
                length > (m_maps.comb ? kNoDirection : 1e-6)) {
                along /= length;
                const double angle = m_layer.comb_angle
                    * (m_layer.comb_angle_map.empty()
                           ? 1.0
                           : double(m_maps.comb_angle.value(s.uv, s.position)));
                const double c = std::cos(angle), sine = std::sin(angle);
                return {along * c - axis * sine, axis * c + along * sine};
            }
        }
        return {anyTangent(axis), axis};
    }

    /// Leans the axis by a random angle to a random side. `tilt` and `side` are uniform in [0, 1).
    Frame tilted(const Frame& frame, const SurfacePoint& s, double tilt, double side) const
    {
        const auto& [x, y] = frame;
        double angle = between(m_layer.tilt, tilt);
        if (!m_layer.tilt_map.empty()) angle *= double(m_maps.tilt.value(s.uv, s.position));
        const Vec3d sideways = x * std::cos(2 * kPi * side) + y.cross(x) * std::sin(2 * kPi * side);
        const Vec3d leaned = y * std::cos(angle) + sideways * std::sin(angle);
        // The smallest rotation from y to the leaned axis takes x along.
        Vec3d turned = x - (y + leaned) * (x.dot(leaned) / std::max(1e-9, 1 + y.dot(leaned)));
        turned -= leaned * turned.dot(leaned);
        turned /= std::max(1e-9, turned.length());
        return {turned, leaned};
    }

    /// What the masks by slope and height leave of a chance.
    double masked(const SurfacePoint& s) const
    {
        const double height = m_layer.height.at(s.position[1]);
        if (height == 0) return 0;
        return height * m_layer.slope.at(std::acos(std::clamp(s.normal[1], -1.0, 1.0)));
    }

    void place(const SurfacePoint& s, Random& random, PlacementList& out,
               const GivenPlace* given = nullptr) const
    {
        // Every number is drawn whether it is used or not, so that one decision does not move the
        // next.
        const double keep = random.uniform(), variant = random.uniform(), size = random.uniform(),
                     turn = random.uniform(), tilt = random.uniform(), side = random.uniform();
        const double where = std::clamp(double(m_maps.where.value(s.uv, s.position)), 0.0, 1.0);
        if (!(keep < m_samples.chance * where * masked(s))) return;
        const double scale = scaleAt(m_layer, size) * m_maps.size.value(s.uv, s.position)
            * (given ? given->scale : 1.0);
        if (!(scale > 1e-9 && scale < 1e9)) return; // a size map of 0 leaves no box

        Frame frame = standingFrame(s);
        if (m_layer.tilt.second > 0) frame = tilted(frame, s, tilt, side);
        double angle = between(m_layer.turn, turn);
        if (given && given->axes) frame = {given->axes->first, given->axes->second}, angle = 0;
        const auto& [x, y] = frame;
        const Vec3d turned = x * std::cos(angle) + y.cross(x) * std::sin(angle);

        Placement p;
        p.x_axis = Vec3f(turned);
        p.y_axis = Vec3f(y);
        p.z_axis = Vec3f(turned.cross(y));
        p.position = s.position + s.normal * m_layer.offset;
        p.scale = static_cast<float>(scale);
        if (m_layer.tint == TintAt::root) p.tint = m_maps.colour.colour(s.uv, s.position);
        if (given) p.tint *= given->tint;
        p.box = static_cast<std::uint16_t>(
            m_boxes.first
            + (given && given->variant >= 0
                   ? given->variant
                   : std::min(m_boxes.count - 1,
                              static_cast<std::int32_t>(variant * m_boxes.count))));
        p.layer = static_cast<std::uint16_t>(m_index);
        out.placements.push_back(p);
        if (m_kept.triangles) out.triangles.push_back(s.triangle);
        if (m_kept.uvs) out.uvs.emplace_back(s.uv);
    }

    const Surface& m_surface;
    const Layer& m_layer;
    LayerBoxes m_boxes;
    int m_index;
    KeptPlaces m_kept;
    const Maps& m_maps;
    const Squares& m_squares;
    SampleCount m_samples;
    std::uint64_t m_key;
};

/// Throws Error if the layer cannot be placed on the surface.
void check(const Surface& surface, const Layer& layer, const LayerBoxes& boxes, int layer_index,
           const Maps& maps)
{
    const std::string place = "layer '" + layer.name + "': ";
    if ((layer.sampling == Sampling::uv || maps.useUv()) && !surface.hasUv())
        throw Error(
            place + "its maps are looked up by texture coordinates, but the mesh of surface '"
            + layer.surface
            + "' has none; give the mesh some, or set the surface's 'projection' to sphere, cylinder or plane");
    if (boxes.first < 0 || boxes.count < 1
        || std::size_t(boxes.first) + std::size_t(boxes.count) > kMostBoxes || layer_index < 0
        || std::size_t(layer_index) >= kMostBoxes)
        throw Error(place
                    + fmt::format("expected at most {} boxes and as many layers", kMostBoxes));
}

/// Throws Error if the layer asks for more samples than anybody waits for.
void checkCount(const Surface& surface, const Layer& layer, const Squares& squares)
{
    const double total = countSamples(surface, layer, squares).total;
    if (!(total <= kMostSamples))
        throw Error(fmt::format(
            "layer '{}': expected at most {:g} samples, found {:g}; lower its "
            "{}, or check the size of surface '{}'",
            layer.name, kMostSamples, total,
            layer.sampling == Sampling::uv ? "'density' or 'cells'" : "'density'", layer.surface));
}

/// The places that are given for a layer; none if it is sampled. Throws Error if a place asks for a
/// variant that there is not.
std::vector<GivenPlace> placesOf(const Layer& layer, const LayerBoxes& boxes)
{
    std::vector<GivenPlace> places;
    if (!layer.points.empty()) places = readPlaces(layer.points);
    std::size_t kept = 0;
    for (GivenPlace& p : places) {
        if (!p.box.empty()) { // a list of several kinds
            const std::size_t bar = p.box.rfind('_');
            if (p.box.substr(0, bar) != layer.box) continue;
            int number = 0;
            for (std::size_t k = bar + 1; k < p.box.size() && number < 100'000; ++k)
                number = p.box[k] >= '0' && p.box[k] <= '9' ? 10 * number + (p.box[k] - '0') : 0;
            p.variant = number - 1;
        }
        if (&places[kept] != &p) places[kept] = std::move(p);
        ++kept;
    }
    places.resize(kept);
    places.insert(places.end(), layer.places.begin(), layer.places.end());
    for (const GivenPlace& p : places)
        if (p.variant >= boxes.count)
            throw fileError(
                layer.points, "layer '" + layer.name + "'",
                fmt::format("variants from 1 to {}, as the box '{}' has", boxes.count, layer.box),
                std::to_string(p.variant + 1));
    return places;
}

} // namespace

void checkSamples(const Surface& surface, const Layer& layer)
{
    layer.validate();
    if (layer.density > 0) checkCount(surface, layer, squaresOf(surface, layer));
}

void scatter(const Surface& surface, const Layer& layer, const LayerBoxes& boxes, int layer_index,
             const KeptPlaces& kept, PlacementCollector& out, const Progress& progress)
{
    layer.validate();
    const Squares squares = squaresOf(surface, layer);
    if (layer.density > 0) checkCount(surface, layer, squares);
    const Maps maps(layer);
    check(surface, layer, boxes, layer_index, maps);
    const std::vector<GivenPlace> places = placesOf(layer, boxes);
    const std::uint64_t count = layer.hasPlaces()
        ? places.size()
        : static_cast<std::uint64_t>(countSamples(surface, layer, squares).total);
    const std::uint64_t chunks = (count + kChunk - 1) / kChunk;
    const Placer placer(surface, layer, boxes, layer_index, kept, maps, squares);
    SharedProgress done(progress, chunks);
    for (std::uint64_t first = 0; first < chunks; first += kBatch) {
        std::vector<PlacementList> pieces(std::min(kBatch, chunks - first));
        tbb::parallel_for(std::uint64_t(0), std::uint64_t(pieces.size()), [&](std::uint64_t piece) {
            const std::uint64_t begin = (first + piece) * kChunk;
            for (std::uint64_t i = begin; i < std::min(count, begin + kChunk); ++i)
                if (layer.hasPlaces()) placer.given(i, places[i], pieces[piece]);
                else placer.sample(i, pieces[piece]);
            done.add();
        });
        for (PlacementList& piece : pieces) out.append(std::move(piece));
    }
    report(progress, 1);
}

PlacementList scatter(const Surface& surface, const Layer& layer, const LayerBoxes& boxes,
                      int layer_index)
{
    PlacementCollector collector;
    scatter(surface, layer, boxes, layer_index, {true, true}, collector);
    return collector.take();
}

} // namespace volcomp
