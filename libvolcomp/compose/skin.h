// The surface itself as an opaque thin shell of voxels with normals, so that nobody sees through
// the fur.
#pragma once

#include <memory>

#include "volcomp/place/placed_scene.h"
#include "volcomp/compose/tile_accumulator.h"

namespace volcomp {

/// The shell of one surface that has a skin. The surface must outlive it.
class Skin {
public:
    explicit Skin(const PlacedSurface& surface)
        : m_surface(&surface.surface), m_spec(surface.skin), m_colour(surface.skin_colour)
    {
    }

    const std::string& material() const { return m_spec.material; }
    const Surface& surface() const { return *m_surface; }
    bool hasColour() const { return !m_colour.isConstant(); }
    Vec3f colour(const SurfacePoint& p) const;

    /// Bounds of a triangle's voxels, in voxels of edge `voxel`.
    void bounds(std::int32_t triangle, double voxel, Vec3d& low, Vec3d& high) const;

    /// Adds one triangle: points on it, closer than the voxels, each with its part of the area as a
    /// cube of one voxel. The optical depth along the normal is -ln(transmittance) whatever the
    /// voxel. What falls outside of the tile is left out.
    void add(std::int32_t triangle, double voxel, const openvdb::Coord& tile_origin,
             TileAccumulator& tile) const;

private:
    const Surface* m_surface;
    SkinSpec m_spec;
    SecondDensity m_colour;
};

/// The skins of a scene, in the order of its surfaces.
std::vector<Skin> skinsOf(const PlacedScene& scene);

} // namespace volcomp
