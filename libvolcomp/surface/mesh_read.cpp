// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/mesh.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <new>
#include <unordered_map>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/random.h"
#include "volcomp/surface/mesh_soup.h"
#include "volcomp/surface/mesh_triangulate.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

const char* const kExpected = "a mesh (OBJ, PLY, OFF, STL or glTF)";

using Reader = PolygonSoup (*)(const fs::path&, std::string_view);

/// The reader for a file's ending. Throws Error if the file cannot be a mesh.
Reader readerFor(const fs::path& file)
{
    std::error_code code;
    if (!fs::is_regular_file(file, code))
        throw fileError(file, "", kExpected,
                        fs::exists(file, code) ? "something that is not a file" : "no file",
                        "Check the path.");
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    if (ending == ".obj") return readObj;
    if (ending == ".ply") return readPly;
    if (ending == ".off") return readOff;
    if (ending == ".stl") return readStl;
    if (ending == ".gltf" || ending == ".glb") return readGltf;
    throw fileError(file, "", kExpected, "a name that ends in '" + ending + "'",
                    "Convert it to OBJ or PLY.");
}

std::string contentOf(const fs::path& file)
{
    std::ifstream in(file, std::ios::binary);
    std::string content(fs::file_size(file), '\0');
    if (content.empty()) throw fileError(file, "", kExpected, "an empty file");
    in.read(content.data(), static_cast<std::streamsize>(content.size()));
    if (!in) throw fileError(file, "", kExpected, "a file that cannot be read");
    return content;
}

/// Throws Error if a corner is none of the file's points.
void checkIndices(const fs::path& file, const PolygonSoup& soup)
{
    const auto check = [&](std::size_t face, std::int32_t index, std::size_t count,
                           const char* what) {
        if (index >= 0 && static_cast<std::size_t>(index) >= count)
            throw fileError(file, fmt::format("face {}", face + 1),
                            fmt::format("one of the {} {} of the file", count, what),
                            fmt::format("number {} of them, counted from 0", index),
                            "Is the file complete?");
    };
    std::size_t corner = 0;
    for (std::size_t f = 0; f < soup.face_ends.size(); ++f)
        for (; corner < soup.face_ends[f]; ++corner) {
            const PolygonSoup::Corner& c = soup.corners[corner];
            check(f, c.point, soup.points.size(), "vertices");
            check(f, c.uv, soup.uvs.size(), "texture coordinates");
            check(f, c.normal, soup.normals.size(), "normals");
        }
}

/// Gives each corner a point that has the corner's normal: the file's point to the first normal
/// that comes with it, and a copy of it to every other.
class SplitPoints {
public:
    SplitPoints(const PolygonSoup& soup, Mesh& mesh) : m_soup(soup), m_mesh(mesh)
    {
        if (soup.normals.empty()) return;
        m_mesh.normals.assign(m_mesh.points.size(), Vec3f(0.0f));
        m_used.assign(m_mesh.points.size(), 0);
    }
    std::int32_t pointOf(const PolygonSoup::Corner& c)
    {
        if (m_soup.normals.empty()) return c.point;
        const Vec3f n = c.normal < 0 ? Vec3f(0.0f) : unit(m_soup.normals[c.normal]);
        if (!m_used[c.point]) {
            m_used[c.point] = 1;
            m_mesh.normals[c.point] = n;
        }
        if (m_mesh.normals[c.point] == n) return c.point;
        const auto next = static_cast<std::int32_t>(m_mesh.points.size());
        const auto [known, is_new] = m_copies.emplace(Key{c.point, n}, next);
        if (is_new) {
            m_mesh.points.push_back(Vec3d(m_mesh.points[c.point]));
            m_mesh.normals.push_back(n);
        }
        return known->second;
    }

private:
    struct Key {
        std::int32_t point;
        Vec3f normal;
        bool operator==(const Key& o) const { return point == o.point && normal == o.normal; }
    };
    struct Hash {
        std::size_t operator()(const Key& k) const
        {
            std::uint64_t hash = static_cast<std::uint64_t>(k.point);
            for (int i = 0; i < 3; ++i) {
                std::uint32_t bits;
                const float x = k.normal[i] + 0.0f; // makes -0 a 0
                std::memcpy(&bits, &x, 4);
                hash = hashKey(hash, bits);
            }
            return hash;
        }
    };
    /// 0 if it has no direction.
    static Vec3f unit(const Vec3f& n)
    {
        const double length = Vec3d(n).length();
        return std::isfinite(length) && length > 1e-20 ? Vec3f(Vec3d(n) / length) : Vec3f(0.0f);
    }

    const PolygonSoup& m_soup;
    Mesh& m_mesh;
    std::vector<char> m_used; ///< points that have their first normal
    std::unordered_map<Key, std::int32_t, Hash> m_copies;
};

/// Cuts the faces into triangles, and makes the parts of the ranges.
class Cutter {
public:
    Cutter(const fs::path& file, const PolygonSoup& soup, Mesh& mesh)
        : m_file(file), m_soup(soup), m_mesh(mesh), m_split(soup, mesh)
    {
    }
    void run()
    {
        const auto has_uv = [](const PolygonSoup::Corner& c) { return c.uv >= 0; };
        std::size_t first = 0, bare = 0, range = 0;
        const bool any = std::any_of(m_soup.corners.begin(), m_soup.corners.end(), has_uv);
        for (std::size_t f = 0; f < m_soup.face_ends.size(); ++f) {
            startPart(f, range);
            const auto* const corners = m_soup.corners.data() + first;
            const std::size_t count = m_soup.face_ends[f] - first;
            const bool full = std::all_of(corners, corners + count, has_uv);
            bare += !full;
            addFace(corners, count, any, full);
            first += count;
            if (m_mesh.triangles.size() > INT32_MAX || m_mesh.points.size() > INT32_MAX)
                throw fileError(m_file, "", "fewer than 2^31 triangles and points", "more");
        }
        closePart();
        if (any && bare)
            warn(fmt::format("{} of {} faces has no texture coordinates; maps take their value at "
                             "(0, 0) there.",
                             bare, m_soup.face_ends.size()));
        if (m_crossed)
            warn(fmt::format("{} of {} faces cross themselves; their shape is not certain.",
                             m_crossed, m_soup.face_ends.size()));
        if (m_soup.short_faces)
            warn(fmt::format("{} faces of fewer than three corners are left out.",
                             m_soup.short_faces));
    }

private:
    void warn(const std::string& what)
    {
        m_mesh.report.warnings.push_back(m_file.string() + ": " + what);
    }
    void startPart(std::size_t face, std::size_t& range)
    {
        const bool first = face == 0 && (m_soup.ranges.empty() || m_soup.ranges[0].first_face > 0);
        if (first) m_mesh.parts.emplace_back();
        for (; range < m_soup.ranges.size() && m_soup.ranges[range].first_face <= face; ++range) {
            closePart();
            const PolygonSoup::Range& r = m_soup.ranges[range];
            m_mesh.parts.push_back({r.name, r.material, m_mesh.triangles.size(), 0});
        }
    }
    void closePart()
    {
        if (m_mesh.parts.empty()) return;
        m_mesh.parts.back().end = m_mesh.triangles.size();
        if (m_mesh.parts.back().first == m_mesh.parts.back().end) m_mesh.parts.pop_back();
    }
    void addFace(const PolygonSoup::Corner* corners, std::size_t count, bool any_uv, bool uv)
    {
        m_polygon.clear();
        m_triangles.clear();
        for (std::size_t k = 0; k < count; ++k)
            m_polygon.push_back(m_mesh.points[corners[k].point]);
        const Cut cut = triangulate(m_polygon, m_triangles);
        if (cut == Cut::too_many)
            throw fileError(m_file, "",
                            fmt::format("concave faces of up to {} corners", kMostConcaveCorners),
                            fmt::format("one of {}", count),
                            "Cut it into triangles in the program that made it.");
        m_crossed += cut == Cut::crossed;
        for (const auto& t : m_triangles) {
            const auto uvOf = [&](int k) {
                return uv ? m_soup.uvs[corners[t[k]].uv] : Vec2f(0.0f, 0.0f);
            };
            m_mesh.triangles.push_back({m_split.pointOf(corners[t[0]]),
                                        m_split.pointOf(corners[t[1]]),
                                        m_split.pointOf(corners[t[2]])});
            if (any_uv) m_mesh.uv.push_back({uvOf(0), uvOf(1), uvOf(2)});
        }
    }

    const fs::path& m_file;
    const PolygonSoup& m_soup;
    Mesh& m_mesh;
    SplitPoints m_split;
    std::vector<Vec3d> m_polygon;
    std::vector<std::array<std::int32_t, 3>> m_triangles; ///< of one face
    std::size_t m_crossed = 0;
};

Mesh read(const fs::path& file)
{
    const Reader reader = readerFor(file);
    PolygonSoup soup = reader(file, contentOf(file));
    if (soup.face_ends.empty())
        throw fileError(file, "", "faces of three corners or more",
                        fmt::format("{} vertices and no such face", soup.points.size()));
    if (soup.points.size() > INT32_MAX)
        throw fileError(file, "", "fewer than 2^31 vertices", "more");
    checkIndices(file, soup);
    Mesh m;
    m.report.vertices = soup.points.size();
    m.report.faces = soup.face_ends.size();
    m.report.warnings = std::move(soup.warnings);
    m.points = std::move(soup.points);
    m.materials = std::move(soup.materials);
    Cutter(file, soup, m).run();
    m.report.triangles = m.triangles.size();
    m.report.has_uv = !m.uv.empty();
    // Normals of zero length alone are none.
    if (std::all_of(m.normals.begin(), m.normals.end(), [](auto& n) { return n == Vec3f(0.0f); }))
        m.normals.clear();
    return m;
}

} // namespace

void PolygonSoup::endFace()
{
    const std::size_t first = face_ends.empty() ? 0 : face_ends.back();
    if (corners.size() - first >= 3) {
        face_ends.push_back(corners.size());
        return;
    }
    corners.resize(first, {0});
    ++short_faces;
}

void PolygonSoup::startRange(const std::string& name, std::int32_t material)
{
    if (!ranges.empty() && ranges.back().name == name && ranges.back().material == material) return;
    if (!ranges.empty() && ranges.back().first_face == face_ends.size()) ranges.pop_back();
    ranges.push_back({name, material, face_ends.size()});
}

Mesh readMesh(const fs::path& file)
{
    try {
        return read(file);
    } catch (const std::bad_alloc&) {
        throw Error(file.string() + ": the memory is not enough to read this mesh.");
    } catch (const fs::filesystem_error& e) {
        throw fileError(file, "", kExpected, e.code().message());
    }
}

} // namespace volcomp
