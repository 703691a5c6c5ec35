// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/shade.h"

#include <cmath>
#include <fstream>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "volcomp/base/random.h"

using namespace volcomp;

namespace {

Vec3d vec(const nlohmann::json& j) { return {j[0], j[1], j[2]}; }

Material material(const nlohmann::json& j, MaterialKind kind)
{
    Material m;
    m.kind = kind;
    m.alpha = j["alpha"];
    m.beta = j["beta"];
    m.gamma = j["gamma"];
    m.n = j["n"];
    return m;
}

void compare(const char* file, MaterialKind kind)
{
    std::ifstream stream(std::string(VOLCOMP_TEST_DATA) + "/" + file);
    const nlohmann::json rows = nlohmann::json::parse(stream);
    ASSERT_GT(rows.size(), 400u);
    for (const auto& row : rows) {
        const Lobe lobe = makeLobe(material(row["material"], kind));
        const Vec3d axis = vec(row["axis"]), V = vec(row["V"]), L = vec(row["L"]);
        for (const double sign : {1.0, -1.0}) { // neither normals nor tangents have a sign
            const Reflection r = kind == MaterialKind::fibre
                ? reflectFibre(lobe, sign * axis, V, L)
                : reflectSurface(lobe, sign * axis, V, L);
            if (kind == MaterialKind::surface && axis.dot(V) == 0 && sign < 0)
                continue; // exactly edge on, the side is arbitrary
            const Vec3d I =
                r.diffuse * vec(row["material"]["c_b"]) + r.specular * vec(row["material"]["e"]);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(I[c], row["rgb"][c].get<double>(), 1e-6) << row.dump();
        }
    }
}

Vec3d randomUnit(Random& random)
{
    Vec3d v(random.normal(), random.normal(), random.normal());
    v.normalize();
    return v;
}

} // namespace

TEST(Shade, SurfaceAgreesWithTheReference) { compare("surface.json", MaterialKind::surface); }
TEST(Shade, FibreAgreesWithTheReference) { compare("fibre.json", MaterialKind::fibre); }

TEST(Shade, FresnelIsTheDielectricsNormalReflectance)
{
    EXPECT_NEAR(fresnel(1, 1.5), 0.04, 1e-12);
    EXPECT_EQ(fresnel(0.3, 1), 0);
    EXPECT_EQ(fresnel(0.1, 0.5), 1); // beyond the critical angle
    EXPECT_NEAR(fresnel(0, 1.5), 1, 1e-12);
}

// The reflection is finite and not negative for grazing, opposite, parallel and antiparallel
// directions and for extreme constants.
TEST(Shade, IsFiniteEverywhere)
{
    Random random(7);
    std::vector<Vec3d> directions{{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
    for (int i = 0; i < 12; ++i) directions.push_back(randomUnit(random));
    for (int i = 0; i < 5; ++i) { // nearly the same or opposite
        Vec3d v = directions[i] + 1e-7 * randomUnit(random);
        v.normalize();
        directions.push_back(v);
        directions.push_back(-v);
    }
    for (double gamma : {0.0, 1e-9, 0.2, 1.5})
        for (double n : {0.2, 1.0, 1.0 + 1e-12, 1.55, 100.0}) {
            Material m;
            m.gamma = gamma;
            m.n = n;
            for (auto kind : {MaterialKind::fibre, MaterialKind::surface}) {
                m.kind = kind;
                const Lobe lobe = makeLobe(m);
                for (const Vec3d& a : directions)
                    for (const Vec3d& V : directions)
                        for (const Vec3d& L : directions)
                            for (const Reflection& r :
                                 {reflectFibre(lobe, a, V, L), reflectSurface(lobe, a, V, L),
                                  reflectSided(lobe, a, V, L)}) {
                                ASSERT_TRUE(std::isfinite(r.diffuse) && std::isfinite(r.specular));
                                ASSERT_TRUE(r.diffuse >= 0 && r.specular >= 0);
                            }
            }
        }
}

// A normal with a side reflects as one without, if it is seen from its side; from behind it
// reflects nothing.
TEST(Shade, ASidedNormalIsDarkFromBehind)
{
    Material m;
    m.kind = MaterialKind::surface;
    const Lobe lobe = makeLobe(m);
    const Vec3d N(0, 0, 1), V = Vec3d(0.3, 0, 1).unit(), L = Vec3d(-0.4, 0.2, 1).unit();
    const Reflection front = reflectSided(lobe, N, V, L), plain = reflectSurface(lobe, N, V, L);
    EXPECT_GT(front.diffuse * front.specular, 0);
    EXPECT_EQ(front.diffuse, plain.diffuse);
    EXPECT_EQ(front.specular, plain.specular);
    for (const Reflection& r : {reflectSided(lobe, -N, V, L), reflectSided(lobe, N, -V, L),
                                reflectSided(lobe, N, -V, -L)})
        EXPECT_EQ(r.diffuse + r.specular, 0);
}

// MODEL section 5: the diffuse light of a bundle follows the mean square sine. Tangents on a cone
// of half angle a around t have l1 = cos^2 a and l2 = l3 = sin^2 a / 2, so a spread of tan(a) /
// sqrt(2).
TEST(Shade, TheDiffuseLightOfABundleIsThatOfItsMeanSquareSine)
{
    Material m;
    m.alpha = 0.7;
    m.beta = 0;
    const Vec3d V = Vec3d(0.3, 0.2, 0.9).unit();
    for (const double a : {0.0, 0.1, 0.5, 0.9})
        for (const double angle : {0.0, 0.01, 0.4, 1.0, kPi / 2}) {
            const Vec3d L(std::cos(angle), std::sin(angle), 0);
            double square = 0;
            const int count = 360;
            for (int k = 0; k < count; ++k) {
                const double turn = 2 * kPi * k / count;
                const Vec3d t(std::cos(a), std::sin(a) * std::cos(turn),
                              std::sin(a) * std::sin(turn));
                square += (1 - t.dot(L) * t.dot(L)) / count;
            }
            const Reflection r =
                reflectFibre(makeLobe(m, std::tan(a) / std::sqrt(2.0)), Vec3d(1, 0, 0), V, L);
            EXPECT_NEAR(r.diffuse, 0.7 * std::sqrt(square), 1e-12) << a << ' ' << angle;
        }
}

// MODEL section 8: the highlight of a bundle of fibres whose tilt has the variance s^2 is the mean
// of the fibres' highlights.
TEST(Surface, NormalsThatLieEvenlyShowWhatAMattSphereShows)
{
    // A sphere of unit radius, summed over the disc that the eye sees.
    Material m;
    m.kind = MaterialKind::surface;
    m.alpha = 1;
    m.beta = 0;
    const Lobe lobe = makeLobe(m, 1);
    const Vec3d V(0, 0, 1);
    for (const double angle : {0.0, 0.5, 1.0, kPi / 2, 2.0, 2.8, kPi}) {
        const Vec3d L(std::sin(angle), 0, std::cos(angle));
        double sum = 0, behind = 0;
        constexpr int kSteps = 400;
        for (int i = 0; i < kSteps; ++i)
            for (int j = 0; j < kSteps; ++j) {
                const double r = std::sqrt((i + 0.5) / kSteps), phi = 2 * kPi * (j + 0.5) / kSteps;
                const Vec3d n(r * std::cos(phi), r * std::sin(phi), std::sqrt(1 - r * r));
                sum += std::max(0.0, n.dot(L)) / (kSteps * kSteps);
                behind += std::max(0.0, -n.dot(L)) / (kSteps * kSteps);
            }
        for (const Vec3d& N : {Vec3d(0, 0, 1), Vec3d(1, 0, 0), Vec3d(0.6, 0, 0.8)}) {
            const Reflection r = reflectSurface(lobe, N, V, L);
            EXPECT_NEAR(r.diffuse, sum, 2e-4) << angle;
            EXPECT_NEAR(r.transmitted, behind, 2e-4) << angle;
        }
    }
}

// MODEL section 5b: what a fibre and a leaf send out in all directions, over what they take of a
// light of strength 1 (irradiance pi), is their albedo.
TEST(Shade, NormalisedParticlesSendOutTheirAlbedo)
{
    Material fibre, leaf;
    fibre.beta = leaf.beta = 0;
    fibre.alpha = leaf.alpha = 0.6;
    leaf.kind = MaterialKind::surface;
    leaf.transmission = Vec3d(0.3, 0.2, 0);
    const Lobe fibre_lobe = makeLobe(fibre, 0, true), leaf_lobe = makeLobe(leaf, 0, true);
    EXPECT_DOUBLE_EQ(makeLobe(fibre).alpha, 0.6); // as printed
    const Vec3d axis(0, 0, 1), body(0.5, 1, 0.8);
    for (const double angle : {0.2, 0.9, 1.4}) {
        const Vec3d L(std::sin(angle), 0, std::cos(angle));
        Vec3d from_fibre(0.0), from_leaf(0.0);
        constexpr int kSteps = 200;
        for (int i = 0; i < kSteps; ++i)
            for (int j = 0; j < kSteps; ++j) {
                const double z = 2 * (i + 0.5) / kSteps - 1, phi = 2 * kPi * (j + 0.5) / kSteps,
                             r = std::sqrt(1 - z * z), solid = 4 * kPi / (kSteps * kSteps);
                const Vec3d V(r * std::cos(phi), r * std::sin(phi), z);
                // Over the width, or the area, that is seen.
                from_fibre += solid * r * reflectFibre(fibre_lobe, axis, V, L).colour(fibre, body);
                from_leaf +=
                    solid * std::abs(z) * reflectSurface(leaf_lobe, axis, V, L).colour(leaf, body);
            }
        for (int c = 0; c < 3; ++c) {
            EXPECT_NEAR(from_fibre[c] / (kPi * std::sin(angle)), 0.6 * body[c], 1e-3);
            EXPECT_NEAR(from_leaf[c] / (kPi * std::cos(angle)),
                        (0.6 + leaf.transmission[c]) * body[c], 1e-3);
        }
    }
}

TEST(Shade, SpreadWidensTheHighlightAsTheMeanOverTheBundle)
{
    Material m;
    m.gamma = 0.15;
    const double s = 0.08;
    const Vec3d t(1, 0, 0), V(0, 0, 1);
    for (double tilt : {0.0, 0.1, 0.2}) {
        const Vec3d L(std::sin(tilt), 0, std::cos(tilt)); // in the plane of t and V: phi = tilt
        Random random(3);
        double mean = 0;
        const int count = 20000;
        for (int i = 0; i < count; ++i) {
            const double a = s * random.normal();
            mean += reflectFibre(makeLobe(m), Vec3d(std::cos(a), 0, std::sin(a)), V, L).specular
                / count;
        }
        const double wide = reflectFibre(makeLobe(m, s), t, V, L).specular,
                     narrow = reflectFibre(makeLobe(m), t, V, L).specular;
        EXPECT_NEAR(wide, mean, 0.02 * mean) << tilt;
        EXPECT_GT(std::abs(narrow - mean), 0.1 * mean) << tilt; // without the widening it is off
    }
    // A surface's angle is the normal's tilt itself, a fibre's twice that: the lobe widens by half
    // as much.
    for (const double tilt : {0.0, 0.1, 0.2}) {
        double mean = 0, weight = 0;
        for (double z = -6; z <= 6; z += 0.01) { // standard deviations
            const double p = std::exp(-0.5 * z * z);
            mean += p * std::exp(-makeLobe(m).falloff * std::pow(tilt + s * z, 2));
            weight += p;
        }
        m.kind = MaterialKind::surface;
        const Lobe wide = makeLobe(m, s);
        EXPECT_NEAR(wide.beta / m.beta * std::exp(-wide.falloff * tilt * tilt), mean / weight, 1e-6)
            << tilt;
    }
}
