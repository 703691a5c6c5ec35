// SPDX-License-Identifier: Apache-2.0
// Principal directions of tensors that are built from known eigenvectors.
#include <gtest/gtest.h>

#include "volcomp/base/principal_direction.h"
#include "volcomp/base/random.h"

using namespace volcomp;

namespace {

Vec3d unitVector(Random& random)
{
    const double z = random.symmetric(), phi = 2 * kPi * random.uniform(), r = std::sqrt(1 - z * z);
    return {r * std::cos(phi), r * std::sin(phi), z};
}

/// Returns |A d - l d| / trace(A), where l = d A d is the Rayleigh quotient: 0 for an eigenvector.
double residual(const SymmetricTensor& a, const Vec3d& d)
{
    const Vec3d ad(a.xx * d[0] + a.xy * d[1] + a.xz * d[2], a.xy * d[0] + a.yy * d[1] + a.yz * d[2],
                   a.xz * d[0] + a.yz * d[1] + a.zz * d[2]);
    return (ad - d * ad.dot(d)).length() / a.trace();
}

} // namespace

TEST(PrincipalDirection, OneDirectionComesBack)
{
    Random random(1);
    for (int i = 0; i < 1000; ++i) {
        const Vec3d t = unitVector(random);
        SymmetricTensor a;
        a.add(std::pow(10, 20 * random.symmetric()), t);
        const Principal p = principalDirection(a);
        EXPECT_NEAR(std::abs(p.direction.dot(t)), 1, 1e-12);
        EXPECT_LT(p.spread, 1e-6);
    }
}

TEST(PrincipalDirection, OppositeSignsDoNotCancel)
{
    SymmetricTensor a;
    a.add(1, Vec3d(0, 1, 0));
    a.add(1, Vec3d(0, -1, 0));
    EXPECT_NEAR(principalDirection(a).direction[1], 1, 1e-15);
    EXPECT_NEAR(principalDirection(a).spread, 0, 1e-7);
}

TEST(PrincipalDirection, MatchesJacobiForRandomSums)
{
    Random random(2);
    for (int i = 0; i < 20000; ++i) {
        SymmetricTensor a;
        const int count = 2 + static_cast<int>(5 * random.uniform());
        for (int k = 0; k < count; ++k) a.add(std::exp(6 * random.symmetric()), unitVector(random));
        double values[3];
        Vec3d vectors[3];
        jacobiEigen(a, values, vectors);
        const Principal p = principalDirection(a);
        EXPECT_NEAR(p.direction.length(), 1, 1e-12);
        EXPECT_LT(residual(a, p.direction), 1e-9);
        EXPECT_NEAR(p.spread, std::sqrt((values[1] + values[2]) / (2 * values[0])), 1e-6);
        if (values[1] < 0.999 * values[0]) {
            EXPECT_NEAR(std::abs(p.direction.dot(vectors[0])), 1, 1e-6);
        }
    }
}

TEST(PrincipalDirection, JacobiAgreesWithKnownEigenvalues)
{
    Random random(3);
    for (int i = 0; i < 1000; ++i) { // built from an orthonormal frame, also with equal values
        const Vec3d e0 = unitVector(random);
        Vec3d e1 = e0.cross(unitVector(random));
        e1.normalize();
        const Vec3d e2 = e0.cross(e1);
        const double l0 = 1, l1 = i % 3 == 0 ? 1 : random.uniform(),
                     l2 = i % 2 == 0 ? l1 : l1 * random.uniform();
        SymmetricTensor a;
        a.add(l0, e0);
        a.add(l1, e1);
        a.add(l2, e2);
        double values[3];
        Vec3d vectors[3];
        jacobiEigen(a, values, vectors);
        EXPECT_NEAR(values[0], l0, 1e-12);
        EXPECT_NEAR(values[1], l1, 1e-12);
        EXPECT_NEAR(values[2], l2, 1e-12);
        EXPECT_LT(residual(a, principalDirection(a).direction), 1e-9);
        EXPECT_NEAR(principalDirection(a).spread, std::sqrt((l1 + l2) / 2), 1e-6);
    }
}

TEST(PrincipalDirection, EqualEigenvaluesTakeThePreferredDirection)
{
    SymmetricTensor a;
    a.add(2, Vec3d(1, 0, 0));
    a.add(2, Vec3d(0, 0, 1));
    const Vec3d preferred(0.6, 0.5, 0.8);
    const Principal p = principalDirection(a, &preferred);
    EXPECT_NEAR(p.direction[0], 0.6, 1e-9);
    EXPECT_NEAR(p.direction[1], 0, 1e-9);
    EXPECT_NEAR(p.direction[2], 0.8, 1e-9);
    EXPECT_NEAR(p.spread, std::sqrt(0.5), 1e-12);
    a.add(2, Vec3d(0, 1, 0)); // the same in every direction: nothing is left of it in the volume
    EXPECT_NEAR(principalDirection(a, &preferred).stored().length(), 0, 1e-7);
}

TEST(PrincipalDirection, NothingGivesNoDirection)
{
    for (double w : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
        SymmetricTensor a;
        a.add(w, Vec3d(0, 1, 0));
        const Principal p = principalDirection(a);
        EXPECT_EQ(p.stored(), Vec3d(0.0)) << w;
        EXPECT_EQ(p.spread, 1) << w;
    }
}
