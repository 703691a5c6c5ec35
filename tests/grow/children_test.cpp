// SPDX-License-Identifier: Apache-2.0
// Where children and forks stand, and whom they follow, if their parents curl, wave or clump; and
// the bound on what may grow.
#include "volcomp/grow/grow.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/growth_rules.h"
#include "tests/support/message_of.h"
#include "volcomp/base/random.h"
#include "volcomp/grow/strand.h"

namespace volcomp {
namespace {

using Pieces = std::vector<Segment>;

GrowthLevel level(const std::string& name, const std::string& parent, double count)
{
    GrowthLevel l;
    l.name = name;
    l.parent = parent;
    l.count = {count, count};
    l.length = 1;
    l.radius = 0.01;
    return l;
}

/// The pieces of each strand, in the order in which strands grow.
std::vector<Pieces> strandsOf(const std::vector<Segment>& segments)
{
    std::map<std::uint32_t, Pieces> by_number;
    for (const Segment& s : segments) by_number[s.strand].push_back(s);
    std::vector<Pieces> strands;
    for (auto& [number, pieces] : by_number) strands.push_back(std::move(pieces));
    return strands;
}

double distance(const Vec3d& p, const Pieces& line)
{
    double least = std::numeric_limits<double>::infinity();
    for (const Segment& s : line) {
        const Vec3d a(s.a), d = Vec3d(s.b) - a;
        const double t = std::clamp((p - a).dot(d) / d.lengthSqr(), 0.0, 1.0);
        least = std::min(least, (p - a - d * t).length());
    }
    return least;
}

/// Distance from the vertical line through `axis`.
double sideways(const Vec3f& p, const Vec3f& axis)
{
    return std::hypot(double(p[0]) - axis[0], double(p[2]) - axis[2]);
}

GrowthLevel clumped()
{
    GrowthLevel l = level("hair", "ground", 30);
    l.spread = 0.5;
    l.clump = 1;
    l.clumps = 5;
    return l;
}

// Guides are vertical here, and with clump = 1 all tips of a clump meet in the tip of its guide. A
// fork ends on the line of the guide that its parent belongs to.
TEST(Clump, ForksFollowTheGuideOfTheirParent)
{
    GrowthLevel hair = clumped();
    hair.depth = 3;
    hair.fork = {2, 2};
    hair.angle = {-0.4, 0.4}; // the guides' is the mean, 0
    const std::vector<Pieces> strands = strandsOf(grow(growthRule({hair}), 0).at(0).segments);
    ASSERT_EQ(strands.size(), 30U * (1 + 2 + 4));
    std::vector<Vec3f> guides;
    for (std::size_t i = 0; i < 30; ++i) guides.push_back(strands[i].back().b);
    double apart = 0;
    for (std::size_t i = 0; i < 30; ++i) {
        EXPECT_NEAR(guides[i][1], 1, 1e-6);
        apart = std::max(apart, sideways(guides[i], guides[0]));
    }
    EXPECT_GT(apart, 0.3) << "the clumps stand beside each other";
    const auto check = [&](std::size_t first, std::size_t first_parent, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t parent = first_parent + i / 2;
            const std::size_t ancestor = parent < 30 ? parent : (parent - 30) / 2; // on the ground
            const Pieces& fork = strands[first + i];
            EXPECT_LT(sideways(fork.back().b, guides[ancestor]), 1e-6) << i;
            EXPECT_LT(distance(Vec3d(fork.front().a), strands[parent]), 1e-6) << i;
            // The guide's way that a fork passes is as long as the fork.
            EXPECT_GT(fork.back().b[1], fork.front().a[1]);
            EXPECT_LT(fork.back().b[1], guides[0][1] + (first == 30 ? 0.5 : 0.75) + 1e-6);
        }
    };
    check(30, 0, 60);
    check(90, 30, 120);
}

// MODEL section 6: p (1 - w) + g w, w = clump s (2 - s).
TEST(Clump, AForkBendsToTheGuidesPartBesideIt)
{
    GrowthLevel hair;
    hair.clump = 0.8;
    hair.segments = 4;
    const std::vector<Vec3d> guide{{3, 0, 0}, {3, 1, 0}, {3, 2, 0}, {3, 3, 0}, {3, 4, 0}};
    const auto check = [&](double start, double span) {
        Strand strand;
        strand.guide_start = start;
        strand.guide_span = span;
        std::vector<Node> nodes;
        for (int i = 0; i <= 4; ++i) nodes.push_back({Vec3d(-1, i, 2), {}, 0.1});
        gather(hair, strand, guide, nodes);
        for (int i = 0; i <= 4; ++i) {
            const double s = i / 4.0, w = 0.8 * s * (2 - s), y = 4 * (start + span * s);
            const Vec3d expected = Vec3d(-1, i, 2) * (1 - w) + Vec3d(3, y, 0) * w;
            EXPECT_LT((nodes[i].p - expected).length(), 1e-12) << start << " " << i;
        }
    };
    check(0, 1);       // on the ground
    check(0.5, 0.5);   // to the tip of the guide
    check(0.3, 0.125); // within one of its pieces
    check(0.9, 0.5);   // beyond its tip
}

TEST(Children, StandOnTheLineThatIsDrawn)
{
    const auto worst = [](auto change) {
        GrowthLevel stem = clumped(), leaf = level("leaf", "hair", 7);
        stem.clump = 0;
        leaf.length = 0.05;
        leaf.outline = Outline::ovate;
        change(stem);
        const std::vector<Pieces> strands =
            strandsOf(grow(growthRule({stem, leaf}), 0).at(0).segments);
        const std::size_t stems = strands.size() / 8; // each has 7 leaves
        EXPECT_EQ(strands.size(), stems * 8);
        double most = 0;
        for (std::size_t i = stems; i < strands.size(); ++i)
            most = std::max(most, distance(Vec3d(strands[i].front().a), strands[(i - stems) / 7]));
        return most;
    };
    EXPECT_LT(worst([](GrowthLevel&) {}), 1e-6);
    EXPECT_LT(worst([](GrowthLevel& l) { l.bend = 1.5; }), 1e-6);
    EXPECT_LT(worst([](GrowthLevel& l) { l.wander = 1; }), 1e-6);
    EXPECT_LT(worst([](GrowthLevel& l) { l.curl_radius = 0.05; }), 1e-6);
    EXPECT_LT(worst([](GrowthLevel& l) { l.frizz = 0.2; }), 1e-6);
    EXPECT_LT(worst([](GrowthLevel& l) { l.clump = 0.8; }), 1e-6);
    EXPECT_LT(worst([](GrowthLevel& l) {
                  l.curl_radius = 0.05;
                  l.frizz = 0.1;
                  l.clump = 0.5;
                  l.bend = 1;
              }),
              1e-6);
    EXPECT_LT(worst([](GrowthLevel& l) {
                  l.curl_radius = 0.05;
                  l.depth = 2;
                  l.fork = {0, 0};
              }),
              1e-6);
}

// An angle is measured from the parent's direction as it is drawn: in the middle of a piece of a
// zigzag or helix that is the piece's, up to the half turn to its neighbours.
TEST(Children, LeanFromTheDirectionThatIsDrawn)
{
    GrowthLevel stem = level("stem", "ground", 1), needle = level("needle", "stem", 60);
    stem.curl_radius = 0.1;
    stem.curl_turns = 3;
    stem.segments = 200;
    needle.length = 0.05;
    needle.angle = {kPi / 2, kPi / 2};
    needle.segments = 1;
    const std::vector<Pieces> strands =
        strandsOf(grow(growthRule({stem, needle}), 0).at(0).segments);
    for (std::size_t i = 1; i < strands.size(); ++i) {
        const Vec3d root(strands[i][0].a);
        const auto nearest = std::min_element(strands[0].begin(), strands[0].end(),
                                              [&](const Segment& a, const Segment& b) {
                                                  return distance(root, {a}) < distance(root, {b});
                                              });
        Vec3d along(nearest->b - nearest->a), out(strands[i][0].b - strands[i][0].a);
        along.normalize();
        out.normalize();
        EXPECT_NEAR(along.dot(out), 0, 0.1) << i; // a piece turns by 6 degrees
    }
}

/// A rule of up to four levels with random counts, most of them small and fractional.
GrowthRule randomRule(std::uint64_t key)
{
    Random random(key);
    const auto span = [&](double most) {
        const double low = most * random.uniform();
        return GrowthLevel::Span{low, random.uniform() < 0.5 ? low : low + random.uniform() * 2};
    };
    std::vector<GrowthLevel> levels;
    const int count = 1 + static_cast<int>(4 * random.uniform());
    for (int i = 0; i < count; ++i) {
        const int parent = static_cast<int>((i + 1) * random.uniform()) - 1;
        GrowthLevel l = level(std::string(1, char('a' + i)),
                              parent < 0 ? "ground" : std::string(1, char('a' + parent)), 1);
        l.count = span(4);
        l.fork = span(2.5);
        l.depth = 1 + static_cast<int>(4 * random.uniform());
        l.on_depth = {1 + std::floor(2 * random.uniform()), 3};
        l.whorl = 1 + static_cast<int>(6 * random.uniform());
        l.segments = 1 + static_cast<int>(3 * random.uniform());
        l.spread = 0.1;
        l.clump = random.uniform() < 0.5 ? 0 : 0.5;
        l.clumps = 1 + static_cast<int>(20 * random.uniform());
        levels.push_back(l);
    }
    return growthRule(levels);
}

TEST(Bound, IsAboveWhatAnyRuleGrows)
{
    int reached = 0;
    for (std::uint64_t key = 0; key < 200; ++key) {
        const GrowthRule rule = randomRule(key);
        double most = 0;
        for (int variant = 0; variant < 10; ++variant)
            most = std::max(most, double(grow(rule, variant).at(0).segments.size()));
        EXPECT_LE(most, rule.segmentBound()) << key;
        reached += most == rule.segmentBound();
    }
    EXPECT_GT(reached, 5) << "and not by far";
}

TEST(Bound, CountsAFractionalSpanAsTheNextWholeNumber)
{
    GrowthLevel l = level("a", "ground", 1);
    l.depth = 4;
    l.fork = {1.9, 1.9}; // 1 or 2, on the average 1.9
    l.segments = 1;
    EXPECT_EQ(growthRule({l}).segmentBound(), 1 + 2 + 4 + 8);
    l.fork = {0.1, 0.1};
    EXPECT_EQ(growthRule({l}).segmentBound(), 4);
    l.count = {2.5, 2.5};
    EXPECT_EQ(growthRule({l}).segmentBound(), 3 * 4);
    l.fork = {3, 3};
    l.count = {0, 0};
    EXPECT_EQ(growthRule({l}).segmentBound(), 0);
}

// A million guides of ten thousand pieces would take 800 GB. One strand has one guide.
TEST(Bound, GuidesGrowOnlyForClumpsThatHaveStrands)
{
    GrowthLevel l = clumped();
    l.count = {1, 1};
    l.clumps = 1000000;
    l.segments = 10000;
    const auto start = std::chrono::steady_clock::now();
    EXPECT_EQ(grow(growthRule({l}), 0).at(0).segments.size(), 10000U);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
}

TEST(Bound, ARefusalNamesTheLevelAndTheKeysToLower)
{
    const auto message = [](std::vector<GrowthLevel> levels, double limit) {
        GrowthRule rule = growthRule(std::move(levels));
        rule.segment_limit = limit;
        return messageOf([&] { grow(rule, 0); });
    };
    GrowthLevel few = level("few", "ground", 2), many = level("many", "few", 1e6);
    const std::string counted = message({few, many}, 1e7);
    EXPECT_NE(counted.find("of level 'many': lower its count (up to 1e+06) or segments (8)"),
              std::string::npos)
        << counted;
    few.depth = 22;
    const std::string forked = message({few}, 1e7);
    EXPECT_NE(forked.find("fork (up to 2) or depth (22)"), std::string::npos) << forked;
    EXPECT_NE(forked.find("raise segment_limit"), std::string::npos) << forked;
    // More than 32 bits count is refused, whatever the limit says.
    many.count = {1e9, 1e9};
    EXPECT_NE(message({few, many}, 1e300).find("at most 4294967295"), std::string::npos);
    GrowthLevel clumps = clumped();
    clumps.count = {1e6, 1e6};
    clumps.segments = 1;
    clumps.clumps = 1000000;
    const std::string far = message({clumps}, 1e7);
    EXPECT_NE(far.find("level 'hair': clumps: expected at most 100000 for"), std::string::npos)
        << far;
    clumps.clump = 0; // then they do not count
    clumps.count = {1, 1};
    EXPECT_NO_THROW(grow(growthRule({clumps}), 0));
}

} // namespace
} // namespace volcomp
