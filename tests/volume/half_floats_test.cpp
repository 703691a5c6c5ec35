// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/half_floats.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/each_target.h"

namespace volcomp {
namespace {

using openvdb::math::half;

std::vector<half> converted(const std::vector<float>& from)
{
    std::vector<half> to(from.size());
    toHalf(from.data(), to.data(), from.size());
    return to;
}

half fromBits(int bits)
{
    half h;
    h.setBits(static_cast<std::uint16_t>(bits));
    return h;
}

TEST(HalfFloats, EveryHalfFloatIsKept)
{
    std::vector<float> all;
    for (int bits = 0; bits < 1 << 16; ++bits)
        if (!fromBits(bits).isNan()) all.push_back(float(fromBits(bits)));
    onEachTarget([&] {
        const std::vector<half> to = converted(all);
        for (std::size_t i = 0; i < all.size(); ++i) {
            ASSERT_EQ(float(to[i]), all[i]);
            ASSERT_EQ(std::signbit(float(to[i])), std::signbit(all[i]));
        }
    });
}

TEST(HalfFloats, ValuesBetweenTwoGoToTheNearestAndTiesToTheEven)
{
    constexpr int kInfinite = 0x7c00;
    std::vector<float> from;
    std::vector<int> expected;
    for (const float sign : {1.0f, -1.0f})
        for (int bits = 0; bits < kInfinite; ++bits) {
            const int above = bits + 1, negative = sign < 0 ? 0x8000 : 0;
            // IEEE 754 rounds as if the numbers went on beyond the greatest.
            const float low = float(fromBits(bits)),
                        high = above == kInfinite ? 65536.0f : float(fromBits(above)),
                        middle = 0.5f * (low + high);
            for (const auto& [value, to] : {std::make_pair(std::nextafter(middle, 0.0f), bits),
                                            std::make_pair(middle, bits % 2 == 0 ? bits : above),
                                            std::make_pair(std::nextafter(middle, 1e9f), above)}) {
                from.push_back(sign * value);
                expected.push_back(negative | to);
            }
        }
    from.insert(from.end(), {1e30f, -std::numeric_limits<float>::infinity(), 1e-30f});
    expected.insert(expected.end(), {kInfinite, 0x8000 | kInfinite, 0});
    onEachTarget([&] {
        const std::vector<half> to = converted(from);
        for (std::size_t i = 0; i < from.size(); ++i)
            ASSERT_EQ(to[i].bits(), expected[i]) << from[i];
        EXPECT_TRUE(converted({NAN})[0].isNan());
    });
}

TEST(HalfFloats, VectorsOfAnyCountAreInterleavedAndNothingElseIsWritten)
{
    std::vector<float> x, y, z;
    for (int i = 0; i < 100; ++i) {
        x.push_back(float(i));
        y.push_back(float(i) + 0.25f);
        z.push_back(-float(i));
    }
    onEachTarget([&] {
        for (std::size_t count = 0; count < 100; ++count) {
            std::vector<Half3> to(101, Half3{half(7), half(8), half(9)});
            toHalf3(x.data(), y.data(), z.data(), to.data(), count);
            std::vector<half> one(101, half(7));
            toHalf(x.data(), one.data(), count);
            for (std::size_t i = 0; i < to.size(); ++i) {
                const Half3 expected = i < count ? Half3{half(x[i]), half(y[i]), half(z[i])}
                                                 : Half3{half(7), half(8), half(9)};
                ASSERT_EQ(to[i], expected) << count << " " << i;
                ASSERT_EQ(float(one[i]), i < count ? x[i] : 7.0f);
            }
        }
    });
}

} // namespace
} // namespace volcomp
