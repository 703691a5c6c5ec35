// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/text.h"

#include <gtest/gtest.h>

#include "volcomp/base/hash.h"

using namespace volcomp;

TEST(Text, WordsAreJoined)
{
    EXPECT_EQ(joined({}), "");
    EXPECT_EQ(joined({"a"}), "a");
    EXPECT_EQ(joined({"a", "", "b"}, "|"), "a||b");
    struct Thing {
        std::string name;
    };
    EXPECT_EQ(joined(namesOf(std::vector<Thing>{{"x"}, {"y"}})), "x, y");
}

TEST(Text, EditDistancesAreLevenshteins)
{
    EXPECT_EQ(editDistance("kitten", "sitting"), 3U);
    EXPECT_EQ(editDistance("", "abc"), 3U);
    EXPECT_EQ(editDistance("abc", ""), 3U);
    EXPECT_EQ(editDistance("radius", "radius"), 0U);
    EXPECT_EQ(editDistance("radius", "raduis"), 2U) << "a swap is two changes";
}

TEST(Text, TheNearestWordIsTheOneMeant)
{
    const std::vector<std::string> known{"length", "width", "wide"};
    EXPECT_EQ(nearestSpelling("lenght", known), "length");
    EXPECT_EQ(nearestSpelling("widt", known), "width") << "the first of two at distance 1 and 2";
    EXPECT_EQ(nearestSpelling("with", {"wide", "wits"}), "wits");
    EXPECT_EQ(nearestSpelling("wid", {"wide", "wit"}), "wide") << "the first of equals";
    EXPECT_EQ(nearestSpelling("colour", known), "");
    EXPECT_EQ(nearestSpelling("x", {"y"}), "y") << "two changes are always allowed";
    EXPECT_EQ(nearestSpelling("length", {}), "");
}

// The published test vectors of FNV-1a, 64 bits.
TEST(Hash, IsFnv1a)
{
    EXPECT_EQ(fnv1a(""), 0xcbf29ce484222325ULL);
    EXPECT_EQ(fnv1a("a"), 0xaf63dc4c8601ec8cULL);
    EXPECT_EQ(fnv1a("foobar"), 0x85944171f73967e8ULL);
    EXPECT_EQ(fnv1a("bar", fnv1a("foo")), fnv1a("foobar"));
    EXPECT_EQ(fnv1a("\xff"), (0xcbf29ce484222325ULL ^ 0xff) * 0x100000001b3ULL);
}
