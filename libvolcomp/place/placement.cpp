// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/placement.h"

#include <utility>

namespace volcomp {
namespace {

/// Large enough (40 MB) for the C library to give a slab's memory back as soon as it is freed.
constexpr std::size_t kSlab = 1 << 19;

template <class T>
void appendTo(std::vector<T>& all, std::vector<T>&& more)
{
    all.insert(all.end(), more.begin(), more.end());
    std::vector<T>().swap(more);
}

template <class T>
void filterList(std::vector<T>& list, const std::vector<char>& keep)
{
    if (list.empty()) return;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < list.size(); ++i)
        if (keep[i]) list[kept++] = list[i];
    list.resize(kept);
    if (kept < list.capacity() / 2) list.shrink_to_fit();
}

} // namespace

std::size_t PlacementList::bytes() const
{
    return placements.capacity() * sizeof(Placement) + triangles.capacity() * sizeof(std::int32_t)
        + uvs.capacity() * sizeof(Vec2f);
}

void PlacementList::append(PlacementList&& more)
{
    appendTo(placements, std::move(more.placements));
    appendTo(triangles, std::move(more.triangles));
    appendTo(uvs, std::move(more.uvs));
}

void PlacementList::filter(const std::vector<char>& keep)
{
    filterList(placements, keep);
    filterList(triangles, keep);
    filterList(uvs, keep);
}

void PlacementCollector::append(PlacementList&& piece)
{
    if (piece.empty()) return;
    if (m_slabs.empty() || m_slabs.back().size() + piece.size() > kSlab) {
        m_slabs.emplace_back();
        m_slabs.back().placements.reserve(kSlab);
    }
    m_slabs.back().append(std::move(piece));
}

std::size_t PlacementCollector::size() const
{
    std::size_t count = 0;
    for (const PlacementList& slab : m_slabs) count += slab.size();
    return count;
}

PlacementList PlacementCollector::take()
{
    PlacementList all;
    if (m_slabs.size() == 1) {
        all = std::move(m_slabs[0]);
        all.placements.shrink_to_fit();
    } else if (!m_slabs.empty()) {
        std::size_t triangles = 0, uvs = 0;
        for (const PlacementList& slab : m_slabs) {
            triangles += slab.triangles.size();
            uvs += slab.uvs.size();
        }
        all.placements.reserve(size());
        all.triangles.reserve(triangles);
        all.uvs.reserve(uvs);
        for (PlacementList& slab : m_slabs) all.append(std::move(slab));
    }
    m_slabs.clear();
    return all;
}

} // namespace volcomp
