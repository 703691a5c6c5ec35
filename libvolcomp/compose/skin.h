// SPDX-License-Identifier: Apache-2.0
// The surface itself as a thin shell of voxels with normals, for programs that show the volume
// alone (SkinAs::voxels).
#pragma once

#include <string>
#include <vector>

#include "volcomp/compose/tile_accumulator.h"
#include "volcomp/place/placed_scene.h"

namespace volcomp {

/// The shell of one surface that has a skin of voxels. The surface must outlive it.
class Skin {
public:
    explicit Skin(const PlacedSurface& surface)
        : m_surface(&surface.surface), m_spec(surface.skin), m_colour(surface.skin_colour)
    {
    }

    const std::string& material() const { return m_spec.material; }
    const Surface& surface() const { return *m_surface; }
    bool hasColour() const { return !m_colour.isConstant(); }
    Vec3f colour(const SurfacePoint& p) const
    {
        return skinColour(m_spec, m_colour, p);
    } ///< linear

    /// How far a triangle's voxels reach beyond it, in voxels.
    double reach() const;
    /// Bounds of a triangle's voxels, in voxels of edge `voxel`.
    openvdb::BBoxd bounds(std::int32_t triangle, double voxel) const;

    /// Adds one triangle to the tile whose first voxel is `tile_origin`. Points on the triangle,
    /// closer to each other than the voxels, each add a cube of one voxel for their part of the
    /// area. The optical depth is -ln(SkinSpec::transmittance) under directed extinction for any
    /// voxel size.
    /// What falls outside of the tile is left out. `voxel` is the edge in world units.
    void add(std::int32_t triangle, double voxel, const openvdb::Coord& tile_origin,
             TileAccumulator& tile) const;

private:
    const Surface* m_surface;
    SkinSpec m_spec;
    SecondDensity m_colour;
};

/// The skins of a scene that are voxels, in the order of its surfaces.
std::vector<Skin> skinsOf(const PlacedScene& scene);

} // namespace volcomp
