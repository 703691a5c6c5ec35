// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/placements_io.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <ostream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "volcomp/base/atomic_file.h"
#include "volcomp/base/error.h"

namespace volcomp {
namespace {

template <class V>
std::string listOf(const V& v)
{
    return fmt::format("[{}, {}, {}]", v[0], v[1], v[2]);
}

/// A name in one line: line breaks and other control characters become \\x0A and so on.
std::string oneLine(const std::string& name)
{
    std::string line;
    for (const char c : name) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 32 || byte == 127) line += fmt::format("\\x{:02X}", byte);
        else line += c;
    }
    return line;
}

/// A name as a JSON string. Bytes that are no UTF-8 become the replacement character.
std::string jsonString(const std::string& name)
{
    return nlohmann::json(name).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void writeJson(std::ostream& out, const PlacedScene& scene)
{
    std::vector<std::string> boxes, layers; // as JSON strings
    for (const std::string& name : boxNames(scene.kinds)) boxes.push_back(jsonString(name));
    for (const PlacedLayer& l : scene.layers) layers.push_back(jsonString(l.layer.name));
    out << "[";
    for (std::size_t i = 0; i < scene.boxes.size(); ++i) {
        const Placement& p = scene.boxes.placements[i];
        std::string uv;
        if (!scene.boxes.uvs.empty())
            uv = fmt::format(R"(, "uv": [{}, {}])", scene.boxes.uvs[i][0], scene.boxes.uvs[i][1]);
        out << (i == 0 ? "\n" : ",\n")
            << fmt::format(
                   R"({{"box": {}, "layer": {}, "position": {}, "scale": {}, "x_axis": {}, "y_axis": {}, "z_axis": {}, "tint": {}{}}})",
                   boxes.at(p.box), layers.at(p.layer), listOf(p.position), p.scale,
                   listOf(p.x_axis), listOf(p.y_axis), listOf(p.z_axis), listOf(p.tint), uv);
    }
    out << "\n]\n";
}

void writePly(std::ostream& out, const PlacedScene& scene, const std::string& recipe_hash)
{
    const std::vector<std::string> boxes = boxNames(scene.kinds);
    out << "ply\nformat binary_little_endian 1.0\n";
    if (!recipe_hash.empty()) out << "comment recipe " << recipe_hash << '\n';
    for (std::size_t i = 0; i < boxes.size(); ++i)
        out << "comment box " << i << ' ' << oneLine(boxes[i]) << '\n';
    for (std::size_t i = 0; i < scene.layers.size(); ++i)
        out << "comment layer " << i << ' ' << oneLine(scene.layers[i].layer.name) << '\n';
    out << "element vertex " << scene.boxes.size()
        << "\nproperty double x\nproperty double y\nproperty double z\nproperty float nx\nproperty float ny\nproperty float nz\n"
           "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float scale\nproperty int box\nproperty int layer\nend_header\n";
    for (const Placement& p : scene.boxes.placements) {
        char record[24 + 12 + 3 + 4 + 8]; // without the padding that a struct would have
        char* at = record;
        const auto put = [&](const auto& value) {
            std::memcpy(at, &value, sizeof value);
            at += sizeof value;
        };
        for (int i = 0; i < 3; ++i) put(p.position[i]);
        for (int i = 0; i < 3; ++i) put(p.y_axis[i]);
        for (int i = 0; i < 3; ++i)
            put(static_cast<unsigned char>(std::lround(std::clamp(p.tint[i], 0.0f, 1.0f) * 255)));
        put(p.scale);
        put(std::int32_t(p.box));
        put(std::int32_t(p.layer));
        out.write(record, sizeof record);
    }
}

} // namespace

bool requirePlacementsName(const std::filesystem::path& file)
{
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    const bool json = ending == ".json";
    if (!json && ending != ".ply")
        throw fileError(file, "", "a name that ends in .json or .ply",
                        "'" + file.extension().string() + "'");
    return json;
}

void writePlacements(const std::filesystem::path& file, const PlacedScene& scene,
                     const std::string& recipe_hash)
{
    const bool json = requirePlacementsName(file);
    writeStreamAtomically(file, [&](std::ostream& stream) {
        if (json) writeJson(stream, scene);
        else writePly(stream, scene, recipe_hash);
    });
}

} // namespace volcomp
