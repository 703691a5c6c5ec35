// SPDX-License-Identifier: Apache-2.0
// The geometry of an ExactScene in Embree 3: round cones, flat pieces, and the
// triangles of meshes and of skins.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include "tools/truth/exact_scene.h"
#include "volcomp/render/shade.h"

namespace volcomp {

/// What a ray has met.
struct ExactHit {
    Vec3d position; ///< world
    /// Unit, world: the tangent of a fibre; else a normal, of a strand the outward one, of a flat
    /// piece either one, of a skin the smooth one.
    Vec3d direction;
    bool fibre = false;
    Vec3d colour{1.0}; ///< c_b, linear RGB
    const Material* material = nullptr;
    const Lobe* lobe = nullptr;

    /// Where rays that leave the hit start, on the side of `direction` and on the other one, and
    /// which primitives they do not meet: the piece that was hit, and for a fibre those that it is
    /// joined to.
    Vec3d start, start_behind;
    std::uint32_t instance, geometry, first_own, last_own;
};

/// Rays may be asked for from several threads at once. The ExactScene must outlive it, and stays as
/// it is. It can be neither copied nor moved.
class EmbreeScene {
public:
    /// Fibres of at least `solid_radius` (world units) are solid bodies, which shade themselves:
    /// rays leave them from outside. Thinner ones do not, as MODEL section 5 gives the radiance of
    /// the whole fibre, lit side and dark side. Throws Error if Embree fails.
    explicit EmbreeScene(const ExactScene& scene,
                         double solid_radius = std::numeric_limits<double>::infinity());
    ~EmbreeScene();
    EmbreeScene(const EmbreeScene&) = delete;
    EmbreeScene& operator=(const EmbreeScene&) = delete;

    /// The first thing that a ray meets; the direction is of unit length.
    std::optional<ExactHit> hit(const Vec3d& origin, const Vec3d& direction) const;

    /// The first thing that a ray meets which leaves a hit in the direction `d` (unit).
    std::optional<ExactHit> hitFrom(const ExactHit& from, const Vec3d& d) const;

    /// Whether something lies within `distance` of the hit in the direction `L` (unit).
    bool isOccluded(const ExactHit& from, const Vec3d& L, double distance) const;

private:
    struct Impl;
    std::unique_ptr<Impl> m;
};

} // namespace volcomp
