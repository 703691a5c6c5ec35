// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/recipe.h"

#include <fstream>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace volcomp {
namespace {

Recipe recipe(const std::vector<std::pair<std::string, std::string>>& entries)
{
    Recipe r;
    for (const auto& [name, value] : entries) r.add(name, value);
    return r;
}

TEST(Recipe, ATextIsReadAsItWasWritten)
{
    const Recipe r =
        recipe({{"a", "1"}, {"b.c", "x = y"}, {"empty", ""}, {"two\nlines", "3\r\n4"}});
    const Recipe read = Recipe::fromText(r.text());
    EXPECT_EQ(read.entries(), r.entries());
    EXPECT_EQ(read.hash(), r.hash());
    ASSERT_EQ(read.entries().size(), 4u);
    EXPECT_EQ(read.entries()[1], std::make_pair(std::string("b.c"), std::string("x = y")));
    EXPECT_EQ(read.entries()[2].second, "");
    EXPECT_EQ(read.entries()[3].first, "two lines");
    EXPECT_TRUE(Recipe::fromText("").empty());
    EXPECT_TRUE(Recipe::fromText("no recipe\nat all").empty());
}

TEST(Recipe, LinesGetThePrefix)
{
    Recipe r;
    r.addLines("box.fur.", "length = [1, 2]\nseed = 3");
    ASSERT_EQ(r.entries().size(), 2u);
    EXPECT_EQ(r.entries()[0].first, "box.fur.length");
    EXPECT_EQ(r.entries()[1].second, "3");
}

TEST(Recipe, EveryEntryCountsForTheHash)
{
    const Recipe r = recipe({{"a", "1"}, {"b", "2"}});
    EXPECT_EQ(r.hash(), recipe({{"a", "1"}, {"b", "2"}}).hash());
    EXPECT_NE(r.hash(), recipe({{"a", "1"}, {"b", "3"}}).hash());
    EXPECT_NE(r.hash(), recipe({{"a", "1"}, {"c", "2"}}).hash());
    EXPECT_NE(r.hash(), recipe({{"b", "2"}, {"a", "1"}}).hash());
    EXPECT_EQ(r.hash().size(), 16u);
}

TEST(Recipe, DifferencesAreNamed)
{
    const Recipe made = recipe({{"a", "1"}, {"list", "x"}, {"list", "y"}, {"gone", "7"}});
    EXPECT_TRUE(differences(made, made).empty());
    const auto found =
        differences(made, recipe({{"a", "2"}, {"new", "5"}, {"list", "x"}, {"list", "z"}}));
    ASSERT_EQ(found.size(), 4u);
    EXPECT_EQ(found[0].name + found[0].made + found[0].wanted, "a12");
    EXPECT_EQ(found[1].name + found[1].made + found[1].wanted, "new5");
    EXPECT_EQ(found[2].name + found[2].made + found[2].wanted, "listyz");
    EXPECT_EQ(found[3].name + found[3].made + found[3].wanted, "gone7");
    // A longer list of the same name.
    const auto shorter = differences(made, recipe({{"a", "1"}, {"list", "x"}, {"gone", "7"}}));
    ASSERT_EQ(shorter.size(), 1u);
    EXPECT_EQ(shorter[0].made, "y");
}

TEST(Recipe, WhatIsUnknownAgreesWithEverything)
{
    const Recipe made = recipe({{"a", Recipe::kUnknown}, {"b", "1"}, {"c", Recipe::kUnknown}});
    EXPECT_TRUE(differences(made, recipe({{"a", "1"}, {"b", Recipe::kUnknown}})).empty());
}

TEST(Recipe, AFileCountsByItsContent)
{
    const TemporaryFolder folder;
    const auto hashOf = [&](const std::string& name) {
        Recipe r;
        r.addFile("content", folder.path() / name);
        return r.entries()[0].second;
    };
    std::ofstream(folder.path() / "a") << "text";
    std::ofstream(folder.path() / "b") << "text";
    std::ofstream(folder.path() / "c") << "Text";
    std::ofstream(folder.path() / "long") << std::string(200000, 'x');
    std::ofstream(folder.path() / "longer") << std::string(200001, 'x');
    std::ofstream(folder.path() / "empty");
    EXPECT_EQ(hashOf("a"), hashOf("b"));
    EXPECT_NE(hashOf("a"), hashOf("c"));
    EXPECT_NE(hashOf("long"), hashOf("longer"));
    EXPECT_EQ(hashOf("empty"), "cbf29ce484222325"); // FNV-1a of no bytes
    EXPECT_EQ(hashOf("missing"), Recipe::kUnknown);
    EXPECT_EQ(hashOf("."), Recipe::kUnknown);
}

} // namespace
} // namespace volcomp
