// SPDX-License-Identifier: Apache-2.0
// Skins as meshes: what a ray meets of them, with Embree 3 (MODEL section 4).
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "volcomp/base/interval.h"
#include "volcomp/base/vec.h"
#include "volcomp/surface/surface.h"
#include "volcomp/volume/material.h"

namespace volcomp {

/// A surface that is traced as it is.
struct SkinMesh {
    std::string name;                 ///< of the surface
    std::shared_ptr<const Mesh> mesh; ///< loadMesh()
    MapProjection projection;
    SkinSpec skin;
    SecondDensity maps; ///< loadSkinMaps()
    Material material;  ///< of kind surface
};

/// What a ray has met of a skin. World space and world units.
struct SkinHit {
    double distance; ///< from the ray's origin
    Vec3d position;
    /// Unit, turned to the side from which the ray came: that of the triangle, and the interpolated
    /// one, which is bent where it would turn away from the ray.
    Vec3d face, normal;
    /// Where rays that leave the hit on that side start: a little above it, and on the round
    /// surface that the normals of a triangle's corners tell of, so that flat triangles do not
    /// darken what the light grazes.
    Vec3d start;
    Vec3d back_start; ///< the same for rays that leave it on the other side
    Vec3d colour;     ///< c_b, linear RGB
    std::size_t skin; ///< number of the SkinMesh
};

/// The meshes of a scene's skins. Threads share it. It can be neither copied nor moved.
///
/// A skin has two sides. Where the alpha of its maps (SecondDensity::alpha()) is below 0.5 it is
/// cut out: rays pass.
class SkinTracer {
public:
    /// Throws Error if Embree fails.
    explicit SkinTracer(std::vector<SkinMesh> meshes);
    ~SkinTracer();
    SkinTracer(const SkinTracer&) = delete;
    SkinTracer& operator=(const SkinTracer&) = delete;

    const std::vector<SkinMesh>& meshes() const;
    bool empty() const { return meshes().empty(); }
    std::size_t triangles() const; ///< of all meshes

    /// The first that a ray meets between two distances from its origin; `from` may be -infinity.
    /// The direction is of unit length.
    std::optional<SkinHit> hit(const Vec3d& origin, const Vec3d& direction, double from = 0,
                               double to = kInfinity) const;

    /// Where it is, and no more.
    struct Meeting {
        double distance;
        Vec3d face; ///< as SkinHit::face
    };
    std::optional<Meeting> meeting(const Vec3d& origin, const Vec3d& direction, double from = 0,
                                   double to = kInfinity) const;

    /// Whether something lies within `distance` of `p` in the direction `L` (unit). From a hit, ask
    /// from its `start`.
    bool isOccluded(const Vec3d& p, const Vec3d& L, double distance) const;

private:
    struct Impl;
    std::unique_ptr<Impl> m;
};

} // namespace volcomp
