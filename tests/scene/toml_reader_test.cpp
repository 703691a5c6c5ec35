// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/toml_reader.h"

#include <fstream>
#include <functional>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

class TomlReader : public testing::Test {
protected:
    TableReader open(const std::string& text)
    {
        m_file = fs::path(testing::TempDir())
            / (std::string("toml_") + testing::UnitTest::GetInstance()->current_test_info()->name()
               + ".toml");
        std::ofstream(m_file) << text;
        return TableReader::open(m_file);
    }
    void TearDown() override { fs::remove(m_file); }

    static std::string messageOf(const std::function<void()>& f)
    {
        try {
            f();
        } catch (const Error& e) {
            return e.what();
        }
        return "no error";
    }

    static void expectAll(const std::string& message, std::initializer_list<const char*> parts)
    {
        for (const char* part : parts)
            EXPECT_NE(message.find(part), std::string::npos)
                << "'" << part << "' is not in: " << message;
    }

    fs::path m_file;
};

TEST_F(TomlReader, readsEveryType)
{
    TableReader r = open(
        "number = 2.5\ncount = 3\nwhole = 7\non = true\nword = \"b\"\nvector = [1, 2.5, -3]\nhex = \"#ff8000\"\n"
        "span = [1, 2]\nsingle = 4\nlist = [1, 2]\nfile = \"maps/a.png\"\ndirection = [0, 0, 5]\n[t.x]\na = 1\n[[rows]]\n[[rows]]\n");
    EXPECT_EQ(r.number({"number", "", ""}, std::nullopt, kAny), 2.5);
    EXPECT_EQ(r.number({"whole", "", ""}, std::nullopt, kAny), 7.0);
    EXPECT_EQ(r.integer({"count", "", ""}, std::nullopt, {0, 10}), 3);
    EXPECT_TRUE(r.flag({"on", "", ""}, false));
    EXPECT_EQ(r.choice<int>({"word", "", ""}, std::nullopt, {{"a", 10}, {"b", 20}}), 20);
    EXPECT_EQ(r.vector({"vector", "", ""}, std::nullopt), Vec3d(1, 2.5, -3));
    const Vec3d hex = r.colour({"hex", "", ""}, std::nullopt);
    EXPECT_DOUBLE_EQ(hex[0], 1);
    EXPECT_NEAR(hex[1], 0.2158605, 1e-6); // the sRGB curve at 128/255
    EXPECT_EQ(hex[2], 0);
    EXPECT_EQ(r.span({"span", "", ""}, std::nullopt, kAny), std::pair(1.0, 2.0));
    EXPECT_EQ(r.span({"single", "", ""}, std::nullopt, kAny), std::pair(4.0, 4.0));
    EXPECT_EQ(r.numbers({"list", "", ""}, {}, kAny), (std::vector<double>{1, 2}));
    EXPECT_EQ(r.path({"file", "", ""}, std::nullopt), m_file.parent_path() / "maps/a.png");
    EXPECT_EQ(r.direction({"direction", "", ""}, std::nullopt), Vec3d(0, 0, 1));
    auto named = r.named({"t", "", ""});
    ASSERT_EQ(named.size(), 1u);
    EXPECT_EQ(named[0].first, "x");
    EXPECT_EQ(named[0].second.integer({"a", "", ""}, 0, kAny), 1);
    EXPECT_EQ(r.tables({"rows", "", ""}).size(), 2u);
    EXPECT_NO_THROW(r.finish());
}

TEST_F(TomlReader, anUnknownKeyIsShownWithItsLineAndTheNearestKey)
{
    TableReader r = open("gamma = 1\n\ngama_degrees = 2\n");
    r.number({"gamma", "", ""}, 1, kAny);
    r.number({"gamma_degrees", "", ""}, 1, kAny);
    expectAll(messageOf([&] { r.finish(); }),
              {".toml:3:", "unknown key 'gama_degrees'", "did you mean 'gamma_degrees'"});
}

TEST_F(TomlReader, wrongTypesAndRangesAreShownWithTheValue)
{
    TableReader r = open(
        "a = \"abc\"\nb = -1\nc = 1.5\nd = [1, 2]\ne = \"fibr\"\nf = [2, 1]\ng = \"#12345\"\nh = [0, 0, 0]\ni = 1\n");
    expectAll(messageOf([&] {
                  r.number({"a", "", ""}, 1, kAny);
              }),
              {".toml:1:", "a: expected a number", "\"abc\""});
    expectAll(messageOf([&] {
                  r.number({"b", "", ""}, 1, kNotNegative);
              }),
              {".toml:2:", ">= 0", "found -1"});
    expectAll(messageOf([&] {
                  r.integer({"c", "", ""}, 1, kAny);
              }),
              {".toml:3:", "whole number", "1.5"});
    expectAll(messageOf([&] { r.vector({"d", "", ""}, Vec3d(0)); }), {".toml:4:", "three numbers"});
    expectAll(messageOf([&] {
                  r.choice<int>({"e", "", ""}, 1, {{"fibre", 1}, {"surface", 2}});
              }),
              {".toml:5:", "did you mean \"fibre\""});
    expectAll(messageOf([&] {
                  r.span({"f", "", ""}, {{1, 2}}, kAny);
              }),
              {".toml:6:", "low <= high"});
    expectAll(messageOf([&] { r.colour({"g", "", ""}, Vec3d(0)); }), {".toml:7:", "colour"});
    expectAll(messageOf([&] {
                  r.direction({"h", "", ""}, Vec3d(0, 1, 0));
              }),
              {".toml:8:", "not zero"});
    expectAll(messageOf([&] { r.table({"i", "", ""}); }), {".toml:9:", "a table"});
}

TEST_F(TomlReader, nanAndInfinityAreRefused)
{
    TableReader r = open("a = nan\nb = inf\nc = [1, nan, 2]\n");
    EXPECT_THROW(r.number({"a", "", ""}, 1, kAny), Error);
    EXPECT_THROW(r.number({"b", "", ""}, 1, kAny), Error);
    EXPECT_THROW(r.vector({"c", "", ""}, Vec3d(0)), Error);
}

TEST_F(TomlReader, aMissingKeyNamesItsTable)
{
    TableReader r = open("[material.fur]\nalpha = 1\n");
    auto tables = r.named({"material", "", ""});
    expectAll(
        messageOf([&] {
            tables.at(0).second.number({"n", "m", "refractive index"}, std::nullopt, kPositive);
        }),
        {".toml:1:", "[material.fur]", "'n' is missing", "refractive index", "add n = ..."});
    TableReader misspelt = open("[layer]\ndensty = 1\n");
    TableReader layer = misspelt.table({"layer", "", ""});
    expectAll(messageOf([&] {
                  layer.number({"density", "", "boxes"}, std::nullopt, kPositive);
              }),
              {"is 'densty' meant to be 'density'?"});
}

TEST_F(TomlReader, badFilesAreNamed)
{
    expectAll(messageOf([&] { TableReader::open("none.toml"); }),
              {"none.toml", "no readable file"});
    expectAll(messageOf([&] { TableReader::open(testing::TempDir()); }), {"a directory"});
    expectAll(messageOf([&] { open(""); }), {"an empty file"});
    expectAll(messageOf([&] { open("a = 1\nb = = 2\n"); }), {".toml", "not valid TOML", "2"});
    expectAll(messageOf([&] { open(std::string("a = \"\0\xff\xfe", 9)); }), {"not valid TOML"});
}

TEST_F(TomlReader, describingListsEveryKeyWithoutAFile)
{
    std::vector<KeyDoc> docs;
    TableReader r = TableReader::describing(docs);
    r.number({"voxel", "m", "edge of a voxel"}, std::nullopt, kPositive);
    for (auto& [name, t] : r.named({"box", "", "a box"}))
        t.integer({"count", "", "how many"}, 3, {1, 9});
    EXPECT_NO_THROW(r.require(false, "voxel", "never"));
    ASSERT_EQ(docs.size(), 3u);
    EXPECT_EQ(docs[0].fallback, "required");
    EXPECT_EQ(docs[0].range, "> 0");
    EXPECT_EQ(docs[2].table, "box.NAME");
    EXPECT_EQ(docs[2].range, "1 to 9");
    EXPECT_NE(keysAsMarkdown(docs).find("| `count` | integer | `3` | 1 to 9 |  | how many |"),
              std::string::npos);
}

} // namespace
} // namespace volcomp
