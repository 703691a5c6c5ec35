// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/mesh.h"

#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

class MeshFile : public ::testing::Test {
protected:
    std::filesystem::path write(const std::string& name, const std::string& text)
    {
        const std::filesystem::path file =
            std::filesystem::path(::testing::TempDir()) / ("volcomp_mesh_" + name);
        std::ofstream(file, std::ios::binary) << text;
        return file;
    }
    Mesh read(const std::string& name, const std::string& text,
              Orientation o = Orientation::outward)
    {
        Mesh m = readMesh(write(name, text));
        prepareMesh(m, 1, Vec3d(0.0), o);
        return m;
    }
};

double signedVolume(const Mesh& m)
{
    double v = 0;
    for (const auto& t : m.triangles)
        v += m.points[t[0]].dot(m.points[t[1]].cross(m.points[t[2]])) / 6;
    return v;
}

const char* kCube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";
const char* kFaces = "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

TEST_F(MeshFile, aCubeOfQuadsBecomesTwelveTriangles)
{
    const Mesh m = read("cube.obj", std::string(kCube) + kFaces);
    EXPECT_EQ(m.triangles.size(), 12u);
    EXPECT_NEAR(signedVolume(m), 1, 1e-12);
    EXPECT_EQ(m.report.boundary_edges, 0u);
    EXPECT_EQ(m.report.parts, 1u);
    EXPECT_EQ(m.report.turned, 0u);
    EXPECT_TRUE(m.report.normals_computed);
    EXPECT_FALSE(m.report.has_uv);
    // Weights by angle make a corner's normal point along the diagonal, however the faces are cut.
    for (std::size_t p = 0; p < 8; ++p)
        EXPECT_NEAR(Vec3d(m.normals[p]).dot((m.points[p] - Vec3d(0.5)).unit()), 1, 1e-6);
}

TEST_F(MeshFile, insideOutAndMixedFacesAreTurnedOutward)
{
    const std::string inside = "f 2 3 4 1\nf 8 7 6 5\nf 5 6 2 1\nf 6 7 3 2\nf 7 8 4 3\nf 8 5 1 4\n";
    EXPECT_NEAR(signedVolume(read("inside.obj", kCube + inside)), 1, 1e-12);
    EXPECT_NEAR(signedVolume(read("inside.obj", kCube + inside, Orientation::file)), -1, 1e-12);
    EXPECT_NEAR(signedVolume(read("inside.obj", kCube + inside, Orientation::inward)), -1, 1e-12);
    const Mesh mixed = read(
        "mixed.obj",
        std::string(kCube) + "f 1 4 3 2\nf 8 7 6 5\nf 1 2 6 5\nf 6 7 3 2\nf 3 4 8 7\nf 4 1 5 8\n");
    EXPECT_NEAR(signedVolume(mixed), 1, 1e-12);
    EXPECT_EQ(mixed.report.turned, 4u);
}

TEST_F(MeshFile, nonManifoldFacesAreKeptAndCounted)
{
    // A half-edge structure would drop one of three triangles at one edge.
    const Mesh m = read(
        "fin.obj", "v 0 0 0\nv 0 0 1\nv 1 0 0\nv -1 1 0\nv -1 -1 0\nf 1 2 3\nf 1 2 4\nf 1 2 5\n");
    EXPECT_EQ(m.triangles.size(), 3u);
    EXPECT_EQ(m.report.non_manifold_edges, 1u);
    EXPECT_EQ(m.report.non_manifold_faces, 3u);
    EXPECT_NE(m.report.text().find("3 non-manifold faces"), std::string::npos);
}

TEST_F(MeshFile, textureSeamsKeepEachFacesCoordinates)
{
    const Mesh m = read(
        "seam.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nvt 0.25 0.5\nvt 0.75 0.5\nvt 0.5 0.75\n"
        "f 1/1 2/2 3/3\nf 2/4 4/5 3/6\n");
    ASSERT_EQ(m.uv.size(), 2u);
    EXPECT_EQ(m.uv[0][1], Vec2f(1, 0));
    EXPECT_EQ(m.uv[1][0], Vec2f(0.25f, 0.5f));
    EXPECT_EQ(m.uv[1][2], Vec2f(0.5f, 0.75f));
    EXPECT_EQ(m.report.boundary_edges, 4u);
}

TEST_F(MeshFile, offPlyAndStlAreRead)
{
    EXPECT_EQ(read("t.off", "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 1 3 2\n")
                  .triangles.size(),
              2u);
    EXPECT_EQ(
        read(
            "t.ply",
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
            "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
            .triangles.size(),
        1u);
    EXPECT_EQ(
        read(
            "t.stl",
            "solid t\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid t\n")
            .triangles.size(),
        1u);
}

TEST_F(MeshFile, zeroAreaTrianglesAreCounted)
{
    const Mesh m =
        read("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\nf 1 1 4\n");
    EXPECT_GE(m.report.zero_area, 1u);
    for (const Vec3f& n : m.normals) EXPECT_TRUE(std::isfinite(n.length()));
}

TEST_F(MeshFile, wrongFilesAreRefusedWithTheirName)
{
    const auto refuses = [&](const std::string& name, const std::string& text) {
        try {
            readMesh(write(name, text));
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
            return true;
        }
        return false;
    };
    EXPECT_TRUE(refuses("empty.obj", ""));
    EXPECT_TRUE(refuses("noface.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"));
    EXPECT_TRUE(refuses("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"));
    EXPECT_TRUE(refuses("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n"));
    EXPECT_TRUE(refuses("text.ply", "this is not a mesh\n"));
    EXPECT_TRUE(refuses(
        "cut.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n"));
    EXPECT_TRUE(refuses("mesh.gltf", "{}"));
    EXPECT_THROW(readMesh("/nonexistent/mesh.obj"), Error);
    EXPECT_THROW(readMesh("/tmp"), Error);
}

} // namespace
} // namespace volcomp
