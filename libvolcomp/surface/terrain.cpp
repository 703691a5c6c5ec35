// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/terrain.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"
#include "volcomp/surface/second_density.h"

namespace volcomp {

Mesh makeTerrain(const TerrainSpec& spec)
{
    if (!(spec.width > 0 && spec.depth > 0
          && std::isfinite(spec.width + spec.depth + spec.low + spec.high))
        || spec.cells < 1 || spec.cells > 8192)
        throw Error(
            "terrain: expected a positive width and depth, finite heights and 1 to 8192 cells");
    MapFactor map;
    map.image = spec.height_map;
    map.wrap = Wrap::clamp;
    map.low = spec.low;
    map.high = spec.high;
    map.constant = Vec3d(0.0);
    const SecondDensity height({map}, false);
    const bool flat = spec.height_map.empty();
    const double longer = std::max(spec.width, spec.depth);
    const int nx = flat ? 1 : std::max(1, int(std::lround(spec.cells * spec.width / longer)));
    const int nz = flat ? 1 : std::max(1, int(std::lround(spec.cells * spec.depth / longer)));
    Mesh m;
    for (int j = 0; j <= nz; ++j)
        for (int i = 0; i <= nx; ++i) {
            const double u = double(i) / nx, v = double(j) / nz;
            m.points.emplace_back((u - 0.5) * spec.width, height.value({u, v}, Vec3d(0.0)),
                                  (0.5 - v) * spec.depth);
        }
    const auto add = [&](int a, int b, int c) {
        const auto uv = [&](int p) {
            return Vec2f(float(p % (nx + 1)) / float(nx), float(p / (nx + 1)) / float(nz));
        };
        m.triangles.push_back({a, b, c});
        m.uv.push_back({uv(a), uv(b), uv(c)});
    };
    for (int j = 0; j < nz; ++j)
        for (int i = 0; i < nx; ++i) {
            const int a = j * (nx + 1) + i, b = a + 1, c = a + nx + 1, d = c + 1;
            add(a, b, d);
            add(a, d, c);
        }
    m.report.vertices = m.points.size();
    m.report.faces = m.report.triangles = m.triangles.size();
    m.report.has_uv = true;
    return m;
}

} // namespace volcomp
