// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/placements_io.h"

#include <algorithm>
#include <array>
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

/// A name as USD allows it: letters, digits and _, not a digit first. Two names may become one, so
/// a number follows.
std::string usdName(const std::string& name, std::size_t number)
{
    std::string result = "box_";
    for (const char c : name)
        result +=
            (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ? c : '_';
    return fmt::format("{}_{}", result, number);
}

/// The rotation of a placement as a quaternion (w, x, y, z) (Shepperd, Quaternion from rotation
/// matrix, 1978).
std::array<double, 4> quaternionOf(const Placement& p)
{
    const Vec3d x(p.x_axis), y(p.y_axis), z(p.z_axis);
    const double parts[4] = {1 + x[0] + y[1] + z[2], 1 + x[0] - y[1] - z[2], 1 - x[0] + y[1] - z[2],
                             1 - x[0] - y[1] + z[2]};
    const auto most = std::max_element(parts, parts + 4) - parts;
    const double s = 2 * std::sqrt(std::max(parts[most], 1e-12));
    switch (most) {
    case 0:
        return {s / 4, (y[2] - z[1]) / s, (z[0] - x[2]) / s, (x[1] - y[0]) / s};
    case 1:
        return {(y[2] - z[1]) / s, s / 4, (y[0] + x[1]) / s, (z[0] + x[2]) / s};
    case 2:
        return {(z[0] - x[2]) / s, (y[0] + x[1]) / s, s / 4, (z[1] + y[2]) / s};
    default:
        return {(x[1] - y[0]) / s, (z[0] + x[2]) / s, (z[1] + y[2]) / s, s / 4};
    }
}

/// USD's text form: a PointInstancer whose prototypes are the boxes' volumes.
void writeUsda(std::ostream& out, const PlacedScene& scene)
{
    const std::vector<std::string> boxes = boxNames(scene.kinds);
    out << "#usda 1.0\n(\n    defaultPrim = \"volcomp\"\n    metersPerUnit = 1\n    upAxis = "
           "\"Y\"\n)\n\ndef PointInstancer \"volcomp\"\n{\n";
    const auto list = [&](const char* name, const auto& text, std::size_t count) {
        out << "    " << name << " = [";
        for (std::size_t i = 0; i < count; ++i) out << (i == 0 ? "" : ", ") << text(i);
        out << "]\n";
    };
    const auto& all = scene.boxes.placements;
    const auto tuple = [](const auto& v) { return fmt::format("({}, {}, {})", v[0], v[1], v[2]); };
    list(
        "rel prototypes",
        [&](std::size_t i) { return "</volcomp/boxes/" + usdName(boxes[i], i) + ">"; },
        boxes.size());
    list(
        "int[] protoIndices", [&](std::size_t i) { return std::to_string(all[i].box); },
        all.size());
    list(
        "point3f[] positions", [&](std::size_t i) { return tuple(Vec3f(all[i].position)); },
        all.size());
    list(
        "quath[] orientations",
        [&](std::size_t i) {
            const auto q = quaternionOf(all[i]);
            return fmt::format("({:.6g}, {:.6g}, {:.6g}, {:.6g})", q[0], q[1], q[2], q[3]);
        },
        all.size());
    list(
        "float3[] scales", [&](std::size_t i) { return tuple(Vec3f(all[i].scale)); }, all.size());
    list(
        "color3f[] primvars:displayColor", [&](std::size_t i) { return tuple(all[i].tint); },
        all.size());
    out << "    uniform token primvars:displayColor:interpolation = \"vertex\"\n";
    out << "\n    def Scope \"boxes\"\n    {\n";
    for (std::size_t b = 0; b < boxes.size(); ++b) {
        const std::string name = usdName(boxes[b], b);
        std::string file = oneLine(boxes[b]) + ".vdb"; // where volcomp-bake puts it
        std::replace(file.begin(), file.end(), '@', '_');
        out << "        def Volume \"" << name << "\"\n        {\n"
            << "            rel field:density = </volcomp/boxes/" << name << "/density>\n"
            << "            def OpenVDBAsset \"density\"\n            {\n"
            << "                token fieldName = \"density\"\n"
            << "                asset filePath = @./" << file << "@\n            }\n        }\n";
    }
    out << "    }\n}\n";
}

} // namespace

bool requirePlacementsName(const std::filesystem::path& file)
{
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    const bool json = ending == ".json";
    if (!json && ending != ".ply" && ending != ".usda")
        throw fileError(file, "", "a name that ends in .json, .ply or .usda",
                        "'" + file.extension().string() + "'");
    return json;
}

static bool isUsda(const std::filesystem::path& file)
{
    const std::string ending = file.extension().string();
    return ending.size() == 5 && (ending[1] == 'u' || ending[1] == 'U');
}

void writePlacements(const std::filesystem::path& file, const PlacedScene& scene,
                     const std::string& recipe_hash)
{
    const bool json = requirePlacementsName(file);
    writeStreamAtomically(file, [&](std::ostream& stream) {
        if (json) writeJson(stream, scene);
        else if (isUsda(file)) writeUsda(stream, scene);
        else writePly(stream, scene, recipe_hash);
    });
}

} // namespace volcomp
