// SPDX-License-Identifier: Apache-2.0
#include "volcomp/curves/curve_readers.h"

#include <algorithm>

namespace volcomp {
namespace {

using EdgeList = std::vector<std::pair<std::size_t, std::size_t>>;

/// The edges at each point, and which of them are in a strand already.
class Edges {
public:
    Edges(const EdgeList& edges, std::size_t points)
        : m_edges(edges), m_begin(points + 1), m_at(2 * edges.size()), m_done(edges.size())
    {
        for (const auto& [a, b] : edges) ++m_begin[a], ++m_begin[b];
        std::size_t sum = 0;
        for (std::size_t& begin : m_begin) {
            const std::size_t count = begin;
            begin = sum;
            sum += count;
        }
        std::vector<std::size_t> next(m_begin);
        for (std::size_t e = 0; e < edges.size(); ++e)
            m_at[next[edges[e].first]++] = m_at[next[edges[e].second]++] = e;
    }
    /// Whether two edges meet there, so that a strand goes through.
    bool through(std::size_t point) const { return m_begin[point + 1] - m_begin[point] == 2; }
    bool done(std::size_t edge) const { return m_done[edge] != 0; }

    /// The strand that begins with an edge at one of its points; it goes as most of its edges do.
    std::vector<std::size_t> strandFrom(std::size_t edge, std::size_t point)
    {
        std::vector<std::size_t> strand{point};
        std::size_t along = 0;
        while (m_done[edge] == 0) {
            m_done[edge] = 1;
            const auto& [a, b] = m_edges[edge];
            along += a == point;
            point = a == point ? b : a;
            strand.push_back(point);
            if (!through(point)) break;
            const std::size_t* const two = &m_at[m_begin[point]];
            edge = two[0] == edge ? two[1] : two[0];
        }
        if (2 * along < strand.size() - 1) std::reverse(strand.begin(), strand.end());
        return strand;
    }

private:
    const EdgeList& m_edges;
    std::vector<std::size_t> m_begin; ///< in m_at of the edges at each point
    std::vector<std::size_t> m_at;
    std::vector<char> m_done;
};

} // namespace

std::vector<std::vector<std::size_t>> chainEdges(const EdgeList& edges, std::size_t points)
{
    Edges all(edges, points);
    std::vector<std::vector<std::size_t>> strands;
    for (const bool rings : {false, true})
        for (std::size_t e = 0; e < edges.size(); ++e) {
            const auto& [a, b] = edges[e];
            if (all.done(e)) continue;
            if (rings || !all.through(a)) strands.push_back(all.strandFrom(e, a));
            else if (!all.through(b)) strands.push_back(all.strandFrom(e, b));
        }
    return strands;
}

} // namespace volcomp
