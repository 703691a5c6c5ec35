#include "volcomp/grow/grow.h"

#include <algorithm>
#include <cmath>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/portable_math.h"
#include "volcomp/base/random.h"

namespace volcomp {
namespace {

/// Heading t, upper side n, and b = t x n to the left. Orthonormal.
struct Frame {
    Vec3d t, n;
    Vec3d b() const { return t.cross(n); }
};

/// v turned about the unit vector `axis` (Rodrigues).
Vec3d turned(const Vec3d& v, const Vec3d& axis, double angle)
{
    const double c = portable::cos(angle), s = portable::sin(angle);
    return v * c + axis.cross(v) * s + axis * (axis.dot(v) * (1 - c));
}

void turn(Frame& f, const Vec3d& axis, double angle)
{
    f.t = turned(f.t, axis, angle);
    f.n = turned(f.n, axis, angle);
}

/// Turns f.t towards `goal` by at most `angle` times the sine between them.
void turnTowards(Frame& f, const Vec3d& goal, double angle)
{
    Vec3d axis = f.t.cross(goal);
    const double sine = axis.length();
    if (sine > 1e-9 && angle != 0) turn(f, axis / sine, angle * sine);
}

void orthonormalize(Frame& f)
{
    f.t.normalize();
    f.n -= f.t * f.t.dot(f.n);
    if (f.n.lengthSqr() < 1e-12)
        f.n = f.t.cross(std::abs(f.t[0]) < 0.7 ? Vec3d(1, 0, 0) : Vec3d(0, 0, 1));
    f.n.normalize();
}

/// A strand that is to grow: all that its level's parameters do not say.
struct Strand {
    Vec3d root{0.0};
    Frame frame{Vec3d(0, 1, 0), Vec3d(0, 0, 1)};
    double length = 0, radius = 0;
    std::uint64_t key = 0;
    int generation = 1;
    int clump = 0;
};

struct Node {
    Vec3d p;
    Frame frame;
    double radius;
};

int drawCount(const GrowthLevel::Span& span, Random& random)
{
    return static_cast<int>(std::floor(random.uniform(span.first, span.second + 1 - 1e-9) + 1e-12));
}

double varied(double value, double deviation, Random& random)
{
    return value * std::clamp(1 + deviation * random.normal(), 0.1, 2.0);
}

/// Half widths of an outline at its nodes, greatest about 1, so that few pieces have the area of
/// the smooth outline.
std::vector<double> nodeWidths(Outline outline, int segments)
{
    constexpr int kSteps = 256;
    double area = 0, pieces = 0;
    for (int k = 0; k < kSteps; ++k) area += outlineWidth(outline, (k + 0.5) / kSteps) / kSteps;
    std::vector<double> widths;
    for (int k = 0; k <= segments; ++k)
        widths.push_back(segments == 1 ? area : outlineWidth(outline, double(k) / segments));
    for (int k = 0; k < segments; ++k) pieces += 0.5 * (widths[k] + widths[k + 1]) / segments;
    for (double& w : widths) w *= area / pieces;
    return widths;
}

/// The line of a strand, segments + 1 nodes, without curl, frizz and clump where `plain`.
void trace(const GrowthLevel& level, const Strand& strand, bool plain, std::vector<Node>& nodes)
{
    Random random(hashKey(strand.key, 1));
    const int n = level.segments;
    const double step = strand.length / n;
    const double bend = (level.bend + level.bend_variation * random.normal()) / n,
                 wander = level.wander / std::sqrt(n);
    nodes.clear();
    Frame f = strand.frame;
    Vec3d p = strand.root;
    for (int i = 0; i <= n; ++i) {
        nodes.push_back({p, f, strand.radius * (1 - level.taper * i / n)});
        if (i == n) break;
        turn(f, f.b(), -bend); // away from the upper side
        if (level.comb != 0) turnTowards(f, Vec3d(1, 0, 0), level.comb / n);
        if (wander > 0) {
            turn(f, f.b(), wander * random.normal());
            turn(f, f.n, wander * random.normal());
        }
        turnTowards(f, Vec3d(0, -1, 0), level.gravity / n);
        turnTowards(f, Vec3d(0, 1, 0), level.light / n);
        if (level.twist != 0) f.n = turned(f.n, f.t, level.twist / n);
        orthonormalize(f);
        p += f.t * step;
    }
    if (plain) return;
    if (level.curl_radius > 0) {
        const double phase = 2 * kPi * random.uniform(),
                     radius = varied(level.curl_radius, 0.3, random);
        for (int i = 1; i <= n;
             ++i) { // the helix opens over the first quarter, so that the root stays
            const double s = double(i) / n, a = phase + 2 * kPi * level.curl_turns * s,
                         r = radius * std::min(1.0, 4 * s);
            const Frame& g = nodes[i].frame;
            nodes[i].p += g.n * (r * (portable::cos(a) - portable::cos(phase)))
                + g.b() * (r * (portable::sin(a) - portable::sin(phase)));
        }
    }
    if (level.frizz > 0) { // a random walk
        Vec3d shift(0.0);
        const double size = level.frizz * strand.length / std::sqrt(n);
        for (int i = 1; i <= n; ++i) {
            shift +=
                (nodes[i].frame.n * random.normal() + nodes[i].frame.b() * random.normal()) * size;
            nodes[i].p += shift;
        }
    }
}

/// Grows one level, generation by generation, and keeps its strands for the levels that stand on
/// it.
class Grower {
public:
    Grower(const GrowthRule& primitive, int variant)
        : m_primitive(primitive),
          m_key(hashKey(primitive.seed, static_cast<std::uint64_t>(variant)))
    {
        for (const GrowthLevel& level : primitive.levels) {
            const std::string& material =
                level.material.empty() ? primitive.material : level.material;
            std::size_t part = 0;
            while (part < m_skeleton.size() && m_skeleton[part].material != material) ++part;
            if (part == m_skeleton.size()) {
                m_skeleton.push_back({material, {}});
                m_strands.push_back(0);
            }
            m_part.push_back(part);
        }
        m_grown.resize(primitive.levels.size());
    }

    Skeleton run()
    {
        const std::size_t count = m_primitive.levels.size();
        std::vector<std::size_t> last_use(
            count); // a level's strands are dropped when nothing stands on them any more
        for (std::size_t i = 0; i < count; ++i) {
            last_use[i] = i;
            if (const int parent = m_primitive.parentOf(i); parent >= 0) last_use[parent] = i;
        }
        for (std::size_t i = 0; i < count; ++i) {
            grow(i, last_use[i] > i);
            for (std::size_t k = 0; k <= i; ++k)
                if (last_use[k] == i) m_grown[k] = {};
        }
        return std::move(m_skeleton);
    }

private:
    void grow(std::size_t index, bool keep)
    {
        const GrowthLevel& level = m_primitive.levels[index];
        const int parent = m_primitive.parentOf(index);
        std::vector<Strand> strands;
        if (parent < 0) {
            strands = onGround(index);
        } else {
            std::vector<Strand> bearers;
            for (const Strand& s : m_grown[parent])
                if (s.generation >= level.on_depth.first && s.generation <= level.on_depth.second)
                    bearers.push_back(s);
            strands = onStrands(bearers, m_primitive.levels[parent], index, false);
        }
        for (int generation = 1; !strands.empty(); ++generation) {
            draw(index, strands);
            if (keep) m_grown[index].insert(m_grown[index].end(), strands.begin(), strands.end());
            if (generation == level.depth) break;
            strands = onStrands(strands, level, index, true);
        }
    }

    /// Where roots stand evenly: the spiral of a sunflower, with jitter.
    static Vec3d groundPoint(double spread, int k, int count, Random& random)
    {
        const double r = spread * std::sqrt((k + 0.2 + 0.6 * random.uniform()) / count),
                     a = k * kGoldenAngle + 0.6 * random.symmetric();
        return {r * portable::cos(a), 0, r * portable::sin(a)};
    }

    std::vector<Strand> onGround(std::size_t index) const
    {
        const GrowthLevel& level = m_primitive.levels[index];
        const std::uint64_t key = hashKey(m_key, index);
        Random random(hashKey(key, 0));
        const int count = drawCount(level.count, random);
        std::vector<Vec3d> centres;
        centres.reserve(static_cast<std::size_t>(level.clumps));
        for (int k = 0; k < level.clumps; ++k)
            centres.push_back(groundPoint(level.spread, k, level.clumps, random));
        std::vector<Strand> strands(static_cast<std::size_t>(count));
        for (int k = 0; k < count; ++k) {
            Strand& s = strands[k];
            s.key = hashKey(key, 1 + static_cast<std::uint64_t>(k));
            Random r(s.key);
            s.root = groundPoint(level.spread, k, count, r);
            const double outward = level.spread > 0
                ? portable::atan2(s.root[2], s.root[0])
                : k * level.divergence + 2 * kPi * r.uniform() * (count == 1);
            place(level, s, outward + level.divergence_variation * r.normal(),
                  r.uniform(level.angle.first, level.angle.second));
            s.length = varied(level.length > 0 ? level.length : level.length_ratio,
                              level.length_variation, r);
            s.radius = level.radius > 0 ? level.radius : level.radius_ratio;
            for (int c = 1; c < level.clumps; ++c)
                if ((centres[c] - s.root).lengthSqr() < (centres[s.clump] - s.root).lengthSqr())
                    s.clump = c;
        }
        return strands;
    }

    /// The frame of a strand on the ground that leans outwards at the azimuth `a`.
    static void place(const GrowthLevel&, Strand& s, double a, double lean)
    {
        const Vec3d outward(portable::cos(a), 0, portable::sin(a));
        s.frame.t = Vec3d(0, 1, 0) * portable::cos(lean) + outward * portable::sin(lean);
        s.frame.n = Vec3d(0, 1, 0) * portable::sin(lean) - outward * portable::cos(lean);
    }

    /// The strands of level `index` that stand on `parents`, in the order of the parents.
    std::vector<Strand> onStrands(const std::vector<Strand>& parents,
                                  const GrowthLevel& parent_level, std::size_t index,
                                  bool fork) const
    {
        const GrowthLevel& level = m_primitive.levels[index];
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
                                  trace(parent_level, parents[i], true, nodes);
                                  bear(level, parents[i], nodes, index, fork, count,
                                       &strands[first[i]]);
                              }
                          });
        return strands;
    }

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
            const double at = u * double(nodes.size() - 1);
            const std::size_t i = std::min(static_cast<std::size_t>(at), nodes.size() - 2);
            const double f = at - double(i);
            const Node &low = nodes[i], &high = nodes[i + 1];
            s.root = low.p * (1 - f) + high.p * f;
            Frame frame{low.frame.t * (1 - f) + high.frame.t * f,
                        low.frame.n * (1 - f) + high.frame.n * f};
            orthonormalize(frame);
            const double parent_radius = low.radius * (1 - f) + high.radius * f;

            const double angle =
                r.uniform(level.angle.first, level.angle.second) * (1 + (level.angle_tip - 1) * u);
            double azimuth = level.divergence_variation * r.normal();
            if (level.planar)
                azimuth += (level.whorl > 1 ? around : place) % 2 ? -kPi / 2 : kPi / 2;
            else azimuth += azimuth0 + place * level.divergence + around * 2 * kPi / level.whorl;
            const Vec3d radial = frame.n * portable::cos(azimuth) + frame.b() * portable::sin(azimuth);
            s.frame.t = frame.t * portable::cos(angle) + radial * portable::sin(angle);
            s.frame.n =
                level.planar ? frame.n : frame.t * portable::sin(angle) - radial * portable::cos(angle);
            orthonormalize(s.frame);
            const double length =
                fork || level.length == 0 ? parent.length * level.length_ratio : level.length;
            s.length = varied(length * (1 + (level.length_tip - 1) * u), level.length_variation, r);
            s.radius =
                fork || level.radius == 0 ? parent_radius * level.radius_ratio : level.radius;
            if (level.facing > 0 && level.flat()) { // about its own axis, so that the face looks up
                const Vec3d up = Vec3d(0, 1, 0) - s.frame.t * s.frame.t[1];
                if (up.length() > 1e-6) {
                    const Vec3d goal = up / up.length();
                    s.frame.n = s.frame.n * (1 - level.facing) + goal * level.facing;
                    orthonormalize(s.frame);
                }
            }
        }
    }

    /// Adds the segments of the strands to the level's part.
    void draw(std::size_t index, const std::vector<Strand>& strands)
    {
        const GrowthLevel& level = m_primitive.levels[index];
        std::vector<std::vector<Node>>
            guides; // the middle line of each clump, towards which its strands bend
        if (m_primitive.parentOf(index) < 0 && level.clump > 0 && !strands.empty())
            guides = clumpGuides(level, index);
        std::vector<Segment>& segments = m_skeleton[m_part[index]].segments;
        const std::size_t first = segments.size();
        const std::uint32_t first_strand = m_strands[m_part[index]];
        const std::size_t pieces = static_cast<std::size_t>(level.segments);
        const std::vector<double> widths = nodeWidths(level.outline, level.segments);
        segments.resize(first + strands.size() * pieces);
        m_strands[m_part[index]] += static_cast<std::uint32_t>(strands.size());
        tbb::parallel_for(
            tbb::blocked_range<std::size_t>(0, strands.size(), 16),
            [&](const tbb::blocked_range<std::size_t>& range) {
                std::vector<Node> nodes;
                for (std::size_t i = range.begin(); i < range.end(); ++i) {
                    const Strand& strand = strands[i];
                    trace(level, strand, false, nodes);
                    if (!guides.empty()) gather(level, guides[strand.clump], nodes);
                    Random random(hashKey(strand.key, 2));
                    const double brightness =
                        std::clamp(1 + level.colour_variation * random.normal(), 0.0, 2.0);
                    const double half_width = 0.5 * level.width_ratio * strand.length;
                    for (std::size_t k = 0; k < pieces; ++k) {
                        Segment& s = segments[first + i * pieces + k];
                        const double s0 = double(k) / double(pieces),
                                     s1 = double(k + 1) / double(pieces);
                        s.a = Vec3f(nodes[k].p);
                        s.b = Vec3f(nodes[k + 1].p);
                        s.strand = first_strand + static_cast<std::uint32_t>(i);
                        s.colour_a = Vec3f((level.colour_root * (1 - s0) + level.colour_tip * s0)
                                           * brightness);
                        s.colour_b = Vec3f((level.colour_root * (1 - s1) + level.colour_tip * s1)
                                           * brightness);
                        if (level.flat()) {
                            const Vec3d axis = nodes[k + 1].p - nodes[k].p;
                            Vec3d side =
                                axis.cross((nodes[k].frame.n + nodes[k + 1].frame.n) * 0.5);
                            if (side.length() > 0) side.normalize();
                            s.side = Vec3f(side);
                            s.size_a = static_cast<float>(half_width * widths[k]);
                            s.size_b = static_cast<float>(half_width * widths[k + 1]);
                        } else {
                            s.size_a = static_cast<float>(nodes[k].radius);
                            s.size_b = static_cast<float>(nodes[k + 1].radius);
                        }
                    }
                }
            });
        segments.erase(std::remove_if(segments.begin() + static_cast<std::ptrdiff_t>(first),
                                      segments.end(),
                                      [&](const Segment& s) {
                                          return s.a == s.b || (level.flat() && !s.flat())
                                              || std::max(s.size_a, s.size_b) <= 0;
                                      }),
                       segments.end());
    }

    std::vector<std::vector<Node>> clumpGuides(const GrowthLevel& level, std::size_t index) const
    {
        Random random(hashKey(hashKey(m_key, index), 0));
        drawCount(level.count, random); // the same stream as in onGround()
        std::vector<std::vector<Node>> guides(static_cast<std::size_t>(level.clumps));
        for (int k = 0; k < level.clumps; ++k) {
            Strand s;
            s.root = groundPoint(level.spread, k, level.clumps, random);
            s.key = hashKey(hashKey(m_key, index), (1ULL << 40) + static_cast<std::uint64_t>(k));
            const double lean = 0.5 * (level.angle.first + level.angle.second)
                * std::min(1.0, s.root.length() / std::max(level.spread, 1e-30));
            place(level, s, portable::atan2(s.root[2], s.root[0]), lean);
            s.length = level.length > 0 ? level.length : level.length_ratio;
            trace(level, s, true, guides[k]);
        }
        return guides;
    }

    static void gather(const GrowthLevel& level, const std::vector<Node>& guide,
                       std::vector<Node>& nodes)
    {
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            const double s = double(i) / double(nodes.size() - 1), w = level.clump * s * (2 - s);
            nodes[i].p = nodes[i].p * (1 - w) + guide[i].p * w;
        }
    }

    const GrowthRule& m_primitive;
    std::uint64_t m_key;
    std::vector<std::size_t> m_part;          ///< of each level
    std::vector<std::uint32_t> m_strands;     ///< numbers given out in each part
    std::vector<std::vector<Strand>> m_grown; ///< of each level that others stand on
    Skeleton m_skeleton;
};

} // namespace

Skeleton grow(const GrowthRule& primitive, int variant)
{
    primitive.validate();
    return Grower(primitive, variant).run();
}

} // namespace volcomp
