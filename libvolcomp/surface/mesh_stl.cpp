// SPDX-License-Identifier: Apache-2.0
// STL (3D Systems, StereoLithography Interface Specification), of text and binary.
#include "volcomp/surface/mesh_soup.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "volcomp/surface/mesh_text.h"
#include "volcomp/surface/mesh_topology.h"

namespace volcomp {
namespace {

constexpr std::size_t kHeader = 84, kFacet = 50; // bytes

bool isWord(std::string_view a, std::string_view small)
{
    return a.size() == small.size()
        && std::equal(a.begin(), a.end(), small.begin(), [](char x, char y) {
               return std::tolower(static_cast<unsigned char>(x)) == y;
           });
}

/// Little endian, as STL is.
std::uint32_t wordAt(std::string_view bytes, std::size_t at)
{
    std::uint32_t x = 0;
    for (int i = 3; i >= 0; --i) x = x << 8 | static_cast<unsigned char>(bytes[at + i]);
    return x;
}

/// A binary file may begin with the word solid too; its size or its zeros tell.
bool isBinary(std::string_view bytes)
{
    if (bytes.size() >= kHeader && bytes.size() == kHeader + kFacet * wordAt(bytes, 80))
        return true;
    std::string_view start = bytes.substr(0, 512);
    if (start.find('\0') != start.npos) return true;
    start.remove_prefix(std::min(start.find_first_not_of(" \t\r\n"), start.size()));
    return !isWord(start.substr(0, 5), "solid");
}

PolygonSoup readBinary(const std::filesystem::path& file, std::string_view bytes)
{
    if (bytes.size() < kHeader)
        throw fileError(file, "", "an STL: the word solid, or a header of 84 bytes",
                        fmt::format("{} bytes", bytes.size()), "Is the file complete?");
    const std::size_t count = wordAt(bytes, 80);
    if (count * kFacet > bytes.size() - kHeader)
        throw fileError(file, "", fmt::format("the {} facets of its header", count),
                        fmt::format("room for {}", (bytes.size() - kHeader) / kFacet),
                        "Is the file complete?");
    PolygonSoup soup;
    for (std::size_t f = 0; f < count; ++f) {
        for (std::size_t c = 0; c < 3; ++c) {
            Vec3d p;
            for (std::size_t i = 0; i < 3; ++i) {
                const std::uint32_t bits =
                    wordAt(bytes, kHeader + f * kFacet + 12 + 12 * c + 4 * i);
                float x;
                std::memcpy(&x, &bits, 4);
                if (!std::isfinite(x))
                    throw fileError(file, fmt::format("facet {}", f + 1), "finite coordinates",
                                    "NaN or infinity");
                p[static_cast<int>(i)] = x;
            }
            soup.corners.push_back({static_cast<std::int32_t>(soup.points.size())});
            soup.points.push_back(p);
        }
        soup.endFace();
    }
    return soup;
}

void readFacet(MeshText& text, PolygonSoup& soup)
{
    const auto need = [&](const char* expected) {
        if (const std::string_view w = text.anyWord(); !isWord(w, expected))
            throw text.error(fmt::format("'{}'", expected), w.empty() ? "the end" : inQuotes(w));
    };
    need("normal");
    for (int i = 0; i < 3; ++i) text.number(text.anyWord(), "a facet's normal");
    need("outer"), need("loop");
    for (int c = 0; c < 3; ++c) {
        need("vertex");
        Vec3d p;
        for (int i = 0; i < 3; ++i) {
            const std::string_view w = text.anyWord();
            p[i] = text.number(w, "a vertex");
            if (!std::isfinite(p[i])) throw text.error("finite coordinates", inQuotes(w));
        }
        soup.corners.push_back({static_cast<std::int32_t>(soup.points.size())});
        soup.points.push_back(p);
    }
    need("endloop"), need("endfacet");
    soup.endFace();
}

PolygonSoup readText(const std::filesystem::path& file, std::string_view bytes)
{
    MeshText text(file, bytes, MeshText::Style::plain);
    PolygonSoup soup;
    bool open = false;
    for (std::string_view w = text.anyWord(); !w.empty(); w = text.anyWord()) {
        if (isWord(w, "solid") && !open) {
            soup.startRange(std::string(text.restOfLine()), -1);
            open = true;
        } else if (isWord(w, "endsolid") && open) {
            text.restOfLine();
            open = false;
        } else if (isWord(w, "facet") && open) readFacet(text, soup);
        else
            throw text.error(open ? "'facet' or 'endsolid'" : "'solid'", inQuotes(w),
                             "Is the file what its ending says?");
    }
    if (open) throw text.error("'endsolid'", "the end", "Is the file complete?");
    return soup;
}

} // namespace

PolygonSoup readStl(const std::filesystem::path& file, std::string_view bytes)
{
    PolygonSoup soup = isBinary(bytes) ? readBinary(file, bytes) : readText(file, bytes);
    // Each facet repeats its points; those at one place are one again.
    const std::vector<std::int32_t> first = weld(soup.points);
    std::vector<std::int32_t> number(first.size());
    std::size_t kept = 0;
    for (std::size_t p = 0; p < first.size(); ++p) {
        if (first[p] == static_cast<std::int32_t>(p)) {
            number[p] = static_cast<std::int32_t>(kept);
            soup.points[kept++] = soup.points[p];
        } else number[p] = number[first[p]];
    }
    soup.points.resize(kept);
    for (PolygonSoup::Corner& c : soup.corners) c.point = number[c.point];
    return soup;
}

} // namespace volcomp
