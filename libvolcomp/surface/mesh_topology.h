// SPDX-License-Identifier: Apache-2.0
// How the triangles of a mesh hang together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/surface/mesh.h"

namespace volcomp {

/// For each point a number that points at exactly the same place share: the smallest index among
/// them. So the seams of texture coordinates do not tear a surface.
std::vector<std::int32_t> weld(const std::vector<Vec3d>& points);

/// One side of one triangle.
struct EdgeUse {
    std::int32_t low, high; ///< the welded points at its ends, low < high
    std::int32_t triangle;
    std::int32_t corner; ///< the side runs from this corner to the next
    bool forward;        ///< it runs from `low` to `high`
    bool sameEdge(const EdgeUse& other) const { return low == other.low && high == other.high; }
};

/// The sides of all triangles, except those whose ends are welded into one point; sorted by edge,
/// then by triangle and corner.
std::vector<EdgeUse> edgeUses(const Mesh& mesh, const std::vector<std::int32_t>& welded);

/// Calls visit(first, last) with the range of uses of each edge. `edges` are sorted as edgeUses()
/// sorts them.
template <class Visit>
void forEachEdge(const std::vector<EdgeUse>& edges, const Visit& visit)
{
    for (auto first = edges.begin(); first != edges.end();) {
        auto last = first;
        while (last != edges.end() && last->sameEdge(*first)) ++last;
        visit(first, last);
        first = last;
    }
}

} // namespace volcomp
