// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/toml_reader.h"

#include <filesystem>
#include <fstream>
#include <functional>
#include <numeric>

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

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
        std::ofstream(m_file, std::ios::binary) << text;
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

// With the file that a message is about: the line, the value underlined, and nothing that is long
// or moves the terminal's cursor.
TEST_F(TomlReader, messagesShowTheLineAndUnderlineTheValue)
{
    TableReader r = open("\xef\xbb\xbf# b\xc3\xa4r\r\n\"\xc3\xa4\" = [ 1, \"zwei\" ]\r\n");
    const std::string message = messageOf([&] { r.numbers({"\xc3\xa4", "", ""}, {}, kAny); });
    EXPECT_EQ(message,
              m_file.string()
                  + ":2: \xc3\xa4: expected an array of numbers, found \"zwei\"\n   |\n"
                    " 2 | \"\xc3\xa4\" = [ 1, \"zwei\" ]\n"
                    "   |            ^~~~~~ expected an array of numbers");

    const std::string in_long = messageOf([&] {
        open("a = \"" + std::string(5000, 'x') + "\" # " + std::string(5000, 'y'))
            .number({"a", "", ""}, 1, kAny);
    });
    expectAll(in_long, {"found \"xxx", "xxx...\n", "   | "});
    EXPECT_LT(in_long.size(), m_file.string().size() + 400) << in_long;

    const std::string escape = messageOf([&] { open("\"a\\u001bc\" = 1\n").finish(); });
    expectAll(escape, {"unknown key 'a?c'"});
    EXPECT_EQ(escape.find('\x1b'), std::string::npos);
    EXPECT_LT(messageOf([&] { open(std::string(1000000, 'k') + " = 1\n").finish(); }).size(), 1000);
}

TEST_F(TomlReader, whatIsNestedTooDeepIsRefusedWithItsLine)
{
    const auto many = [](const std::string& text, int count) {
        std::string result;
        for (int i = 0; i < count; ++i) result += text;
        return result;
    };
    for (const int depth : {33, 6000, 1000000}) {
        expectAll(messageOf([&] { open("a = 1\nb = " + many("[", depth) + many("]", depth)); }),
                  {".toml:2:", "at most 32 open brackets"});
        expectAll(messageOf([&] { open("a = 1\nb = " + many("{a = ", depth)); }),
                  {".toml:2:", "at most 32 open brackets"});
        expectAll(messageOf([&] { open("\n\na" + many(" . a", depth) + " = 1"); }),
                  {".toml:3:", "at most 32 parts of a key"});
        expectAll(messageOf([&] { open("[a" + many(".'a.b'", depth) + "]"); }),
                  {".toml:1:", "at most 32 parts of a key"});
    }
    EXPECT_NO_THROW(open("b = " + many("[", 32) + many("]", 32)));
    EXPECT_NO_THROW(open("a" + many(".a", 31) + " = 1"));
    // Brackets and dots in texts and comments do not count.
    const std::string marks = many("[.{", 50);
    EXPECT_NO_THROW(open("# \" ' " + marks + "\na = \"\\\"" + marks + "\"\nb = '" + marks
                         + "\\'\nc = \"\"\"\n\\\"\"" + marks + "\n\"\"\"\nd = '''\n'" + marks
                         + "'''\n"));
    expectAll(messageOf([&] { open(many("[[light]]\n", 200001)); }),
              {".toml:200001:", "at most 200000 tables"});
}

TEST_F(TomlReader, headersWithoutANameAreRefused)
{
    for (const char* text : {"a = 1\n[\x01]\n", "a = 1\n[[ =]]\n", "a = 1\n  [.a]\n", "a = 1\n[",
                             "a = 1\n[]\n", "a = 1\n[[\n"})
        expectAll(messageOf([&] { open(text); }),
                  {".toml:2:", "not valid TOML: expected a table's name"});
    EXPECT_NO_THROW(open("a = [\n[1],\n[ ],\n[[2]]]\n[ 'b' ]\n[[ \"\" ]]\n"));
}

TEST_F(TomlReader, bytesThatAreNotUtf8AreNamedWithTheirLine)
{
    for (const char* text : {"a = 1\nmesh = 'b\xe4ume.obj'\n", "a = 1\nb = \"\xff\xfe\"\n",
                             "a = 1\n# \xc3(\n", "a = 1\nb = '''\xed\xa0\x80'''\n"})
        expectAll(messageOf([&] { open(text); }), {".toml:2:", "not valid TOML", "UTF-8"});
    expectAll(messageOf([&] { open("'\x9a'''\xda"); }), {".toml:1:", "UTF-8"});
    expectAll(messageOf([&] { open(std::string("\xff\xfe\x61\0=\0\x31\0", 8)); }),
              {".toml:1:", "UTF-8"}); // UTF-16
    for (const std::string& text :
         {std::string("a = 1\n\0\n", 8), std::string("a = 1\nb = \"\0\"\n", 14)})
        expectAll(messageOf([&] { open(text); }), {".toml:2:", "not valid TOML"});
}

TEST_F(TomlReader, aByteOrderMarkAndOtherEndsOfLinesAreRead)
{
    TableReader r = open("\xef\xbb\xbf\x61 = 1\r\n[t]\r\nb = 2\r\n");
    EXPECT_EQ(r.integer({"a", "", ""}, 0, {0, 9}), 1);
    EXPECT_EQ(r.table({"t", "", ""}).integer({"b", "", ""}, 0, {0, 9}), 2);
}

TEST_F(TomlReader, aLineOfManyNumbersIsRead)
{
    std::string text = "a = [0";
    for (int i = 1; i < 100000; ++i) text += ", " + std::to_string(i);
    const std::vector<double> a = open(text + "]\n").numbers({"a", "", ""}, {}, kAny);
    ASSERT_EQ(a.size(), 100000u);
    EXPECT_EQ(std::accumulate(a.begin(), a.end(), 0.0), 4999950000.0);
}

TEST_F(TomlReader, wholeNumbersOutOfRangeSayTheRange)
{
    TableReader r = open("a = 3000000000\nb = 9223372036854775807\nc = -1\nd = 1.0\n");
    expectAll(messageOf([&] {
                  r.integer({"a", "", ""}, 1, kNotNegative);
              }),
              {".toml:1:", "a whole number, 0 to 2147483647", "found 3000000000"});
    EXPECT_EQ(r.seed({"a", "", ""}, 1), 3000000000u);
    EXPECT_EQ(r.seed({"b", "", ""}, 1), 9223372036854775807u);
    EXPECT_EQ(r.seed({"none", "", ""}, 7), 7u);
    expectAll(messageOf([&] { r.seed({"c", "", ""}, 1); }), {".toml:3:", ">= 0", "found -1"});
    expectAll(messageOf([&] { r.seed({"d", "", ""}, 1); }), {".toml:4:", "whole number"});
    expectAll(messageOf([&] { open("a = 1\nb = 9223372036854775808\n"); }),
              {".toml:2:", "not valid TOML", "9223372036854775808"});
}

TEST_F(TomlReader, wholeNumbersAreNotCutFromFractions)
{
    TableReader r = open("a = [2.9, 3.9]\nb = [2, 3]\nc = [2, 3, 4]\nd = [2, 0]\n");
    const auto read = [&](const char* key) { return r.integers({key, "", ""}, {1, 1}, {1, 9}); };
    EXPECT_EQ(read("b"), (std::vector<int>{2, 3}));
    EXPECT_EQ(read("none"), (std::vector<int>{1, 1}));
    expectAll(messageOf([&] { read("a"); }), {".toml:1:", "2 whole numbers, 1 to 9", "found 2.9"});
    expectAll(messageOf([&] { read("c"); }), {".toml:3:", "2 whole numbers"});
    expectAll(messageOf([&] { read("d"); }), {".toml:4:", "found 0"});
}

TEST_F(TomlReader, pathsCanBePrinted)
{
    TableReader r = open("a = \"b\\u0000c\"\nb = [\"x.toml\", \"y\\n.toml\"]\nc = \"\"\n");
    expectAll(messageOf([&] { r.path({"a", "", ""}, ""); }), {".toml:1:", "printable"});
    expectAll(messageOf([&] { r.paths({"b", "", ""}, {}); }), {".toml:2:", "printable"});
    expectAll(messageOf([&] { r.path({"c", "", ""}, ""); }), {".toml:3:", "printable"});
}

TEST_F(TomlReader, namesAreFitForFilesAndChannels)
{
    for (const char* name : {"a", "key_2-b", "rote T\xc3\xbclpe 2", "\xe8\x8d\x89"})
        EXPECT_TRUE(isName(name)) << name;
    for (const char* name :
         {"", "a\nb", "a/b", "..", "a.R", "a*", " a", "a ", "a  b", "a\xc2\x85", "a\xe2\x80\xa8"})
        EXPECT_FALSE(isName(name)) << name;
    EXPECT_FALSE(isName(std::string("a\0b", 3)));
    EXPECT_TRUE(isName(std::string(100, 'a')));
    EXPECT_FALSE(isName(std::string(101, 'a')));
}

// The text of a table is what a box's file keeps of its recipe.
TEST_F(TomlReader, tablesThatSayTheSameGiveTheSameText)
{
    const std::string expected =
        R"(colour = [1, 0.5, 0.1]
flag = true
level.1.length = 0.25
level.1.name = "a \"b\"\n"
level.2.count = 16
level.2.t.u = 100
)";
    const auto text = [&](const std::string& file) {
        return open(file).table({"box", "", ""}).toml();
    };
    EXPECT_EQ(text(R"(
[box]
flag = true
colour = [1.0, 0.5, 1e-1]
[[box.level]] # the first
name = '''a "b"
'''
length = 0.250
[[box.level]]
count = 0x10
t.u = 1e2
)"),
              expected);
    EXPECT_EQ(text(R"(box = {level = [{length = 25.0e-2, name = "a \u0022b\u0022\n"},
    {t = {u = 100.0}, count = 1_6}], colour = [ 1,
    0.5, 0.1 ], flag = true})"),
              expected);
    EXPECT_EQ(open(expected).toml(), expected);
    EXPECT_NE(text("[box]\na = 0.1\n"), text("[box]\na = 0.10000000000000002\n"));
    EXPECT_NE(text("[box]\na = \"1\"\n"), text("[box]\na = 1\n"));
}

TEST_F(TomlReader, aPipeIsReadToItsEnd)
{
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const std::string text = "a = 3\nfile = \"maps/a.png\"\n";
    ASSERT_EQ(write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
    close(ends[1]);
    TableReader r = TableReader::open("/dev/fd/" + std::to_string(ends[0]));
    close(ends[0]);
    EXPECT_EQ(r.integer({"a", "", ""}, 0, {0, 9}), 3);
    EXPECT_EQ(r.path({"file", "", ""}, ""), fs::path("maps/a.png"));
    EXPECT_EQ(r.folder(), fs::path());
}

TEST_F(TomlReader, whatHasNoEndIsNotRead)
{
    const fs::path fifo = fs::path(testing::TempDir()) / "toml_fifo";
    fs::remove(fifo);
    ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0); // nobody writes to it
    expectAll(messageOf([&] { TableReader::open(fifo); }), {"toml_fifo", "a FIFO"});
    fs::remove(fifo);
    expectAll(messageOf([&] { TableReader::open("/dev/zero"); }), {"/dev/zero", "a device"});
    open("a = 1\n");
    fs::resize_file(m_file, 100 << 20);
    expectAll(messageOf([&] { TableReader::open(m_file); }), {".toml", "at most 33554432 bytes"});
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
