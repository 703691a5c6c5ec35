// SPDX-License-Identifier: Apache-2.0
// Meshes that several tests trace as skins.
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "volcomp/base/interval.h"
#include "volcomp/render/skin/skin_tracer.h"

namespace volcomp {

/// A square of edge `size` around `middle`, across `normal` (unit), with texture coordinates 0
/// to 1.
inline Mesh squareMesh(const Vec3d& middle, const Vec3d& normal, double size)
{
    const Vec3d a = normal.cross(std::abs(normal[1]) < 0.9 ? Vec3d(0, 1, 0) : Vec3d(0, 0, 1)).unit()
        * (-0.5 * size),
                b = normal.cross(a);
    Mesh m;
    m.points = {middle - a - b, middle + a - b, middle + a + b, middle - a + b};
    m.triangles = {{0, 1, 2}, {0, 2, 3}};
    m.normals.assign(4, Vec3f(normal));
    m.uv = {{Vec2f(0, 0), Vec2f(1, 0), Vec2f(1, 1)}, {Vec2f(0, 0), Vec2f(1, 1), Vec2f(0, 1)}};
    return m;
}

/// A ball of triangles whose corners and normals are those of a sphere; `rings` from pole to pole.
inline Mesh ballMesh(const Vec3d& centre, double radius, int rings)
{
    Mesh m;
    const int sides = 2 * rings;
    for (int i = 0; i <= rings; ++i)
        for (int j = 0; j < sides; ++j) {
            const double polar = kPi * i / rings, turn = 2 * kPi * j / sides;
            const Vec3d n(std::sin(polar) * std::cos(turn), std::cos(polar),
                          std::sin(polar) * std::sin(turn));
            m.points.push_back(centre + n * radius);
            m.normals.emplace_back(n);
        }
    for (int i = 0; i < rings; ++i)
        for (int j = 0; j < sides; ++j) {
            const int k = (j + 1) % sides, a = i * sides + j, b = i * sides + k, c = a + sides,
                      d = b + sides;
            if (i > 0) m.triangles.push_back({a, b, d});
            if (i < rings - 1) m.triangles.push_back({a, d, c});
        }
    return m;
}

/// A material of a wall: alpha 0.8, without specular light.
inline Material wallMaterial(double alpha = 0.8, double beta = 0)
{
    Material m;
    m.name = "wall";
    m.kind = MaterialKind::surface;
    m.alpha = alpha;
    m.beta = beta;
    return m;
}

/// One mesh as a skin.
inline SkinMesh skinMesh(Mesh mesh, const Material& material = wallMaterial(),
                         const Vec3d& colour = Vec3d(1.0), const std::vector<MapFactor>& maps = {})
{
    SkinSpec spec;
    spec.material = material.name;
    spec.colour = colour;
    spec.maps = maps;
    return {"surface",
            std::make_shared<const Mesh>(std::move(mesh)),
            MapProjection{},
            spec,
            SecondDensity(maps, true),
            material};
}

inline std::unique_ptr<SkinTracer> tracerOf(SkinMesh mesh)
{
    std::vector<SkinMesh> meshes;
    meshes.push_back(std::move(mesh));
    return std::make_unique<SkinTracer>(std::move(meshes));
}

} // namespace volcomp
