// SPDX-License-Identifier: Apache-2.0
// The unit squares of (u,v) that a surface reaches; artists call them UDIM tiles.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "volcomp/surface/surface.h"

namespace volcomp {

/// Returns the lower left corners of the squares with an edge of 1 whose (u,v) the surface may
/// reach, by rows, from the lowest u and v on. A triangle reaches all squares that the box around
/// its (u,v) meets. Borders that are passed by less than 1e-5 do not count. By texture coordinates,
/// triangles without finite ones reach none. Throws Error for more than 65536 squares, or (u,v)
/// beyond 1e9; `place` begins its message.
std::vector<std::array<std::int64_t, 2>> unitSquares(const Surface& surface,
                                                     const std::string& place);

} // namespace volcomp
