// SPDX-License-Identifier: Apache-2.0
// The reader of each format of strands. Private to readCurves().
//
// Each takes the whole content of a file and takes memory in proportion to it. They throw Error for
// anything that they do not read right. readCurves() checks what they return: strands of one point,
// places and widths that are not finite.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "volcomp/curves/curve_set.h"

namespace volcomp {

/// What a reader returns: the set, but its points in double and without an offset.
struct ReadStrands {
    CurveSet set; ///< without points and offset
    std::vector<Vec3d> points;
};

ReadStrands readHair(const std::filesystem::path& file, std::string_view bytes);
ReadStrands readTressFx(const std::filesystem::path& file, std::string_view bytes);
ReadStrands readPlyLines(const std::filesystem::path& file, std::string_view bytes);
ReadStrands readObjLines(const std::filesystem::path& file, std::string_view bytes);

/// Adds what the sidecar of volcomp-import says (docs/grooms.md has its form). `text` is its
/// content. Throws Error if its lists have not one value for each strand.
void readSidecar(const std::filesystem::path& file, std::string_view text, CurveSet& set);

/// Lines over numbered points become strands: edges that meet at a point where no other does are
/// joined. A strand goes as most of its edges point; a ring begins at the first of its edges. The
/// numbers of `edges` must be below `points`. Returns for each strand its points.
std::vector<std::vector<std::size_t>>
chainEdges(const std::vector<std::pair<std::size_t, std::size_t>>& edges, std::size_t points);

/// The little-endian values of a binary file from one place on. The place was checked by the
/// caller: nothing is read beyond the text.
class BinaryArray {
public:
    explicit BinaryArray(std::string_view bytes) : m_bytes(bytes) { }
    std::uint32_t u32(std::size_t index) const { return bits(4 * index, 4); }
    std::uint16_t u16(std::size_t index) const
    {
        return static_cast<std::uint16_t>(bits(2 * index, 2));
    }
    float f32(std::size_t index) const;
    Vec3f vec3(std::size_t index) const
    {
        return {f32(3 * index), f32(3 * index + 1), f32(3 * index + 2)};
    }

private:
    std::uint32_t bits(std::size_t at, std::size_t count) const
    {
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < count; ++i)
            value |= std::uint32_t(static_cast<unsigned char>(m_bytes[at + i])) << (8 * i);
        return value;
    }
    std::string_view m_bytes;
};

} // namespace volcomp
