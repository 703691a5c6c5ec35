// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ (Wavefront, Advanced Visualizer manual, appendix B1) and its MTL.
#include "volcomp/surface/mesh_soup.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <unordered_map>

#include <fmt/format.h>

#include "volcomp/surface/mesh_text.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMostMtlBytes = 64 << 20;
constexpr std::size_t kLongestName = 256; ///< of an object or group: each part repeats them

/// A file that another names, which may have been written on Windows.
fs::path beside(const fs::path& file, std::string_view name)
{
    std::string path(name);
    std::replace(path.begin(), path.end(), '\\', '/');
    return file.parent_path() / path;
}

/// The file name of a texture statement, behind its options and their values.
std::string_view textureName(MeshText& text)
{
    std::string_view rest = text.restOfLine();
    const auto take = [&] {
        const std::string_view w = rest.substr(0, rest.find_first_of(" \t"));
        rest.remove_prefix(w.size());
        rest.remove_prefix(std::min(rest.find_first_not_of(" \t"), rest.size()));
        return w;
    };
    const auto isNumber = [&] {
        return !rest.empty() && rest.find_first_of("0123456789.+-") == 0
            && rest.find_first_of(" \t") != rest.npos
            && rest.find_first_not_of("0123456789.+-eE") == rest.find_first_of(" \t");
    };
    while (!rest.empty() && rest[0] == '-') {
        const std::string_view option = take();
        if (option == "-o" || option == "-s" || option == "-t" || option == "-mm")
            for (int k = 0; k < 3 && isNumber(); ++k) take();
        else take();
    }
    return rest;
}

/// Reads one statement of a material. Colours that are no numbers are left as they were.
void readMtlKey(const fs::path& file, std::string_view key, MeshText& text, MeshMaterial& m)
{
    if (key == "map_Kd") {
        m.texture = beside(file, textureName(text));
        m.colour = Vec3f(1.0f);
    } else if (key == "map_d") {
        m.alpha = beside(file, textureName(text));
        m.cut = true;
    } else if (key == "Kd" && m.texture.empty()) {
        const std::string words(text.restOfLine());
        Vec3f c;
        const char* at = words.c_str();
        for (int k = 0; k < 3; ++k) {
            char* end = nullptr;
            c[k] = std::strtof(at, &end);
            if (end == at || !std::isfinite(c[k]) || c[k] < 0) return;
            at = end;
        }
        m.colour = c;
    }
}

/// Fills in the textures of materials. A library that is missing is no error: the names remain.
void readMtl(const fs::path& file, std::vector<MeshMaterial>& materials)
{
    std::error_code code;
    if (!fs::is_regular_file(file, code)) return;
    // The files of /proc have no size, and reading some of them never ends.
    if (const auto size = fs::file_size(file, code); code || size == 0 || size > kMostMtlBytes)
        return;
    std::ifstream in(file, std::ios::binary);
    const std::string content{std::istreambuf_iterator<char>(in), {}};
    std::unordered_map<std::string, std::size_t> known;
    for (std::size_t k = 0; k < materials.size(); ++k) known.emplace(materials[k].name, k);
    MeshText text(file, content, MeshText::Style::comments);
    auto material = known.end();
    do {
        const std::string_view key = text.word();
        if (key == "newmtl") material = known.find(std::string(text.restOfLine()));
        else if (material != known.end()) readMtlKey(file, key, text, materials[material->second]);
    } while (text.nextLine());
}

class ObjReader {
public:
    ObjReader(const fs::path& file, std::string_view content)
        : m_text(file, content, MeshText::Style::obj)
    {
    }
    PolygonSoup read()
    {
        do {
            if (const std::string_view key = m_text.word(); !key.empty()) statement(key);
        } while (m_text.nextLine());
        for (const fs::path& file : m_libraries) readMtl(file, m_soup.materials);
        if (m_curved && m_soup.face_ends.empty())
            throw fileError(m_text.file(), "", "faces",
                            "free-form curves or surfaces alone, which are not supported",
                            "Convert them to polygons.");
        if (m_curved)
            m_soup.warnings.push_back(m_text.file().string()
                                      + ": free-form surfaces are not supported and left out.");
        if (m_unknown)
            m_soup.warnings.push_back(fmt::format("{}: {} statements like {} are not known and "
                                                  "left out.",
                                                  m_text.file().string(), m_unknown, m_example));
        return std::move(m_soup);
    }

private:
    void statement(std::string_view key)
    {
        if (key == "v") {
            const double x = m_text.finite("x"), y = m_text.finite("y");
            m_soup.points.emplace_back(x, y, m_text.finite("z"));
        } else if (key == "vt") {
            const double u = m_text.finite("u");
            const std::string_view v = m_text.word();
            m_soup.uvs.emplace_back(float(u), float(v.empty() ? 0 : m_text.number(v, "v")));
            if (!std::isfinite(m_soup.uvs.back()[0]) || !std::isfinite(m_soup.uvs.back()[1]))
                throw m_text.error("finite texture coordinates", "others");
        } else if (key == "vn") {
            const double x = m_text.number(m_text.word(), "x"),
                         y = m_text.number(m_text.word(), "y"),
                         z = m_text.number(m_text.word(), "z");
            m_soup.normals.emplace_back(float(x), float(y), float(z));
        } else if (key == "f" || key == "fo") face();
        else if (key == "o")
            m_object = m_text.restOfLine().substr(0, kLongestName), m_group.clear(), m_moved = true;
        else if (key == "g") m_group = m_text.restOfLine().substr(0, kLongestName), m_moved = true;
        else if (key == "usemtl") useMaterial(std::string(m_text.restOfLine()));
        else if (key == "mtllib") addLibraries();
        else other(key);
    }

    void face()
    {
        if (m_moved)
            m_soup.startRange(m_object + (m_object.empty() || m_group.empty() ? "" : "/") + m_group,
                              m_material);
        m_moved = false;
        for (std::string_view w = m_text.word(); !w.empty(); w = m_text.word())
            m_soup.corners.push_back(corner(w));
        m_soup.endFace();
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    PolygonSoup::Corner corner(std::string_view w) const
    {
        std::array<std::string_view, 3> part;
        std::size_t count = 0;
        for (std::string_view left = w;; ++count) {
            if (count == 3) throw m_text.error("a corner like 1/2/3", inQuotes(w));
            const std::size_t slash = left.find('/');
            part[count] = left.substr(0, slash);
            if (slash == left.npos) break;
            left.remove_prefix(slash + 1);
        }
        if (part[0].empty()) throw m_text.error("a corner like 1/2/3", inQuotes(w));
        PolygonSoup::Corner c{index(part[0], m_soup.points.size(), "a vertex")};
        if (!part[1].empty()) c.uv = index(part[1], m_soup.uvs.size(), "texture coordinates");
        if (!part[2].empty()) c.normal = index(part[2], m_soup.normals.size(), "a normal");
        return c;
    }

    /// From 1 upward, or from -1, the last of `count`, downward. One that comes later in the file
    /// is well.
    std::int32_t index(std::string_view w, std::size_t count, const char* what) const
    {
        const std::int64_t i = m_text.whole(w, what);
        const std::int64_t from_0 = i < 0 ? i + static_cast<std::int64_t>(count) : i - 1;
        if (i == 0 || from_0 < 0 || from_0 > INT32_MAX)
            throw m_text.error(fmt::format("the number of {} that the file has", what),
                               inQuotes(w));
        return static_cast<std::int32_t>(from_0);
    }

    void useMaterial(const std::string& name)
    {
        const auto next = static_cast<std::int32_t>(m_soup.materials.size());
        const auto [known, is_new] = m_materials.emplace(name, next);
        if (is_new) m_soup.materials.emplace_back().name = name;
        m_material = known->second;
        m_moved = true;
    }

    void addLibraries()
    {
        // Names are separated by blanks, but programs write names with blanks too.
        const std::string_view rest = m_text.restOfLine();
        std::error_code code;
        if (const fs::path whole = beside(m_text.file(), rest); fs::is_regular_file(whole, code)) {
            addLibrary(whole);
            return;
        }
        MeshText names(m_text.file(), rest, MeshText::Style::plain);
        for (std::string_view w = names.word(); !w.empty(); w = names.word())
            addLibrary(beside(m_text.file(), w));
    }
    void addLibrary(const fs::path& file)
    {
        if (m_libraries.size() < 64
            && std::find(m_libraries.begin(), m_libraries.end(), file) == m_libraries.end())
            m_libraries.push_back(file);
    }

    void other(std::string_view key)
    {
        for (const char* const curved :
             {"curv", "curv2", "surf", "bzp", "bsp", "cdc", "cdp", "res"})
            if (key == curved) {
                m_curved = true;
                return;
            }
        // Points, lines, how to show and to smooth, and what belongs to free-form surfaces.
        for (const char* const known :
             {"p",      "l",          "s",         "mg",    "vp",       "lod",      "cstype",
              "deg",    "bmat",       "step",      "parm",  "trim",     "hole",     "scrv",
              "sp",     "end",        "con",       "bevel", "c_interp", "d_interp", "usemap",
              "maplib", "shadow_obj", "trace_obj", "ctech", "stech",    "call",     "csh"})
            if (key == known) return;
        if (m_unknown++ == 0)
            m_example = fmt::format("{} in line {}", inQuotes(key), m_text.line());
    }

    MeshText m_text;
    PolygonSoup m_soup;
    std::string m_object, m_group, m_example;
    std::unordered_map<std::string, std::int32_t> m_materials;
    std::vector<fs::path> m_libraries;
    std::int32_t m_material = -1;
    std::size_t m_unknown = 0;
    bool m_moved = false; ///< a new object, group or material since the last face
    bool m_curved = false;
};

} // namespace

PolygonSoup readObj(const fs::path& file, std::string_view text)
{
    return ObjReader(file, text).read();
}

} // namespace volcomp
