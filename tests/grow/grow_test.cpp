// SPDX-License-Identifier: Apache-2.0
// The strands that rules grow, against lengths, angles, counts and areas known from the rules.
#include "volcomp/grow/grow.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <map>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/support/growth_rules.h"
#include "tests/support/message_of.h"

namespace volcomp {
namespace {

GrowthLevel strands(const std::string& name, const std::string& parent, double count)
{
    GrowthLevel l;
    l.name = name;
    l.parent = parent;
    l.count = {count, count};
    l.length = 1;
    l.radius = 0.01;
    return l;
}

std::vector<Segment> grown(const GrowthRule& p, int variant = 0)
{
    return grow(p, variant).at(0).segments;
}

std::map<std::uint32_t, std::vector<Segment>> byStrand(const std::vector<Segment>& segments)
{
    std::map<std::uint32_t, std::vector<Segment>> result;
    for (const Segment& s : segments) result[s.strand].push_back(s);
    return result;
}

Vec3d axis(const Segment& s)
{
    const Vec3d d(s.b - s.a);
    return d / d.length();
}

std::string failureOf(const GrowthRule& rule)
{
    return messageOf([&] { grow(rule, 0); });
}

TEST(Grow, HairIsTheRecursionWithOneChild)
{
    GrowthLevel hair = strands("hair", "ground", 40);
    hair.spread = 0.2;
    hair.length = 3;
    hair.taper = 0.75;
    hair.wander = 0.5;
    const auto all = byStrand(grown(growthRule({hair})));
    ASSERT_EQ(all.size(), 40U);
    for (const auto& [number, pieces] : all) {
        ASSERT_EQ(pieces.size(), 8U);
        EXPECT_NEAR(pieces.front().a[1], 0, 1e-6) << "roots stand on the ground";
        EXPECT_LE(std::hypot(pieces.front().a[0], pieces.front().a[2]), 0.2 + 1e-6);
        double length = 0;
        for (std::size_t k = 0; k < pieces.size(); ++k) {
            length += (pieces[k].b - pieces[k].a).length();
            if (k > 0) {
                EXPECT_EQ(pieces[k].a, pieces[k - 1].b);
            }
        }
        EXPECT_NEAR(length, 3, 1e-5);
        EXPECT_NEAR(pieces.front().size_a, 0.01, 1e-8);
        EXPECT_NEAR(pieces.back().size_b, 0.0025, 1e-8);
    }
}

TEST(Grow, ChildrenStandWhereAndAsTheirLevelSays)
{
    GrowthLevel trunk = strands("trunk", "ground", 1), branch = strands("branch", "trunk", 9);
    branch.length = 0;
    branch.length_ratio = 0.25;
    branch.length_tip = 0.5;
    branch.radius = 0;
    branch.radius_ratio = 0.5;
    branch.angle = {kPi / 3, kPi / 3};
    branch.start = 0.4;
    const auto all = byStrand(grown(growthRule({trunk, branch})));
    ASSERT_EQ(all.size(), 10U);
    for (const auto& [number, pieces] : all) {
        if (number == 0) continue;
        const Segment& first = pieces.front();
        EXPECT_NEAR(axis(first)[1], 0.5, 1e-5) << "60 degrees from the trunk";
        EXPECT_GE(first.a[1], 0.4 - 1e-6);
        EXPECT_NEAR((pieces.back().b - first.a).length(), 0.25 * (1 - 0.5 * first.a[1]), 1e-5);
        EXPECT_NEAR(first.size_a, 0.5 * 0.01 * (1 - 0.5 * first.a[1]), 1e-6);
        if (number == 1) continue;
        const Vec3d u = axis(all.at(number - 1).front()), v = axis(first);
        const double turn =
            std::atan2(u[2] * v[0] - u[0] * v[2], u[0] * v[0] + u[2] * v[2]) / kDegree;
        EXPECT_NEAR(std::abs(turn), 137.50776, 1e-3) << "phyllotaxis";
    }
}

TEST(Grow, WhorlsAndPlanesAreRegular)
{
    GrowthLevel trunk = strands("trunk", "ground", 1), branch = strands("branch", "trunk", 12);
    branch.whorl = 4;
    branch.angle = {kPi / 2, kPi / 2};
    auto all = byStrand(grown(growthRule({trunk, branch})));
    for (std::uint32_t node = 0; node < 3; ++node) {
        Vec3d sum(0.0);
        for (std::uint32_t k = 1; k <= 4; ++k) {
            sum += axis(all.at(4 * node + k).front());
            EXPECT_EQ(all.at(4 * node + k).front().a, all.at(4 * node + 1).front().a);
        }
        EXPECT_NEAR(sum.length(), 0, 1e-5);
    }
    branch.whorl = 1;
    branch.planar = true;
    all = byStrand(grown(growthRule({trunk, branch})));
    for (std::uint32_t k = 2; k <= 12; ++k)
        EXPECT_NEAR(axis(all.at(k).front()).dot(axis(all.at(k - 1).front())), -1, 1e-5);
}

TEST(Grow, TropismsTurnTheRightWay)
{
    GrowthLevel trunk = strands("trunk", "ground", 1), branch = strands("branch", "trunk", 5);
    branch.angle = {kPi / 2, kPi / 2};
    const auto tip = [&](auto change) {
        GrowthLevel changed = branch;
        change(changed);
        const auto all = byStrand(grown(growthRule({trunk, changed})));
        double rise = 0;
        for (const auto& [number, pieces] : all)
            if (number > 0) rise += double(pieces.back().b[1] - pieces.front().a[1]) / 5;
        return rise;
    };
    EXPECT_NEAR(tip([](GrowthLevel&) {}), 0, 1e-6);
    EXPECT_LT(tip([](GrowthLevel& l) { l.gravity = 1; }), -0.2);
    EXPECT_GT(tip([](GrowthLevel& l) { l.light = 1; }), 0.2);
    EXPECT_LT(tip([](GrowthLevel& l) { l.bend = 1; }), -0.2)
        << "bend leads away from the parent's tip";
    GrowthLevel hair = strands("hair", "ground", 20);
    hair.comb = kPi / 2;
    hair.spread = 0.1;
    for (const auto& [number, pieces] : byStrand(grown(growthRule({hair}))))
        EXPECT_GT(axis(pieces.back())[0], 0.5);
}

TEST(Grow, ClumpBringsTipsTogether)
{
    GrowthLevel hair = strands("hair", "ground", 200);
    hair.spread = 0.5;
    const auto spreadOfTips = [&](double clump) {
        hair.clump = clump;
        double sum = 0;
        for (const auto& [number, pieces] : byStrand(grown(growthRule({hair}))))
            sum += Vec3d(pieces.back().b[0], 0, pieces.back().b[2]).length() / 200;
        return sum;
    };
    EXPECT_GT(spreadOfTips(0), 0.3);
    EXPECT_LT(spreadOfTips(0.8),
              0.35 * spreadOfTips(0) + 0.2); // one clump, whose middle may lie anywhere
}

TEST(Grow, FewPiecesOfALeafHaveTheAreaOfTheOutline)
{
    for (Outline outline : {Outline::blade, Outline::ellipse, Outline::ovate, Outline::obovate}) {
        double expected = 0;
        for (int k = 0; k < 10000; ++k)
            expected += 0.3 * outlineWidth(outline, (k + 0.5) / 10000) / 10000;
        for (int pieces : {1, 2, 3, 16}) {
            GrowthLevel leaf = strands("leaf", "ground", 1);
            leaf.outline = outline;
            leaf.segments = pieces;
            double area = 0;
            for (const Segment& s : grown(growthRule({leaf}))) {
                area += double(s.size_a + s.size_b) * (s.b - s.a).length();
                EXPECT_NEAR(s.side.length(), 1, 1e-5);
                EXPECT_NEAR(s.side.dot(s.b - s.a), 0, 1e-5);
            }
            EXPECT_NEAR(area, expected, 1e-3 * expected) << pieces;
        }
    }
}

TEST(Grow, TheBoundIsTheCount)
{
    GrowthLevel trunk = strands("trunk", "ground", 3), branch = strands("branch", "trunk", 4),
                leaf = strands("leaf", "branch", 5);
    branch.depth = 3;
    branch.fork = {2, 2};
    leaf.on_depth = {2, 3};
    leaf.segments = 1;
    const GrowthRule p = growthRule({trunk, branch, leaf});
    EXPECT_EQ(p.segmentBound(), 3 * 8 + (12 + 24 + 48) * 8 + (24 + 48) * 5);
    EXPECT_EQ(double(grown(p).size()), p.segmentBound());
}

// 21 multiplications give the bound; growing first and counting then would never end.
TEST(Grow, TenToTheTwentiethSegmentsAreRefusedBeforeTheyGrow)
{
    GrowthLevel level = strands("branch", "ground", 1);
    level.depth = 21;
    level.fork = {10, 10};
    level.segments = 1;
    const GrowthRule rule = growthRule({level});
    EXPECT_DOUBLE_EQ(rule.segmentBound(), (1e21 - 1) / 9);
    const std::string message = failureOf(rule);
    EXPECT_EQ(message, messageOf([&] { rule.validate(); })) << "which grows nothing";
    EXPECT_NE(message.find("1.11111e+20"), std::string::npos) << message;
    EXPECT_NE(message.find("segment_limit"), std::string::npos) << message;
}

TEST(Grow, SameSegmentsForAnyNumberOfThreadsAndOthersForAnotherVariant)
{
    GrowthLevel hair = strands("hair", "ground", 300), leaf = strands("leaf", "hair", 4);
    hair.frizz = hair.wander = hair.clump = 0.3;
    hair.curl_radius = 0.1;
    leaf.outline = Outline::ovate;
    const GrowthRule p = growthRule({hair, leaf});
    const auto with = [&](std::size_t threads, int variant) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        return grown(p, variant);
    };
    const auto one = with(1, 0), four = with(4, 0), other = with(4, 1);
    ASSERT_EQ(one.size(), four.size());
    ASSERT_EQ(one.size(), other.size());
    std::size_t same = 0;
    for (std::size_t i = 0; i < one.size(); ++i) {
        ASSERT_EQ(std::memcmp(&one[i], &four[i], sizeof(Segment)), 0) << i;
        same += one[i].b == other[i].b;
    }
    EXPECT_LT(same, one.size() / 100);
}

TEST(Grow, DegenerateParametersGrowNothingThatIsNotFinite)
{
    const auto count = [](auto change) {
        GrowthLevel level = strands("a", "ground", 5);
        change(level);
        return grown(growthRule({level})).size();
    };
    EXPECT_EQ(count([](GrowthLevel& l) { l.count = {0, 0}; }), 0U);
    EXPECT_EQ(count([](GrowthLevel& l) { l.length = l.length_ratio = 0; }), 0U);
    EXPECT_EQ(count([](GrowthLevel& l) { l.radius = l.radius_ratio = 0; }), 0U);
    GrowthLevel knot = strands("knot", "ground", 5);
    knot.curl_radius = 5;
    knot.curl_turns = 1000;
    knot.bend = 1e5;
    knot.twist = -1e5;
    knot.radius = 50;
    GrowthLevel leaf = strands("leaf", "knot", 3);
    leaf.outline = Outline::ellipse;
    leaf.angle = {0, 0};
    leaf.facing = 1;
    for (const Segment& s : grown(growthRule({knot, leaf})))
        EXPECT_TRUE((s.a + s.b + s.side).isFinite());
}

TEST(Grow, ValuesOutOfRangeAreNamed)
{
    for (double bad : {std::nan(""), std::numeric_limits<double>::infinity(), -1.0}) {
        GrowthLevel level = strands("a", "ground", 5);
        level.curl_radius = bad;
        EXPECT_NE(failureOf(growthRule({level})).find("level 'a': curl_radius"), std::string::npos)
            << failureOf(growthRule({level}));
        level = strands("a", "ground", 5);
        level.count.second = bad;
        EXPECT_NE(failureOf(growthRule({level})).find("level 'a': count"), std::string::npos)
            << failureOf(growthRule({level}));
    }
    EXPECT_NE(failureOf(growthRule({strands("a", "b", 5)})).find("stands on 'b'"),
              std::string::npos);
}

} // namespace
} // namespace volcomp
