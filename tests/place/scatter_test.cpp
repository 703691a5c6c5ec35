// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/scatter.h"

#include <cmath>
#include <fstream>
#include <map>

#include <gtest/gtest.h>

#include "tests/support/message_of.h"
#include "volcomp/base/error.h"
#include "volcomp/base/parallel.h"
#include "volcomp/base/random.h"

namespace volcomp {
namespace {

/// A square of edge 2 around the origin in y = 0 with normals +Y. u and v grow from 0 to 1 along +X
/// and -Z; if `distorted`, u is the square of that.
Mesh square(int n, bool distorted)
{
    Mesh m;
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) m.points.emplace_back(2.0 * i / n - 1, 0, 1 - 2.0 * j / n);
    m.normals.assign(m.points.size(), Vec3f(0, 1, 0));
    const auto uv = [&](int p) {
        const double u = double(p % (n + 1)) / n, v = double(p / (n + 1)) / n;
        return Vec2f(float(distorted ? u * u : u), float(v));
    };
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            const int a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
            for (const std::array<std::int32_t, 3>& t :
                 {std::array<std::int32_t, 3>{a, b, d}, std::array<std::int32_t, 3>{a, d, c}}) {
                m.triangles.push_back(t);
                m.uv.push_back({uv(t[0]), uv(t[1]), uv(t[2])});
            }
        }
    return m;
}

Mesh sphere(int rows)
{
    Mesh m;
    const int columns = 2 * rows;
    for (int j = 0; j <= rows; ++j)
        for (int i = 0; i < columns; ++i) {
            const double lon = 2 * kPi * i / columns, lat = (double(j) / rows - 0.5) * kPi;
            m.points.emplace_back(std::sin(lon) * std::cos(lat), std::sin(lat),
                                  std::cos(lon) * std::cos(lat));
        }
    for (const Vec3d& p : m.points) m.normals.emplace_back(p);
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            const int a = j * columns + i, b = j * columns + (i + 1) % columns, c = a + columns,
                      d = b + columns;
            m.triangles.push_back({a, b, d});
            m.triangles.push_back({a, d, c});
        }
    return m;
}

MapProjection by(ProjectionKind kind)
{
    MapProjection p;
    p.kind = kind;
    p.width = p.height = 2;
    return p;
}

/// A map of 4 x 4 values between 0.1 and 1, each constant over most of its cell.
std::vector<MapFactor> checker(double values[4][4])
{
    const std::filesystem::path file = std::filesystem::path(::testing::TempDir())
        / (std::string("volcomp_scatter_test_")
           + ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".pgm");
    std::ofstream stream(file);
    stream << "P2\n128 128\n65535\n";
    for (int y = 0; y < 128; ++y)
        for (int x = 0; x < 128; ++x) {
            const int i = x / 32, j = 3 - y / 32; // row 0 of values is at v = 0
            values[j][i] = (1 + (5 * i + 3 * j) % 10) / 10.0;
            stream << int(std::lround(values[j][i] * 65535)) << ' ';
        }
    MapFactor m;
    m.image = file;
    m.wrap = Wrap::clamp;
    return {m};
}

Layer layer(double density)
{
    Layer l;
    l.name = "fur";
    l.density = density;
    return l;
}

std::vector<Placement> placementsOf(const Surface& s, const Layer& l, const LayerBoxes& boxes = {},
                                    int index = 0)
{
    return scatter(s, l, boxes, index).placements;
}

/// Pearson's statistic of the counts in the map's 16 cells against density * area * value. For
/// independent samples it would be 16 +- 5.7; stratified ones stay below that.
template <class AreaOf>
double chiSquare(const PlacementList& list, const double values[4][4], double density,
                 const AreaOf& area)
{
    double count[4][4] = {};
    for (const Vec2f& uv : list.uvs)
        ++count[std::min(3, int(uv[1] * 4))][std::min(3, int(uv[0] * 4))];
    double sum = 0;
    for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i) {
            const double expected = density * area(i, j) * values[j][i];
            sum += (count[j][i] - expected) * (count[j][i] - expected) / expected;
        }
    return sum;
}

constexpr double kLimit = 34.3; // exceeded by 0.5 % of independent samples

TEST(Scatter, countsFollowTheMapOnAPlane)
{
    double values[4][4];
    Layer l = layer(10000);
    l.where = checker(values);
    const Surface s(square(8, false), by(ProjectionKind::plane));
    EXPECT_LT(chiSquare(scatter(s, l), values, l.density, [](int, int) { return 4.0 / 16; }),
              kLimit);
    l.sampling = Sampling::uv;
    l.cells_u = l.cells_v = 64;
    l.density = 9.5;
    EXPECT_LT(chiSquare(scatter(s, l), values, l.density, [](int, int) { return 4096 / 16.0; }),
              kLimit);
}

TEST(Scatter, countsFollowTheMapOnASphereWithItsPoles)
{
    double values[4][4];
    Layer l = layer(8000);
    l.where = checker(values);
    const Surface s(sphere(128), by(ProjectionKind::sphere));
    const auto area = [](int, int j) { // a quarter of the longitudes between two latitudes
        const double low = (j / 4.0 - 0.5) * kPi, high = ((j + 1) / 4.0 - 0.5) * kPi;
        return (std::sin(high) - std::sin(low)) * kPi / 2;
    };
    EXPECT_LT(chiSquare(scatter(s, l), values, l.density, area), kLimit);
    // Samples that are even in the map crowd at the poles: every cell gets the same number.
    l.sampling = Sampling::uv;
    l.cells_u = 128;
    l.cells_v = 64;
    l.density = 4;
    EXPECT_LT(chiSquare(scatter(s, l), values, l.density, [](int, int) { return 8192 / 16.0; }),
              kLimit);
}

TEST(Scatter, countsFollowTheMapOnDistortedTextureCoordinates)
{
    double values[4][4];
    Layer l = layer(20000);
    l.where = checker(values);
    const Surface s(square(128, true), by(ProjectionKind::uv));
    // u = x^2: the strip between u0 and u1 has the width sqrt(u1) - sqrt(u0) of the square's.
    const auto area = [](int i, int) {
        return (std::sqrt((i + 1) / 4.0) - std::sqrt(i / 4.0)) * 4 / 4;
    };
    EXPECT_LT(chiSquare(scatter(s, l), values, l.density, area), kLimit);
    l.sampling = Sampling::uv;
    l.cells_u = l.cells_v = 100;
    l.density = 3;
    EXPECT_LT(chiSquare(scatter(s, l), values, l.density, [](int, int) { return 10000 / 16.0; }),
              kLimit);
}

TEST(Scatter, stratificationBeatsPlainRandom)
{
    // The variance of the counts in 400 equal cells; for independent places it would be the mean.
    const Surface s(square(8, false), by(ProjectionKind::plane));
    for (const Sampling sampling : {Sampling::area, Sampling::uv}) {
        Layer l = layer(10000);
        l.sampling = sampling;
        if (sampling == Sampling::uv) l.cells_u = l.cells_v = 200, l.density = 1;
        std::map<std::pair<int, int>, int> count;
        const std::vector<Vec2f> uvs = scatter(s, l).uvs;
        EXPECT_EQ(uvs.size(), 40000u);
        for (const Vec2f& uv : uvs)
            ++count[{std::min(19, int(uv[0] * 20)), std::min(19, int(uv[1] * 20))}];
        double variance = 0;
        for (int i = 0; i < 20; ++i)
            for (int j = 0; j < 20; ++j)
                variance += std::pow(count[std::pair(i, j)] - 100, 2) / 400;
        EXPECT_LT(variance, sampling == Sampling::area ? 30 : 1e-9);
    }
}

TEST(Scatter, anotherMapOrLayerLeavesTheOthersWhereTheyAre)
{
    double values[4][4];
    const Surface s(square(8, false), by(ProjectionKind::plane));
    Layer l = layer(500);
    const auto all = placementsOf(s, l, {0, 4});
    l.where = checker(values);
    const auto some = placementsOf(s, l, {0, 4});
    ASSERT_LT(some.size(), all.size());
    std::size_t k = 0;
    for (const Placement& p : some) { // a subsequence, unchanged
        while (k < all.size() && all[k].position != p.position) ++k;
        ASSERT_LT(k, all.size());
        EXPECT_EQ(all[k].x_axis, p.x_axis);
        EXPECT_EQ(all[k].scale, p.scale);
        EXPECT_EQ(all[k].box, p.box);
    }
    // Another place among the layers changes nothing; another name or seed changes everything.
    EXPECT_EQ(placementsOf(s, l, {0, 4}, 3)[5].position, some[5].position);
    l.name = "whiskers";
    EXPECT_NE(placementsOf(s, l, {0, 4})[5].position, some[5].position);
}

TEST(Scatter, threadsDoNotMatter)
{
    const Surface s(sphere(16), by(ProjectionKind::sphere));
    Layer l = layer(3000);
    std::vector<Placement> one, many;
    {
        const ThreadLimit limit(1);
        one = placementsOf(s, l, {0, 3});
    }
    {
        const ThreadLimit limit(4);
        many = placementsOf(s, l, {0, 3});
    }
    ASSERT_EQ(one.size(), many.size());
    for (std::size_t i = 0; i < one.size(); ++i)
        EXPECT_TRUE(one[i].position == many[i].position && one[i].x_axis == many[i].x_axis);
}

TEST(Scatter, framesAreRightHandedAndLeanAsAsked)
{
    const Surface s(sphere(32), by(ProjectionKind::sphere));
    Layer l = layer(200);
    l.combed = true;
    l.comb = Vec3d(0, -1, 0);
    l.comb_angle = 30 * kDegree;
    l.turn = {0, 0};
    for (const Placement& p : placementsOf(s, l)) {
        EXPECT_LT((p.x_axis.cross(p.y_axis) - p.z_axis).length(), 1e-5f);
        const Vec3d n = p.position.unit();
        if (std::abs(n[1]) > 0.95) continue; // at a pole there is no way down
        EXPECT_NEAR(std::acos(std::min(1.0, Vec3d(p.y_axis).dot(n))), 30 * kDegree, 0.06);
        EXPECT_LT(p.y_axis[1], n[1]);
        EXPECT_GT(Vec3d(p.x_axis).dot(l.comb - n * n.dot(l.comb)),
                  0); // +X faces the comb direction
    }
    l.combed = false;
    l.tilt = {10 * kDegree, 20 * kDegree};
    double sideways = 0;
    const auto tilted = placementsOf(s, l);
    for (const Placement& p : tilted) {
        const double angle = std::acos(std::min(1.0, Vec3d(p.y_axis).dot(p.position.unit())));
        EXPECT_TRUE(angle > 9 * kDegree && angle < 21 * kDegree) << angle / kDegree;
        EXPECT_LT((p.x_axis.cross(p.y_axis) - p.z_axis).length(), 1e-5f);
        sideways += p.y_axis.cross(Vec3f(p.position.unit()))[0];
    }
    EXPECT_LT(std::abs(sideways) / double(tilted.size()), 0.05);
}

/// An image of 16 bits whose left half holds the direction `a` and whose right half holds `b`.
std::filesystem::path combImage(const Vec3d& a, const Vec3d& b)
{
    const std::filesystem::path file =
        std::filesystem::path(::testing::TempDir()) / "volcomp_scatter_test_comb.ppm";
    std::ofstream stream(file);
    stream << "P3\n64 1\n65535\n";
    for (int x = 0; x < 64; ++x)
        for (int i = 0; i < 3; ++i)
            stream << std::lround(((x < 32 ? a : b)[i] + 1) / 2 * 65535) << '\n';
    return file;
}

// On the square u runs along +X and v along -Z, so a painted (x, y) is the direction (x, 0, -y).
TEST(Scatter, boxesLeanAlongThePaintedDirection)
{
    const Vec3d left(0.6, 0.8, 0), right(-0.5, 0.25, 0.7);
    Layer l = layer(500);
    l.combed = true;
    l.comb_map = combImage(left, right);
    l.comb_angle = 40 * kDegree;
    l.turn = {0, 0};
    MapProjection plane = by(ProjectionKind::plane);
    plane.up = Vec3d(0, 0, -1);
    for (const MapProjection& projection : {by(ProjectionKind::uv), plane})
        for (const CombSpace space : {CombSpace::tangent, CombSpace::world}) {
            const Surface s(square(8, false), projection);
            l.comb_space = space;
            const PlacementList list = scatter(s, l);
            ASSERT_EQ(list.size(), 2000u);
            for (std::size_t i = 0; i < list.size(); ++i) {
                const double u = list.uvs[i][0];
                if (std::abs(u - 0.5) < 0.02 || u < 0.02 || u > 0.98) continue; // mixed directions
                const Vec3d c = u < 0.5 ? left : right;
                const Vec3d along =
                    space == CombSpace::tangent ? Vec3d(c[0], 0, -c[1]) : Vec3d(c[0], 0, c[2]);
                const Vec3d wanted =
                    Vec3d(0, 1, 0) * std::cos(l.comb_angle) + along.unit() * std::sin(l.comb_angle);
                const Placement& p = list.placements[i];
                ASSERT_LT((Vec3d(p.y_axis) - wanted).length(), 1e-4) << u;
                ASSERT_GT(Vec3d(p.x_axis).dot(along), 0);
            }
        }
}

// Neutral grey is 127 or 128 of 255, and 32767 or 32768 of 65535.
TEST(Scatter, aNeutralCombMapIsNoComb)
{
    const std::filesystem::path file =
        std::filesystem::path(::testing::TempDir()) / "volcomp_scatter_test_neutral.ppm";
    Layer plain = layer(100);
    plain.tilt = {0.1, 0.2};
    Layer l = plain;
    l.combed = true;
    l.comb_map = file;
    l.comb_angle = 60 * kDegree;
    const Surface s(square(4, false), by(ProjectionKind::uv));
    const auto wanted = placementsOf(s, plain);
    ASSERT_EQ(wanted.size(), 400u);
    for (const CombSpace space : {CombSpace::tangent, CombSpace::world})
        for (const char* colour : {"255 127 127 127", "255 128 128 128", "255 127 128 128",
                                   "65535 32767 32768 32767", "65535 32640 32896 32896"}) {
            const std::string numbers = colour;
            const std::size_t space_at = numbers.find(' ');
            std::ofstream(file) << "P3\n1 1\n"
                                << numbers.substr(0, space_at) << '\n'
                                << numbers.substr(space_at + 1) << '\n';
            l.comb_space = space;
            const auto found = placementsOf(s, l);
            ASSERT_EQ(found.size(), wanted.size());
            for (std::size_t i = 0; i < found.size(); ++i)
                ASSERT_EQ(found[i].y_axis, wanted[i].y_axis) << colour;
        }
    // Blue alone is the direction of the normal: along the surface there is none.
    std::ofstream(file) << "P3\n1 1\n255\n128 128 255\n";
    l.comb_space = CombSpace::tangent;
    EXPECT_EQ(placementsOf(s, l)[7].y_axis, wanted[7].y_axis);
    std::ofstream(file) << "P3\n1 1\n255\n128 255 128\n";
    l.comb_space = CombSpace::world;
    EXPECT_EQ(placementsOf(s, l)[7].y_axis, wanted[7].y_axis);
    // The next colour of 8 bits is a direction: +u.
    std::ofstream(file) << "P3\n1 1\n255\n130 128 128\n";
    l.comb_space = CombSpace::tangent;
    l.tilt = {0, 0};
    EXPECT_GT(placementsOf(s, l)[7].y_axis[0], 0.5f);
}

/// The square, with u and v in other unit squares.
Mesh shifted(double u, double v, double times = 1)
{
    Mesh m = square(4, false);
    for (auto& corners : m.uv)
        for (Vec2f& uv : corners) uv = Vec2f(float(u + uv[0] * times), float(v + uv[1] * times));
    return m;
}

/// Puts the second mesh beside the first.
Mesh beside(Mesh a, const Mesh& b)
{
    const auto first = static_cast<std::int32_t>(a.points.size());
    for (const Vec3d& p : b.points) a.points.push_back(p + Vec3d(4, 0, 0));
    a.normals.assign(a.points.size(), Vec3f(0, 1, 0));
    for (std::array<std::int32_t, 3> t : b.triangles) {
        for (std::int32_t& corner : t) corner += first;
        a.triangles.push_back(t);
    }
    a.uv.insert(a.uv.end(), b.uv.begin(), b.uv.end());
    return a;
}

TEST(Scatter, cellsFillEveryUnitSquareThatTheSurfaceReaches)
{
    Layer l = layer(1);
    l.sampling = Sampling::uv;
    l.cells_u = l.cells_v = 17;
    const auto count = [&](const Mesh& m) {
        return placementsOf(Surface(m, by(ProjectionKind::uv)), l).size();
    };
    EXPECT_EQ(count(square(4, false)), 289u);
    EXPECT_EQ(count(shifted(-1, -1)), 289u);
    EXPECT_EQ(count(shifted(3, -7)), 289u);
    EXPECT_EQ(count(shifted(-1, -1, 2)), 4 * 289u) << "u and v from -1 to 1";
    EXPECT_EQ(count(shifted(1e-7, -1e-7)), 289u) << "a sliver over a border is no square";
    EXPECT_NEAR(double(count(shifted(0.25, 0.5))), 289, 17) << "parts of four squares";
    // Two tiles of UDIM: the first has what it has alone.
    const Surface one(square(4, false), by(ProjectionKind::uv)),
        two(beside(square(4, false), shifted(1, 0)), by(ProjectionKind::uv));
    const auto alone = placementsOf(one, l), both = placementsOf(two, l);
    ASSERT_EQ(both.size(), 2 * 289u);
    for (std::size_t i = 0; i < 289; ++i) {
        EXPECT_EQ(both[i].position, alone[i].position);
        EXPECT_EQ(both[i].x_axis, alone[i].x_axis);
        EXPECT_GT(both[289 + i].position[0], 3 - 1e-9);
    }
    EXPECT_NE(both[289].position[2], both[0].position[2]) << "other random numbers";
    // A plane that is smaller than the surface repeats.
    MapProjection plane = by(ProjectionKind::plane);
    plane.width = plane.height = 0.5;
    plane.centre = Vec3d(0.25, 0, 0.25);
    EXPECT_EQ(placementsOf(Surface(square(4, false), plane), l).size(), 16 * 289u);
    l.cells_u = l.cells_v = 1;
    EXPECT_THROW(count(shifted(0, 0, 1000)), Error);
    EXPECT_THROW(count(shifted(1e12, 0)), Error);
}

TEST(Scatter, roundingOfTheAreaDoesNotMakeASecondSample)
{
    const Surface s(square(4, false), by(ProjectionKind::uv));
    for (int seed = 1; seed <= 20; ++seed) {
        Layer l = layer(0.25 * (1 + 1e-12));
        l.seed = static_cast<std::uint64_t>(seed);
        EXPECT_EQ(placementsOf(s, l).size(), 1u);
    }
}

TEST(Scatter, impossibleNumbersAreRefusedBeforeMapsAreRead)
{
    const Surface s(square(4, false), by(ProjectionKind::uv));
    Layer l = layer(1e9);
    MapFactor m;
    m.image = "/nonexistent/map.png";
    l.where = {m};
    EXPECT_NE(messageOf([&] { placementsOf(s, l); }).find("at most 5e+08 samples, found 4e+09"),
              std::string::npos);
    l.sampling = Sampling::uv;
    l.cells_u = l.cells_v = 65536;
    l.density = 1;
    EXPECT_NE(messageOf([&] { checkSamples(s, l); }).find("'density' or 'cells'"),
              std::string::npos);
}

TEST(Scatter, manyBoxesKeepTheOrderOfTheirSamples)
{
    // Two layers, of more boxes than fit into one slab of the collector.
    const Surface s(square(8, false), by(ProjectionKind::plane));
    Layer l = layer(150000);
    PlacementCollector collector;
    scatter(s, l, {}, 0, {true, false}, collector);
    EXPECT_EQ(collector.size(), 600000u);
    l.density = 1000;
    l.name = "other";
    scatter(s, l, {}, 1, {true, false}, collector);
    const PlacementList list = collector.take();
    ASSERT_EQ(list.size(), 604000u);
    EXPECT_EQ(list.triangles.size(), 604000u);
    EXPECT_TRUE(list.uvs.empty());
    EXPECT_EQ(list.placements[599999].layer, 0);
    EXPECT_EQ(list.placements[600000].layer, 1);
    const PlacementList alone = scatter(s, l, {}, 1);
    for (std::size_t i = 0; i < 4000; ++i) {
        ASSERT_EQ(list.placements[600000 + i].position, alone.placements[i].position);
        ASSERT_EQ(list.triangles[600000 + i], alone.triangles[i]);
    }
    l.name = "fur";
    l.density = 150000;
    const PlacementList first = scatter(s, l);
    for (const std::size_t i : {0, 4095, 4096, 524287, 524288, 599999})
        EXPECT_EQ(list.placements[i].position, first.placements[i].position);
}

TEST(Scatter, uprightTurnsTheAxisFromTheNormalToTheSky)
{
    const Surface s(sphere(32), by(ProjectionKind::sphere));
    Layer l = layer(200);
    const auto plain = placementsOf(s, l);
    for (const double upright : {0.5, 1.0}) {
        l.upright = upright;
        const auto raised = placementsOf(s, l);
        ASSERT_EQ(raised.size(), plain.size());
        for (std::size_t i = 0; i < raised.size(); ++i) {
            EXPECT_EQ(raised[i].position, plain[i].position);
            const Vec3d n(plain[i].y_axis), y(raised[i].y_axis);
            if (n[1] < -0.99) continue; // half upright on a ceiling has no direction
            const Vec3d wanted = upright == 1 ? Vec3d(0, 1, 0) : (n + Vec3d(0, 1, 0)).unit();
            EXPECT_LT((y - wanted).length(), 1e-5);
            EXPECT_LT((raised[i].x_axis.cross(raised[i].y_axis) - raised[i].z_axis).length(),
                      1e-5f);
        }
    }
    l.upright = 1.5;
    EXPECT_THROW(l.validate(), Error);
}

// Two spheres that run through each other, as parts of meshes do.
TEST(Scatter, partsThatIntersectHaveBoxesOnBothOrOnTheOuterAlone)
{
    Mesh both = sphere(24);
    const Mesh other = both;
    const Vec3d shift(0, 0, 0.8);
    const auto first = static_cast<std::int32_t>(both.points.size());
    for (const Vec3d& p : other.points) both.points.push_back(p + shift);
    both.normals.insert(both.normals.end(), other.normals.begin(), other.normals.end());
    for (std::array<std::int32_t, 3> t : other.triangles) {
        for (std::int32_t& c : t) c += first;
        both.triangles.push_back(t);
    }
    const Surface s(both, by(ProjectionKind::cylinder));
    Layer l = layer(400);
    const auto inner = [&](const Vec3d& p) {
        return std::min(p.length(), (p - shift).length()) < 0.98;
    };
    const auto all = placementsOf(s, l);
    EXPECT_NEAR(double(all.size()), 400 * s.area(), 0.02 * 400 * s.area()); // the hidden parts too
    EXPECT_GT(std::count_if(all.begin(), all.end(),
                            [&](const Placement& p) { return inner(p.position); }),
              500);
    for (const Placement& p : all)
        EXPECT_NEAR(std::min(std::abs(p.position.length() - 1),
                             std::abs((p.position - shift).length() - 1)),
                    0, 0.02);
    l.sheets = Sheets::first;
    const auto outer = placementsOf(s, l);
    EXPECT_GT(outer.size(), 1000u);
    for (const Placement& p : outer) EXPECT_FALSE(inner(p.position)) << p.position;
}

TEST(Scatter, onlyTheFirstSheetWhereTheLayerSaysSo)
{
    Mesh m = sphere(16), inner = sphere(16);
    const auto base = static_cast<std::int32_t>(m.points.size());
    for (const Vec3d& p : inner.points) m.points.push_back(p * 0.5);
    m.normals.insert(m.normals.end(), inner.normals.begin(), inner.normals.end());
    for (const auto& t : inner.triangles)
        m.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
    const Surface s(std::move(m), by(ProjectionKind::sphere));
    for (const Sampling sampling : {Sampling::area, Sampling::uv}) {
        Layer l = layer(sampling == Sampling::area ? 200 : 1);
        l.sampling = sampling;
        l.cells_u = l.cells_v = 40;
        std::size_t inside = 0;
        for (const Placement& p : placementsOf(s, l)) inside += p.position.length() < 0.75;
        EXPECT_GT(inside, 300u);
        l.sheets = Sheets::first;
        const auto first = placementsOf(s, l);
        EXPECT_GT(first.size(), 1000u);
        for (const Placement& p : first) EXPECT_GT(p.position.length(), 0.9);
    }
}

TEST(Scatter, sizesColoursAndOffsetsFollowTheirMaps)
{
    const Surface s(square(4, false), by(ProjectionKind::plane));
    Layer l = layer(500);
    MapFactor half, red;
    half.constant = Vec3d(0.5);
    red.constant = Vec3d(1, 0, 0);
    l.size = {half};
    l.colour = {red};
    l.scale = {0.8, 1.2};
    l.offset = -0.25;
    double mean = 0;
    const auto placements = placementsOf(s, l, {7, 3}, 2);
    for (const Placement& p : placements) {
        EXPECT_TRUE(p.scale >= 0.4f && p.scale <= 0.6f);
        EXPECT_EQ(p.tint, Vec3f(1, 0, 0));
        EXPECT_NEAR(p.position[1], -0.25, 1e-12);
        EXPECT_TRUE(p.box >= 7 && p.box < 10 && p.layer == 2);
        mean += p.scale / double(placements.size());
    }
    EXPECT_NEAR(mean, 0.5, 0.01);
    l.size[0].constant = Vec3d(0.0);
    EXPECT_TRUE(scatter(s, l).empty());
}

TEST(Scatter, wrongInputIsRefused)
{
    Mesh bare = square(4, false);
    bare.uv.clear();
    const Surface s(std::move(bare), by(ProjectionKind::uv));
    EXPECT_EQ(scatter(s, layer(100)).size(),
              400u); // without a map nothing needs texture coordinates
    double values[4][4];
    Layer l = layer(100);
    l.where = checker(values);
    EXPECT_THROW(scatter(s, l), Error);
    EXPECT_THROW(scatter(s, layer(1e12)), Error);
    EXPECT_THROW(scatter(s, layer(NAN)), Error);
    EXPECT_THROW(scatter(s, layer(-1)), Error);
    EXPECT_TRUE(scatter(s, layer(0)).empty());
}

} // namespace
} // namespace volcomp
