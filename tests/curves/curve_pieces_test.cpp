// SPDX-License-Identifier: Apache-2.0
// Strands that are cut into pieces: nothing is lost, and everything stays where it was.
#include <algorithm>
#include <fstream>
#include <set>

#include <gtest/gtest.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "volcomp/base/random.h"
#include "volcomp/curves/curve_pieces.h"
#include "volcomp/curves/hilbert.h"

namespace volcomp {
namespace {

/// Strands of 2 to 5 segments with roots in a square of 10 units around (1000, 0, 0), as OBJ.
std::string manyStrands(int count)
{
    std::string text;
    int points = 0;
    for (int s = 0; s < count; ++s) {
        Random random(hashKey(3, std::uint64_t(s)));
        const double x = 1000 + 10 * random.uniform(), z = 10 * random.uniform();
        const int segments = 2 + s % 4;
        std::string line = "l";
        for (int k = 0; k <= segments; ++k) {
            text += "v " + std::to_string(x + 0.01 * k * k) + " " + std::to_string(k) + " "
                + std::to_string(z) + "\n";
            line += " " + std::to_string(++points);
        }
        text += line + "\n";
    }
    return text;
}

class Pieces : public testing::Test {
protected:
    GrowthRule rule(bool groom, int pieces, const std::string& obj)
    {
        GrowthRule r;
        r.name = "hair";
        r.material = "hair";
        r.variants = pieces;
        CurvesSpec& c = r.curves.emplace();
        c.file = m_folder.write("strands.obj", obj);
        c.groom = groom;
        c.width = 0.002;
        c.axes.scale = 0.1;
        return r;
    }
    TemporaryFolder m_folder;
};

TEST(Hilbert, neighboursOnTheCurveAreNeighboursInSpace)
{
    // The cells of a cube of 8^3 at the origin are the first 512, or some aligned 512 in a row.
    std::vector<std::pair<std::uint64_t, std::array<int, 3>>> cells;
    for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y)
            for (int z = 0; z < 8; ++z)
                cells.push_back(
                    {hilbertIndex({std::uint32_t(x), std::uint32_t(y), std::uint32_t(z)}),
                     {x, y, z}});
    std::sort(cells.begin(), cells.end());
    for (std::size_t i = 1; i < cells.size(); ++i) {
        EXPECT_EQ(cells[i].first, cells[i - 1].first + 1);
        int steps = 0;
        for (int a = 0; a < 3; ++a)
            steps +=
                std::abs(cells[i].second[std::size_t(a)] - cells[i - 1].second[std::size_t(a)]);
        EXPECT_EQ(steps, 1);
    }
}

TEST_F(Pieces, aGroomLosesNoSegmentAndStaysWhereItIs)
{
    const GrowthRule r = rule(true, 7, manyStrands(400));
    const CurveSet set = readCurves(r.curves->file);
    std::vector<std::array<double, 3>> wanted, found;
    const auto key = [](const Vec3d& p) { return std::array<double, 3>{p[0], p[1], p[2]}; };
    for (std::size_t s = 0; s < set.size(); ++s)
        for (std::size_t p = set.first(s) + 1; p < set.ends[s]; ++p)
            wanted.push_back(key((Vec3d(set.points[p]) + set.offset) * 0.1));
    const CurvePieces pieces(r);
    EXPECT_EQ(pieces.segmentCount(), set.segmentCount());
    std::size_t least = 1000000, most = 0;
    for (int k = 0; k < pieces.count(); ++k) {
        const Skeleton skeleton = pieces.skeleton(k);
        ASSERT_EQ(skeleton.size(), 1u);
        const std::vector<Segment>& segments = skeleton[0].segments;
        least = std::min(least, segments.size()), most = std::max(most, segments.size());
        for (const Segment& s : segments) {
            found.push_back(key(Vec3d(s.b) + pieces.origin(k)));
            EXPECT_EQ(s.size_a, 0.001f); // half the width
        }
    }
    std::sort(wanted.begin(), wanted.end());
    std::sort(found.begin(), found.end());
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < wanted.size(); ++i)
        for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(found[i][a], wanted[i][a], 2e-7) << i;
    EXPECT_LE(most - least, 10u); // two strands at most
}

TEST_F(Pieces, piecesAreTogetherInSpace)
{
    const CurvePieces pieces(rule(true, 16, manyStrands(1600)));
    double area = 0;
    for (int k = 0; k < pieces.count(); ++k) {
        Vec3f low(1e30f), high(-1e30f);
        const Skeleton skeleton = pieces.skeleton(k);
        for (const Segment& s : skeleton[0].segments) {
            low = openvdb::math::minComponent(low, s.a);
            high = openvdb::math::maxComponent(high, s.a);
        }
        area += double(high[0] - low[0]) * double(high[2] - low[2]);
    }
    EXPECT_LT(area, 2.0); // metres^2; the roots cover 1, and at random pieces would have 16
}

TEST_F(Pieces, aTuftStandsOnItsRootAlongItsOwnDirection)
{
    // All strands lean by the same angle to +X +Z.
    std::string text;
    for (int s = 0; s < 100; ++s) {
        Random random(hashKey(5, std::uint64_t(s)));
        const double x = random.uniform(), z = random.uniform();
        for (int k = 0; k < 3; ++k)
            text += "v " + std::to_string(x + k) + " " + std::to_string(k) + " "
                + std::to_string(z + k) + "\n";
        text += "l -3 -2 -1\n";
    }
    const CurvePieces tufts(rule(false, 4, text));
    for (int k = 0; k < 4; ++k) {
        Vec3d roots(0.0);
        const std::vector<Segment> segments = tufts.skeleton(k)[0].segments;
        for (std::size_t i = 0; i < segments.size(); ++i) {
            const Vec3d way = Vec3d(segments[i].b) - Vec3d(segments[i].a);
            EXPECT_NEAR(way[1], 0.1 * std::sqrt(3.0), 1e-6);
            EXPECT_NEAR(Vec3d(way[0], 0, way[2]).length(), 0, 1e-6);
            if (i % 2 == 0) roots += Vec3d(segments[i].a);
        }
        EXPECT_NEAR(roots.length(), 0, 1e-4);
    }
}

TEST_F(Pieces, theUpAxisIsTurnedToY)
{
    GrowthRule r = rule(true, 1, "v 1 2 3\nv 1 2 4\nv 1 2 5\nl 1 2 3\n");
    const auto tip = [&] {
        const CurvePieces pieces(r);
        return Vec3d(pieces.skeleton(0)[0].segments[1].b) + pieces.origin(0);
    };
    EXPECT_LT((tip() - Vec3d(0.1, 0.2, 0.5)).length(), 1e-6);
    r.curves->axes.up = UpAxis::z;
    EXPECT_LT((tip() - Vec3d(0.1, 0.5, -0.2)).length(), 1e-6);
    r.curves->axes.up = UpAxis::x;
    EXPECT_LT((tip() - Vec3d(-0.2, 0.1, 0.5)).length(), 1e-6);
    r.curves->move = Vec3d(0, 0, 100);
    EXPECT_LT((tip() - Vec3d(-0.2, 0.1, 100.5)).length(), 1e-6);
}

TEST_F(Pieces, groupsColoursAndMissingWidths)
{
    GrowthRule r = rule(true, 1,
                        "g a\nv 0 0 0\nv 0 1 0\nv 0 2 0\nl 1 2 3\n"
                        "g b\nv 9 0 0\nv 9 1 0\nv 9 3 0\nl 4 5 6\n");
    r.curves->groups = {1};
    r.curves->colour_root = Vec3d(1, 0, 0);
    r.curves->colour_tip = Vec3d(0, 1, 0);
    const std::vector<Segment> segments = CurvePieces(r).skeleton(0)[0].segments;
    ASSERT_EQ(segments.size(), 2u);
    EXPECT_EQ(segments[0].colour_a, Vec3f(1, 0, 0));
    EXPECT_EQ(segments[0].colour_b, Vec3f(0.5f, 0.5f, 0));
    EXPECT_EQ(segments[1].colour_b, Vec3f(0, 1, 0));
    r.curves->groups = {7};
    EXPECT_NE(messageOf([&] { CurvePieces{r}; }).find("groups"), std::string::npos);
    r.curves->groups = {};
    r.curves->width = 0;
    EXPECT_NE(messageOf([&] { CurvePieces{r}; }).find("'width'"), std::string::npos);
    r.curves->width = 1;
    r.curves->colour_map = m_folder / "map.png";
    EXPECT_NE(messageOf([&] { CurvePieces{r}; }).find("map.png"), std::string::npos);
}

TEST_F(Pieces, aMapColoursEachStrandAtItsRoot)
{
    // A PPM of two pixels: red at the left, green at the right.
    std::ofstream(m_folder / "map.ppm", std::ios::binary)
        << "P6\n2 1\n255\n"
        << '\xff' << '\0' << '\0' << '\0' << '\xff' << '\0';
    GrowthRule r = rule(true, 1,
                        "v 0 0 0\nv 0 1 0\nv 0 2 0\nvt 0.25 0.5\nl 1/1 2 3\n"
                        "v 9 0 0\nv 9 1 0\nv 9 3 0\nvt 0.75 0.5\nl 4/2 5 6\n");
    r.curves->colour_root = Vec3d(0.5, 0.5, 0.5);
    r.curves->colour_map = m_folder / "map.ppm";
    std::set<std::array<float, 3>> colours;
    const Skeleton skeleton = CurvePieces(r).skeleton(0);
    for (const Segment& s : skeleton[0].segments)
        colours.insert({s.colour_a[0], s.colour_a[1], s.colour_a[2]});
    EXPECT_EQ(colours, (std::set<std::array<float, 3>>{{0.5f, 0, 0}, {0, 0.5f, 0}}));
}

TEST_F(Pieces, morePiecesThanStrandsAreEmpty)
{
    const CurvePieces pieces(rule(true, 5, "v 0 0 0\nv 0 1 0\nv 0 2 0\nl 1 2 3\n"));
    std::size_t segments = 0;
    for (int k = 0; k < 5; ++k) segments += pieces.skeleton(k)[0].segments.size();
    EXPECT_EQ(segments, 2u);
}

} // namespace
} // namespace volcomp
