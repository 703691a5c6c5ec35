// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/mesh_topology.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <tuple>
#include <unordered_map>

#include "volcomp/base/random.h"

namespace volcomp {

std::vector<std::int32_t> weld(const std::vector<Vec3d>& points)
{
    struct Hash {
        std::size_t operator()(const Vec3d& p) const
        {
            std::uint64_t bits[3];
            for (int i = 0; i < 3; ++i) {
                const double x = p[i] + 0.0; // makes -0 a 0
                std::memcpy(&bits[i], &x, 8);
            }
            return hashKey(hashKey(bits[0], bits[1]), bits[2]);
        }
    };
    struct Same {
        bool operator()(const Vec3d& a, const Vec3d& b) const
        {
            return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
        }
    };
    std::unordered_map<Vec3d, std::int32_t, Hash, Same> first;
    std::vector<std::int32_t> result(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
        result[i] = first.emplace(points[i], static_cast<std::int32_t>(i)).first->second;
    return result;
}

std::vector<EdgeUse> edgeUses(const Mesh& mesh, const std::vector<std::int32_t>& welded)
{
    std::vector<EdgeUse> edges;
    edges.reserve(mesh.triangles.size() * 3);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::int32_t i = 0; i < 3; ++i) {
            const std::int32_t a = welded[mesh.triangles[t][i]],
                               b = welded[mesh.triangles[t][(i + 1) % 3]];
            if (a != b)
                edges.push_back(
                    {std::min(a, b), std::max(a, b), static_cast<std::int32_t>(t), i, a < b});
        }
    std::sort(edges.begin(), edges.end(), [](const EdgeUse& x, const EdgeUse& y) {
        return std::tie(x.low, x.high, x.triangle, x.corner)
            < std::tie(y.low, y.high, y.triangle, y.corner);
    });
    return edges;
}

} // namespace volcomp
