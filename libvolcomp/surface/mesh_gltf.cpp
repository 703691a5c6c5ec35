// SPDX-License-Identifier: Apache-2.0
// glTF 2.0 (Khronos Group, glTF 2.0 Specification), as JSON and as GLB: the triangles of the
// default scene with their nodes' transforms, texture coordinates, normals, and of materials the
// base colour and what it cuts out. Neither skins nor morph targets, cameras and animations.
#include "volcomp/surface/mesh_soup.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <openvdb/math/Mat4.h>

#include "volcomp/base/error.h"
#include "volcomp/surface/gltf_buffers.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Matrix = openvdb::math::Mat4<double>; // rows times matrix, as OpenVDB's: p' = p M

constexpr std::size_t kMostCorners = 60'000'000; ///< of all nodes together: a mesh may stand often
constexpr int kDeepest = 200;                    ///< nodes inside each other
constexpr std::size_t kLongestName = 256;

/// Extensions without which the geometry and its colours are what they would be with them.
bool isHarmless(const std::string& extension)
{
    return extension.rfind("KHR_materials_", 0) == 0 || extension == "KHR_mesh_quantization";
}

/// The two pieces of a file.
struct Pieces {
    std::string_view text, binary;
};

std::uint32_t numberAt(std::string_view bytes, std::size_t at)
{
    std::uint32_t value;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
}

Pieces piecesOf(const fs::path& file, std::string_view content)
{
    if (content.size() < 4 || content.substr(0, 4) != "glTF") return {content, {}};
    if (content.size() < 20 || numberAt(content, 4) != 2)
        throw fileError(file, "the header", "a GLB of version 2", "another one");
    Pieces pieces;
    for (std::size_t at = 12; content.size() - at >= 8;) {
        const std::size_t length = numberAt(content, at);
        const std::uint32_t type = numberAt(content, at + 4);
        at += 8;
        if (length > content.size() - at)
            throw fileError(file, fmt::format("the piece at byte {}", at - 8),
                            fmt::format("{} bytes", length), std::to_string(content.size() - at),
                            "Is the file complete?");
        if (type == 0x4e4f534a && pieces.text.empty()) pieces.text = content.substr(at, length);
        if (type == 0x004e4942 && pieces.binary.empty()) pieces.binary = content.substr(at, length);
        at += length;
    }
    return pieces;
}

/// The numbers of an array of `count`, or nothing if there is none.
template <std::size_t count>
std::optional<std::array<double, count>> arrayOf(const json& table, const char* key)
{
    if (!table.contains(key)) return std::nullopt;
    return table.at(key).get<std::array<double, count>>();
}

Matrix transformOf(const json& node)
{
    if (const auto m = arrayOf<16>(node, "matrix"))
        return Matrix(m->data()); // columns are rows here
    const auto t = arrayOf<3>(node, "translation").value_or(std::array<double, 3>{0, 0, 0}),
               s = arrayOf<3>(node, "scale").value_or(std::array<double, 3>{1, 1, 1});
    const auto q = arrayOf<4>(node, "rotation").value_or(std::array<double, 4>{0, 0, 0, 1});
    const auto [x, y, z, w] = q;
    const Vec3d ax =
                    s[0] * Vec3d(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)),
                ay =
                    s[1] * Vec3d(2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)),
                az =
                    s[2] * Vec3d(2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y));
    Matrix m = Matrix::identity();
    const Vec3d rows[] = {ax, ay, az, Vec3d(t[0], t[1], t[2])};
    for (int i = 0; i < 4; ++i)
        for (int k = 0; k < 3; ++k) m[i][k] = rows[i][k];
    return m;
}

class GltfReader {
public:
    GltfReader(const fs::path& file, const json& root, std::string_view binary)
        : m_file(file), m_root(root), m_buffers(file, root, binary)
    {
    }

    PolygonSoup read()
    {
        for (const json& e : m_root.value("extensionsRequired", json::array()))
            if (const auto name = e.get<std::string>(); !isHarmless(name))
                throw fileError(m_file, "extensionsRequired", "a file that needs no extension",
                                name.substr(0, kLongestName),
                                "Export it without compression and extensions.");
        readMaterials();
        m_visited.assign(m_root.value("nodes", json::array()).size(), false);
        for (const std::uint64_t node : roots()) visit(node, Matrix::identity(), 0);
        if (m_left_out)
            m_soup.warnings.push_back(fmt::format("{}: {} pieces of points or lines are left out.",
                                                  m_file.string(), m_left_out));
        return std::move(m_soup);
    }

private:
    /// The nodes of the default scene; of a file without scenes those that nothing holds.
    std::vector<std::uint64_t> roots() const
    {
        if (m_root.contains("scenes") && !m_root.at("scenes").empty())
            return m_root.at("scenes")
                .at(m_root.value("scene", std::uint64_t(0)))
                .value("nodes", std::vector<std::uint64_t>{});
        const json nodes = m_root.value("nodes", json::array());
        std::vector<bool> held(nodes.size(), false);
        for (const json& node : nodes)
            for (const json& child : node.value("children", json::array()))
                if (const auto c = child.get<std::uint64_t>(); c < held.size()) held[c] = true;
        std::vector<std::uint64_t> result;
        for (std::size_t i = 0; i < held.size(); ++i)
            if (!held[i]) result.push_back(i);
        return result;
    }

    void visit(std::uint64_t index, const Matrix& outer, int depth)
    {
        const json& node = m_root.at("nodes").at(index);
        if (m_visited[index] || depth > kDeepest)
            throw fileError(
                m_file, fmt::format("node {}", index),
                fmt::format("nodes that stand in one other node each, at most {} deep", kDeepest),
                "other ones");
        m_visited[index] = true;
        const Matrix world = transformOf(node) * outer;
        if (node.contains("mesh")) {
            const json& mesh = m_root.at("meshes").at(node.at("mesh").get<std::uint64_t>());
            const std::string own = node.value("name", ""), shared = mesh.value("name", "");
            std::string name = own.substr(0, kLongestName);
            if (!own.empty() && !shared.empty()) name += "/";
            name += shared.substr(0, kLongestName);
            for (const json& primitive : mesh.at("primitives")) add(primitive, world, name);
        }
        for (const json& child : node.value("children", json::array()))
            visit(child.get<std::uint64_t>(), world, depth + 1);
    }

    void add(const json& primitive, const Matrix& world, const std::string& name)
    {
        const int mode = primitive.value("mode", 4);
        if (mode < 4 || mode > 6 || !primitive.at("attributes").contains("POSITION")) {
            ++m_left_out;
            return;
        }
        const json& attributes = primitive.at("attributes");
        const std::int32_t material =
            primitive.contains("material") ? primitive.at("material").get<std::int32_t>() : -1;
        if (material >= 0 && std::size_t(material) >= m_soup.materials.size())
            throw fileError(m_file, "mesh '" + name + "'",
                            fmt::format("one of {} materials", m_soup.materials.size()),
                            fmt::format("number {}", material));
        const auto first_point = static_cast<std::int32_t>(m_soup.points.size()),
                   first_uv = static_cast<std::int32_t>(m_soup.uvs.size()),
                   first_normal = static_cast<std::int32_t>(m_soup.normals.size());
        const std::size_t points = addPoints(attributes, world, name);
        const std::size_t uvs = addUvs(attributes, material);
        const std::size_t normals = addNormals(attributes, world);
        std::vector<std::uint32_t> order;
        if (primitive.contains("indices"))
            order = m_buffers.indices(primitive.at("indices").get<std::uint64_t>());
        else
            for (std::size_t i = 0; i < points; ++i) order.push_back(std::uint32_t(i));
        m_soup.startRange(name, material);
        const auto corner = [&](std::uint32_t i) {
            if (i >= points)
                throw fileError(m_file, "mesh '" + name + "'",
                                fmt::format("one of {} points", points),
                                fmt::format("number {}", i), "Is the file complete?");
            const auto n = static_cast<std::int32_t>(i);
            m_soup.corners.push_back({first_point + n, i < uvs ? first_uv + n : -1,
                                      i < normals ? first_normal + n : -1});
        };
        for (std::size_t i = 0; i + 2 < order.size(); i += mode == 4 ? 3 : 1) {
            const bool odd = mode == 5 && i % 2 == 1;
            corner(order[mode == 6 ? 0 : i + odd]);
            corner(order[i + 1 - odd]);
            corner(order[i + 2]);
            m_soup.endFace();
        }
        if (std::max({m_soup.corners.size(), m_soup.points.size(), m_soup.uvs.size(),
                      m_soup.normals.size()})
            > kMostCorners)
            throw fileError(m_file, "", "at most 20,000,000 triangles in all nodes together",
                            "more");
    }

    std::size_t addPoints(const json& attributes, const Matrix& world, const std::string& name)
    {
        const auto p = m_buffers.numbers(attributes.at("POSITION").get<std::uint64_t>(), 3);
        for (std::size_t i = 0; i + 2 < p.size(); i += 3) {
            const Vec3d at = world.transform(Vec3d(p[i], p[i + 1], p[i + 2]));
            if (!at.isFinite())
                throw fileError(m_file, "mesh '" + name + "'", "finite positions", "others");
            m_soup.points.push_back(at);
        }
        return p.size() / 3;
    }

    std::size_t addUvs(const json& attributes, std::int32_t material)
    {
        std::string key = material < 0
            ? "TEXCOORD_0"
            : fmt::format("TEXCOORD_{}", m_uv_set[std::size_t(material)]);
        if (!attributes.contains(key)) key = "TEXCOORD_0";
        if (!attributes.contains(key)) return 0;
        const auto uv = m_buffers.numbers(attributes.at(key).get<std::uint64_t>(), 2);
        for (std::size_t i = 0; i + 1 < uv.size(); i += 2) {
            // glTF counts v from the top of the picture.
            const Vec2f at(float(uv[i]), float(1 - uv[i + 1]));
            const bool finite = std::isfinite(at[0]) && std::isfinite(at[1]);
            m_soup.uvs.push_back(finite ? at : Vec2f(0.0f, 0.0f));
        }
        return uv.size() / 2;
    }

    std::size_t addNormals(const json& attributes, const Matrix& world)
    {
        if (!attributes.contains("NORMAL")) return 0;
        const auto n = m_buffers.numbers(attributes.at("NORMAL").get<std::uint64_t>(), 3);
        // Normals go with the inverse transposed, which is the matrix of cofactors but for a
        // factor.
        const Vec3d a(world[0][0], world[0][1], world[0][2]),
            b(world[1][0], world[1][1], world[1][2]), c(world[2][0], world[2][1], world[2][2]);
        const Vec3d rows[3] = {b.cross(c), c.cross(a), a.cross(b)};
        const double sign = a.dot(rows[0]) < 0 ? -1 : 1;
        for (std::size_t i = 0; i + 2 < n.size(); i += 3)
            m_soup.normals.emplace_back((rows[0] * n[i] + rows[1] * n[i + 1] + rows[2] * n[i + 2])
                                        * sign);
        return n.size() / 3;
    }

    void readMaterials()
    {
        for (const json& m : m_root.value("materials", json::array())) {
            MeshMaterial& material = m_soup.materials.emplace_back();
            std::size_t& uv_set = m_uv_set.emplace_back(0);
            material.name = m.value("name", "").substr(0, kLongestName);
            material.cut = m.value("alphaMode", "OPAQUE") != "OPAQUE";
            material.cutoff =
                m.value("alphaMode", "OPAQUE") == "MASK" ? m.value("alphaCutoff", 0.5) : 0.5;
            const json pbr = m.value("pbrMetallicRoughness", json::object());
            if (const auto c = arrayOf<4>(pbr, "baseColorFactor"))
                for (int k = 0; k < 3; ++k) material.colour[k] = float((*c)[std::size_t(k)]);
            if (!material.colour.isFinite()) material.colour = Vec3f(1.0f);
            if (!pbr.contains("baseColorTexture")) continue;
            const json& texture = pbr.at("baseColorTexture");
            uv_set = texture.value("texCoord", std::size_t(0));
            readImage(texture.at("index").get<std::uint64_t>(), material);
        }
    }

    void readImage(std::uint64_t texture, MeshMaterial& material)
    {
        const json& t = m_root.at("textures").at(texture);
        if (!t.contains("source")) {
            m_soup.warnings.push_back(fmt::format(
                "{}: the texture of material '{}' has a form that is not known; it is left out.",
                m_file.string(), material.name));
            return;
        }
        const auto index = t.at("source").get<std::uint64_t>();
        const json& image = m_root.at("images").at(index);
        const std::string uri = image.value("uri", "");
        if (!uri.empty() && uri.rfind("data:", 0) != 0) {
            material.texture = gltfPath(m_file, uri);
            return;
        }
        const std::string place = fmt::format("image {}", index);
        std::shared_ptr<const std::string>& bytes = m_images[index];
        if (!bytes)
            bytes = std::make_shared<const std::string>(
                uri.empty() ? m_buffers.view(image.at("bufferView").get<std::uint64_t>())
                            : gltfBytes(m_file, place, uri));
        material.embedded = bytes;
        material.texture = m_file.string() + ": " + place;
    }

    const fs::path& m_file;
    const json& m_root;
    GltfBuffers m_buffers;
    PolygonSoup m_soup;
    std::vector<std::size_t> m_uv_set; ///< of each material's texture
    std::vector<bool> m_visited;
    std::map<std::uint64_t, std::shared_ptr<const std::string>> m_images; ///< those in the file
    std::size_t m_left_out = 0;
};

} // namespace

PolygonSoup readGltf(const fs::path& file, std::string_view content)
{
    const Pieces pieces = piecesOf(file, content);
    try {
        const json root = json::parse(pieces.text);
        if (root.at("asset").at("version").get<std::string>().rfind("2.", 0) != 0)
            throw fileError(file, "asset.version", "2.0",
                            root.at("asset").at("version").get<std::string>().substr(0, 20));
        return GltfReader(file, root, pieces.binary).read();
    } catch (const json::exception& e) {
        throw fileError(file, "", "glTF 2.0", std::string(e.what()).substr(0, 300),
                        "Is the file complete?");
    }
}

} // namespace volcomp
