// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/node_table.h"

#include <map>

#include <gtest/gtest.h>

#include "volcomp/base/random.h"

namespace volcomp {
namespace {

using openvdb::Coord;

Coord randomPlace(Random& random, int reach)
{
    const auto at = [&] { return (int(random.uniform() * 2 * reach) - reach) & ~7; };
    const int x = at(), y = at(), z = at();
    return {x, y, z};
}

// Against a map, with places in clusters and out to the borders of what is allowed, and a table
// that was given too little room.
TEST(NodeTable, FindsWhatWasSetAndNothingElse)
{
    for (const std::size_t room : {0, 5000}) {
        NodeTable table(room);
        std::map<Coord, int> expected;
        Random random(1);
        for (int i = 0; i < 3000; ++i) {
            const Coord place = randomPlace(random, i % 2 ? 300 : (1 << 27) - 8);
            expected[place] = i;
            table.setLeaf(place, i);
        }
        for (const auto& [place, leaf] : expected)
            for (const int inside : {0, 7})
                ASSERT_EQ(table.leafAt(place[0] + inside, place[1] + inside, place[2] + inside),
                          leaf)
                    << place;
        for (int i = 0; i < 3000; ++i) {
            const Coord place = randomPlace(random, i % 2 ? 300 : (1 << 27) - 8);
            if (!expected.count(place)) {
                ASSERT_EQ(table.leafAt(place[0], place[1], place[2]), NodeTable::kEmpty);
            }
        }
        std::map<Coord, int> found;
        table.forEachPlace([&](const Coord& place, int leaf) {
            EXPECT_TRUE(found.emplace(place, leaf).second) << place;
        });
        EXPECT_EQ(found, expected);
    }
}

TEST(NodeTable, NodesMayShareATable)
{
    NodeTable table(2);
    const int shared = table.addTable(5);
    table.insert({0, 0, 0}, shared);
    table.insert({-128, 0, 128}, shared);
    EXPECT_EQ(table.leafAt(127, 0, 64), 5);
    EXPECT_EQ(table.leafAt(-1, 127, 255), 5);
    EXPECT_EQ(table.leafAt(-1, 0, 0), NodeTable::kEmpty);
    table.leaves(shared)[numberInNode(8, 16, 24)] = 6;
    EXPECT_EQ(table.leafAt(8, 16, 24), 6);
    EXPECT_EQ(table.leafAt(8 - 128, 16, 24 + 128), 6);
}

} // namespace
} // namespace volcomp
