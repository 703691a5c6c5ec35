// SPDX-License-Identifier: Apache-2.0
// TFX, the format of TressFX 4: a header of 160 bytes with the places of the arrays. All strands
// have equally many points, four floats each, of which the last is no width.
#include "volcomp/curves/curve_readers.h"

#include <fmt/format.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

constexpr std::size_t kHeaderBytes = 160;

/// An array of `count` times `size` bytes at a place that the header gives.
BinaryArray arrayAt(const std::filesystem::path& file, std::string_view bytes, const char* what,
                    std::size_t place, std::size_t count, std::size_t size)
{
    if (place < kHeaderBytes || place > bytes.size() || count > (bytes.size() - place) / size)
        throw fileError(file, what,
                        fmt::format("{} values of {} bytes at byte {}", count, size, place),
                        fmt::format("a file of {} bytes", bytes.size()), "Is the file complete?");
    return BinaryArray(bytes.substr(place, count * size));
}

} // namespace

ReadStrands readTressFx(const std::filesystem::path& file, std::string_view bytes)
{
    if (bytes.size() < kHeaderBytes)
        throw fileError(file, "", "a header of 160 bytes",
                        fmt::format("a file of {} bytes", bytes.size()),
                        "Is the file what its ending says?");
    const BinaryArray header(bytes.substr(0, kHeaderBytes));
    const float version = header.f32(0);
    if (!(version >= 4 && version < 5))
        throw fileError(file, "header", "version 4 of the format", fmt::format("{}", version),
                        "Is the file what its ending says?");
    const std::size_t strands = header.u32(1), length = header.u32(2), count = strands * length;
    if (length < 2)
        throw fileError(file, "header", "at least 2 points in a strand", fmt::format("{}", length));
    const auto at = [&](const char* what, int entry, std::size_t values, std::size_t size) {
        return arrayAt(file, bytes, what, header.u32(std::size_t(entry)), values, size);
    };
    const auto has = [&](int entry) { return header.u32(std::size_t(entry)) != 0; };
    ReadStrands read;
    const BinaryArray points = at("points", 3, count, 16);
    read.points.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
        read.points.emplace_back(points.f32(4 * i), points.f32(4 * i + 1), points.f32(4 * i + 2));
    read.set.ends.reserve(strands);
    for (std::size_t s = 1; s <= strands; ++s) read.set.ends.push_back(s * length);
    if (has(4) || has(5)) { // of strands, or else of points
        const std::size_t step = has(4) ? 1 : length;
        const BinaryArray uvs = at("texture coordinates", has(4) ? 4 : 5, strands * step, 8);
        read.set.root_uvs.reserve(strands);
        for (std::size_t s = 0; s < strands; ++s)
            read.set.root_uvs.emplace_back(uvs.f32(2 * s * step), uvs.f32(2 * s * step + 1));
    }
    if (has(6)) {
        const BinaryArray widths = at("thickness", 6, strands, 4);
        read.set.widths.given = Given::per_strand;
        read.set.widths.values.resize(strands);
        for (std::size_t s = 0; s < strands; ++s) read.set.widths.values[s] = widths.f32(s);
    }
    if (has(7)) {
        const BinaryArray colours = at("colours", 7, count, 16);
        read.set.colours.given = Given::per_point;
        read.set.colours.values.reserve(count);
        for (std::size_t i = 0; i < count; ++i)
            read.set.colours.values.emplace_back(colours.f32(4 * i), colours.f32(4 * i + 1),
                                                 colours.f32(4 * i + 2));
    }
    return read;
}

} // namespace volcomp
