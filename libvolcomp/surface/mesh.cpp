#include "volcomp/surface/mesh.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include <OpenMesh/Core/IO/BinaryHelper.hh>
#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/IO/reader/OBJReader.hh>
#include <OpenMesh/Core/IO/reader/OFFReader.hh>
#include <OpenMesh/Core/IO/reader/PLYReader.hh>
#include <OpenMesh/Core/IO/reader/STLReader.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/random.h"

namespace volcomp {
namespace {

namespace om = OpenMesh;
namespace fs = std::filesystem;

/// Takes what a reader finds as it stands: polygons over points.
class Soup final : public om::IO::BaseImporter {
public:
    std::vector<Vec3d> points;
    std::vector<Vec3f> normals;
    std::vector<Vec2f> vertex_uv;
    std::vector<std::vector<int>> faces;
    std::vector<std::vector<Vec2f>> face_uv;
    std::size_t normals_set = 0, uvs_set = 0, wrong_indices = 0;

    om::VertexHandle add_vertex(const om::Vec3f& p) override
    {
        return add_vertex(om::Vec3d(p[0], p[1], p[2]));
    }
    om::VertexHandle add_vertex(const om::Vec3d& p) override
    {
        points.emplace_back(p[0], p[1], p[2]);
        normals.emplace_back(0.0f);
        vertex_uv.emplace_back(0.0f, 0.0f);
        return om::VertexHandle(static_cast<int>(points.size()) - 1);
    }
    om::VertexHandle add_vertex() override { return add_vertex(om::Vec3d(0, 0, 0)); }
    void set_point(om::VertexHandle v, const om::Vec3f& p) override
    {
        if (known(v)) points[v.idx()] = Vec3d(p[0], p[1], p[2]);
    }
    om::FaceHandle add_face(const VHandles& corners) override
    {
        std::vector<int> face;
        for (const om::VertexHandle v : corners) {
            if (!known(v)) {
                ++wrong_indices;
                return om::FaceHandle();
            }
            face.push_back(v.idx());
        }
        faces.push_back(std::move(face));
        face_uv.emplace_back();
        return om::FaceHandle(static_cast<int>(faces.size()) - 1);
    }
    void add_face_texcoords(om::FaceHandle f, om::VertexHandle,
                            const std::vector<om::Vec2f>& uv) override
    {
        if (!f.is_valid() || uv.size() != faces[f.idx()].size()) return;
        for (const om::Vec2f& x : uv) face_uv[f.idx()].emplace_back(x[0], x[1]);
    }
    void add_face_texcoords(om::FaceHandle, om::VertexHandle,
                            const std::vector<om::Vec3f>&) override
    {
    }
    void set_normal(om::VertexHandle v, const om::Vec3f& n) override
    {
        if (!known(v)) return;
        normals[v.idx()] = Vec3f(n[0], n[1], n[2]);
        ++normals_set;
    }
    void set_normal(om::VertexHandle v, const om::Vec3d& n) override
    {
        set_normal(v, om::Vec3f(float(n[0]), float(n[1]), float(n[2])));
    }
    void set_texcoord(om::VertexHandle v, const om::Vec2f& x) override
    {
        if (!known(v)) return;
        vertex_uv[v.idx()] = Vec2f(x[0], x[1]);
        ++uvs_set;
    }
    void set_texcoord(om::VertexHandle v, const om::Vec3f& x) override
    {
        set_texcoord(v, om::Vec2f(x[0], x[1]));
    }

    // What a triangle soup has no place for.
    om::HalfedgeHandle add_edge(om::VertexHandle, om::VertexHandle) override
    {
        return om::HalfedgeHandle();
    }
    om::FaceHandle add_face(om::HalfedgeHandle) override { return om::FaceHandle(); }
    void set_face_texindex(om::FaceHandle, int) override { }
    void set_halfedge(om::VertexHandle, om::HalfedgeHandle) override { }
    void set_color(om::VertexHandle, const om::Vec3uc&) override { }
    void set_color(om::VertexHandle, const om::Vec4uc&) override { }
    void set_color(om::VertexHandle, const om::Vec3f&) override { }
    void set_color(om::VertexHandle, const om::Vec4f&) override { }
    void set_status(om::VertexHandle, const om::Attributes::StatusInfo&) override { }
    void set_next(om::HalfedgeHandle, om::HalfedgeHandle) override { }
    void set_face(om::HalfedgeHandle, om::FaceHandle) override { }
    void request_face_texcoords2D() override { }
    void set_texcoord(om::HalfedgeHandle, const om::Vec2f&) override { }
    void set_texcoord(om::HalfedgeHandle, const om::Vec3f&) override { }
    void set_status(om::HalfedgeHandle, const om::Attributes::StatusInfo&) override { }
    void set_color(om::EdgeHandle, const om::Vec3uc&) override { }
    void set_color(om::EdgeHandle, const om::Vec4uc&) override { }
    void set_color(om::EdgeHandle, const om::Vec3f&) override { }
    void set_color(om::EdgeHandle, const om::Vec4f&) override { }
    void set_status(om::EdgeHandle, const om::Attributes::StatusInfo&) override { }
    void set_normal(om::FaceHandle, const om::Vec3f&) override { }
    void set_normal(om::FaceHandle, const om::Vec3d&) override { }
    void set_color(om::FaceHandle, const om::Vec3uc&) override { }
    void set_color(om::FaceHandle, const om::Vec4uc&) override { }
    void set_color(om::FaceHandle, const om::Vec3f&) override { }
    void set_color(om::FaceHandle, const om::Vec4f&) override { }
    void set_status(om::FaceHandle, const om::Attributes::StatusInfo&) override { }
    void add_texture_information(int, std::string) override { }
    std::size_t n_vertices() const override { return points.size(); }
    std::size_t n_faces() const override { return faces.size(); }
    std::size_t n_edges() const override { return 0; }

private:
    bool known(om::VertexHandle v) const
    {
        return v.is_valid() && v.idx() < static_cast<int>(points.size());
    }
};

/// OpenMesh's readers print what they think; our own messages say it.
class Silence {
public:
    Silence() { omerr().disable(), omlog().disable(), omout().disable(); }
    ~Silence() { omerr().enable(), omlog().enable(), omout().enable(); }
};

Vec3d faceNormal(const Mesh& m, std::size_t t) ///< length: twice the area
{
    const auto& c = m.triangles[t];
    return (m.points[c[1]] - m.points[c[0]]).cross(m.points[c[2]] - m.points[c[0]]);
}

/// Points at the same place get the same number, so that texture seams do not tear the surface.
std::vector<std::int32_t> weld(const std::vector<Vec3d>& points)
{
    struct Hash {
        std::size_t operator()(const Vec3d& p) const
        {
            std::uint64_t bits[3];
            for (int i = 0; i < 3; ++i) {
                const double x = p[i] + 0.0; // -0 is 0
                std::memcpy(&bits[i], &x, 8);
            }
            return hashKey(hashKey(bits[0], bits[1]), bits[2]);
        }
    };
    struct Same {
        bool operator()(const Vec3d& a, const Vec3d& b) const
        {
            return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
        }
    };
    std::unordered_map<Vec3d, std::int32_t, Hash, Same> first;
    std::vector<std::int32_t> result(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
        result[i] = first.emplace(points[i], static_cast<std::int32_t>(i)).first->second;
    return result;
}

struct EdgeUse {
    std::uint64_t edge; ///< both welded points, the smaller first
    std::int32_t triangle;
    bool forward; ///< the triangle runs from the smaller to the larger
};

std::vector<EdgeUse> edgesOf(const Mesh& m, const std::vector<std::int32_t>& welded)
{
    std::vector<EdgeUse> edges;
    edges.reserve(m.triangles.size() * 3);
    for (std::size_t t = 0; t < m.triangles.size(); ++t)
        for (int i = 0; i < 3; ++i) {
            const std::uint32_t a = welded[m.triangles[t][i]],
                                b = welded[m.triangles[t][(i + 1) % 3]];
            if (a != b)
                edges.push_back({std::uint64_t(std::min(a, b)) << 32 | std::max(a, b),
                                 static_cast<std::int32_t>(t), a < b});
        }
    std::sort(edges.begin(), edges.end(), [](const EdgeUse& x, const EdgeUse& y) {
        return x.edge != y.edge ? x.edge < y.edge : x.triangle < y.triangle;
    });
    return edges;
}

/// Counts edges, finds connected parts and turns triangles round (unless `orientation` is file).
void orient(Mesh& m, const std::vector<std::int32_t>& welded, Orientation orientation)
{
    const std::vector<EdgeUse> edges = edgesOf(m, welded);
    struct Link {
        std::int32_t triangle;
        bool agrees;
    };
    std::vector<std::vector<Link>> links(m.triangles.size());
    std::vector<char> bad(m.triangles.size(), 0), on_boundary(m.triangles.size(), 0);
    for (std::size_t i = 0; i < edges.size();) {
        std::size_t j = i;
        while (j < edges.size() && edges[j].edge == edges[i].edge) ++j;
        if (j - i == 1) {
            ++m.report.boundary_edges;
            on_boundary[edges[i].triangle] = 1;
        } else if (j - i > 2) {
            ++m.report.non_manifold_edges;
            for (std::size_t k = i; k < j; ++k)
                bad[edges[k].triangle] = on_boundary[edges[k].triangle] = 1;
        } else {
            const bool agrees = edges[i].forward != edges[i + 1].forward;
            links[edges[i].triangle].push_back({edges[i + 1].triangle, agrees});
            links[edges[i + 1].triangle].push_back({edges[i].triangle, agrees});
        }
        i = j;
    }
    m.report.non_manifold_faces = static_cast<std::size_t>(std::count(bad.begin(), bad.end(), 1));

    std::vector<signed char> turn(m.triangles.size(), -1);
    for (std::size_t seed = 0; seed < m.triangles.size(); ++seed) {
        if (turn[seed] >= 0) continue;
        ++m.report.parts;
        std::vector<std::int32_t> part{static_cast<std::int32_t>(seed)};
        turn[seed] = 0;
        for (std::size_t k = 0; k < part.size(); ++k)
            for (const Link& link : links[part[k]])
                if (turn[link.triangle] < 0) {
                    turn[link.triangle] =
                        static_cast<signed char>(link.agrees ? turn[part[k]] : 1 - turn[part[k]]);
                    part.push_back(link.triangle);
                }
        bool closed = true;
        double volume = 0, magnitude = 0;
        std::size_t turned = 0;
        const Vec3d reference = m.points[m.triangles[seed][0]];
        for (const std::int32_t t : part) {
            closed = closed && !on_boundary[t];
            turned += turn[t];
            const double v =
                faceNormal(m, t).dot(m.points[m.triangles[t][0]] - reference) * (turn[t] ? -1 : 1);
            volume += v;
            magnitude += std::abs(v);
        }
        bool invert =
            closed && std::abs(volume) > 1e-9 * magnitude ? volume < 0 : 2 * turned > part.size();
        if (orientation == Orientation::inward) invert = !invert;
        if (invert)
            for (const std::int32_t t : part) turn[t] = static_cast<signed char>(1 - turn[t]);
    }
    if (orientation == Orientation::file) return;
    std::vector<char> normal_turned(m.points.size(), 0);
    for (std::size_t t = 0; t < m.triangles.size(); ++t) {
        if (turn[t] != 1) continue;
        ++m.report.turned;
        for (const std::int32_t p : m.triangles[t]) normal_turned[p] = 1;
        std::swap(m.triangles[t][1], m.triangles[t][2]);
        if (!m.uv.empty()) std::swap(m.uv[t][1], m.uv[t][2]);
    }
    // A normal of the file that pointed to the old outside goes with its faces.
    std::vector<Vec3d> around(m.points.size(), Vec3d(0.0));
    for (std::size_t t = 0; t < m.triangles.size(); ++t)
        for (const std::int32_t p : m.triangles[t]) around[p] += faceNormal(m, t);
    for (std::size_t p = 0; p < m.normals.size(); ++p)
        if (normal_turned[p] && around[p].dot(Vec3d(m.normals[p])) < 0)
            m.normals[p] = -m.normals[p];
}

void computeNormals(Mesh& m, const std::vector<std::int32_t>& welded)
{
    std::vector<Vec3d> sum(m.points.size(), Vec3d(0.0));
    for (std::size_t t = 0; t < m.triangles.size(); ++t) {
        Vec3d n = faceNormal(m, t);
        const double length = n.length();
        if (!(length > 0)) continue;
        n /= length;
        for (int i = 0; i < 3; ++i) {
            const auto& c = m.triangles[t];
            const Vec3d a = m.points[c[(i + 1) % 3]] - m.points[c[i]],
                        b = m.points[c[(i + 2) % 3]] - m.points[c[i]];
            sum[welded[c[i]]] += n * std::atan2(a.cross(b).length(), a.dot(b));
        }
    }
    m.normals.assign(m.points.size(), Vec3f(0.0f));
    for (std::size_t p = 0; p < m.points.size(); ++p) {
        const Vec3d& n = sum[welded[p]];
        const double length = n.length();
        if (length > 1e-6) m.normals[p] = Vec3f(n / length);
    }
}

} // namespace

std::string MeshReport::text() const
{
    std::string s = fmt::format("{} points, {} triangles in {} part{}", vertices, triangles, parts,
                                parts == 1 ? "" : "s");
    if (boundary_edges) s += fmt::format(", {} open edges", boundary_edges);
    if (non_manifold_faces)
        s += fmt::format(", {} non-manifold faces at {} edges (kept)", non_manifold_faces,
                         non_manifold_edges);
    if (zero_area) s += fmt::format(", {} triangles without area", zero_area);
    if (turned) s += fmt::format(", {} triangles turned round", turned);
    if (normals_computed) s += ", normals computed";
    s += has_uv ? ", texture coordinates" : ", no texture coordinates";
    return s;
}

Mesh readMesh(const fs::path& file)
{
    const char* expected = "a mesh (OBJ, PLY, OFF or STL)";
    std::error_code code;
    if (!fs::is_regular_file(file, code))
        throw fileError(file, "", expected,
                        fs::exists(file, code) ? "something that is not a file" : "no file",
                        "Check the path.");
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    if (ending != ".obj" && ending != ".ply" && ending != ".off" && ending != ".stl")
        throw fileError(file, "", expected, "a name that ends in '" + ending + "'",
                        "Convert it to one of these.");
    if (fs::file_size(file, code) == 0) throw fileError(file, "", expected, "an empty file");

    // Named so that a static OpenMesh links its readers; they register themselves.
    om::IO::OBJReader(), om::IO::OFFReader(), om::IO::PLYReader(), om::IO::STLReader();
    Soup soup;
    bool ok = false;
    {
        const Silence silence;
        om::IO::Options options = om::IO::Options::VertexNormal;
        options += om::IO::Options::VertexTexCoord;
        options += om::IO::Options::FaceTexCoord;
        try {
            ok = om::IO::IOManager().read(file.string(), soup, options);
        } catch (const std::exception&) {
            ok = false;
        }
    }
    if (!ok)
        throw fileError(file, "", expected, "content that OpenMesh cannot read",
                        "Is the file complete, and what its ending says?");
    if (soup.wrong_indices)
        throw fileError(file, "", "faces over vertices that the file has",
                        fmt::format("{} faces with other indices", soup.wrong_indices),
                        "Is the file complete?");
    if (soup.faces.empty())
        throw fileError(file, "", "faces",
                        fmt::format("{} vertices and no face", soup.points.size()));

    Mesh m;
    m.points = std::move(soup.points);
    for (std::size_t i = 0; i < m.points.size(); ++i)
        if (!std::isfinite(m.points[i][0] + m.points[i][1] + m.points[i][2]))
            throw fileError(file, fmt::format("vertex {}", i + 1), "finite coordinates",
                            "NaN or infinity");
    if (soup.normals_set >= m.points.size()) {
        m.normals = std::move(soup.normals);
        for (Vec3f& n : m.normals) {
            const float length = n.length();
            n = std::isfinite(length) && length > 1e-20f ? n / length : Vec3f(0.0f);
        }
    }
    const bool face_uv = std::any_of(soup.face_uv.begin(), soup.face_uv.end(),
                                     [](const auto& x) { return !x.empty(); });
    const bool has_uv = face_uv || soup.uvs_set >= m.points.size();
    for (std::size_t f = 0; f < soup.faces.size(); ++f) {
        const auto& face = soup.faces[f];
        const auto uvOf = [&](std::size_t corner) {
            if (face_uv && !soup.face_uv[f].empty()) return soup.face_uv[f][corner];
            return soup.vertex_uv[face[corner]];
        };
        const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
            m.triangles.push_back({face[a], face[b], face[c]});
            if (has_uv) m.uv.push_back({uvOf(a), uvOf(b), uvOf(c)});
        };
        if (face.size()
            == 4) { // cut a quadrilateral along the diagonal that leaves no dent folded over
            const auto normal = [&](std::size_t a, std::size_t b, std::size_t c) {
                return (m.points[face[b]] - m.points[face[a]])
                    .cross(m.points[face[c]] - m.points[face[a]]);
            };
            if (normal(0, 1, 2).dot(normal(0, 2, 3)) >= 0) add(0, 1, 2), add(0, 2, 3);
            else add(1, 2, 3), add(1, 3, 0);
        } else
            for (std::size_t i = 2; i < face.size(); ++i) add(0, i - 1, i);
    }
    for (const auto& corners : m.uv)
        for (const Vec2f& x : corners)
            if (!std::isfinite(x[0] + x[1]))
                throw fileError(file, "", "finite texture coordinates", "NaN or infinity");
    if (m.triangles.empty()) throw fileError(file, "", "faces of three corners or more", "none");
    m.report.vertices = m.points.size();
    m.report.faces = soup.faces.size();
    m.report.triangles = m.triangles.size();
    m.report.has_uv = has_uv;
    return m;
}

void prepareMesh(Mesh& m, double scale, const Vec3d& move, Orientation orientation)
{
    for (Vec3d& p : m.points) p = p * scale + move;
    const std::vector<std::int32_t> welded = weld(m.points);
    orient(m, welded, orientation);
    for (std::size_t t = 0; t < m.triangles.size(); ++t)
        m.report.zero_area += !(faceNormal(m, t).length() > 0);
    m.report.normals_computed = m.normals.empty();
    if (m.normals.empty()) computeNormals(m, welded);
}

} // namespace volcomp
