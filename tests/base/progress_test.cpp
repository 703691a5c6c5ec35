// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/progress.h"

#include <atomic>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

using namespace volcomp;

// Reports never fall and never overlap, and one thread alone reports every step.
TEST(SharedProgress, CountsToOne)
{
    std::vector<double> fractions;
    std::atomic<int> inside{0};
    const Progress progress = [&](double fraction) {
        EXPECT_EQ(++inside, 1);
        EXPECT_TRUE(fractions.empty() || fraction >= fractions.back());
        fractions.push_back(fraction);
        --inside;
    };
    SharedProgress many(progress, 10000);
    tbb::parallel_for(0, 5000, [&](int) { many.add(2); });
    EXPECT_FALSE(fractions.empty());
    EXPECT_LE(fractions.back(), 1);

    fractions.clear();
    SharedProgress alone(progress, 4);
    alone.add();
    alone.add(2);
    alone.add();
    EXPECT_EQ(fractions, (std::vector<double>{0.25, 0.75, 1}));
    const Progress none;
    SharedProgress(none, 1).add();
}
