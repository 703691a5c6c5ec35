// SPDX-License-Identifier: Apache-2.0
// The surface that boxes stand on: a mesh with what scattering and maps need to know of it.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "volcomp/surface/second_density.h"
#include "volcomp/surface/map_projection.h"
#include "volcomp/surface/mesh.h"
#include "volcomp/surface/surface_walk.h"
#include "volcomp/surface/terrain.h"
#include "volcomp/base/vec.h"
#include "volcomp/base/words.h"

namespace volcomp {

class SurfaceTree;

/// What a skin is made of.
enum class SkinAs {
    mesh,  ///< the surface itself, traced beside the volume
    voxels ///< a thin opaque shell of voxels in the volume, for other programs
};
constexpr Word<SkinAs> kSkinAsWords[] = {{"mesh", SkinAs::mesh}, {"voxels", SkinAs::voxels}};

/// The surface that is seen under what stands on it.
struct SkinSpec {
    std::string material; ///< name of a material of kind surface; empty: no skin
    SkinAs as = SkinAs::mesh;
    Vec3d colour{1.0};           ///< linear RGB
    std::vector<MapFactor> maps; ///< factors on the colour; a mesh is cut out by their alpha

    // Of voxels:
    /// Mean transmittance of the shell under directed extinction, from any side, > 0 and < 1; its
    /// root along the normal under isotropic extinction. The optical depth that a single ray meets
    /// depends on how the voxels lie, and is 0.4 of the mean at least.
    double transmittance = 1e-6;
    double depth = 0; ///< depth of the shell's middle below the surface, voxels
};

/// One [surface.NAME] of the scene.
struct SurfaceSpec {
    std::string name;
    std::filesystem::path mesh; ///< OBJ, PLY, OFF, STL or glTF; empty: `terrain` is used
    TerrainSpec terrain;
    double scale = 1; ///< world units in one unit of the file
    Vec3d move{0.0};  ///< added after the scale, world units
    Orientation orientation = Orientation::outward;
    MapProjection projection;
    SkinSpec skin;

    /// The table as a scene has it, a line "KEY = VALUE" for each key, for recipes; may be empty.
    std::string source;

    /// Throws Error if a value is out of range or not finite.
    void validate() const;
};

/// A place on the surface.
struct SurfacePoint {
    Vec3d position;
    Vec3d normal; ///< unit, interpolated; the triangle's own if the interpolated one vanishes
    Vec2d uv;     ///< by the surface's projection; 0 if that is `uv` and the mesh has none
    std::int32_t triangle = -1;
    double b1 = 0, b2 = 0; ///< weights of the triangle's second and third corner
};

/// The point of a mesh's triangle (0 to the number of them - 1) with these weights of its second
/// and third corner. The mesh is as prepareMesh() leaves it.
SurfacePoint pointOf(const Mesh& mesh, const MapProjection& projection, std::int32_t triangle,
                     double b1, double b2);

/// A mesh or terrain with its projection. All const functions may be called by several threads at a
/// time. World space and world units. It can be moved, but not copied; one that was moved from may
/// only be assigned to or destroyed.
class Surface {
public:
    /// Takes a mesh as prepareMesh() leaves it. `place` names the surface in messages. Throws Error
    /// if no triangle has an area.
    Surface(Mesh mesh, const MapProjection& projection, const std::string& place = "surface");
    ~Surface();
    Surface(Surface&&) noexcept;
    Surface& operator=(Surface&&) noexcept;

    const Mesh& mesh() const { return m_mesh; }
    const MapProjection& projection() const { return m_projection; }
    /// False if maps cannot be looked up: by texture coordinates that the mesh lacks.
    bool hasUv() const { return m_projection.kind != ProjectionKind::uv || !m_mesh.uv.empty(); }
    /// Of the whole surface, square world units.
    double area() const { return m_area.back(); }

    /// The point that has the fraction `f` (0 to 1) of the area before it on a curve through the
    /// whole surface. The curve visits triangles in the order of a kd-tree's leaves, and runs
    /// inside each as Sierpinski's does; so equal intervals of f are pieces of equal area, most of
    /// them compact, and stratified f gives points that cover the surface evenly.
    SurfacePoint atFraction(double f) const;

    /// pointOf() of its mesh.
    SurfacePoint at(std::int32_t triangle, double b1, double b2) const;

    /// Every point of the surface that has this (u,v): where the projection's line meets the
    /// surface, from the projector's side (outside) inward. By texture coordinates: one point in
    /// each triangle that covers (u,v), in the mesh's order; neighbours that share the point give
    /// one.
    std::vector<SurfacePoint> sheets(const Vec2d& uv) const;

    /// The point of the surface that is nearest to `p`.
    SurfacePoint nearest(const Vec3d& p) const;
    /// Texture coordinates of the surface's point near `p` that a walk from `triangle` finds, see
    /// SurfaceWalk; `triangle` becomes that point's. If it is -1, the walk starts at the nearest
    /// point. Only if the projection is `uv` and the mesh has texture coordinates.
    Vec2d uvNear(const Vec3d& p, std::int32_t& triangle) const;

    /// True if the surface cuts the way from `eye` to `p`, its last thousandth excepted.
    bool hides(const Vec3d& eye, const Vec3d& p) const;

    /// Gradients of u and v along the surface, 1 / length. Zero if they are not defined.
    struct UvGradient {
        Vec3d du, dv;
    };
    /// By the texture coordinates of a triangle.
    UvGradient uvGradient(std::int32_t triangle) const;
    /// By the surface's projection; by central differences if that is not `uv`.
    UvGradient uvGradientAt(const SurfacePoint& s) const;

private:
    /// The point of a triangle at a position that lies in it, to rounding.
    SurfacePoint inTriangle(std::int32_t triangle, const Vec3d& position) const;
    std::vector<SurfacePoint> sheetsByMesh(const Vec2d& uv) const;
    Mesh m_mesh;
    MapProjection m_projection;
    std::vector<std::int32_t> m_order; ///< triangles along the curve of atFraction()
    std::vector<double> m_area;        ///< running sum of their areas
    SurfaceWalk m_walk;                ///< empty if m_uv_tree is
    std::unique_ptr<SurfaceTree> m_tree;
    std::unique_ptr<SurfaceTree> m_uv_tree; ///< of the texture coordinates; null if not used
};

/// Reads or makes the mesh of `spec` and prepares it. Throws Error as SurfaceSpec::validate(),
/// readMesh() and makeTerrain() do.
Mesh loadMesh(const SurfaceSpec& spec);

/// The same, indexed. Throws Error as loadMesh() and Surface() do.
Surface loadSurface(const SurfaceSpec& spec);

/// The maps of a skin's colour, for the mesh of `spec`. Without a skin none. Throws Error if they
/// need texture coordinates that the mesh lacks, and as SecondDensity().
SecondDensity loadSkinMaps(const SurfaceSpec& spec, const Mesh& mesh);

/// The colour of a skin at a place of its surface, linear RGB; `maps` are those of `skin`.
Vec3f skinColour(const SkinSpec& skin, const SecondDensity& maps, const SurfacePoint& at);

} // namespace volcomp
