// SPDX-License-Identifier: Apache-2.0
#include "volcomp/grow/grow.h"

#include <algorithm>
#include <cmath>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/portable_math.h"
#include "volcomp/base/random.h"
#include "volcomp/grow/strand.h"

namespace volcomp {
namespace {

/// For each clump of a level, the points of its guide.
using Guides = std::vector<std::vector<Vec3d>>;

/// Grows one level after the other, each generation by generation, and keeps the strands of a level
/// as long as another level stands on it.
class Grower {
public:
    Grower(const GrowthRule& rule, int variant)
        : m_rule(rule), m_key(hashKey(rule.seed, static_cast<std::uint64_t>(variant)))
    {
        for (const GrowthLevel& level : rule.levels) {
            const std::string& material = level.material.empty() ? rule.material : level.material;
            std::size_t part = 0;
            while (part < m_skeleton.size() && m_skeleton[part].material != material) ++part;
            if (part == m_skeleton.size()) {
                m_skeleton.push_back({material, {}});
                m_strands.push_back(0);
            }
            m_part.push_back(part);
        }
        m_grown.resize(rule.levels.size());
        m_guides.resize(rule.levels.size());
    }

    Skeleton run()
    {
        const std::size_t count = m_rule.levels.size();
        // The strands of a level are dropped when the last level that stands on them has grown.
        std::vector<std::size_t> last_use(count);
        for (std::size_t i = 0; i < count; ++i) {
            last_use[i] = i;
            if (const int parent = m_rule.parentOf(i); parent >= 0) last_use[parent] = i;
        }
        for (std::size_t i = 0; i < count; ++i) {
            grow(i, last_use[i] > i);
            for (std::size_t k = 0; k <= i; ++k)
                if (last_use[k] == i) m_grown[k] = {}, m_guides[k] = {};
        }
        return std::move(m_skeleton);
    }

private:
    /// Grows all generations of a level; keeps its strands in m_grown if `keep`.
    void grow(std::size_t index, bool keep)
    {
        const GrowthLevel& level = m_rule.levels[index];
        const int parent = m_rule.parentOf(index);
        std::vector<Strand> strands;
        if (parent < 0) {
            strands = onGround(index);
            m_guides[index] = guidesOf(index, strands);
        } else {
            std::vector<Strand> bearers;
            for (const Strand& s : m_grown[parent])
                if (s.generation >= level.on_depth.first && s.generation <= level.on_depth.second)
                    bearers.push_back(s);
            strands = onStrands(bearers, static_cast<std::size_t>(parent), index, false);
        }
        for (int generation = 1; !strands.empty(); ++generation) {
            draw(index, strands);
            if (keep) m_grown[index].insert(m_grown[index].end(), strands.begin(), strands.end());
            if (generation == level.depth) break;
            strands = onStrands(strands, index, index, true);
        }
    }

    /// Returns root k of `count` that stand evenly on a disc: the spiral of a sunflower, with
    /// jitter.
    static Vec3d groundPoint(double spread, int k, int count, Random& random)
    {
        const double r = spread * std::sqrt((k + 0.2 + 0.6 * random.uniform()) / count),
                     a = k * kGoldenAngle + 0.6 * random.symmetric();
        return {r * portable::cos(a), 0, r * portable::sin(a)};
    }

    /// Returns the strands of a level that stands on the ground.
    std::vector<Strand> onGround(std::size_t index) const
    {
        const GrowthLevel& level = m_rule.levels[index];
        const std::uint64_t key = hashKey(m_key, index);
        Random random(hashKey(key, 0));
        const int count = drawCount(level.count, random);
        const std::vector<Vec3d> centres = clumpCentres(level, random);
        std::vector<Strand> strands(static_cast<std::size_t>(count));
        tbb::parallel_for(0, count, [&](int k) {
            Strand& s = strands[static_cast<std::size_t>(k)];
            s.key = hashKey(key, 1 + static_cast<std::uint64_t>(k));
            Random r(s.key);
            s.root = groundPoint(level.spread, k, count, r);
            const double outward = level.spread > 0
                ? portable::atan2(s.root[2], s.root[0])
                : k * level.divergence + 2 * kPi * r.uniform() * (count == 1);
            const double lean = r.uniform(level.angle.first, level.angle.second);
            s.frame = leaning(outward + level.divergence_variation * r.normal(), lean);
            s.length = varied(level.length > 0 ? level.length : level.length_ratio,
                              level.length_variation, r);
            s.radius = level.radius > 0 ? level.radius : level.radius_ratio;
            for (std::size_t c = 1; c < centres.size(); ++c)
                if ((centres[c] - s.root).lengthSqr() < (centres[s.clump] - s.root).lengthSqr())
                    s.clump = static_cast<int>(c);
        });
        return strands;
    }

    /// Returns where the guides of a level on the ground stand; none if it has no clumps.
    static std::vector<Vec3d> clumpCentres(const GrowthLevel& level, Random& random)
    {
        std::vector<Vec3d> centres;
        if (!(level.clump > 0)) return centres;
        centres.reserve(static_cast<std::size_t>(level.clumps));
        for (int k = 0; k < level.clumps; ++k)
            centres.push_back(groundPoint(level.spread, k, level.clumps, random));
        return centres;
    }

    /// Returns the frame of a strand on the ground that leans by `lean` from +Y towards `azimuth`.
    static Frame leaning(double azimuth, double lean)
    {
        const Vec3d outward(portable::cos(azimuth), 0, portable::sin(azimuth));
        const double c = portable::cos(lean), s = portable::sin(lean);
        return {Vec3d(0, 1, 0) * c + outward * s, Vec3d(0, 1, 0) * s - outward * c};
    }

    /// Returns the strands of level `index` that stand on `parents`, in the order of the parents.
    std::vector<Strand> onStrands(const std::vector<Strand>& parents, std::size_t parent_index,
                                  std::size_t index, bool fork) const
    {
        const GrowthLevel& level = m_rule.levels[index];
        const GrowthLevel::Span span = fork ? level.fork : level.count;
        std::vector<std::size_t> first(parents.size() + 1, 0);
        for (std::size_t i = 0; i < parents.size(); ++i) {
            Random random(hashKey(parents[i].key, 1000 + index));
            first[i + 1] = first[i] + static_cast<std::size_t>(drawCount(span, random));
        }
        std::vector<Strand> strands(first.back());
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, parents.size(), 16),
                          [&](const tbb::blocked_range<std::size_t>& range) {
                              std::vector<Node> nodes;
                              for (std::size_t i = range.begin(); i < range.end(); ++i) {
                                  const int count = static_cast<int>(first[i + 1] - first[i]);
                                  if (count == 0) continue;
                                  drawnLine(parent_index, parents[i], nodes);
                                  if (movesNodes(parent_index)) alignFrames(nodes);
                                  bear(level, parents[i], nodes, index, fork, count,
                                       &strands[first[i]]);
                              }
                          });
        return strands;
    }

    /// Sets out[0 ... count - 1] to the strands of level `index` that stand on one parent.
    void bear(const GrowthLevel& level, const Strand& parent, const std::vector<Node>& nodes,
              std::size_t index, bool fork, int count, Strand* out) const
    {
        const std::uint64_t key = hashKey(parent.key, 2000 + index);
        Random shared(key);
        const double azimuth0 = 2 * kPi * shared.uniform();
        const int places = (count + level.whorl - 1) / level.whorl;
        const double start = fork ? level.fork_start : level.start, end = level.end;
        for (int k = 0; k < count; ++k) {
            const int place = k / level.whorl, around = k % level.whorl;
            Strand& s = out[k];
            s.key = hashKey(key, 1 + static_cast<std::uint64_t>(k));
            s.generation = fork ? parent.generation + 1 : 1;
            Random r(s.key);
            const double jitter = level.whorl > 1 ? 0 : 0.5 * r.symmetric() * (start < end);
            const double u =
                std::clamp(start + (end - start) * (place + 0.5 + jitter) / places, 0.0, 1.0);
            const Node node = nodeAt(nodes, u);
            s.root = node.p;
            s.frame = branching(level, node.frame, u, azimuth0, place, around, r);
            const double length =
                fork || level.length == 0 ? parent.length * level.length_ratio : level.length;
            s.length = varied(length * (1 + (level.length_tip - 1) * u), level.length_variation, r);
            s.radius = fork || level.radius == 0 ? node.radius * level.radius_ratio : level.radius;
            if (level.facing > 0 && level.flat()) s.frame.faceUp(level.facing);
            if (fork) follow(parent, u, s);
        }
    }

    /// Lets a fork at the fraction u of its parent follow the same clump's guide: from the place
    /// that the parent has reached, and as far as its length says.
    static void follow(const Strand& parent, double u, Strand& s)
    {
        s.clump = parent.clump;
        s.guide_start = parent.guide_start + u * parent.guide_span;
        const double part = parent.length > 0 ? s.length / parent.length : 0;
        s.guide_span = std::min(parent.guide_span * part, 1e6); // not infinite
    }

    /// Whether strands of the level are drawn elsewhere than the plain line that they grow along.
    bool movesNodes(std::size_t index) const
    {
        const GrowthLevel& level = m_rule.levels[index];
        return level.curl_radius > 0 || level.frizz > 0 || !m_guides[index].empty();
    }

    /// Sets `nodes` to the line along which a strand of level `index` is drawn. Its children stand
    /// on it.
    void drawnLine(std::size_t index, const Strand& strand, std::vector<Node>& nodes) const
    {
        const GrowthLevel& level = m_rule.levels[index];
        trace(level, strand, false, nodes);
        if (!m_guides[index].empty()) gather(level, strand, m_guides[index][strand.clump], nodes);
    }

    /// Returns the frame of a child at the fraction u of its parent, whose frame there is `parent`:
    /// the child number `around` of the whorl number `place`. `azimuth0` is the first whorl's.
    static Frame branching(const GrowthLevel& level, const Frame& parent, double u, double azimuth0,
                           int place, int around, Random& random)
    {
        const double angle =
            random.uniform(level.angle.first, level.angle.second) * (1 + (level.angle_tip - 1) * u);
        double azimuth = level.divergence_variation * random.normal();
        if (level.planar) azimuth += (level.whorl > 1 ? around : place) % 2 ? -kPi / 2 : kPi / 2;
        else azimuth += azimuth0 + place * level.divergence + around * 2 * kPi / level.whorl;
        const Vec3d radial =
            parent.n * portable::cos(azimuth) + parent.b() * portable::sin(azimuth);
        const double c = portable::cos(angle), s = portable::sin(angle);
        Frame frame{parent.t * c + radial * s, level.planar ? parent.n : parent.t * s - radial * c};
        frame.orthonormalize();
        return frame;
    }

    /// Adds the segments of the strands to the part of the level's material.
    void draw(std::size_t index, const std::vector<Strand>& strands)
    {
        const GrowthLevel& level = m_rule.levels[index];
        std::vector<Segment>& segments = m_skeleton[m_part[index]].segments;
        const std::size_t first = segments.size();
        const std::uint32_t first_strand = m_strands[m_part[index]];
        const std::size_t pieces = static_cast<std::size_t>(level.segments);
        const std::vector<double> widths = nodeWidths(level.outline, level.segments);
        segments.resize(first + strands.size() * pieces);
        m_strands[m_part[index]] += static_cast<std::uint32_t>(strands.size());
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, strands.size(), 16),
                          [&](const tbb::blocked_range<std::size_t>& range) {
                              std::vector<Node> nodes;
                              for (std::size_t i = range.begin(); i < range.end(); ++i) {
                                  drawnLine(index, strands[i], nodes);
                                  drawStrand(level, strands[i], nodes, widths,
                                             first_strand + static_cast<std::uint32_t>(i),
                                             &segments[first + i * pieces]);
                              }
                          });
        const auto vanishes = [&](const Segment& s) {
            return s.a == s.b || (level.flat() && !s.flat()) || std::max(s.size_a, s.size_b) <= 0;
        };
        segments.erase(std::remove_if(segments.begin() + static_cast<std::ptrdiff_t>(first),
                                      segments.end(), vanishes),
                       segments.end());
    }

    /// Sets out[0 ... level.segments - 1] to the pieces of one strand.
    static void drawStrand(const GrowthLevel& level, const Strand& strand,
                           const std::vector<Node>& nodes, const std::vector<double>& widths,
                           std::uint32_t number, Segment* out)
    {
        Random random(hashKey(strand.key, 2));
        const double brightness =
            std::clamp(1 + level.colour_variation * random.normal(), 0.0, 2.0);
        const auto colourAt = [&](double s) {
            return Vec3f((level.colour_root * (1 - s) + level.colour_tip * s) * brightness);
        };
        const double half_width = 0.5 * level.width_ratio * strand.length;
        const std::size_t pieces = nodes.size() - 1;
        for (std::size_t k = 0; k < pieces; ++k) {
            const Node &low = nodes[k], &high = nodes[k + 1];
            Segment& s = out[k];
            s.a = Vec3f(low.p);
            s.b = Vec3f(high.p);
            s.strand = number;
            s.colour_a = colourAt(double(k) / double(pieces));
            s.colour_b = colourAt(double(k + 1) / double(pieces));
            if (level.flat()) {
                Vec3d side = (high.p - low.p).cross((low.frame.n + high.frame.n) * 0.5);
                if (side.length() > 0) side.normalize();
                s.side = Vec3f(side);
                s.size_a = static_cast<float>(half_width * widths[k]);
                s.size_b = static_cast<float>(half_width * widths[k + 1]);
            } else {
                s.size_a = static_cast<float>(low.radius);
                s.size_b = static_cast<float>(high.radius);
            }
        }
    }

    /// Returns the guide of each clump: the line that its strands bend to. Those of clumps without
    /// strands are empty; without clumps, or on another level, there is none.
    Guides guidesOf(std::size_t index, const std::vector<Strand>& strands) const
    {
        const GrowthLevel& level = m_rule.levels[index];
        Random random(hashKey(hashKey(m_key, index), 0));
        drawCount(level.count, random); // the same stream as in onGround()
        const std::vector<Vec3d> centres = clumpCentres(level, random);
        Guides guides(centres.size());
        std::vector<char> used(centres.size(), 0);
        if (!centres.empty())
            for (const Strand& s : strands) used[static_cast<std::size_t>(s.clump)] = 1;
        std::vector<Node> nodes;
        for (std::size_t k = 0; k < guides.size(); ++k) {
            if (!used[k]) continue;
            Strand s;
            s.root = centres[k];
            s.key = hashKey(hashKey(m_key, index), (1ULL << 40) + k);
            const double lean = 0.5 * (level.angle.first + level.angle.second)
                * std::min(1.0, s.root.length() / std::max(level.spread, 1e-30));
            s.frame = leaning(portable::atan2(s.root[2], s.root[0]), lean);
            s.length = level.length > 0 ? level.length : level.length_ratio;
            trace(level, s, true, nodes);
            for (const Node& n : nodes) guides[k].push_back(n.p);
        }
        return guides;
    }

    const GrowthRule& m_rule;
    std::uint64_t m_key;
    std::vector<std::size_t> m_part;          ///< for each level, its part of m_skeleton
    std::vector<std::uint32_t> m_strands;     ///< for each part, how many strands it has so far
    std::vector<std::vector<Strand>> m_grown; ///< for each level that others stand on, its strands
    std::vector<Guides> m_guides;             ///< for each level, of its clumps
    Skeleton m_skeleton;
};

} // namespace

Skeleton grow(const GrowthRule& rule, int variant)
{
    rule.validate();
    return Grower(rule, variant).run();
}

} // namespace volcomp
