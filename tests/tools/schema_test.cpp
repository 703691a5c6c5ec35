// SPDX-License-Identifier: Apache-2.0
// The JSON Schema has what the parser has. tests/schema.sh holds the scenes to it.
#include "tools/volcomp/schema.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "volcomp/scene/scene.h"

namespace volcomp {
namespace {

using nlohmann::json;

json schema() { return json::parse(keysAsSchema(sceneKeys())); }

TEST(Schema, hasEveryKeyOfTheParser)
{
    const json s = schema();
    std::size_t keys = 0;
    for (const KeyDoc& d : sceneKeys()) {
        if (d.key.empty()) continue;
        const json* at = &s;
        std::string rest = d.table;
        while (!rest.empty()) {
            const std::string part = rest.substr(0, rest.find('.'));
            rest = rest.size() > part.size() ? rest.substr(part.size() + 1) : "";
            at = part == "NAME" ? &at->at("additionalProperties") : &at->at("properties").at(part);
            if (at->at("type") == "array") at = &at->at("items");
        }
        ASSERT_TRUE(at->at("properties").contains(d.key)) << d.table << "." << d.key;
        EXPECT_EQ(at->at("additionalProperties"), false) << d.table;
        const bool level = d.table == "box.NAME.level";
        EXPECT_EQ(at->contains("required")
                      && at->at("required").dump().find('"' + d.key + '"') != std::string::npos,
                  d.fallback == "required" && !level)
            << d.table << "." << d.key;
        ++keys;
    }
    EXPECT_GT(keys, 150u);
}

TEST(Schema, hasTypesAndRanges)
{
    const json s = schema(), &p = s.at("properties");
    const json& render = p.at("render").at("properties");
    EXPECT_EQ(render.at("samples").at("type"), "integer");
    EXPECT_EQ(render.at("samples").at("minimum"), 1);
    EXPECT_EQ(render.at("samples").at("maximum"), 65536);
    EXPECT_EQ(render.at("shadows").at("enum").size(), 3u);
    EXPECT_EQ(render.at("lod").at("default"), false);
    EXPECT_EQ(p.at("camera").at("properties").at("width").at("exclusiveMinimum"), 0);
    EXPECT_EQ(p.at("light").at("type"), "array");
    const json& strength = p.at("light").at("items").at("properties").at("strength");
    EXPECT_EQ(strength.at("anyOf").size(), 3u);
    EXPECT_EQ(strength.at("anyOf")[0].at("maxItems"), 3);
    const json& level =
        p.at("box").at("additionalProperties").at("properties").at("level").at("items");
    const json& preset = p.at("preset").at("additionalProperties");
    EXPECT_TRUE(level.at("properties").contains("use"));
    EXPECT_FALSE(preset.at("properties").contains("use"));
    EXPECT_EQ(preset.at("properties").at("length"), level.at("properties").at("length"));
}

TEST(Schema, readsEveryKindOfRange)
{
    const json s = json::parse(keysAsSchema({{"", "", "table", "", "", "", ""},
                                             {"", "a", "number", "1", "> 0, <= 2.5", "", "x"},
                                             {"", "b", "number", "required", "-3 to 4", "m", "y"},
                                             {"", "c", "something new", "", "", "", "z"}}));
    const json& p = s.at("properties");
    EXPECT_EQ(p.at("a").at("exclusiveMinimum"), 0);
    EXPECT_EQ(p.at("a").at("maximum"), 2.5);
    EXPECT_EQ(p.at("b").at("minimum"), -3);
    EXPECT_EQ(p.at("b").at("description"), "y (m)");
    EXPECT_EQ(s.at("required"), json({"b"}));
    EXPECT_FALSE(p.at("c").contains("type"));
}

} // namespace
} // namespace volcomp
