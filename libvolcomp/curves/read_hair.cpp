// SPDX-License-Identifier: Apache-2.0
// HAIR (Yuksel, Schaefer and Keyser, Hair Meshes, 2009, and the page "HAIR Model Files" of its
// author): a header of 128 bytes, then the arrays that its flags name, one behind the other.
#include "volcomp/curves/curve_readers.h"

#include <cstring>
#include <numeric>

#include <fmt/format.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

constexpr std::size_t kHeaderBytes = 128;
// Bits of the header's flags. The last is LuxCoreRender's.
constexpr std::uint32_t kSegments = 1, kPoints = 2, kThickness = 4, kTransparency = 8,
                        kColours = 16, kUvs = 32;

struct Header {
    std::size_t strands, points;
    std::uint32_t flags, segments;
    float thickness;
    Vec3f colour;
};

/// Cuts one array after the other off the file.
class Arrays {
public:
    Arrays(const std::filesystem::path& file, std::string_view bytes) : m_file(file), m_bytes(bytes)
    {
    }
    BinaryArray take(const char* what, std::size_t count, std::size_t size)
    {
        if (count > m_bytes.size() / size)
            throw fileError(m_file, what, fmt::format("{} values of {} bytes", count, size),
                            fmt::format("the last {} bytes of the file", m_bytes.size()),
                            "Is the file complete?");
        const std::string_view array = m_bytes.substr(0, count * size);
        m_bytes.remove_prefix(count * size);
        return BinaryArray(array);
    }
    std::size_t bytesLeft() const { return m_bytes.size(); }

private:
    std::filesystem::path m_file;
    std::string_view m_bytes;
};

Header readHeader(const std::filesystem::path& file, std::string_view bytes)
{
    if (bytes.size() < kHeaderBytes || bytes.substr(0, 4) != "HAIR")
        throw fileError(file, "", "a header of 128 bytes that begins with HAIR",
                        fmt::format("another, in a file of {} bytes", bytes.size()),
                        "Is the file what its ending says?");
    const BinaryArray h(bytes.substr(0, kHeaderBytes));
    return {h.u32(1), h.u32(2), h.u32(3), h.u32(4), h.f32(5), {h.f32(7), h.f32(8), h.f32(9)}};
}

/// The index behind the last point of each strand.
std::vector<std::size_t> readEnds(const std::filesystem::path& file, const Header& h,
                                  Arrays& arrays)
{
    std::vector<std::size_t> ends;
    std::size_t end = 0;
    if (h.flags & kSegments) {
        const BinaryArray segments = arrays.take("segments", h.strands, 2);
        ends.reserve(h.strands);
        for (std::size_t i = 0; i < h.strands; ++i)
            ends.push_back(end += std::size_t(segments.u16(i)) + 1);
    } else {
        end = h.strands * (std::size_t(h.segments) + 1); // below 2^65 / 2
        // Without points in the file for them no memory is taken: each takes 12 bytes there.
        if (end == h.points && end <= arrays.bytesLeft() / 12) {
            ends.reserve(h.strands);
            for (std::size_t i = 1; i <= h.strands; ++i)
                ends.push_back(i * (std::size_t(h.segments) + 1));
        }
    }
    if (end != h.points)
        throw fileError(file, "header", fmt::format("{} points, as the segments say", end),
                        fmt::format("{}", h.points), "Is the file complete?");
    return ends;
}

} // namespace

ReadStrands readHair(const std::filesystem::path& file, std::string_view bytes)
{
    const Header h = readHeader(file, bytes);
    if (!(h.flags & kPoints)) throw fileError(file, "header", "an array of points", "none");
    ReadStrands read;
    CurveSet& set = read.set;
    Arrays arrays(file, bytes.substr(kHeaderBytes));
    set.ends = readEnds(file, h, arrays);
    const BinaryArray points = arrays.take("points", h.points, 12);
    read.points.reserve(h.points);
    for (std::size_t i = 0; i < h.points; ++i) read.points.emplace_back(points.vec3(i));
    if (h.flags & kThickness) {
        const BinaryArray widths = arrays.take("thickness", h.points, 4);
        set.widths.given = Given::per_point;
        set.widths.values.resize(h.points);
        for (std::size_t i = 0; i < h.points; ++i) set.widths.values[i] = widths.f32(i);
    } else if (h.thickness > 0) set.widths = {Given::once, {h.thickness}};
    if (h.flags & kTransparency) arrays.take("transparency", h.points, 4);
    if (h.flags & kColours) {
        const BinaryArray colours = arrays.take("colours", h.points, 12);
        set.colours.given = Given::per_point;
        set.colours.values.reserve(h.points);
        for (std::size_t i = 0; i < h.points; ++i) set.colours.values.push_back(colours.vec3(i));
    } else if (h.colour != Vec3f(0.0f)) set.colours = {Given::once, {h.colour}};
    if (h.flags & kUvs) {
        const BinaryArray uvs = arrays.take("texture coordinates", h.points, 8);
        set.root_uvs.reserve(set.size());
        for (std::size_t s = 0; s < set.size(); ++s)
            set.root_uvs.emplace_back(uvs.f32(2 * set.first(s)), uvs.f32(2 * set.first(s) + 1));
    }
    return read;
}

float BinaryArray::f32(std::size_t index) const
{
    const std::uint32_t value = u32(index);
    float x;
    std::memcpy(&x, &value, 4);
    return x;
}

} // namespace volcomp
