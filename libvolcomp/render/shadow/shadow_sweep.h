// SPDX-License-Identifier: Apache-2.0
// Light that is swept through the volume once, instead of a ray for each shaded voxel and light:
// the cheap shadows (MODEL section 3).
//
// For each light a lattice of rays 2/3 voxel apart (LightLattice) is pushed through the volume,
// layer by layer of leaves; the optical depth of every ray is exact. On the plane by which the
// light enters a layer, patches of 16 x 16 rays are kept: the root of each ray's transmittance in 8
// bits. The way from a point to the light is then marched exactly as far as that plane, 8 slices at
// most, and goes on with the transmittance that is interpolated between the four rays there. If a
// point has little weight in its pixel, or lies in shade, nothing is marched: its light is
// interpolated between the planes before and behind it, on rays 2 voxels apart. If no more than
// that is asked of a patch, it keeps only those 6 x 6 rays.
//
// In fur of one hair a voxel, a pixel is off by 1.1 % of the mean radiance (RMSE), and the
// picture's mean by 0.1 %. Nothing is kept for each voxel. Bundles of rays are pushed only as far
// as something asks for them, and end where they are dark.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "volcomp/view/light.h"
#include "volcomp/render/shadow/light_lattice.h"
#include "volcomp/render/shadow/ray_bundle.h"
#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {

/// How much of each light reaches which place, computed once and then looked up from any thread.
class ShadowSweep {
public:
    static constexpr double kSpacing = 2.0 / 3; ///< between neighbouring rays, voxels

    /// A point is marched to the plane if its weight in the pixel times the transmittance to the
    /// light is at least this.
    static constexpr double kFineWeight = 0.002;
    /// A patch keeps all its rays if the greatest weight in a pixel of the leaves behind it times
    /// its greatest transmittance is at least this.
    static constexpr double kFinePatch = 0.065;

    /// `seen` holds for each leaf, by VoxelTree::place(), the greatest weight that one of its
    /// voxels has in its pixel, 0 if the leaf asks for no light. Tiles that are not there are made
    /// on the way, and may be let go (TileBudget::relieve()). `extinction` is the optical depth of
    /// density 1 over one voxel. No light is taken to arrive behind an optical depth of `darkest`.
    /// If `directed`, densities are multiplied by VoxelTree::directionFactor(). The tree must
    /// outlive this; lights and `seen` need not.
    ///
    /// `beyond`, if not null, is made on the way of the same particles, too, with voxels of twice,
    /// four times ... the width. Light comes through it as far as 128 voxels of the tree, or a bit
    /// more, before the leaves that ask for it: there its shadows are no sharper than that.
    ShadowSweep(const VoxelTree& tree, const std::vector<Light>& lights,
                const std::vector<float>& seen, double extinction, double darkest, bool directed,
                const VoxelTree* beyond = nullptr);

    /// A light's transmittance that was looked up without marching.
    struct CoarseTransmittance {
        double value;
        bool fine; ///< whether pathToLight() knows this place, too
    };
    /// The transmittance to a light from `p` (corner coordinates), which lies in voxel `cell` or on
    /// its faces. `L` (unit length) and `distance` (voxels) lead to the light. Nothing if the sweep
    /// does not know it: in leaves that were not `seen`, and before the first plane of a light
    /// inside the volume.
    std::optional<CoarseTransmittance> approximateTransmittance(std::size_t light, const int* cell,
                                                                const Vec3d& p, const Vec3d& L,
                                                                double distance) const;

    /// The way to a light: `march` voxels to be marched, then an optical depth of `beyond`.
    struct Path {
        double march, beyond;
    };
    /// The same question, answered precisely. Nothing if no patch with all rays is kept there. Rays
    /// see the box filter; if the light goes along an axis, `trilinear` interpolates between
    /// columns of voxels, as that filter does.
    std::optional<Path> pathToLight(std::size_t light, const int* cell, const Vec3d& p,
                                    const Vec3d& L, double distance, bool trilinear = false) const;

    std::size_t memoryBytes() const;

private:
    static constexpr int kBundle = RayBundle::kStep, kSide = RayBundle::kSide,
                         kRays = RayBundle::kRays;
    /// A rough patch keeps each kStride-th ray along both axes.
    static constexpr int kStride = 3, kRoughSide = kBundle / kStride + 1,
                         kRoughRays = kRoughSide * kRoughSide;
    static constexpr int kUnit = 4; ///< bytes in which the places of patches are counted
    /// Where a patch is, see Field::patches. With 32 bits 4 GB of codes were the end.
    using PatchPlace = std::int64_t;
    static constexpr PatchPlace kUnknown = -1, kDark = -2, kBright = -3; ///< instead of a patch
    /// A rectangle of bundles, bounds included.
    struct Rectangle {
        int low[2] = {1, 1}, high[2] = {0, 0};
        bool empty() const { return high[0] < low[0]; }
        int width() const { return high[1] - low[1] + 1; }
        std::size_t size() const
        {
            return empty() ? 0 : std::size_t(high[0] - low[0] + 1) * width();
        }
        bool holds(int b, int c) const
        {
            return b >= low[0] && b <= high[0] && c >= low[1] && c <= high[1];
        }
        std::size_t index(int b, int c) const
        {
            return std::size_t(b - low[0]) * width() + (c - low[1]);
        }
        void add(const Rectangle& r);
    };
    struct Plane {
        Rectangle bundles;
        std::size_t first = 0; ///< index in Field::patches of the rectangle's first bundle
    };
    /// What is kept of a directional light, or of one of a point light's pyramids.
    struct Field {
        LightLattice lattice;
        /// By axis b and c: the rays go along the columns of voxels and leave none. Then a point
        /// takes the light of the rays in its own column: that of its neighbours is another.
        bool in_columns[2] = {false, false};
        double first_s = 0; ///< s of the first plane; there is one every kLeafDim
        std::vector<Plane> planes;
        /// By plane and bundle: kUnknown, kDark, kBright, or 2 x (place in `codes` in kUnit) + (1
        /// if the patch keeps all rays).
        std::vector<PatchPlace> patches;
        /// 255 sqrt(transmittance), kRays or kRoughRays of them for each patch.
        std::vector<std::uint8_t> codes;

        PatchPlace patch(int plane, int bundle_b, int bundle_c) const;
        /// s of the plane by which the light enters the layer of leaves of a voxel.
        double planeBefore(const int* cell) const;
        struct RoughCode {
            double value; ///< 0 to 255
            bool fine;    ///< whether the patch keeps all rays
        };
        /// The code between rays kStride apart, where the way from p along L crosses a plane that
        /// is `to_plane` voxels away. Nothing if no patch is kept there.
        std::optional<RoughCode> roughCode(int plane, const Vec3d& p, const Vec3d& L,
                                           double to_plane, double darkest) const;
    };
    class Sweeper;

    /// Moves the rays of a directional light off the faces of voxels; sets Field::in_columns.
    void sweepTogether(const std::vector<std::unique_ptr<Sweeper>>& sweepers) const;
    static void alignWithColumns(const VoxelTree& tree, Field& field);
    const Field* fieldOf(std::size_t light, const Vec3d& L) const;

    const VoxelTree& m_tree;
    const VoxelTree* m_beyond; ///< null: light comes through the tree alone
    double m_extinction, m_darkest;
    bool m_directed;
    std::vector<Field> m_fields;
    /// By light, the number of its field or -1. A directional light has only the first; a point
    /// light's are counted by 2 x axis + (1 if the light goes towards +).
    std::vector<std::array<int, 6>> m_field_of;
    std::vector<bool> m_directional; ///< by light
};

} // namespace volcomp
