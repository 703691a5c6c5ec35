// The surface that boxes stand on: a mesh with areas, frames and the ways maps fall on it.
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

namespace volcomp {

class SurfaceTree;

/// The surface itself as an opaque thin shell of voxels, so that nobody sees through the fur.
struct SkinSpec {
    std::string material;        ///< of kind surface; empty: no skin
    Vec3d colour{1.0};           ///< linear RGB
    std::vector<MapFactor> maps; ///< multiply the colour
    double transmittance = 1e-6; ///< along the normal, in the mean, > 0 and < 1; where voxels lie
                                 ///< awkwardly one ray may meet 0.4 of that optical depth
    double depth = 0;            ///< of the shell's middle below the surface, voxels
};

/// One [surface.NAME] of the scene.
struct SurfaceSpec {
    std::string name;
    std::filesystem::path mesh; ///< OBJ, PLY, OFF or STL; empty: terrain
    TerrainSpec terrain;
    double scale = 1; ///< world units in one unit of the file
    Vec3d move{0.0};  ///< added after the scale
    Orientation orientation = Orientation::outward;
    MapProjection projection;
    SkinSpec skin;

    void validate() const;
};

/// A place on the surface.
struct SurfacePoint {
    Vec3d position;
    Vec3d normal; ///< unit, interpolated; the face's own where the interpolated one vanishes
    Vec2d uv;     ///< by the surface's projection; 0 where it is `uv` and the mesh has none
    std::int32_t triangle = -1;
    double b1 = 0, b2 = 0; ///< weights of the triangle's second and third corner
};

/// A mesh or terrain with its projection: where boxes stand and maps fall.
class Surface {
public:
    /// Takes a mesh as prepareMesh() leaves it. Throws Error where no triangle has an area. `place`
    /// names the surface in messages.
    Surface(Mesh mesh, const MapProjection& projection, const std::string& place = "surface");
    ~Surface();
    Surface(Surface&&) noexcept;

    const Mesh& mesh() const { return m_mesh; }
    const MapProjection& projection() const { return m_projection; }
    bool hasUv() const { return m_projection.kind != ProjectionKind::uv || !m_mesh.uv.empty(); }
    double area() const { return m_area.back(); }

    /// The point where the fraction `f` (0 to 1) of the area lies before it, along a curve that
    /// stays together: triangles are ordered as leaves of a kd-tree, and Sierpinski's curve runs
    /// inside each. So equal intervals of f are pieces of equal area, most of them compact:
    /// stratified f gives points that cover the surface evenly.
    SurfacePoint atFraction(double f) const;

    /// A point by its triangle and weights; normal and (u,v) filled in.
    SurfacePoint at(std::int32_t triangle, double b1, double b2) const;

    /// Where the line of (u,v) meets the surface: every sheet, from the projector's side (outside)
    /// inward. By texture coordinates: every triangle that covers (u,v), in the mesh's order.
    std::vector<SurfacePoint> sheets(const Vec2d& uv) const;

    /// The nearest point of the surface.
    SurfacePoint nearest(const Vec3d& p) const;
    /// Texture coordinates of the surface's point near `p` that a walk from `triangle` finds
    /// (SurfaceWalk); moves `triangle` there. From -1 it starts at the nearest point of all. Only
    /// by texture coordinates, and where the mesh has them.
    Vec2d uvNear(const Vec3d& p, std::int32_t& triangle) const;

    /// True where the surface cuts the way from `eye` to `p` before the last thousandth of it.
    bool hides(const Vec3d& eye, const Vec3d& p) const;

    /// Gradients of u and v along the surface, 1/length. Zero where undefined.
    struct UvGradient {
        Vec3d du, dv;
    };
    UvGradient uvGradient(std::int32_t triangle) const;   ///< of the texture coordinates
    UvGradient uvGradientAt(const SurfacePoint& s) const; ///< by the surface's projection

private:
    SurfacePoint onLine(std::int32_t triangle, const Vec3d& position) const;
    Mesh m_mesh;
    MapProjection m_projection;
    std::vector<std::int32_t> m_order; ///< triangles along the curve
    std::vector<double> m_area;        ///< running sum along m_order
    SurfaceWalk m_walk;                ///< where there are texture coordinates
    std::unique_ptr<SurfaceTree> m_tree, m_uv_tree;
};

/// Reads, prepares and indexes the surface that `spec` names.
Surface loadSurface(const SurfaceSpec& spec);

} // namespace volcomp
