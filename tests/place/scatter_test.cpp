#include "volcomp/place/scatter.h"

#include <cmath>
#include <fstream>
#include <map>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"
#include "volcomp/base/parallel.h"
#include "volcomp/base/random.h"

namespace volcomp {
namespace {

/// A square of edge 2 around the origin in y = 0, normals +Y, its texture coordinates drawn out: u
/// = x'^2 with x' from 0 to 1.
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
    const std::filesystem::path file =
        std::filesystem::path(::testing::TempDir()) / "volcomp_scatter_map.pgm";
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

/// Pearson's statistic of counts per map cell against density * area * value, over the cells' 16
/// degrees of freedom. Stratified samples stay below the 16 +- 5.7 of independent ones.
template <class AreaOf>
double chiSquare(const std::vector<Placement>& placements, const double values[4][4],
                 double density, const AreaOf& area)
{
    double count[4][4] = {};
    for (const Placement& p : placements)
        ++count[std::min(3, int(p.uv[1] * 4))][std::min(3, int(p.uv[0] * 4))];
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
    EXPECT_LT(chiSquare(scatter(s, l, {}, 0), values, l.density, [](int, int) { return 4.0 / 16; }),
              kLimit);
    l.sampling = Sampling::uv;
    l.cells_u = l.cells_v = 64;
    l.density = 9.5;
    EXPECT_LT(
        chiSquare(scatter(s, l, {}, 0), values, l.density, [](int, int) { return 4096 / 16.0; }),
        kLimit);
}

TEST(Scatter, countsFollowTheMapOnASphereWithItsPoles)
{
    double values[4][4];
    Layer l = layer(8000);
    l.where = checker(values);
    const Surface s(sphere(128), by(ProjectionKind::sphere));
    const auto area = [](int, int j) { // of a quarter of the longitudes between two latitudes
        const double low = (j / 4.0 - 0.5) * kPi, high = ((j + 1) / 4.0 - 0.5) * kPi;
        return (std::sin(high) - std::sin(low)) * kPi / 2;
    };
    EXPECT_LT(chiSquare(scatter(s, l, {}, 0), values, l.density, area), kLimit);
    // Even in the map means crowded at the poles: every cell gets the same number.
    l.sampling = Sampling::uv;
    l.cells_u = 128;
    l.cells_v = 64;
    l.density = 4;
    EXPECT_LT(
        chiSquare(scatter(s, l, {}, 0), values, l.density, [](int, int) { return 8192 / 16.0; }),
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
    EXPECT_LT(chiSquare(scatter(s, l, {}, 0), values, l.density, area), kLimit);
    l.sampling = Sampling::uv;
    l.cells_u = l.cells_v = 100;
    l.density = 3;
    EXPECT_LT(
        chiSquare(scatter(s, l, {}, 0), values, l.density, [](int, int) { return 10000 / 16.0; }),
        kLimit);
}

TEST(Scatter, stratificationBeatsPlainRandom)
{
    // Boxes in each of 400 equal cells: their variance is the mean for plain random places.
    const Surface s(square(8, false), by(ProjectionKind::plane));
    for (const Sampling sampling : {Sampling::area, Sampling::uv}) {
        Layer l = layer(10000);
        l.sampling = sampling;
        if (sampling == Sampling::uv) l.cells_u = l.cells_v = 200, l.density = 1;
        std::map<std::pair<int, int>, int> count;
        const auto placements = scatter(s, l, {}, 0);
        EXPECT_EQ(placements.size(), 40000u);
        for (const Placement& p : placements)
            ++count[{std::min(19, int(p.uv[0] * 20)), std::min(19, int(p.uv[1] * 20))}];
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
    const auto all = scatter(s, l, {0, 4}, 0);
    l.where = checker(values);
    const auto some = scatter(s, l, {0, 4}, 0);
    ASSERT_LT(some.size(), all.size());
    std::size_t k = 0;
    for (const Placement& p : some) { // a subsequence, unchanged
        while (k < all.size() && all[k].position != p.position) ++k;
        ASSERT_LT(k, all.size());
        EXPECT_EQ(all[k].x_axis, p.x_axis);
        EXPECT_EQ(all[k].scale, p.scale);
        EXPECT_EQ(all[k].box, p.box);
    }
    // Another place among the layers changes nothing, another name or seed everything.
    EXPECT_EQ(scatter(s, l, {0, 4}, 3)[5].position, some[5].position);
    l.name = "whiskers";
    EXPECT_NE(scatter(s, l, {0, 4}, 0)[5].position, some[5].position);
}

TEST(Scatter, threadsDoNotMatter)
{
    const Surface s(sphere(16), by(ProjectionKind::sphere));
    Layer l = layer(3000);
    std::vector<Placement> one, many;
    {
        const ThreadLimit limit(1);
        one = scatter(s, l, {0, 3}, 0);
    }
    {
        const ThreadLimit limit(4);
        many = scatter(s, l, {0, 3}, 0);
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
    for (const Placement& p : scatter(s, l, {}, 0)) {
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
    const auto tilted = scatter(s, l, {}, 0);
    for (const Placement& p : tilted) {
        const double angle = std::acos(std::min(1.0, Vec3d(p.y_axis).dot(p.position.unit())));
        EXPECT_TRUE(angle > 9 * kDegree && angle < 21 * kDegree) << angle / kDegree;
        EXPECT_LT((p.x_axis.cross(p.y_axis) - p.z_axis).length(), 1e-5f);
        sideways += p.y_axis.cross(Vec3f(p.position.unit()))[0];
    }
    EXPECT_LT(std::abs(sideways) / double(tilted.size()), 0.05);
}

TEST(Scatter, uprightTurnsTheAxisFromTheNormalToTheSky)
{
    const Surface s(sphere(32), by(ProjectionKind::sphere));
    Layer l = layer(200);
    const auto plain = scatter(s, l, {}, 0);
    for (const double upright : {0.5, 1.0}) {
        l.upright = upright;
        const auto raised = scatter(s, l, {}, 0);
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

// Two spheres through each other: what meshes of several parts bring.
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
    const auto all = scatter(s, l, {}, 0);
    EXPECT_NEAR(double(all.size()), 400 * s.area(), 0.02 * 400 * s.area()); // the hidden parts too
    EXPECT_GT(std::count_if(all.begin(), all.end(),
                            [&](const Placement& p) { return inner(p.position); }),
              500);
    for (const Placement& p : all)
        EXPECT_NEAR(std::min(std::abs(p.position.length() - 1),
                             std::abs((p.position - shift).length() - 1)),
                    0, 0.02);
    l.sheets = Sheets::first;
    const auto outer = scatter(s, l, {}, 0);
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
        for (const Placement& p : scatter(s, l, {}, 0)) inside += p.position.length() < 0.75;
        EXPECT_GT(inside, 300u);
        l.sheets = Sheets::first;
        const auto first = scatter(s, l, {}, 0);
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
    const auto placements = scatter(s, l, {7, 3}, 2);
    for (const Placement& p : placements) {
        EXPECT_TRUE(p.scale >= 0.4f && p.scale <= 0.6f);
        EXPECT_EQ(p.tint, Vec3f(1, 0, 0));
        EXPECT_NEAR(p.position[1], -0.25, 1e-12);
        EXPECT_TRUE(p.box >= 7 && p.box < 10 && p.layer == 2);
        mean += p.scale / double(placements.size());
    }
    EXPECT_NEAR(mean, 0.5, 0.01);
    l.size[0].constant = Vec3d(0.0);
    EXPECT_TRUE(scatter(s, l, {}, 0).empty());
}

TEST(Scatter, wrongInputIsRefused)
{
    Mesh bare = square(4, false);
    bare.uv.clear();
    const Surface s(std::move(bare), by(ProjectionKind::uv));
    EXPECT_EQ(scatter(s, layer(100), {}, 0).size(),
              400u); // without a map nothing needs texture coordinates
    double values[4][4];
    Layer l = layer(100);
    l.where = checker(values);
    EXPECT_THROW(scatter(s, l, {}, 0), Error);
    EXPECT_THROW(scatter(s, layer(1e12), {}, 0), Error);
    EXPECT_THROW(scatter(s, layer(NAN), {}, 0), Error);
    EXPECT_THROW(scatter(s, layer(-1), {}, 0), Error);
    EXPECT_TRUE(scatter(s, layer(0), {}, 0).empty());
}

} // namespace
} // namespace volcomp
