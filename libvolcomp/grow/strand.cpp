// SPDX-License-Identifier: Apache-2.0
#include "volcomp/grow/strand.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/portable_math.h"

namespace volcomp {
namespace {

/// Returns v turned about the unit vector `axis` (Rodrigues' formula).
Vec3d turned(const Vec3d& v, const Vec3d& axis, double angle)
{
    const double c = portable::cos(angle), s = portable::sin(angle);
    return v * c + axis.cross(v) * s + axis * (axis.dot(v) * (1 - c));
}

/// The bends of a level over one of its n pieces.
void bendPiece(const GrowthLevel& level, double bend, Random& random, Frame& f)
{
    const int n = level.segments;
    const double wander = level.wander / std::sqrt(n);
    f.turn(f.b(), -bend); // away from the upper side
    if (level.comb != 0) f.turnTowards(Vec3d(1, 0, 0), level.comb / n);
    if (wander > 0) {
        f.turn(f.b(), wander * random.normal());
        f.turn(f.n, wander * random.normal());
    }
    f.turnTowards(Vec3d(0, -1, 0), level.gravity / n);
    f.turnTowards(Vec3d(0, 1, 0), level.light / n);
    if (level.twist != 0) f.n = turned(f.n, f.t, level.twist / n);
    f.orthonormalize();
}

/// Winds the line into a helix, which opens over the first quarter, so that the root stays.
void addCurl(const GrowthLevel& level, Random& random, std::vector<Node>& nodes)
{
    const int n = level.segments;
    const double phase = 2 * kPi * random.uniform(),
                 radius = varied(level.curl_radius, 0.3, random);
    for (int i = 1; i <= n; ++i) {
        const double s = double(i) / n, a = phase + 2 * kPi * level.curl_turns * s,
                     r = radius * std::min(1.0, 4 * s);
        const Frame& g = nodes[i].frame;
        nodes[i].p += g.n * (r * (portable::cos(a) - portable::cos(phase)))
            + g.b() * (r * (portable::sin(a) - portable::sin(phase)));
    }
}

/// Shifts the nodes sideways by a random walk.
void addFrizz(const GrowthLevel& level, double length, Random& random, std::vector<Node>& nodes)
{
    const int n = level.segments;
    Vec3d shift(0.0);
    const double size = level.frizz * length / std::sqrt(n);
    for (int i = 1; i <= n; ++i) {
        const double left = random.normal(), up = random.normal();
        shift += (nodes[i].frame.n * up + nodes[i].frame.b() * left) * size;
        nodes[i].p += shift;
    }
}

} // namespace

void Frame::orthonormalize()
{
    t.normalize();
    n -= t * t.dot(n);
    if (n.lengthSqr() < 1e-12) n = t.cross(std::abs(t[0]) < 0.7 ? Vec3d(1, 0, 0) : Vec3d(0, 0, 1));
    n.normalize();
}

void Frame::turn(const Vec3d& axis, double angle)
{
    t = turned(t, axis, angle);
    n = turned(n, axis, angle);
}

void Frame::turnTowards(const Vec3d& goal, double angle)
{
    const Vec3d axis = t.cross(goal);
    const double sine = axis.length();
    if (sine > 1e-9 && angle != 0) turn(axis / sine, angle * sine);
}

void Frame::faceUp(double amount)
{
    const Vec3d up = Vec3d(0, 1, 0) - t * t[1];
    if (up.length() <= 1e-6) return; // t is vertical
    const Vec3d goal = up / up.length();
    n = n * (1 - amount) + goal * amount;
    orthonormalize();
}

int drawCount(const GrowthLevel::Span& span, Random& random)
{
    return static_cast<int>(std::floor(random.uniform(span.first, span.second + 1 - 1e-9) + 1e-12));
}

double mostDrawn(const GrowthLevel::Span& span)
{
    // Random::uniform() is below its upper end, up to rounding.
    return std::floor(std::max(span.first, span.second + 1 - 1e-9) + 1e-12);
}

double varied(double value, double deviation, Random& random)
{
    return value * std::clamp(1 + deviation * random.normal(), 0.1, 2.0);
}

void trace(const GrowthLevel& level, const Strand& strand, bool plain, std::vector<Node>& nodes)
{
    Random random(hashKey(strand.key, 1));
    const int n = level.segments;
    const double step = strand.length / n;
    const double bend = (level.bend + level.bend_variation * random.normal()) / n;
    nodes.clear();
    Frame f = strand.frame;
    Vec3d p = strand.root;
    for (int i = 0; i <= n; ++i) {
        nodes.push_back({p, f, strand.radius * (1 - level.taper * i / n)});
        if (i == n) break;
        bendPiece(level, bend, random, f);
        p += f.t * step;
    }
    if (plain) return;
    if (level.curl_radius > 0) addCurl(level, random, nodes);
    if (level.frizz > 0) addFrizz(level, strand.length, random, nodes);
}

void gather(const GrowthLevel& level, const Strand& strand, const std::vector<Vec3d>& guide,
            std::vector<Node>& nodes)
{
    const std::size_t last = nodes.size() - 1;
    for (std::size_t i = 0; i <= last; ++i) {
        const double s = double(i) / double(last), w = level.clump * s * (2 - s);
        const double at = strand.guide_start * double(last) + strand.guide_span * double(i);
        const auto k = static_cast<std::size_t>(std::clamp(at, 0.0, double(last - 1)));
        const double f = at - double(k); // above 1 beyond the guide's tip
        const Vec3d goal = guide[k] * (1 - f) + guide[k + 1] * f;
        nodes[i].p = nodes[i].p * (1 - w) + goal * w;
    }
}

void alignFrames(std::vector<Node>& nodes)
{
    const auto piece = [&](std::size_t i) { // its direction
        Vec3d d = nodes[i + 1].p - nodes[i].p;
        const double length = d.length();
        return length > 0 ? d / length : Vec3d(0.0);
    };
    const std::size_t last = nodes.size() - 1;
    for (std::size_t i = 0; i <= last; ++i) {
        const Vec3d t = (i > 0 ? piece(i - 1) : Vec3d(0.0)) + (i < last ? piece(i) : Vec3d(0.0));
        if (t.length() < 1e-6) continue; // the line has no direction here
        nodes[i].frame.t = t;
        nodes[i].frame.orthonormalize();
    }
}

Node nodeAt(const std::vector<Node>& nodes, double u)
{
    const double at = u * double(nodes.size() - 1);
    const std::size_t i = std::min(static_cast<std::size_t>(at), nodes.size() - 2);
    const double f = at - double(i);
    const Node &low = nodes[i], &high = nodes[i + 1];
    Node node{low.p * (1 - f) + high.p * f,
              {low.frame.t * (1 - f) + high.frame.t * f, low.frame.n * (1 - f) + high.frame.n * f},
              low.radius * (1 - f) + high.radius * f};
    node.frame.orthonormalize();
    return node;
}

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

} // namespace volcomp
