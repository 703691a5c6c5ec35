// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/mesh.h"

#include <algorithm>
#include <cmath>

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

namespace volcomp {
namespace {

namespace om = OpenMesh;
namespace fs = std::filesystem;

const char* const kExpected = "a mesh (OBJ, PLY, OFF or STL)";

/// Receives what a reader of OpenMesh finds, as it stands: polygons over points.
class Soup final : public om::IO::BaseImporter {
public:
    std::vector<Vec3d> points;
    std::vector<Vec3f> normals;
    std::vector<Vec2f> vertex_uv;
    std::vector<std::vector<int>> faces;
    std::vector<std::vector<Vec2f>> face_uv;
    std::size_t normals_set = 0, uvs_set = 0;
    std::size_t wrong_indices = 0; ///< faces with a vertex that the file does not have

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

    // The rest of the interface: what a soup of polygons has no place for.
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

/// While it lives OpenMesh's readers, which print their complaints, are silent: our own messages
/// say what is wrong.
class Silence {
public:
    Silence() { omerr().disable(), omlog().disable(), omout().disable(); }
    ~Silence() { omerr().enable(), omlog().enable(), omout().enable(); }
};

/// Throws Error if the file cannot be a mesh.
void checkFile(const fs::path& file)
{
    std::error_code code;
    if (!fs::is_regular_file(file, code))
        throw fileError(file, "", kExpected,
                        fs::exists(file, code) ? "something that is not a file" : "no file",
                        "Check the path.");
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    if (ending != ".obj" && ending != ".ply" && ending != ".off" && ending != ".stl")
        throw fileError(file, "", kExpected, "a name that ends in '" + ending + "'",
                        "Convert it to one of these.");
    if (fs::file_size(file, code) == 0) throw fileError(file, "", kExpected, "an empty file");
}

Soup readSoup(const fs::path& file)
{
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
        } catch (const std::bad_alloc&) {
            throw; // the file is not to blame
        } catch (const std::exception&) {
            ok = false;
        }
    }
    if (!ok)
        throw fileError(file, "", kExpected, "content that OpenMesh cannot read",
                        "Is the file complete, and what its ending says?");
    if (soup.wrong_indices)
        throw fileError(file, "", "faces over vertices that the file has",
                        fmt::format("{} faces with other indices", soup.wrong_indices),
                        "Is the file complete?");
    if (soup.faces.empty())
        throw fileError(file, "", "faces",
                        fmt::format("{} vertices and no face", soup.points.size()));
    for (std::size_t i = 0; i < soup.points.size(); ++i)
        if (!std::isfinite(soup.points[i][0] + soup.points[i][1] + soup.points[i][2]))
            throw fileError(file, fmt::format("vertex {}", i + 1), "finite coordinates",
                            "NaN or infinity");
    return soup;
}

/// Calls add(a, b, c) with the corners, counted from 0, of the triangles that a face is cut into.
template <class Add>
void triangulate(const std::vector<Vec3d>& points, const std::vector<int>& face, const Add& add)
{
    if (face.size() == 4) {
        // Cut along the diagonal that does not fold a dent over.
        const auto normal = [&](std::size_t a, std::size_t b, std::size_t c) {
            return (points[face[b]] - points[face[a]]).cross(points[face[c]] - points[face[a]]);
        };
        if (normal(0, 1, 2).dot(normal(0, 2, 3)) >= 0) add(0, 1, 2), add(0, 2, 3);
        else add(1, 2, 3), add(1, 3, 0);
    } else
        for (std::size_t i = 2; i < face.size(); ++i) add(0, i - 1, i);
}

void addTriangles(const Soup& soup, Mesh& m)
{
    const bool face_uv = std::any_of(soup.face_uv.begin(), soup.face_uv.end(),
                                     [](const auto& x) { return !x.empty(); });
    m.report.has_uv = face_uv || soup.uvs_set >= m.points.size();
    for (std::size_t f = 0; f < soup.faces.size(); ++f) {
        const auto& face = soup.faces[f];
        const auto uvOf = [&](std::size_t corner) {
            if (face_uv && !soup.face_uv[f].empty()) return soup.face_uv[f][corner];
            return soup.vertex_uv[face[corner]];
        };
        triangulate(m.points, face, [&](std::size_t a, std::size_t b, std::size_t c) {
            m.triangles.push_back({face[a], face[b], face[c]});
            if (m.report.has_uv) m.uv.push_back({uvOf(a), uvOf(b), uvOf(c)});
        });
    }
}

} // namespace

Mesh readMesh(const fs::path& file)
{
    checkFile(file);
    Soup soup = readSoup(file);
    Mesh m;
    m.points = std::move(soup.points);
    if (soup.normals_set >= m.points.size()) {
        m.normals = std::move(soup.normals);
        for (Vec3f& n : m.normals) {
            const float length = n.length();
            n = std::isfinite(length) && length > 1e-20f ? n / length : Vec3f(0.0f);
        }
    }
    addTriangles(soup, m);
    for (const auto& corners : m.uv)
        for (const Vec2f& x : corners)
            if (!std::isfinite(x[0] + x[1]))
                throw fileError(file, "", "finite texture coordinates", "NaN or infinity");
    if (m.triangles.empty()) throw fileError(file, "", "faces of three corners or more", "none");
    m.report.vertices = m.points.size();
    m.report.faces = soup.faces.size();
    m.report.triangles = m.triangles.size();
    return m;
}

} // namespace volcomp
