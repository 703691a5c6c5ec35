// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/node_table.h"

namespace volcomp {
namespace {

// The number that the 21 bits from `shift` stand for.
int coordinate(std::uint64_t key, int shift)
{
    return int(std::int32_t(key >> shift & 0x1fffff) << 11) >> 11;
}

} // namespace

NodeTable::NodeTable(std::size_t nodes)
{
    std::size_t size = 16;
    while (size < 2 * nodes) size *= 2;
    m_slots.resize(size);
    m_mask = size - 1;
}

int NodeTable::addTable(int leaf)
{
    m_leaves.resize(m_leaves.size() + kNodeSize, leaf);
    return int(m_leaves.size() / kNodeSize) - 1;
}

void NodeTable::insert(const openvdb::Coord& origin, int table)
{
    if (2 * ++m_nodes > m_slots.size()) {
        std::vector<Slot> old(2 * m_slots.size());
        old.swap(m_slots);
        m_mask = m_slots.size() - 1;
        for (const Slot& slot : old)
            if (slot.table != kEmpty) insertKey(slot.key, slot.table);
    }
    insertKey(keyOf(origin[0], origin[1], origin[2]), table);
}

void NodeTable::insertKey(std::uint64_t key, int table)
{
    std::size_t slot = hash(key);
    while (m_slots[slot & m_mask].table != kEmpty) ++slot;
    m_slots[slot & m_mask] = {key, table};
}

void NodeTable::setLeaf(const openvdb::Coord& place, int leaf)
{
    int table = node(place[0], place[1], place[2]);
    if (table == kEmpty) insert(place, table = addTable());
    leaves(table)[numberInNode(place[0], place[1], place[2])] = leaf;
}

openvdb::Coord NodeTable::originOf(std::uint64_t key)
{
    return {coordinate(key, 42) * kNodeDim, coordinate(key, 21) * kNodeDim,
            coordinate(key, 0) * kNodeDim};
}

} // namespace volcomp
