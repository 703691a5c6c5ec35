// SPDX-License-Identifier: Apache-2.0
// Meshes as other programs write them: what is legal is read right.
#include <cmath>
#include <cstring>
#include <fstream>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"
#include "volcomp/base/random.h"
#include "volcomp/surface/mesh.h"
#include "volcomp/surface/mesh_triangulate.h"

namespace volcomp {
namespace {

std::filesystem::path write(const std::string& name, const std::string& text)
{
    const std::filesystem::path file =
        std::filesystem::path(::testing::TempDir()) / ("volcomp_mesh_read_" + name);
    std::ofstream(file, std::ios::binary) << text;
    return file;
}

Mesh read(const std::string& name, const std::string& text)
{
    Mesh m = readMesh(write(name, text));
    prepareMesh(m, 1, Vec3d(0.0), Orientation::outward);
    return m;
}

Vec3d areaVector(const Mesh& m, std::size_t t)
{
    const auto& c = m.triangles[t];
    return (m.points[c[1]] - m.points[c[0]]).cross(m.points[c[2]] - m.points[c[0]]) / 2;
}

double area(const Mesh& m)
{
    double sum = 0;
    for (std::size_t t = 0; t < m.triangles.size(); ++t) sum += areaVector(m, t).length();
    return sum;
}

/// The message of the Error that the file makes; empty if it is read.
std::string refusal(const std::string& name, const std::string& text)
{
    try {
        readMesh(write(name, text));
    } catch (const Error& e) {
        return e.what();
    }
    return "";
}

bool has(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

const char* const kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(MeshObj, aHardEdgeHasTheNormalOfEachFace)
{
    const char* const cube =
        "v 1 -1 -1\nv 1 -1 1\nv -1 -1 1\nv -1 -1 -1\nv 1 1 -1\nv 1 1 1\nv -1 1 1\nv -1 1 -1\n"
        "vn 0 -1 0\nvn 0 1 0\nvn 1 0 0\nvn 0 0 1\nvn -1 0 0\nvn 0 0 -1\n"
        "f 2//1 3//1 4//1 1//1\nf 8//2 7//2 6//2 5//2\nf 5//3 6//3 2//3 1//3\n"
        "f 6//4 7//4 3//4 2//4\nf 3//5 7//5 8//5 4//5\nf 5//6 1//6 4//6 8//6\n";
    const Mesh m = read("hard.obj", cube);
    ASSERT_EQ(m.triangles.size(), 12u);
    EXPECT_EQ(m.report.vertices, 8u);
    EXPECT_EQ(m.report.boundary_edges, 0u);
    EXPECT_EQ(m.report.parts, 1u);
    EXPECT_EQ(m.points.size(), 24u); // three normals at each of eight places
    for (std::size_t t = 0; t < 12; ++t)
        for (const std::int32_t p : m.triangles[t])
            EXPECT_NEAR(Vec3d(m.normals[p]).dot(areaVector(m, t).unit()), 1, 1e-6) << t;
    // Turned round, with the normals of its file.
    Mesh inward = readMesh(write("hard.obj", cube));
    prepareMesh(inward, 1, Vec3d(0.0), Orientation::inward);
    for (std::size_t t = 0; t < 12; ++t)
        for (const std::int32_t p : inward.triangles[t])
            EXPECT_NEAR(Vec3d(inward.normals[p]).dot(areaVector(inward, t).unit()), 1, 1e-6);
}

TEST(MeshObj, cornersWithoutNormalGetOne)
{
    const Mesh m = read("some.obj",
                        std::string(kSquare)
                            + "v 2 0 0\nv 2 1 0\nvn 0 0.6 0.8\n"
                              "f 1//1 2//1 3//1 4//1\nf 2 5 6 3\n");
    ASSERT_EQ(m.triangles.size(), 4u);
    for (const std::int32_t p : m.triangles[0]) EXPECT_NEAR(m.normals[p][1], 0.6, 1e-6);
    for (const std::int32_t p : m.triangles[3]) EXPECT_NEAR(m.normals[p][2], 1, 1e-6);
    // Equal values under two numbers are one normal.
    EXPECT_EQ(
        read("twice.obj",
             std::string(kSquare) + "vn 0 0 1\nvn 0 0 2\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n")
            .points.size(),
        4u);
}

TEST(MeshObj, concaveFacesKeepTheirArea)
{
    const char* const c =
        "v 0 0 0\nv 3 0 0\nv 3 1 0\nv 1 1 0\nv 1 2 0\nv 3 2 0\nv 3 3 0\nv 0 3 0\n";
    EXPECT_NEAR(area(read("c.obj", c + std::string("f 1 2 3 4 5 6 7 8\n"))), 7, 1e-12);
    const Mesh back = read("c.obj", c + std::string("f 8 7 6 5 4 3 2 1\n"));
    EXPECT_NEAR(area(back), 7, 1e-12);
    for (std::size_t t = 0; t < back.triangles.size(); ++t) EXPECT_LT(areaVector(back, t)[2], 0);
    for (const char* face : {"f 1 2 3 4\n", "f 2 3 4 1\n", "f 3 4 1 2\n", "f 4 1 2 3\n"})
        EXPECT_NEAR(
            area(read("dart.obj", std::string("v 0 0 0\nv 2 1 0\nv 0 2 0\nv 1 1 0\n") + face)), 1,
            1e-12);
    // A wall of 4 x 3 with a window of 1 x 1, cut open from corner to corner.
    EXPECT_NEAR(area(read("wall.obj",
                          "v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nv 1 1 0\nv 1 2 0\nv 2 2 0\nv 2 1 0\n"
                          "f 1 2 3 4 1 5 6 7 8 5\n")),
                11, 1e-12);
}

TEST(MeshObj, aStarOf2000CornersOnASlopeKeepsItsArea)
{
    // By the shoelace formula in the plane of the star, turned to a slope.
    const int n = 2000;
    std::string text, face = "f";
    double flat = 0;
    const auto corner = [&](int i) {
        const double r = i % 2 ? 1 : 3 + std::sin(i * 0.1), a = 2 * kPi * i / n;
        return Vec2d(r * std::cos(a), r * std::sin(a));
    };
    for (int i = 0; i < n; ++i) {
        const Vec2d p = corner(i), q = corner((i + 1) % n);
        flat += (p[0] * q[1] - p[1] * q[0]) / 2;
        text += "v " + std::to_string(p[0]) + " " + std::to_string(0.6 * p[1]) + " "
            + std::to_string(0.8 * p[1]) + "\n";
        face += " " + std::to_string(i + 1);
    }
    const Mesh m = read("star.obj", text + face + "\n");
    EXPECT_EQ(m.triangles.size(), n - 2u);
    EXPECT_NEAR(area(m), flat, 1e-4 * flat);
}

TEST(MeshObj, facesThatCrossThemselvesWarn)
{
    const Mesh m = read("crossed.obj",
                        "v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 2 0\nv -1 1 0\nv 5 1 0.5\nf 1 2 3 4 5 6\n");
    ASSERT_EQ(m.report.warnings.size(), 1u);
    EXPECT_TRUE(has(m.report.warnings[0], "crossed.obj: 1 of 1 faces cross themselves"));
    EXPECT_EQ(m.triangles.size(), 4u);
    // One that goes round twice.
    EXPECT_EQ(read("round.obj", "v 0 0 0\nv 3 0 0\nv 1 1 0\nv 0 3 0\nf 1 2 3 4 1 2 3 4\n")
                  .report.warnings.size(),
              1u);
    // Faces without area, of one place or on a line, are no fault of the reader.
    EXPECT_EQ(read("line.obj",
                   "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 4 0 0\nv 4 4 0\n"
                   "f 1 2 3 4 5\nf 1 1 1 1 1\nf 1 5 6\n")
                  .report.zero_area,
              6u);
}

TEST(MeshObj, facesWithoutTextureCoordinatesAreCountedAndDoNotSmear)
{
    const Mesh m = read("mix.obj",
                        std::string(kSquare)
                            + "v 2 0 0\nv 2 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
                              "vt 0 1\nf 1/1 2/2 3/3 4/4\nf 2 5 6 3\n");
    ASSERT_EQ(m.report.warnings.size(), 1u);
    EXPECT_TRUE(has(m.report.warnings[0], "mix.obj: 1 of 2 faces has no texture coordinates"));
    ASSERT_EQ(m.uv.size(), 4u);
    EXPECT_EQ(m.uv[0][1], Vec2f(1, 0));
    for (const std::size_t t : {2, 3})
        for (const Vec2f& x : m.uv[t]) EXPECT_EQ(x, Vec2f(0, 0));
    EXPECT_FALSE(read("none.obj", std::string(kSquare) + "f 1 2 3 4\n").report.has_uv);
}

TEST(MeshObj, everyLegalSpellingIsRead)
{
    const std::string square = kSquare;
    for (const std::string& text :
         {square + "f 1 2 3 4", // no line end at the end
          square + "f 1 2 3 4 # a comment\n", square + "f 1 2 3#comment\nf 1 3 4\n",
          square + "f 1 \\\n2 3\\\n 4\n", square + "f 1 \\\r\n2 3 4\r\n",
          square + "f -4 -3 -2 -1\n", "f 1 2 3 4\n" + square, square + "f +1 2 3 4\n",
          std::string("v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\r\nv 0 1 0\r\nf 1 2 3 4\r\n"),
          std::string("v 0 0 0\rv 1 0 0\rv 1 1 0\rv 0 1 0\rf 1 2 3 4\r"),
          std::string("\tv\t0 0\t0\n  v 1.0E+0 0e-400 +0.\nv 100e-2 .1e1 0\nv 0 1 0 # top\n\n"
                      "f  1\t2 3  4  \n"),
          std::string("v 0 0 0 1\nv 1 0 0 1.0\nv 1 1 0 1\nv 0 1 0 1\nf 1 2 3 4\n"),
          std::string("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nf 1 2 3 4\n"),
          square + "vt 0\nvt 1 0 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n",
          square + "vn 0 0 1\nf 1//1 2//1 3//1 4//1\n", square + "f 1/ 2/ 3/ 4//\n",
          square + "o a\ng b c\ns off\nusemtl x\nmtllib missing.mtl\nl 1 2 3\np 1\nf 1 2 3 4\n"}) {
        const Mesh m = read("legal.obj", text);
        EXPECT_EQ(m.triangles.size(), 2u) << text;
        EXPECT_NEAR(area(m), 1, 1e-12) << text;
        EXPECT_TRUE(m.report.warnings.empty()) << text;
    }
    const Mesh odd = read("odd.obj", square + "teapot 3\nf 1 2\nf 1 2 3 4\n");
    ASSERT_EQ(odd.report.warnings.size(), 2u);
    EXPECT_TRUE(has(odd.report.warnings[0], "1 statements like 'teapot' in line 5"));
    EXPECT_TRUE(has(odd.report.warnings[1], "1 faces of fewer than three corners"));
}

TEST(MeshObj, coordinatesKeepADoublesDigits)
{
    const char* const square = "v 587432.125 4477123.250 0\nv 587432.725 4477123.250 0\n"
                               "v 587432.725 4477123.850 0\nv 587432.125 4477123.850 0\n";
    EXPECT_NEAR(area(read("utm.obj", square + std::string("f 1 2 3 4\n"))), 0.36, 1e-8);
    EXPECT_NEAR(area(read("utm.off",
                          "OFF 4 1 4\n587432.125 4477123.250 0\n587432.725 4477123.250 0\n"
                          "587432.725 4477123.850 0\n587432.125 4477123.850 0\n4 0 1 2 3\n")),
                0.36, 1e-8);
    Mesh moved = readMesh(write("utm.obj", square + std::string("f 1 2 3 4\n")));
    prepareMesh(moved, 1, Vec3d(-587432.125, -4477123.25, 0), Orientation::outward);
    EXPECT_NEAR(moved.points[2][0], 0.6, 1e-9);
    EXPECT_NEAR(moved.points[2][1], 0.6, 1e-9);
}

TEST(MeshObj, partsMaterialsAndTexturesAreNamed)
{
    const std::filesystem::path mtl =
        write("house.mtl",
              "newmtl brick # red\nKd 1 0 0\nmap_Kd -s 2 2 2 -clamp on maps\\red wall.png\n"
              "newmtl tiles\nmap_Kd roof.png\n");
    const Mesh m =
        read("house.obj",
             std::string(kSquare) + "mtllib " + mtl.filename().string()
                 + "\nf 1 2 3\no house\ng walls\nusemtl brick\nf 1 2 3 4\nf 4 3 2\ng roof\n"
                   "usemtl tiles\n"
                   "f 1 3 4\nusemtl none\nusemtl brick\nf 2 3 4\n");
    ASSERT_EQ(m.materials.size(), 3u);
    EXPECT_EQ(m.materials[0].name, "brick");
    EXPECT_EQ(m.materials[0].texture, mtl.parent_path() / "maps/red wall.png");
    EXPECT_EQ(m.materials[1].texture, mtl.parent_path() / "roof.png");
    EXPECT_TRUE(m.materials[2].texture.empty());
    ASSERT_EQ(m.parts.size(), 4u);
    const struct {
        const char* name;
        std::int32_t material;
        std::size_t first, end;
    } expected[] = {
        {"", -1, 0, 1}, {"house/walls", 0, 1, 4}, {"house/roof", 1, 4, 5}, {"house/roof", 0, 5, 6}};
    for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_EQ(m.parts[k].name, expected[k].name);
        EXPECT_EQ(m.parts[k].material, expected[k].material);
        EXPECT_EQ(m.parts[k].first, expected[k].first);
        EXPECT_EQ(m.parts[k].end, expected[k].end);
    }
}

TEST(MeshObj, aFaceOfTooManyCornersIsRefusedOnlyIfItIsConcave)
{
    for (const bool convex : {true, false}) {
        const int n = static_cast<int>(kMostConcaveCorners) + 2;
        std::string text, face = "f";
        for (int i = 0; i < n; ++i) {
            const double a = 2 * kPi * i / n, r = convex || i % 2 ? 1e6 : 1e5;
            text += "v " + std::to_string(r * std::cos(a)) + " " + std::to_string(r * std::sin(a))
                + " 0\n";
            face += " " + std::to_string(i + 1);
        }
        const std::string message = refusal("many.obj", text + face + "\n");
        EXPECT_EQ(has(message, "many.obj: expected concave faces of up to 20000 corners"), !convex)
            << message;
    }
}

TEST(MeshObj, aLongNameIsNotRepeatedWhole)
{
    // A megabyte for each of 20000 parts would be 20 GB.
    std::string text = kSquare + ("o " + std::string(1 << 20, 'x') + "\n");
    for (int k = 0; k < 10000; ++k) text += "g a\nf 1 2 3\ng b\nf 1 3 4\n";
    const Mesh m = readMesh(write("name.obj", text));
    EXPECT_EQ(m.parts.size(), 20000u);
    EXPECT_LT(m.parts[0].name.size(), 1000u);
}

// --------------------------------------------------------------------------------------- PLY

/// A PLY of the unit square with these lines between its vertices and its end.
std::string ply(const std::string& vertex_properties, const std::string& face_properties,
                const std::string& body)
{
    return "ply\nformat ascii 1.0\ncomment made by hand\nobj_info 1\nelement vertex 4\n"
        + vertex_properties + "element face 1\n" + face_properties + "end_header\n" + body;
}
const char* const kXyz = "property float x\nproperty float y\nproperty float z\n";
const char* const kCorners = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

TEST(MeshPly, facePropertiesOfAnyOrderAndTypeAreRead)
{
    for (const auto& [properties, face] : std::vector<std::pair<std::string, std::string>>{
             {"property list uchar int vertex_indices\n", "4 0 1 2 3\n"},
             {"property list uchar uint vertex_index\n", "4 0 1 2 3"},
             {"property list ushort int32 vertex_index\n", "4 0 1 2 3\n"},
             {"property list int uint8 vertex_index\n", "4\n0 1\n2 3\n"},
             {"property uchar material\nproperty list uchar int vertex_indices\n", "7 4 0 1 2 3\n"},
             {"property list uchar int vertex_indices\nproperty uchar red\nproperty double q\n",
              "4 0 1 2 3 255 nan\n"},
             {"property list uint8 float weights\nproperty list uchar int vertex_indices\n",
              "2 0.5 1 4 0 1 2 3\n"}}) {
        const Mesh m = read("face.ply", ply(kXyz, properties, kCorners + face));
        EXPECT_NEAR(area(m), 1, 1e-12) << properties;
        EXPECT_FALSE(m.report.has_uv);
    }
    const std::string edges =
        "ply\r\nformat ascii 1.0\r\nelement edge 1\r\nproperty int vertex1\r\n"
        "property int vertex2\r\n"
        "element face 1\r\nproperty list uchar int vertex_index\r\nelement none 900000000000\r\n"
        "element vertex 3\r\nproperty double z\r\nproperty list uchar int ring\r\n"
        "property double y\r\nproperty float64 x\r\nend_header\r\n0 1\r\n3 0 1 2\r\n"
        "0 0 0 0\r\n0 2 8 9 0 1\r\n0 0 1 0\r\n";
    EXPECT_NEAR(area(read("edges.ply", edges)), 0.5, 1e-12);
}

TEST(MeshPly, textureCoordinatesOfVerticesHaveAnyOfTheirNames)
{
    for (const char* names : {"u v", "s t", "texture_u texture_v", "texture_s texture_t"}) {
        const std::string u(names, std::strchr(names, ' ')), v(std::strchr(names, ' ') + 1);
        const Mesh m =
            read("uv.ply",
                 ply(kXyz + ("property float " + u + "\nproperty float " + v + "\n"),
                     "property list uchar int vertex_indices\n",
                     "0 0 0 0 0\n1 0 0 0.5 0\n1 1 0 0.5 0.25\n0 1 0 0 0.25\n4 0 1 2 3\n"));
        ASSERT_EQ(m.uv.size(), 2u) << names;
        EXPECT_EQ(m.uv[0][2], Vec2f(0.5f, 0.25f));
        EXPECT_EQ(m.uv[1][2], Vec2f(0, 0.25f));
    }
}

/// Appends the bytes of a value, in the order that a file of this kind has them.
template <class T>
void put(std::string& bytes, T value, bool big)
{
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes += raw[big ? sizeof(T) - 1 - i : i];
}

TEST(MeshPly, textureCoordinatesOfCornersAreReadFromTextAndBytes)
{
    const std::string header = " 1.0\ncomment TextureFile a.png\ncomment TextureFile b b.png\n"
                               "element vertex 4\nproperty double x\nproperty double y\n"
                               "property float z\nproperty uchar red\nelement face 2\n"
                               "property list uchar int vertex_indices\n"
                               "property list uchar float texcoord\nproperty int texnumber\n"
                               "property short flags\nend_header\n";
    const int corner[2][3] = {{0, 1, 2}, {0, 2, 3}};
    const double place[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    std::string text = "ply\nformat ascii" + header;
    for (const auto& p : place)
        text += std::to_string(4e6 + p[0]) + " " + std::to_string(p[1]) + " 0 255\n";
    text += "3 0 1 2 6 0 0 0.5 0 0.5 0.25 1 -1\n3 0 2 3 6 0 0 0.5 0.25 0 0.75 0 7\n";
    std::vector<std::pair<std::string, std::string>> files = {{"corner.ply", text}};
    for (const bool big : {false, true}) {
        std::string bytes =
            std::string("ply\nformat binary_") + (big ? "big" : "little") + "_endian" + header;
        for (const auto& p : place) {
            put(bytes, 4e6 + p[0], big), put(bytes, p[1], big), put(bytes, 0.0f, big);
            bytes += '\r'; // a byte that could be taken for a line's end
        }
        const float uv[2][6] = {{0, 0, 0.5f, 0, 0.5f, 0.25f}, {0, 0, 0.5f, 0.25f, 0, 0.75f}};
        for (int f = 0; f < 2; ++f) {
            bytes += '\3';
            for (const int c : corner[f]) put(bytes, c, big);
            bytes += '\6';
            for (const float x : uv[f]) put(bytes, x, big);
            put(bytes, 1 - f, big), put(bytes, std::int16_t(-1), big);
        }
        files.emplace_back(big ? "big.ply" : "little.ply", bytes);
    }
    for (const auto& [name, content] : files) {
        const Mesh m = read(name, content);
        ASSERT_EQ(m.triangles.size(), 2u) << name;
        EXPECT_NEAR(area(m), 1, 1e-9);
        ASSERT_EQ(m.uv.size(), 2u);
        EXPECT_EQ(m.uv[0][2], Vec2f(0.5f, 0.25f));
        EXPECT_EQ(m.uv[1][2], Vec2f(0, 0.75f));
        ASSERT_EQ(m.parts.size(), 2u);
        EXPECT_EQ(m.materials.at(m.parts[0].material).texture.filename(), "b b.png");
        EXPECT_EQ(m.materials.at(m.parts[1].material).texture.filename(), "a.png");
        EXPECT_EQ(m.parts[1].first, 1u);
    }
}

TEST(MeshPly, normalsOfVerticesAreKept)
{
    const Mesh m = read("normals.ply",
                        ply(kXyz
                                + std::string("property float nx\nproperty float ny\n"
                                              "property float nz\n"),
                            "property list uchar int vertex_indices\n",
                            "0 0 0 0 3 4\n1 0 0 0 3 4\n1 1 0 0 3 4\n0 1 0 0 3 4\n4 0 1 2 3\n"));
    EXPECT_EQ(m.points.size(), 4u);
    EXPECT_FALSE(m.report.normals_computed);
    for (const Vec3f& n : m.normals) EXPECT_NEAR(n[1], 0.6, 1e-6);
}

// --------------------------------------------------------------------------------- OFF, STL

TEST(MeshOff, kindsCommentsAndColoursAreRead)
{
    const std::string corners = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n", face = "4 0 1 2 3";
    for (const std::string& text :
         {"OFF\n4 1 0\n" + corners + face, "OFF 4 1 0\n" + corners + face + " 255 0 0\n",
          "# made\nOFF # here\n# counts\n4 1 4\n\n" + corners + "# face\n" + face + " 3\n",
          "4 1 0\n" + corners + face + "\n", "OFF\n4 1\n" + corners + face + "\n",
          "OFF\r\n4 1 0\r\n0 0 0\r\n1 0 0\r\n1 1 0\r\n0 1 0\r\n" + face + "\r\n",
          "OFF\n4 1 0\n0 0 0\n1 0 0 1 1 0 0 1 0\n" + face + " 0.5 0.5 0.5\n",
          std::string("OFF\n4 1 0\n0 0 0 9 9 9\n1 0 0 9 9 9\n1 1 0 9 9 9\n0 1 0 9 9 9\n") + face,
          std::string("COFF\n4 1 0\n0 0 0 255 0 0\n1 0 0 255 0 0\n1 1 0 0 0 0 255\n0 1 0 1 1 1\n")
              + face,
          std::string("COFF 4 1 0 0 0 0 .1 .1 .1 1 1 0 0 .1 .1 .1 1\n1 1 0 .1 .1 .1 1 ")
              + "0 1 0 .1 .1 .1 1 4 0 1 2 3\n"}) {
        const Mesh m = read("kind.off", text);
        EXPECT_EQ(m.triangles.size(), 2u) << text;
        EXPECT_NEAR(area(m), 1, 1e-12) << text;
        EXPECT_TRUE(m.report.normals_computed) << text;
    }
    const Mesh n = read("n.off", "NOFF\n3 1 0\n0 0 0 0 3 4\n1 0 0 0 3 4\n0 1 0 0 3 4\n3 0 1 2\n");
    for (const Vec3f& v : n.normals) EXPECT_NEAR(v[2], 0.8, 1e-6);
    const Mesh st = read("st.off",
                         "STCNOFF\n3 1 0\n0 0 0 0 0 1 1 0 0 1 0 0\n"
                         "1 0 0 0 0 1 1 0 0 1 0.5 0\n0 1 0 0 0 1 1 0 0 1 0 0.25\n3 0 1 2\n");
    ASSERT_EQ(st.uv.size(), 1u);
    EXPECT_EQ(st.uv[0][1], Vec2f(0.5f, 0));
    EXPECT_EQ(st.uv[0][2], Vec2f(0, 0.25f));
    EXPECT_TRUE(has(refusal("b.off", "OFF BINARY\n"), "a binary OFF, which is not supported"));
    EXPECT_TRUE(has(refusal("4.off", "4OFF\n1 1 1\n"), "'4OFF', which is not supported"));
}

TEST(MeshStl, textAndBytesOfATetrahedronAreClosed)
{
    const float p[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    std::string text = "SOLID two words\n", bytes(80, ' ');
    bytes.replace(0, 5, "solid"); // binary files may begin so
    put(bytes, std::uint32_t(4), false);
    for (const auto& f : faces) {
        text += "\tfacet normal 0 nan 0\n outer loop\n";
        for (int i = 0; i < 3; ++i) put(bytes, std::nanf(""), false);
        for (const int c : f) {
            text += "  Vertex";
            for (const float x : p[c]) text += " " + std::to_string(x), put(bytes, x, false);
            text += "\r\n";
        }
        text += "endloop endfacet\n";
        put(bytes, std::uint16_t(0), false);
    }
    text += "endsolid two words\n";
    for (const Mesh& m : {read("text.stl", text), read("bytes.stl", bytes),
                          read("more.stl", bytes + "behind the facets")}) {
        EXPECT_EQ(m.points.size(), 4u);
        EXPECT_EQ(m.triangles.size(), 4u);
        EXPECT_EQ(m.report.boundary_edges, 0u);
        EXPECT_NEAR(area(m), 1.5 + std::sqrt(3) / 2, 1e-6);
    }
    EXPECT_EQ(read("text.stl", text).parts.at(0).name, "two words");
    EXPECT_EQ(read("text.stl", text + text).parts.size(), 1u); // equal names in succession are one
}

// ------------------------------------------------------------------------------------ damaged

TEST(MeshDamaged, everyDamagedFileIsRefusedAndNamed)
{
    const std::string ply_head = "ply\nformat ascii 1.0\nelement vertex 3\n" + std::string(kXyz)
        + "element face 1\nproperty list uchar int vertex_indices\n";
    const std::string three = "0 0 0\n1 0 0\n0 1 0\n", v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    std::string list = ply_head + "end_header\n";
    list.replace(list.find("ascii"), 5, "binary_little_endian");
    list.replace(list.find("list uchar"), 10, "list int  ");
    for (int i = 0; i < 9; ++i) put(list, 1.0f, false);
    put(list, std::int32_t(-5), false), put(list, 7, false);
    const struct {
        const char* name;
        std::string text;
        const char* part; ///< of the message
    } files[] = {
        {"slash.obj", "f /1", "line 1"},
        {"zero.obj", v + "f 0 1 2\n", "line 4"},
        {"range.obj", v + "f 1 2 9\n", "face 1"},
        {"back.obj", v + "f -1 -2 -4\n", "line 4"},
        {"vt.obj", v + "f 1/1 2/2 3/3\n", "texture coordinates"},
        {"vn.obj", v + "vn 0 0 1\nf 1//1 2//2 3//3\n", "normals"},
        {"wide.obj", v + "f 1 2 4294967299\n", "4294967299"},
        {"widest.obj", v + "f 1 2 99999999999999999999\n", "99999999999999999999"},
        {"nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "line 1"},
        {"inf.obj", "v 0 0 0\nv 1e999 0 0\nv 0 1 0\nf 1 2 3\n", "'1e999'"},
        {"comma.obj", "v 1,5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "'1,5'"},
        {"short.obj", "v 1 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a number for z"},
        {"uv.obj", v + "vt nan 0\nf 1/1 2/1 3/1\n", "line 4"},
        {"curve.obj", v + "cstype bezier\nsurf 0 1 0 1 1 2 3\n", "free-form"},
        {"zeros.obj", std::string(1000, '\0'), "no such face"},
        {"format.ply", "ply\nformat asc", "'asc'"},
        {"cut.ply", "ply\nformat ascii 1.0\nelement v", "cut.ply"},
        {"bare.ply", "ply\nformat binary_big_endian 1.0\nelement ver", "bare.ply"},
        {"line.ply", "ply\nformat ascii 1.0\nfoo\n", "'foo'"},
        {"early.ply", "ply\nformat ascii 1.0\nproperty float x\n", "an element before"},
        {"open.ply", ply_head, "end_header"},
        {"type.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\n", "'half'"},
        {"many.ply",
         "ply\nformat ascii 1.0\nelement vertex 9000000000000000000\n" + std::string(kXyz)
             + "element face 1\nproperty list uchar int vertex_index\nend_header\n" + three,
         "of element 'vertex'"},
        {"minus.ply", "ply\nformat ascii 1.0\nelement vertex -1\n", "'-1'"},
        {"less.ply", ply_head + "end_header\n0 0 0\n1 0 0\n", "less.ply"},
        {"index.ply", ply_head + "end_header\n" + three + "3 0 1 3\n", "face 1"},
        {"below.ply", ply_head + "end_header\n" + three + "3 0 1 -1\n", "line 13"},
        {"nan.ply", ply_head + "end_header\n0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n", "vertex 0"},
        {"word.ply", ply_head + "end_header\n" + three + "3 0 one 2\n", "'one'"},
        {"list.ply", list, "vertex_indices"},
        {"strips.ply",
         "ply\nformat ascii 1.0\nelement vertex 3\n" + std::string(kXyz)
             + "element tristrips 1\nproperty list int int vertex_indices\nend_header\n" + three
             + "3 0 1 2\n",
         "strips of triangles are not supported"},
        {"points.ply",
         "ply\nformat ascii 1.0\nelement vertex 3\n" + std::string(kXyz) + "end_header\n" + three,
         "Points alone"},
        {"xy.ply",
         "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
         "element face 1\nproperty list uchar int vertex_index\nend_header\n0 0\n3 0 0 0\n",
         "properties x, y and z"},
        {"zeros.off", std::string("OFF\0|", 5), "zeros.off"},
        {"vertices.off", "OFF\n1000000000000 1 0\n" + three + "3 0 1 2\n", "number of vertices"},
        {"faces.off", "OFF\n3 2147483647 0\n" + three + "3 0 1 2\n", "number of faces"},
        {"minus.off", "OFF\n-1 1 0\n" + three + "3 0 1 2\n", "number of vertices"},
        {"corners.off", "OFF\n3 1 0\n" + three + "2147483647 0 1 2\n", "number of corners"},
        {"degree.off", "OFF\n3 1 0\n" + three + "-3 0 1 2\n", "line 6"},
        {"range.off", "OFF\n3 1 0\n" + three + "3 0 1 3\n", "from 0 to 2"},
        {"none.off", "OFF\n0 1 0\n3 0 0 0\n", "none.off"},
        {"text.off", "this is not a mesh\n", "'this'"},
        {"cut.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0", "line 5"},
        {"open.stl", "solid a\n", "endsolid"},
        {"word.stl", "solid a\nface\nendsolid\n", "'face'"},
        {"bytes.stl", std::string(83, '\0'), "83 bytes"},
        {"many.stl", std::string(80, '\0') + "\xff\xff\xff\xff" + std::string(50, '\0'),
         "room for 1"},
        {"none.stl", std::string(84, '\0'), "no such face"},
        {"scene.fbx", "Kaydara", "Convert it to OBJ or PLY"},
    };
    for (const auto& f : files) {
        const std::string message = refusal(f.name, f.text);
        EXPECT_TRUE(has(message, f.name)) << f.name << ": " << message;
        EXPECT_TRUE(has(message, f.part)) << f.name << ": " << message;
    }
    // A file that is cut anywhere is read, with fewer faces, or refused.
    for (std::size_t n = 0; n < list.size(); ++n)
        EXPECT_FALSE(refusal("cut_anywhere.ply", list.substr(0, n)).empty()) << n;
}

TEST(Triangulate, randomPolygonsAndCombsEnd)
{
    std::vector<std::array<std::int32_t, 3>> triangles;
    for (const int n : {5, 7, 9, 51, 3001}) {
        std::vector<Vec3d> random, comb;
        Random r(7);
        for (int i = 0; i < n; ++i) {
            random.emplace_back(r.symmetric(), r.symmetric(), r.symmetric());
            comb.emplace_back(i, i % 2 ? 1e6 : 0, 0);
        }
        triangles.clear();
        triangulate(random, triangles);
        EXPECT_LE(triangles.size(), n - 2u);
        comb.emplace_back(n / 2.0, -1, 0);
        triangles.clear();
        EXPECT_EQ(triangulate(comb, triangles), Cut::whole);
        EXPECT_EQ(triangles.size(), n - 1u);
    }
}

} // namespace
} // namespace volcomp
