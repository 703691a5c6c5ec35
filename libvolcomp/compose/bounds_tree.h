// SPDX-License-Identifier: Apache-2.0
// Which of many things, such as placements, may lie in a part of space.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include <openvdb/Types.h>

namespace volcomp {

/// A binary tree of bounds over things with numbers, which are sorted along a Morton curve of their
/// bounds' centres. It holds 4 bytes for each thing and 24 for each node, of which there are about
/// as many as there are eighths of things.
class BoundsTree {
public:
    /// The bounds of a thing in the world; empty ones: it is left out. Called from several threads.
    using BoundsOf = std::function<openvdb::BBoxd(std::uint32_t)>;

    BoundsTree() = default;
    /// Over the things 0 to count - 1. Throws Error if there are 2^32 or more. The tree does not
    /// depend on the number of threads.
    BoundsTree(std::size_t count, const BoundsOf& bounds_of);

    /// Calls `visit` with the numbers of all things whose bounds meet the box, and of some whose
    /// bounds are close to it, each once, in an order of the tree's own.
    template <class Visit>
    void query(const openvdb::BBoxd& box, const Visit& visit) const
    {
        forLeaves(box, [&](std::size_t leaf) {
            const std::size_t end = std::min(m_numbers.size(), (leaf + 1) * kLeaf);
            for (std::size_t i = leaf * kLeaf; i < end; ++i) visit(m_numbers[i]);
        });
    }

    openvdb::BBoxd bounds() const; ///< of all things; empty if there are none
    std::size_t memoryBytes() const;

private:
    static constexpr std::size_t kLeaf = 16; ///< things

    /// Rounded outward.
    struct Node {
        float low[3], high[3];
        bool meets(const Node& other) const;
    };
    /// A row of nodes: [0] has the leaves, [n + 1] a node for each two of row n.
    struct Row {
        std::size_t first, count; ///< in m_nodes
    };

    static Node rounded(const openvdb::BBoxd& bounds);
    static Node united(const Node& a, const Node& b);
    void sort(std::size_t count, const BoundsOf& bounds_of);
    void addRows(const BoundsOf& bounds_of);

    /// Calls `visit` with the numbers of the leaves whose bounds meet the box.
    template <class Visit>
    void forLeaves(const openvdb::BBoxd& box, const Visit& visit) const
    {
        if (m_rows.empty()) return;
        struct {
            std::uint32_t row, node;
        } waiting[2 * kMostRows];
        int count = 0;
        const Node wanted = rounded(box);
        waiting[count++] = {static_cast<std::uint32_t>(m_rows.size() - 1), 0};
        while (count > 0) {
            const auto [row, node] = waiting[--count];
            if (!m_nodes[m_rows[row].first + node].meets(wanted)) continue;
            if (row == 0) {
                visit(std::size_t(node));
                continue;
            }
            for (std::uint32_t child = 2 * node + 2; child-- > 2 * node;)
                if (child < m_rows[row - 1].count) waiting[count++] = {row - 1, child};
        }
    }
    static constexpr int kMostRows = 32;

    std::vector<std::uint32_t> m_numbers; ///< of the things, in the order of the curve
    std::vector<Node> m_nodes;
    std::vector<Row> m_rows;
};

} // namespace volcomp
