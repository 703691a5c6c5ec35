// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/bounds_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>

#include "volcomp/base/error.h"
#include "volcomp/base/vec.h"
#include "volcomp/compose/coarsen.h"

namespace volcomp {
namespace {

using Range = tbb::blocked_range<std::size_t>;

/// A thing at its place along the curve.
struct OnCurve {
    std::uint64_t key;
    std::uint32_t number;

    bool operator<(const OnCurve& other) const
    {
        return key != other.key ? key < other.key : number < other.number;
    }
};
constexpr std::uint64_t kLeftOut = std::numeric_limits<std::uint64_t>::max(); ///< as a key

/// Flat bounds are not empty here, as they are for OpenVDB.
bool isEmpty(const openvdb::BBoxd& b)
{
    return !(b.min()[0] <= b.max()[0] && b.min()[1] <= b.max()[1] && b.min()[2] <= b.max()[2]);
}

/// The bounds of the centres of all things.
openvdb::BBoxd boundsOfCentres(std::size_t count, const BoundsTree::BoundsOf& bounds_of)
{
    return tbb::parallel_reduce(
        Range(0, count, 4096), openvdb::BBoxd(),
        [&](const Range& range, openvdb::BBoxd all) {
            for (std::size_t i = range.begin(); i < range.end(); ++i)
                if (const openvdb::BBoxd b = bounds_of(static_cast<std::uint32_t>(i)); !isEmpty(b))
                    all.expand(b.getCenter());
            return all;
        },
        [](openvdb::BBoxd a, const openvdb::BBoxd& b) {
            a.expand(b);
            return a;
        });
}

/// The key of a place on a curve through a cube of 2^21 cells along an edge.
std::uint64_t keyOf(const Vec3d& place, const openvdb::BBoxd& all)
{
    constexpr int kCells = 1 << 21;
    const Vec3d edges = all.extents();
    const double edge = std::max({edges[0], edges[1], edges[2]}),
                 cells = edge > 0 ? kCells / edge : 0;
    std::int32_t cell[3];
    for (int i = 0; i < 3; ++i)
        cell[i] =
            static_cast<std::int32_t>(std::min((place[i] - all.min()[i]) * cells, kCells - 1.0))
            - kCells / 2;
    return mortonKey(cell[0], cell[1], cell[2]);
}

} // namespace

bool BoundsTree::Node::meets(const Node& other) const
{
    return low[0] <= other.high[0] && high[0] >= other.low[0] && low[1] <= other.high[1]
        && high[1] >= other.low[1] && low[2] <= other.high[2] && high[2] >= other.low[2];
}

BoundsTree::Node BoundsTree::rounded(const openvdb::BBoxd& bounds)
{
    constexpr float kLargest = std::numeric_limits<float>::infinity();
    Node n;
    for (int i = 0; i < 3; ++i) {
        n.low[i] = static_cast<float>(bounds.min()[i]);
        n.high[i] = static_cast<float>(bounds.max()[i]);
        if (double(n.low[i]) > bounds.min()[i]) n.low[i] = std::nextafter(n.low[i], -kLargest);
        if (double(n.high[i]) < bounds.max()[i]) n.high[i] = std::nextafter(n.high[i], kLargest);
    }
    return n;
}

BoundsTree::Node BoundsTree::united(const Node& a, const Node& b)
{
    Node n;
    for (int i = 0; i < 3; ++i) {
        n.low[i] = std::min(a.low[i], b.low[i]);
        n.high[i] = std::max(a.high[i], b.high[i]);
    }
    return n;
}

BoundsTree::BoundsTree(std::size_t count, const BoundsOf& bounds_of)
{
    if (count > std::numeric_limits<std::uint32_t>::max())
        throw Error(fmt::format("expected fewer than 2^32 boxes or triangles, found {}", count));
    sort(count, bounds_of);
    if (!m_numbers.empty()) addRows(bounds_of);
}

/// Lists the numbers in the order of the curve.
void BoundsTree::sort(std::size_t count, const BoundsOf& bounds_of)
{
    const openvdb::BBoxd all = boundsOfCentres(count, bounds_of);
    std::vector<OnCurve> order(count);
    tbb::parallel_for(Range(0, count, 4096), [&](const Range& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            const auto number = static_cast<std::uint32_t>(i);
            const openvdb::BBoxd b = bounds_of(number);
            order[i] = {isEmpty(b) ? kLeftOut : keyOf(b.getCenter(), all), number};
        }
    });
    tbb::parallel_sort(order.begin(), order.end());
    while (!order.empty() && order.back().key == kLeftOut) order.pop_back();
    m_numbers.reserve(order.size());
    for (const OnCurve& o : order) m_numbers.push_back(o.number);
}

/// Makes the nodes, leaves first.
void BoundsTree::addRows(const BoundsOf& bounds_of)
{
    std::size_t total = 0, count = (m_numbers.size() + kLeaf - 1) / kLeaf;
    for (;; count = (count + 1) / 2) {
        m_rows.push_back({total, count});
        total += count;
        if (count == 1) break;
    }
    m_nodes.resize(total);
    tbb::parallel_for(Range(0, m_rows[0].count, 256), [&](const Range& range) {
        for (std::size_t leaf = range.begin(); leaf < range.end(); ++leaf) {
            openvdb::BBoxd bounds;
            for (std::size_t i = leaf * kLeaf; i < std::min(m_numbers.size(), (leaf + 1) * kLeaf);
                 ++i)
                bounds.expand(bounds_of(m_numbers[i]));
            m_nodes[leaf] = rounded(bounds);
        }
    });
    for (std::size_t r = 1; r < m_rows.size(); ++r)
        for (std::size_t n = 0; n < m_rows[r].count; ++n) {
            const Node* const below = &m_nodes[m_rows[r - 1].first];
            m_nodes[m_rows[r].first + n] = 2 * n + 1 < m_rows[r - 1].count
                ? united(below[2 * n], below[2 * n + 1])
                : below[2 * n];
        }
}

openvdb::BBoxd BoundsTree::bounds() const
{
    if (m_nodes.empty()) return {};
    const Node& n = m_nodes.back();
    return {Vec3d(n.low[0], n.low[1], n.low[2]), Vec3d(n.high[0], n.high[1], n.high[2])};
}

std::size_t BoundsTree::memoryBytes() const
{
    return m_numbers.capacity() * sizeof(std::uint32_t) + m_nodes.capacity() * sizeof(Node)
        + m_rows.capacity() * sizeof(Row);
}

} // namespace volcomp
