// SPDX-License-Identifier: Apache-2.0
// A composite whose tiles are made when they are asked for, at any of several voxel sizes (MODEL
// section 8).
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "volcomp/base/progress.h"
#include "volcomp/compose/compose_params.h"
#include "volcomp/place/placed_scene.h"
#include "volcomp/volume/tile_maker.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

struct PackedBox; // box_pyramids.h

/// Placed boxes, and skins that are voxels, as one TileMaker for each level. Level n has voxels of
/// edge `finest` 2^n, and its tiles hold what compose() at this voxel has there, bit for bit, as a
/// PackedSource gives it. Parts are the same at each level, but for PartInfo::has_scatter_ratio.
///
/// What levels share is kept once: the packed boxes, coarser ones among them, and the trees by
/// which sources are found (8 bytes a placement). A level keeps the lists of the nodes that were
/// asked for: 4 bytes for each source of a tile, 8 for a tile; nothing of a node without sources.
///
/// A box adds the voxels that it has: at levels finer than its own voxel they are spread, and
/// nothing new is seen.
class VirtualComposite {
public:
    /// params.voxel does not count. `levels`, at least one. The scene must outlive this, and stay
    /// as it is. Only what voxels from `finest` on need is kept. OpenVDB must have been started
    /// (openvdb::initialize). Throws the Errors of compose(), but the scene may reach 2^27 voxels
    /// of the finest level from the origin.
    VirtualComposite(std::vector<PackedBox>&& boxes, const PlacedScene& scene,
                     const ComposeParams& params, double finest, int levels,
                     const Progress& progress = {});
    /// The same of boxes that are packed here; those that are not placed are not.
    VirtualComposite(const std::vector<Box>& boxes, const PlacedScene& scene,
                     const ComposeParams& params, double finest, int levels,
                     const Progress& progress = {});
    ~VirtualComposite();
    VirtualComposite(VirtualComposite&&) noexcept;
    VirtualComposite& operator=(VirtualComposite&&) noexcept;

    int levels() const;
    double voxel(int level) const; ///< edge, world units
    /// It lives as long as this, moved or not. Its memoryBytes() are its own lists alone.
    TileMaker& level(int level);
    const TileMaker& level(int level) const;

    /// Of what the levels share: packed boxes, trees, and working memory of about 2 MB for each
    /// thread that has made tiles. The scene is not in it. For several threads at once.
    std::size_t memoryBytes() const;

private:
    struct Impl;
    std::unique_ptr<Impl> m_impl;
};

} // namespace volcomp
