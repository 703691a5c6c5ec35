// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/bounds_tree.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "volcomp/base/parallel.h"
#include "volcomp/base/random.h"
#include "volcomp/base/vec.h"

namespace volcomp {
namespace {

using openvdb::BBoxd;

std::vector<BBoxd> randomBounds(int count, double reach, double far, std::uint64_t seed)
{
    Random r(seed);
    std::vector<BBoxd> bounds;
    bounds.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
        const Vec3d centre =
            Vec3d(r.symmetric(), r.symmetric(), r.symmetric()) * reach + Vec3d(far, -far, 0);
        const double size = std::pow(10, r.uniform(-3, 0));
        const Vec3d half(size * r.uniform(), size * r.uniform(), i % 7 == 0 ? 0.0 : size);
        if (i % 11 == 0) bounds.emplace_back();
        else bounds.emplace_back(centre - half, centre + half);
    }
    return bounds;
}

bool meet(const BBoxd& a, const BBoxd& b)
{
    for (int i = 0; i < 3; ++i)
        if (!(a.min()[i] <= b.max()[i] && a.max()[i] >= b.min()[i])) return false;
    return true;
}

std::vector<std::uint32_t> found(const BoundsTree& tree, const BBoxd& box)
{
    std::vector<std::uint32_t> numbers;
    tree.query(box, [&](std::uint32_t n) { numbers.push_back(n); });
    return numbers;
}

BoundsTree treeOf(const std::vector<BBoxd>& bounds)
{
    return {bounds.size(), [&](std::uint32_t i) { return bounds[i]; }};
}

TEST(BoundsTree, FindsEveryThingThatMeetsABoxOnce)
{
    for (const int count : {1, 2, 15, 16, 17, 33, 1000, 20000})
        for (const double far : {0.0, 1e6}) {
            const std::vector<BBoxd> all = randomBounds(count, 3, far, 1);
            const BoundsTree tree = treeOf(all);
            Random r(2);
            std::size_t visited = 0, met = 0;
            for (int q = 0; q < 60; ++q) {
                const Vec3d centre =
                    Vec3d(r.symmetric(), r.symmetric(), r.symmetric()) * 3.5 + Vec3d(far, -far, 0);
                const Vec3d half(std::pow(10, r.uniform(-3, 0.5)));
                const BBoxd box(centre - half, centre + half);
                std::vector<std::uint32_t> numbers = found(tree, box);
                visited += numbers.size();
                std::sort(numbers.begin(), numbers.end());
                EXPECT_EQ(std::unique(numbers.begin(), numbers.end()), numbers.end());
                for (std::uint32_t i = 0; i < all.size(); ++i) {
                    const bool listed = std::binary_search(numbers.begin(), numbers.end(), i),
                               is_empty = i % 11 == 0;
                    if (is_empty) EXPECT_FALSE(listed);
                    else if (meet(all[i], box)) {
                        EXPECT_TRUE(listed) << i;
                        ++met;
                    }
                }
            }
            // It looks at no more than what is near: the rest is left out.
            if (count == 20000 && far == 0) {
                EXPECT_LT(visited, 2 * met + 60 * 16 * 20);
            }
        }
}

TEST(BoundsTree, HoldsTwelveBytesAThingAtMostAndTheirBounds)
{
    const std::vector<BBoxd> all = randomBounds(30000, 3, 0, 3);
    const BoundsTree tree = treeOf(all);
    EXPECT_LE(tree.memoryBytes(), 12u * all.size());
    BBoxd united;
    for (const BBoxd& b : all) united.expand(b);
    for (int i = 0; i < 3; ++i) {
        EXPECT_LE(tree.bounds().min()[i], united.min()[i]);
        EXPECT_GE(tree.bounds().max()[i], united.max()[i]);
        EXPECT_NEAR(tree.bounds().min()[i], united.min()[i], 1e-5);
        EXPECT_NEAR(tree.bounds().max()[i], united.max()[i], 1e-5);
    }
    const BoundsTree none;
    EXPECT_TRUE(found(none, united).empty());
    EXPECT_GT(none.bounds().min()[0], none.bounds().max()[0]);
    EXPECT_TRUE(found(treeOf({BBoxd()}), BBoxd(Vec3d(-1e30), Vec3d(1e30))).empty());
}

TEST(BoundsTree, IsTheSameForAnyNumberOfThreads)
{
    const std::vector<BBoxd> all = randomBounds(50000, 3, 0, 4);
    const BBoxd everywhere(Vec3d(-10.0), Vec3d(10.0));
    const std::vector<std::uint32_t> expected = found(treeOf(all), everywhere);
    for (const int threads : {1, 3, 8}) {
        const ThreadLimit limit(threads);
        EXPECT_EQ(found(treeOf(all), everywhere), expected);
    }
    // Things in one place, whose keys are the same, too.
    const std::vector<BBoxd> same(1000, BBoxd(Vec3d(1.0), Vec3d(2.0)));
    EXPECT_EQ(found(treeOf(same), everywhere), found(treeOf(same), everywhere));
}

} // namespace
} // namespace volcomp
