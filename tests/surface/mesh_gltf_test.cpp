// SPDX-License-Identifier: Apache-2.0
// glTF files of our own, whole and damaged.
#include <cmath>
#include <cstring>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "volcomp/base/error.h"
#include "volcomp/surface/mesh.h"

namespace volcomp {
namespace {

using nlohmann::json;

template <class T>
void append(std::string& bytes, const std::vector<T>& values)
{
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

/// A rectangle as two triangles in a node that is moved, turned and scaled.
json rectangle(std::string& binary)
{
    append<float>(binary, {0, 0, 0, 1, 0, 0, 1, 2, 0, 0, 2, 0});             // positions, 48
    append<std::uint16_t>(binary, {0, 65535, 65535, 65535, 65535, 0, 0, 0}); // uv, 16
    append<std::uint16_t>(binary, {0, 1, 2, 0, 2, 3});                       // indices, 12
    return json::parse(R"({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1], "translation": [10, 0, 0]},
                  {"mesh": 0, "name": "Leaf", "scale": [2, 3, 4],
                   "rotation": [0, 0, 0.70710678118654752, 0.70710678118654752]}],
        "meshes": [{"name": "Card", "primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1},
                                                    "indices": 2, "material": 0}]}],
        "materials": [{"name": "green", "alphaMode": "MASK", "alphaCutoff": 0.25,
                       "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.5, 0.2, 1],
                                                "baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}], "images": [{"uri": "a%20leaf.png"}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                      {"bufferView": 1, "componentType": 5123, "normalized": true, "count": 4,
                       "type": "VEC2"},
                      {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 48},
                        {"buffer": 0, "byteOffset": 48, "byteLength": 16},
                        {"buffer": 0, "byteOffset": 64, "byteLength": 12}],
        "buffers": [{"byteLength": 76}]})");
}

std::string glb(const json& root, std::string binary)
{
    std::string text = root.dump();
    while (text.size() % 4) text += ' ';
    while (binary.size() % 4) binary += '\0';
    std::string bytes = "glTF";
    const auto number = [&](std::uint32_t n) { append<std::uint32_t>(bytes, {n}); };
    number(2);
    number(static_cast<std::uint32_t>(28 + text.size() + binary.size()));
    number(static_cast<std::uint32_t>(text.size()));
    number(0x4e4f534a);
    bytes += text;
    number(static_cast<std::uint32_t>(binary.size()));
    number(0x004e4942);
    return bytes + binary;
}

class MeshGltfTest : public testing::Test {
protected:
    std::filesystem::path write(const std::string& name, const std::string& content) const
    {
        const std::filesystem::path file = m_folder.path() / name;
        std::ofstream(file, std::ios::binary) << content;
        return file;
    }
    std::string failure(const std::string& name, const std::string& content) const
    {
        const std::filesystem::path file = write(name, content);
        return messageOf([&] { readMesh(file); });
    }

private:
    TemporaryFolder m_folder;
};

void expectRectangle(const Mesh& mesh)
{
    ASSERT_EQ(mesh.triangles.size(), 2u);
    // (1, 2, 0), scaled to (2, 6, 0), turned about Z to (-6, 2, 0), and moved.
    const Vec3d corner = mesh.points[mesh.triangles[0][2]];
    EXPECT_NEAR((corner - Vec3d(4, 2, 0)).length(), 0, 1e-6);
    EXPECT_NEAR(mesh.uv[0][0][1], 0, 1e-6); // v = 1 of the file is the picture's lower edge
    EXPECT_NEAR(mesh.uv[0][2][1], 1, 1e-6);
    ASSERT_EQ(mesh.parts.size(), 1u);
    EXPECT_EQ(mesh.parts[0].name, "Leaf/Card");
    ASSERT_EQ(mesh.materials.size(), 1u);
    EXPECT_EQ(mesh.materials[0].name, "green");
    EXPECT_TRUE(mesh.materials[0].cut);
    EXPECT_EQ(mesh.materials[0].cutoff, 0.25);
    EXPECT_EQ(mesh.materials[0].texture.filename(), "a leaf.png");
    EXPECT_EQ(mesh.materials[0].colour, Vec3f(0.1f, 0.5f, 0.2f));
}

TEST_F(MeshGltfTest, ReadsGlbAndJsonWithItsNumbersBesideOrInside)
{
    std::string binary;
    json root = rectangle(binary);
    expectRectangle(readMesh(write("mesh.glb", glb(root, binary))));
    write("numbers.bin", binary);
    root["buffers"][0]["uri"] = "numbers.bin";
    expectRectangle(readMesh(write("mesh.gltf", root.dump())));
    // The same numbers in base64 (RFC 4648), by a coder of the test's own.
    static const char kLetters[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text = "data:application/octet-stream;base64,";
    for (std::size_t i = 0; i < binary.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, binary.size() - i);
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (k < count ? static_cast<unsigned char>(binary[i + k]) : 0);
        for (std::size_t k = 0; k < 4; ++k)
            text += k <= count ? kLetters[bits >> (18 - 6 * k) & 63] : '=';
    }
    root["buffers"][0]["uri"] = text;
    expectRectangle(readMesh(write("inside.gltf", root.dump())));
}

TEST_F(MeshGltfTest, StripsAndFansAreTriangles)
{
    std::string binary;
    json root = rectangle(binary);
    json& primitive = root["meshes"][0]["primitives"][0];
    primitive.erase("indices");
    primitive["mode"] = 6;
    EXPECT_EQ(readMesh(write("fan.glb", glb(root, binary))).triangles.size(), 2u);
    primitive["mode"] = 5;
    const Mesh strip = readMesh(write("strip.glb", glb(root, binary)));
    ASSERT_EQ(strip.triangles.size(), 2u);
    EXPECT_EQ(strip.triangles[1], (std::array<std::int32_t, 3>{2, 1, 3}));
}

TEST_F(MeshGltfTest, ATruncatedFileIsAnErrorWhereverItEnds)
{
    std::string binary;
    const std::string whole = glb(rectangle(binary), binary);
    for (std::size_t length = 0; length < whole.size(); length += length < 40 ? 1 : 13)
        EXPECT_NE(failure("cut.glb", whole.substr(0, length)), "") << length;
}

TEST_F(MeshGltfTest, WhatDoesNotFitIsAnError)
{
    const auto changed = [&](const char* pointer, const json& value) {
        std::string binary;
        json root = rectangle(binary);
        root[json::json_pointer(pointer)] = value;
        const std::string message = failure("bad.glb", glb(root, binary));
        EXPECT_NE(message.find("bad.glb"), message.npos) << pointer << ": " << message;
    };
    changed("/accessors/0/count", 5);
    changed("/accessors/0/count", 18446744073709551615ULL);
    changed("/accessors/0/byteOffset", 18446744073709551600ULL);
    changed("/accessors/0/componentType", 1);
    changed("/accessors/0/type", "MAT4");
    changed("/accessors/0/sparse", json::object());
    changed("/accessors/2/componentType", 5126);
    changed("/bufferViews/0/byteLength", 1000);
    changed("/bufferViews/0/byteOffset", 18446744073709551615ULL);
    changed("/bufferViews/0/byteStride", 1);
    changed("/buffers/0/byteLength", 80);
    changed("/buffers/0/uri", "none.bin");
    changed("/nodes/1/children", json::array({0}));
    changed("/nodes/1/children", json::array({-1}));
    changed("/nodes/1/mesh", 7);
    changed("/nodes/1/scale", json::array({1, "a", 1}));
    changed("/nodes/1/scale", json::array({1e308, 1e308, 1e308}));
    changed("/meshes/0/primitives/0/material", 3);
    changed("/meshes/0/primitives/0/attributes/POSITION", 9);
    changed("/extensionsRequired", json::array({"KHR_draco_mesh_compression"}));
    changed("/asset/version", "1.0");
    changed("/scene", 4);
    EXPECT_NE(failure("bad.gltf", "{"), "");
    EXPECT_NE(failure("bad.gltf", "[]"), "");
}

} // namespace
} // namespace volcomp
