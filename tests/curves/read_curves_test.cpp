// SPDX-License-Identifier: Apache-2.0
// Strands as other programs write them: what is legal is read right, and the rest is refused.
#include <cstring>

#include <gtest/gtest.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "volcomp/base/random.h"
#include "volcomp/base/srgb.h"
#include "volcomp/curves/curve_readers.h"

namespace volcomp {
namespace {

/// The bytes of values, in this machine's order, which is the formats'.
template <class... T>
std::string bytes(T... values)
{
    std::string text;
    const auto put = [&](auto value) {
        text.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    (put(values), ...);
    return text;
}

std::string u32(std::initializer_list<std::uint32_t> values)
{
    std::string text;
    for (const std::uint32_t value : values) text += bytes(value);
    return text;
}

std::string f32(std::initializer_list<float> values)
{
    std::string text;
    for (const float value : values) text += bytes(value);
    return text;
}

std::string hairHeader(std::uint32_t strands, std::uint32_t points, std::uint32_t flags,
                       std::uint32_t segments, float thickness)
{
    std::string text =
        "HAIR" + u32({strands, points, flags, segments}) + f32({thickness, 0, 0.25f, 0.5f, 0.75f});
    text.resize(128);
    return text;
}

/// Two strands, of two and of three points.
std::string hair()
{
    return hairHeader(2, 5, 1 | 2 | 4 | 16, 0, 9) + bytes(std::uint16_t(1), std::uint16_t(2))
        + f32({0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 1, 2, 0}) + f32({4, 3, 2, 1, 0})
        + f32({1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 0, 0, 1, 1});
}

Vec3d placeOf(const CurveSet& set, std::size_t point)
{
    return Vec3d(set.points[point]) + set.offset;
}

class Curves : public testing::Test {
protected:
    CurveSet read(const std::string& name, const std::string& text)
    {
        return readCurves(m_folder.write(name, text));
    }
    /// The message of a file that is refused, which names it.
    std::string refusal(const std::string& name, const std::string& text)
    {
        const auto file = m_folder.write(name, text);
        const std::string message = messageOf([&] { readCurves(file); });
        EXPECT_NE(message.find(file.string()), std::string::npos) << message;
        return message;
    }
    TemporaryFolder m_folder;
};

TEST_F(Curves, hairHasStrandsWidthsAndColours)
{
    const CurveSet set = read("a.hair", hair());
    EXPECT_EQ(set.ends, (std::vector<std::size_t>{2, 5}));
    EXPECT_EQ(set.segmentCount(), 3u);
    EXPECT_EQ(placeOf(set, 1), Vec3d(0, 1, 0));
    EXPECT_EQ(placeOf(set, 4), Vec3d(1, 2, 0));
    EXPECT_EQ(set.widths.given, Given::per_point);
    EXPECT_EQ(set.widths.at(1, 3), 1);
    EXPECT_EQ(set.colours.at(1, 4), Vec3f(0, 1, 1));
    EXPECT_TRUE(set.groups.empty());
}

TEST_F(Curves, hairWithoutArraysHasTheDefaultsOfItsHeader)
{
    const CurveSet set = read("a.hair",
                              hairHeader(2, 6, 2, 2, 0.5f)
                                  + f32({0, 0, 0, 0, 1, 0, 0, 2, 0, 1, 0, 0, 1, 1, 0, 1, 2, 0}));
    EXPECT_EQ(set.ends, (std::vector<std::size_t>{3, 6}));
    EXPECT_EQ(set.widths.given, Given::once);
    EXPECT_EQ(set.widths.at(1, 5), 0.5f);
    EXPECT_EQ(set.colours.at(0, 0), Vec3f(0.25f, 0.5f, 0.75f));
}

TEST_F(Curves, hairThatDoesNotHoldWhatItSaysIsRefusedBeforeMemoryIsTaken)
{
    EXPECT_NE(refusal("a.hair", "HAIR").find("header of 128 bytes"), std::string::npos);
    EXPECT_NE(refusal("a.hair", hairHeader(4294967295U, 4294967295U, 3, 0, 1)).find("segments"),
              std::string::npos);
    EXPECT_NE(refusal("a.hair", hairHeader(1, 4294967295U, 2, 4294967294U, 1)).find("points"),
              std::string::npos);
    EXPECT_NE(refusal("a.hair", hairHeader(4294967295U, 4294967295U, 2, 4294967295U, 1))
                  .find("as the segments say"),
              std::string::npos);
    EXPECT_NE(refusal("a.hair", hairHeader(1, 2, 1, 1, 1)).find("an array of points"),
              std::string::npos);
    const std::string whole = hair();
    for (std::size_t size = 0; size < whole.size(); ++size)
        refusal("a.hair", whole.substr(0, size));
    std::string nan = whole;
    const float bad = std::numeric_limits<float>::quiet_NaN();
    std::memcpy(&nan[128 + 4], &bad, 4);
    EXPECT_NE(refusal("a.hair", nan).find("finite places"), std::string::npos);
}

TEST_F(Curves, strandsOfOnePointAreLeftOutWithAWarning)
{
    const CurveSet set = read("a.hair",
                              hairHeader(3, 6, 1 | 2 | 4, 0, 9)
                                  + bytes(std::uint16_t(1), std::uint16_t(0), std::uint16_t(2))
                                  + f32({0, 0, 0, 0, 1, 0, 7, 7, 7, 1, 0, 0, 1, 1, 0, 1, 2, 0})
                                  + f32({4, 3, 9, 2, 1, 0}));
    EXPECT_EQ(set.ends, (std::vector<std::size_t>{2, 5}));
    EXPECT_EQ(set.widths.at(1, 2), 2);
    EXPECT_EQ(placeOf(set, 4), Vec3d(1, 2, 0));
    ASSERT_EQ(set.warnings.size(), 1u);
    EXPECT_NE(set.warnings[0].find("1 of 3 strands"), std::string::npos) << set.warnings[0];
}

TEST_F(Curves, theSidecarSaysWhatHairHasNoPlaceFor)
{
    m_folder.write("a.hair.json",
                   R"({"unit": 0.01, "up": "z", "groups": [3, 5], "guides": [0, 1],
                       "root_uv": [[0.25, 0.5], [0.75, 1]]})");
    const CurveSet set = read("a.hair", hair());
    EXPECT_EQ(set.unit, 0.01);
    EXPECT_TRUE(set.says_up);
    EXPECT_EQ(set.up, UpAxis::z);
    EXPECT_EQ(set.groups, (std::vector<std::int32_t>{3, 5}));
    EXPECT_EQ(set.guides, (std::vector<char>{0, 1}));
    EXPECT_EQ(set.root_uvs[1], Vec2f(0.75f, 1.0f));
    for (const char* const text :
         {"[", "[]", R"({"unit": 0})", R"({"up": "w"})", R"({"groups": [1]})",
          R"({"groups": [1, 0.5]})", R"({"guides": [1, "x"]})", R"({"root_uv": [[0, 1], [0]]})",
          R"({"root_uv": 3})"}) {
        m_folder.write("a.hair.json", text);
        EXPECT_NE(refusal("a.hair", hair()).find("a.hair.json"), std::string::npos) << text;
    }
}

std::string tressFx(std::uint32_t strands, std::uint32_t length)
{
    std::string text = f32({4}) + u32({strands, length, 160, 160 + 16 * 4, 0, 0, 0});
    text.resize(160);
    return text + f32({0, 0, 0, 0, 0, 1, 0, 1, 1, 0, 0, 0, 1, 3, 0, 1}) // w is no width
        + f32({0.25f, 0.5f, 0.75f, 1});
}

TEST_F(Curves, tressFxHasEqualStrands)
{
    const std::string whole = tressFx(2, 2);
    const CurveSet set = read("a.tfx", whole);
    EXPECT_EQ(set.ends, (std::vector<std::size_t>{2, 4}));
    EXPECT_EQ(placeOf(set, 3), Vec3d(1, 3, 0));
    EXPECT_EQ(set.widths.given, Given::never);
    EXPECT_EQ(set.root_uvs[1], Vec2f(0.75f, 1.0f));
    for (std::size_t size = 0; size < whole.size(); ++size) refusal("a.tfx", whole.substr(0, size));
    refusal("a.tfx", tressFx(4294967295U, 4294967295U));
    EXPECT_NE(refusal("a.tfx", tressFx(4, 1)).find("2 points"), std::string::npos);
    EXPECT_NE(refusal("a.tfx", tressFx(0, 2)).find("strands"), std::string::npos);
}

TEST_F(Curves, objLinesAreJoinedAndHaveGroupsColoursAndUv)
{
    const CurveSet set = read("a.obj",
                              "v 0 0 0 1 0 0\nv 0 1 0 0 1 0\nv 0 2 0 0 0 1\nvt 0.5 0.25\nvt 1 1\n"
                              "g long\nl 2/2 3/2\nl 1/1 2/2\n"
                              "v 5 0 0\nv 5 1 0\nv 5 2 0\nv 5 3 0\ng short\nl -4 -3 \\\n -2 -1\n");
    ASSERT_EQ(set.size(), 2u);
    EXPECT_EQ(set.groups, (std::vector<std::int32_t>{1, 0})); // lines of many points come first
    EXPECT_EQ(placeOf(set, set.first(1)), Vec3d(0, 0, 0));
    EXPECT_EQ(placeOf(set, set.first(1) + 2), Vec3d(0, 2, 0));
    EXPECT_EQ(set.root_uvs[1], Vec2f(0.5f, 0.25f));
    EXPECT_EQ(set.colours.at(1, set.first(1) + 1), Vec3f(0, 1, 0));
    EXPECT_EQ(set.colours.at(0, 0), Vec3f(1.0f));
    EXPECT_NE(refusal("a.obj", "v 0 0 0\nl 1 2\n").find(":"), std::string::npos);
    EXPECT_NE(refusal("a.obj", "v 0 0 0\nl 1\n").find("line 2"), std::string::npos);
    EXPECT_NE(refusal("a.obj", "v 0 0 0\nf 1 1 1\n").find("strands"), std::string::npos);
}

constexpr const char* kPlyVertices =
    "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "property float radius\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n";
constexpr const char* kPlyBody =
    "0 0 0 0.5 255 0 0\n0 1 0 0.25 0 255 0\n0 2 0 0 0 0 128\n0 3 0 0 0 0 0\n";

TEST_F(Curves, plyEdgesAreJoined)
{
    const std::string head = std::string("ply\nformat ascii 1.0\n") + kPlyVertices;
    const CurveSet set = read("a.ply",
                              head
                                  + "element edge 3\nproperty int vertex1\nproperty int vertex2\n"
                                    "end_header\n"
                                  + kPlyBody + "2 3\n0 1\n1 2\n");
    EXPECT_EQ(set.ends, (std::vector<std::size_t>{4}));
    for (int i = 0; i < 4; ++i) EXPECT_EQ(placeOf(set, std::size_t(i)), Vec3d(0, i, 0));
    EXPECT_EQ(set.widths.at(0, 0), 1); // a diameter
    EXPECT_EQ(set.colours.at(0, 1), Vec3f(0, 1, 0));
    EXPECT_NEAR(set.colours.at(0, 2)[2], linearFromSrgb(128 / 255.0), 1e-6); // bytes are sRGB
    EXPECT_NE(refusal("a.ply",
                      head
                          + "element edge 900000000\nproperty int vertex1\nproperty int vertex2\n"
                            "end_header\n"
                          + kPlyBody)
                  .find("too short"),
              std::string::npos);
}

TEST_F(Curves, plyListsAreStrandsInBinaryToo)
{
    const std::string vertices = "element vertex 3\nproperty double x\nproperty double y\n"
                                 "property double z\n"
                                 "element strand 1\nproperty list uchar int vertex_indices\n"
                                 "end_header\n";
    const double far = 1e9; // its floats are 64 apart
    const auto body = [&](bool big) {
        std::string text;
        for (const double y : {0.0, 0.125, 0.25}) text += bytes(far) + bytes(y) + bytes(0.0);
        text += bytes(std::uint8_t(3)) + u32({2, 1, 0});
        if (!big) return text;
        std::string turned;
        const std::size_t sizes[] = {8, 8, 8, 8, 8, 8, 8, 8, 8, 1, 4, 4, 4};
        std::size_t at = 0;
        for (const std::size_t size : sizes) {
            const std::string value = text.substr(at, size);
            turned.append(value.rbegin(), value.rend());
            at += size;
        }
        return turned;
    };
    for (const bool big : {false, true}) {
        const CurveSet set = read("a.ply",
                                  std::string("ply\nformat binary_") + (big ? "big" : "little")
                                      + "_endian 1.0\n" + vertices + body(big));
        EXPECT_EQ(set.ends, (std::vector<std::size_t>{3}));
        EXPECT_EQ(placeOf(set, 0), Vec3d(far, 0.25, 0));
        EXPECT_EQ(set.points[0] - set.points[1], Vec3f(0, 0.125f, 0)); // exact, far as it is
    }
}

TEST_F(Curves, chainsGoAsMostOfTheirEdgesPointAndStopWhereThreeMeet)
{
    using Strands = std::vector<std::vector<std::size_t>>;
    EXPECT_EQ(chainEdges({{3, 2}, {1, 2}, {1, 0}}, 4), (Strands{{3, 2, 1, 0}}));
    EXPECT_EQ(chainEdges({{0, 1}, {1, 2}, {1, 3}}, 4), (Strands{{0, 1}, {1, 2}, {1, 3}}));
    EXPECT_EQ(chainEdges({{1, 2}, {2, 0}, {0, 1}}, 3), (Strands{{1, 2, 0, 1}}));
    EXPECT_EQ(chainEdges({{0, 0}, {0, 1}}, 2).size(), 2u);
    // Every edge is in exactly one strand.
    Random random(7);
    for (int round = 0; round < 50; ++round) {
        std::vector<std::pair<std::size_t, std::size_t>> edges;
        for (int i = 0; i < 40; ++i)
            edges.emplace_back(std::size_t(random.uniform() * 30),
                               std::size_t(random.uniform() * 30));
        std::size_t count = 0;
        for (const auto& strand : chainEdges(edges, 30)) count += strand.size() - 1;
        EXPECT_EQ(count, edges.size());
    }
}

TEST_F(Curves, otherFilesAreRefused)
{
    EXPECT_NE(refusal("a.abc", "Ogawa").find("volcomp-import"), std::string::npos);
    EXPECT_NE(messageOf([&] { readCurves(m_folder / "none.hair"); }).find("no file"),
              std::string::npos);
}

} // namespace
} // namespace volcomp
