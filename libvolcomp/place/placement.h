// SPDX-License-Identifier: Apache-2.0
// Placed boxes: what scattering makes and composing works through.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/surface/mesh.h"

namespace volcomp {

/// One placed box, world units. Scenes have millions of them, so it holds nothing that can be
/// looked up elsewhere; the position is double because it is divided by a voxel that may be a
/// millionth of it.
struct Placement {
    Vec3d position{0.0}; ///< of the box's root
    Vec3f x_axis{1, 0, 0}, y_axis{0, 1, 0},
        z_axis{0, 0, 1};     ///< the box's axes in the world, unit and right-handed
    float scale = 1;         ///< world units in one unit of the box, > 0
    Vec3f tint{1.0f};        ///< multiplies the box's colour, linear RGB
    std::uint16_t box = 0;   ///< index into the boxes given to compose()
    std::uint16_t layer = 0; ///< index of the layer that it belongs to
};
static_assert(sizeof(Placement) == 80);

/// Most boxes, and most layers, that placements can name.
constexpr std::size_t kMostBoxes = 65536;

/// Placed boxes, layer by layer, and what is known of the places where they stand. The lists run in
/// parallel; those of places are empty if nobody has asked for them.
struct PlacementList {
    std::vector<Placement> placements;
    std::vector<std::int32_t> triangles; ///< triangle of the layer's surface at the root
    std::vector<Vec2f> uvs;              ///< (u,v) of the layer's surface at the root

    std::size_t size() const { return placements.size(); }
    bool empty() const { return placements.empty(); }
    /// The triangle of placement `i`; -1 if it is not known.
    std::int32_t triangle(std::size_t i) const { return triangles.empty() ? -1 : triangles[i]; }
    std::size_t bytes() const; ///< that the lists have allocated

    /// Moves the placements of `more` to the end. Both must keep the same lists.
    void append(PlacementList&& more);
    /// Drops the placements `i` with keep[i] == 0, without a second copy of the others.
    void filter(const std::vector<char>& keep);
};

/// Collects placements piece by piece without ever holding them twice: a std::vector that grows
/// copies itself, and several gigabytes at a time do not fit beside their copy.
class PlacementCollector {
public:
    void append(PlacementList&& piece);
    std::size_t size() const; ///< number of placements collected
    /// All of them in one list, in the order in which they came. The collector is empty then.
    PlacementList take();

private:
    std::vector<PlacementList> m_slabs; ///< of up to half a million placements
};

} // namespace volcomp
