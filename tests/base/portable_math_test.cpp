// SPDX-License-Identifier: Apache-2.0
// The functions against the standard library's in long double, and their bytes against those of
// every other machine.
#include "volcomp/base/portable_math.h"

#include <cmath>
#include <cstring>
#include <limits>

#include <gtest/gtest.h>

#include "volcomp/base/random.h"

using namespace volcomp;

namespace {

constexpr double kUlp = 0x1.0p-52;

/// |found - exact| in units of the last place of the exact value; values below `floor` count as
/// `floor`.
double error(double found, long double exact, double floor = 1e-300)
{
    return static_cast<double>(std::abs(found - exact)
                               / (kUlp * std::max<long double>(std::abs(exact), floor)));
}

std::uint64_t bitsOf(double x)
{
    std::uint64_t bits = 0;
    std::memcpy(&bits, &x, sizeof x);
    return bits;
}

} // namespace

TEST(PortableMath, IsWithinFourUnitsInTheLastPlace)
{
    Random random(1);
    for (int i = 0; i < 200000; ++i) {
        const double x = random.symmetric() * std::pow(10, 6 * random.uniform()),
                     y = random.symmetric(), positive = std::pow(10, 300 * random.symmetric());
        ASSERT_LT(error(portable::sin(x), std::sin(static_cast<long double>(x))), 4) << x;
        ASSERT_LT(error(portable::cos(x), std::cos(static_cast<long double>(x))), 4) << x;
        ASSERT_LT(error(portable::atan2(y, x), std::atan2(static_cast<long double>(y), x)), 4)
            << y << ' ' << x;
        ASSERT_LT(error(portable::exp(700 * y), std::exp(700.0L * y)), 700)
            << y; // 700 y is rounded
        ASSERT_LT(error(portable::exp(0.3 * y), std::exp(static_cast<long double>(0.3 * y))), 4);
        ASSERT_LT(error(portable::log(positive), std::log(static_cast<long double>(positive))), 4)
            << positive;
        ASSERT_LT(
            error(portable::log(1 + 0.5 * y), std::log(static_cast<long double>(1 + 0.5 * y))), 4)
            << y;
        ASSERT_LT(error(portable::log1p(0.99 * y), std::log1p(static_cast<long double>(0.99 * y))),
                  4)
            << y;
        const double u = random.uniform();
        ASSERT_LT(error(portable::pow(u, 0.6), std::pow(static_cast<long double>(u), 0.6)), 40)
            << u;
        ASSERT_LT(error(portable::acos(y), std::acos(static_cast<long double>(y)), 1e-8), 4) << y;
    }
}

TEST(PortableMath, KnowsItsEdges)
{
    EXPECT_EQ(portable::sin(0), 0);
    EXPECT_EQ(portable::cos(0), 1);
    EXPECT_EQ(portable::atan2(0, 0), 0);
    EXPECT_EQ(portable::atan2(0, 2), 0);
    EXPECT_DOUBLE_EQ(portable::atan2(0, -2), kPi);
    EXPECT_DOUBLE_EQ(portable::atan2(-3, 0), -kPi / 2);
    EXPECT_EQ(portable::acos(1), 0);
    EXPECT_DOUBLE_EQ(portable::acos(-1), kPi);
    EXPECT_EQ(portable::exp(0), 1);
    EXPECT_EQ(portable::exp(-1e9), 0);
    EXPECT_TRUE(std::isinf(portable::exp(1e9)));
    EXPECT_EQ(portable::log(1), 0);
    EXPECT_TRUE(std::isinf(portable::log(0)));
    EXPECT_TRUE(std::isnan(portable::log(-1)));
    EXPECT_EQ(portable::log1p(1e-300), 1e-300);
    EXPECT_EQ(portable::pow(0, 0.6), 0);
    EXPECT_EQ(portable::pow(1, 0.6), 1);
}

// The number was found on one machine and holds for all: another build, another compiler or another
// processor that gives another number grows other boxes.
TEST(PortableMath, GivesTheSameBitsOnEveryMachine)
{
    Random random(2);
    std::uint64_t key = 0;
    for (int i = 0; i < 100000; ++i) {
        const double u = random.uniform(), x = 100 * random.symmetric();
        for (const double value : {portable::sin(x), portable::cos(x), portable::atan2(x, u),
                                   portable::acos(u), portable::exp(x), portable::log(u),
                                   portable::log1p(-u), portable::pow(u, 0.6), random.normal()})
            key = hashKey(key, bitsOf(value));
    }
    EXPECT_EQ(key, 1812799522984187901ULL);
}
