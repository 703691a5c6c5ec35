// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/spacing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include <tbb/parallel_for.h>

#include "volcomp/base/random.h"

namespace volcomp {
namespace {

/// Roots in cubic cells, so that those near a place are found by 27 cells.
class RootCells {
public:
    explicit RootCells(double edge) : m_edge(edge) { }

    void add(const Root& root)
    {
        const auto [at, is_new] = m_first.emplace(keyOf(root.position, {0, 0, 0}), kNone);
        m_roots.push_back({root, at->second});
        at->second = static_cast<std::uint32_t>(m_roots.size() - 1);
    }

    /// Whether `near(root)` holds for a root in the cells around `p`.
    template <class F>
    bool any(const Vec3d& p, F&& near) const
    {
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y)
                for (int z = -1; z <= 1; ++z) {
                    const auto at = m_first.find(keyOf(p, {x, y, z}));
                    if (at == m_first.end()) continue;
                    for (std::uint32_t i = at->second; i != kNone; i = m_roots[i].next)
                        if (near(m_roots[i].root)) return true;
                }
        return false;
    }

private:
    static constexpr std::uint32_t kNone = ~0U;
    struct Link {
        Root root;
        std::uint32_t next; ///< in the same cell
    };

    /// Two cells may share a key: then there is more to look at, and nothing is missed.
    std::uint64_t keyOf(const Vec3d& p, const std::array<int, 3>& step) const
    {
        std::uint64_t key = 0;
        for (int k = 0; k < 3; ++k) {
            const double cell = std::floor(p[k] / m_edge) + step[std::size_t(k)];
            key = hashKey(key,
                          static_cast<std::uint64_t>(
                              static_cast<std::int64_t>(std::clamp(cell, -9e18, 9e18))));
        }
        return key;
    }

    double m_edge;
    std::vector<Link> m_roots;
    std::unordered_map<std::uint64_t, std::uint32_t> m_first; ///< by cell, the root added last
};

double largest(const std::vector<Root>& roots)
{
    double radius = 0;
    for (const Root& root : roots) radius = std::max(radius, root.radius);
    return radius;
}

} // namespace

std::vector<Root> rootsOf(const PlacementList& list, double spacing)
{
    std::vector<Root> roots;
    roots.reserve(list.size());
    for (const Placement& p : list.placements)
        roots.push_back({p.position, 0.5 * spacing * double(p.scale)});
    return roots;
}

std::vector<char> keepSpacing(const PlacementList& list, const Layer& layer,
                              const std::vector<const std::vector<Root>*>& others)
{
    const std::vector<Root> own = rootsOf(list, layer.spacing);
    const double own_radius = largest(own);
    double farthest = 2 * own_radius;
    for (const auto* other : others) farthest = std::max(farthest, own_radius + largest(*other));
    std::vector<char> keep(list.size(), 1);
    if (!(farthest > 0)) return keep;
    RootCells cells(farthest);
    for (const auto* other : others)
        for (const Root& root : *other) cells.add(root);
    for (std::size_t i = 0; i < own.size(); ++i) {
        const Root& root = own[i];
        const bool crowded = cells.any(root.position, [&](const Root& other) {
            const double room = root.radius + other.radius;
            return (other.position - root.position).lengthSqr() < room * room;
        });
        if (crowded) keep[i] = 0;
        else cells.add(root);
    }
    return keep;
}

void keepAway(const PlacementList& list, const std::vector<Root>& roots, double distance,
              std::vector<char>& keep)
{
    if (!(distance > 0)) return;
    RootCells cells(distance);
    for (const Root& root : roots) cells.add(root);
    tbb::parallel_for(std::size_t(0), list.size(), [&](std::size_t i) {
        const Vec3d& p = list.placements[i].position;
        if (keep[i] && cells.any(p, [&](const Root& root) {
                return (root.position - p).lengthSqr() < distance * distance;
            }))
            keep[i] = 0;
    });
}

void keepAway(const PlacementList& list, const Surface& surface, double distance,
              std::vector<char>& keep)
{
    tbb::parallel_for(std::size_t(0), list.size(), [&](std::size_t i) {
        const Vec3d& p = list.placements[i].position;
        if (keep[i] && (surface.nearest(p).position - p).length() < distance) keep[i] = 0;
    });
}

} // namespace volcomp
