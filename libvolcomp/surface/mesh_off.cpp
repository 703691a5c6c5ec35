// SPDX-License-Identifier: Apache-2.0
// OFF as Geomview's manual has it (Object File Format), in text.
#include "volcomp/surface/mesh_soup.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "volcomp/surface/mesh_text.h"

namespace volcomp {
namespace {

constexpr char kHint[] = "Export it as a text OFF, OBJ or PLY.";

struct OffHeader {
    bool normals = false, colours = false, uvs = false;
    std::size_t vertices = 0, faces = 0;
};

/// The word [ST][C][N]OFF, and the three counts. The word may be missing.
OffHeader readHeader(MeshText& text)
{
    OffHeader h;
    std::string_view w = text.anyWord();
    if (w.size() >= 3 && w.substr(w.size() - 3) == "OFF") {
        for (std::string_view kind = w.substr(0, w.size() - 3); !kind.empty();) {
            const std::size_t length = kind.substr(0, 2) == "ST" ? 2 : 1;
            if (length == 2) h.uvs = true;
            else if (kind[0] == 'C') h.colours = true;
            else if (kind[0] == 'N') h.normals = true;
            else
                throw text.error("OFF in three dimensions",
                                 inQuotes(w) + ", which is not supported", kHint);
            kind.remove_prefix(length);
        }
        w = text.anyWord();
        if (w == "BINARY" || w == "binary")
            throw text.error("an OFF of text", "a binary OFF, which is not supported", kHint);
    }
    const auto count = [&](std::string_view word, const char* what) {
        const std::int64_t n = text.whole(word, what);
        if (n < 0 || n > static_cast<std::int64_t>(text.bytesLeft()))
            throw text.error(fmt::format("{} that fits the file's size", what), inQuotes(word),
                             "Is the file complete?");
        return static_cast<std::size_t>(n);
    };
    h.vertices = count(w, "the number of vertices");
    h.faces = count(text.anyWord(), "the number of faces");
    text.word(); // the number of edges, which may be missing and means nothing
    return h;
}

/// True if each vertex and each face can have a line. Then what a vertex' line has more than it
/// must is left out, since programs write colours even below the plain word OFF. Else a vertex'
/// numbers may stand anywhere.
bool hasLines(MeshText text, const OffHeader& h)
{
    std::size_t lines = 0;
    do lines += !text.word().empty();
    while (text.nextLine());
    return lines >= h.vertices + h.faces;
}

void readVertex(MeshText& text, const OffHeader& h, bool lines, std::vector<double>& values,
                PolygonSoup& soup)
{
    const std::string place = fmt::format("of vertex {}", soup.points.size() + 1);
    const std::size_t least = 3 + 3 * h.normals + 2 * h.uvs;
    const std::size_t all = least + 4 * h.colours;
    values.clear();
    std::string_view w = text.anyWord();
    for (; !w.empty() && values.size() < (lines ? 64 : all);) {
        values.push_back(text.number(w, place.c_str()));
        if (!lines && values.size() == all) break;
        w = lines ? text.word() : text.anyWord();
    }
    if (values.size() < least)
        throw text.error(fmt::format("{} numbers {}", least, place),
                         fmt::format("{}", values.size()), "Is the file complete?");
    for (const std::size_t i : {0, 1, 2})
        if (!std::isfinite(values[i]))
            throw text.error("finite coordinates " + place, fmt::format("{}", values[i]));
    soup.points.emplace_back(values[0], values[1], values[2]);
    if (h.normals) soup.normals.emplace_back(float(values[3]), float(values[4]), float(values[5]));
    if (!h.uvs) return;
    const Vec2f uv(float(values[values.size() - 2]), float(values.back()));
    if (!std::isfinite(uv[0]) || !std::isfinite(uv[1]))
        throw text.error("finite texture coordinates " + place, "others");
    soup.uvs.push_back(uv);
}

void readFace(MeshText& text, const OffHeader& h, PolygonSoup& soup)
{
    const std::string_view w = text.anyWord();
    const std::int64_t n = text.whole(w, "the number of a face's corners");
    if (n < 0 || n > static_cast<std::int64_t>(text.bytesLeft()))
        throw text.error("a face's number of corners", inQuotes(w), "Is the file complete?");
    for (std::int64_t i = 0; i < n; ++i) {
        const std::string_view corner = text.anyWord();
        const std::int64_t p = text.whole(corner, "a face's vertex");
        if (p < 0 || p >= static_cast<std::int64_t>(h.vertices))
            throw text.error(fmt::format("a vertex from 0 to {}", h.vertices - 1),
                             inQuotes(corner));
        const auto point = static_cast<std::int32_t>(p);
        soup.corners.push_back({point, h.uvs ? point : -1, h.normals ? point : -1});
    }
    soup.endFace();
    text.nextLine(); // the rest is the face's colour
}

} // namespace

PolygonSoup readOff(const std::filesystem::path& file, std::string_view content)
{
    MeshText text(file, content, MeshText::Style::comments);
    const OffHeader h = readHeader(text);
    const bool lines = hasLines(text, h);
    PolygonSoup soup;
    std::vector<double> values;
    for (std::size_t i = 0; i < h.vertices; ++i) readVertex(text, h, lines, values, soup);
    if (lines) text.nextLine();
    for (std::size_t i = 0; i < h.faces; ++i) readFace(text, h, soup);
    return soup;
}

} // namespace volcomp
