// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/vdb_tree_check.h"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>
#include <openvdb/io/Compression.h>

namespace volcomp {
namespace {

constexpr int kLeafVoxels = 8 * 8 * 8;
constexpr std::size_t kLeafMask = kLeafVoxels / 8; // bytes

template <class T>
T valueAt(const std::byte* from)
{
    T value;
    std::memcpy(&value, from, sizeof(T));
    return value;
}

/// Checks the head of a chunk that Blosc compressed, whose length and result are known: Blosc
/// trusts it. What follows it Blosc checks itself.
void checkBlosc(const VdbBytes& bytes, const std::byte* chunk, std::uint64_t length,
                std::uint64_t result)
{
    constexpr std::uint64_t kHead = 16;
    const auto is = [&](bool right, const char* what) {
        if (!right) bytes.fail("a chunk that Blosc compressed", std::string("another ") + what);
    };
    is(length >= kHead, "length");
    constexpr std::uint8_t kCopied = 2; // flag: not compressed
    const auto version = valueAt<std::uint8_t>(chunk), flags = valueAt<std::uint8_t>(chunk + 2),
               type_size = valueAt<std::uint8_t>(chunk + 3);
    const auto values = valueAt<std::uint32_t>(chunk + 4),
               block = valueAt<std::uint32_t>(chunk + 8),
               stored = valueAt<std::uint32_t>(chunk + 12);
    is(version > 0 && version <= 2, "version");
    is(values == result, "number of values");
    is(stored == length, "length");
    if (result == 0) return;
    is(type_size > 0, "type");
    is(block > 0 && block <= result, "size of blocks");
    if (flags & kCopied) is(length == kHead + result, "length");
    else is(kHead + 4 * ((result + block - 1) / block) <= length, "number of blocks");
}

class TreeCheck {
public:
    TreeCheck(VdbBytes& bytes, const VdbValues& values) : m_bytes(bytes), m_values(values) { }

    void topology()
    {
        if (const auto buffers = m_bytes.take<std::int32_t>(); buffers != 1)
            m_bytes.fail("one buffer in a leaf", fmt::format("{}", buffers));
        m_bytes.skip(m_values.bytes); // background
        const auto tiles = m_bytes.take<std::uint32_t>(), children = m_bytes.take<std::uint32_t>();
        for (std::uint32_t i = 0; i < tiles; ++i) {
            m_entries.push_back({takeOrigin(), m_leaves.size(), m_leaves.size()});
            m_bytes.skip(m_values.bytes);
            if (m_bytes.take<std::uint8_t>() > 1)
                m_bytes.fail("0 or 1 for a tile that is active or not", "another number");
        }
        for (std::uint32_t i = 0; i < children; ++i) {
            Entry entry{takeOrigin(), m_leaves.size(), 0};
            node<32 * 32 * 32>([&] {
                node<16 * 16 * 16>([&] {
                    m_leaves.push_back(m_bytes.at());
                    m_bytes.skip(kLeafMask);
                });
            });
            entry.end = m_leaves.size();
            m_entries.push_back(entry);
        }
    }

    /// The leaves' values. The topology has the order of the file, they have that of a map.
    void buffers()
    {
        std::sort(m_entries.begin(), m_entries.end(),
                  [](const Entry& a, const Entry& b) { return a.origin < b.origin; });
        for (std::size_t i = 0; i < m_entries.size(); ++i) {
            const Entry& entry = m_entries[i];
            if (i > 0 && entry.origin == m_entries[i - 1].origin)
                m_bytes.fail("each node of the root once", "one of them twice");
            for (std::size_t leaf = entry.first; leaf < entry.end; ++leaf) {
                const std::byte* const mask = m_bytes.skip(kLeafMask);
                if (std::memcmp(mask, m_bytes.of(m_leaves[leaf]), kLeafMask) != 0)
                    m_bytes.fail("the mask that the topology has of the leaf", "another one");
                std::uint64_t active = 0;
                for (std::size_t w = 0; w < kLeafMask; w += 8)
                    active += popcount(valueAt<std::uint64_t>(mask + w));
                nodeValues(active, kLeafVoxels);
            }
        }
    }

private:
    struct Entry { // of the root
        std::array<std::int32_t, 3> origin;
        std::size_t first, end; // of its leaves
    };

    static std::uint64_t popcount(std::uint64_t word)
    {
        return static_cast<std::uint64_t>(__builtin_popcountll(word));
    }

    std::array<std::int32_t, 3> takeOrigin()
    {
        const auto origin = m_bytes.take<std::array<std::int32_t, 3>>();
        for (const std::int32_t c : origin)
            if (c & 4095) m_bytes.fail("a node at multiples of 4096 voxels", fmt::format("{}", c));
        return origin;
    }

    /// An internal node; `child` goes over one of its children.
    template <int kChildren, class F>
    void node(F&& child)
    {
        const std::byte* const masks = m_bytes.skip(2 * kChildren / 8);
        std::uint64_t children = 0, active = 0;
        for (int w = 0; w < kChildren / 8; w += 8) {
            const auto child_word = valueAt<std::uint64_t>(masks + w),
                       value_word = valueAt<std::uint64_t>(masks + kChildren / 8 + w);
            if (child_word & value_word)
                m_bytes.fail("a child or an active value in each place", "both in one");
            children += popcount(child_word);
            active += popcount(value_word);
        }
        nodeValues(active, kChildren);
        for (; children > 0; --children) child();
    }

    /// The values of a node with so many active ones, as io::readCompressedValues() reads them.
    void nodeValues(std::uint64_t active, std::uint64_t all)
    {
        const bool masked = m_values.compression & openvdb::io::COMPRESS_ACTIVE_MASK;
        const auto kind = m_bytes.take<std::int8_t>();
        using namespace openvdb::io;
        if (kind < NO_MASK_OR_INACTIVE_VALS || kind > NO_MASK_AND_ALL_VALS
            || (!masked && kind != NO_MASK_AND_ALL_VALS))
            m_bytes.fail("a kind of inactive values from 0 to 6", fmt::format("{}", int(kind)));
        if (kind == NO_MASK_AND_ONE_INACTIVE_VAL || kind == MASK_AND_ONE_INACTIVE_VAL)
            m_bytes.skip(m_values.bytes);
        if (kind == MASK_AND_TWO_INACTIVE_VALS) m_bytes.skip(2 * m_values.bytes);
        if (kind == MASK_AND_NO_INACTIVE_VALS || kind == MASK_AND_ONE_INACTIVE_VAL
            || kind == MASK_AND_TWO_INACTIVE_VALS)
            m_bytes.skip(all / 8);
        chunk(masked && kind != NO_MASK_AND_ALL_VALS ? active : all);
    }

    void chunk(std::uint64_t count)
    {
        if (count == 0 && m_values.half) return; // OpenVDB writes nothing
        const std::uint64_t result = count * m_values.bytes / (m_values.half ? 2 : 1);
        const bool blosc = m_values.compression & openvdb::io::COMPRESS_BLOSC;
        if (!blosc && !(m_values.compression & openvdb::io::COMPRESS_ZIP)) {
            m_bytes.skip(result);
            return;
        }
        const auto length = m_bytes.take<std::int64_t>();
        if (length <= 0) { // not compressed
            if (length != -static_cast<std::int64_t>(result))
                m_bytes.fail(fmt::format("a chunk of {} bytes", result),
                             fmt::format("one of {}", length));
            m_bytes.skip(result);
            return;
        }
        const auto bytes = static_cast<std::uint64_t>(length);
        const std::byte* const begin = m_bytes.skip(bytes);
        if (blosc) checkBlosc(m_bytes, begin, bytes, result);
    }

    VdbBytes& m_bytes;
    const VdbValues m_values;
    std::vector<Entry> m_entries;
    std::vector<std::size_t> m_leaves; // where the topology has their masks
};

} // namespace

void checkVdbTree(VdbBytes& bytes, const VdbValues& values)
{
    TreeCheck check(bytes, values);
    check.topology();
    check.buffers();
}

} // namespace volcomp
