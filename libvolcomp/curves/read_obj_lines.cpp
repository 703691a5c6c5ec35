// SPDX-License-Identifier: Apache-2.0
// Lines of a Wavefront OBJ: `l 1 2 3`, with the texture coordinates of `l 1/1 2/2`, colours behind
// the points as many programs write them, and a group for each `o` or `g`.
#include "volcomp/curves/curve_readers.h"

#include <map>

#include <fmt/format.h>

#include "volcomp/surface/mesh_text.h"

namespace volcomp {
namespace {

/// A line as the file has it.
struct Line {
    std::vector<std::size_t> points;
    std::int64_t uv = -1; ///< of its first point
    std::int32_t group = 0;
};

class ObjLines {
public:
    ObjLines(const std::filesystem::path& file, std::string_view bytes)
        : m_text(file, bytes, MeshText::Style::obj)
    {
    }

    ReadStrands read()
    {
        do {
            const std::string_view key = m_text.word();
            if (key == "v") readPoint();
            else if (key == "vt") {
                const double u = m_text.finite("u"), v = m_text.finite("v");
                m_uvs.emplace_back(float(u), float(v));
            } else if (key == "l") readLine();
            else if (key == "g" || key == "o") startGroup();
        } while (m_text.nextLine());
        joinPairs();
        for (const Line& line : m_lines) addStrand(line);
        if (m_named.size() < 2) m_read.set.groups.clear();
        return std::move(m_read);
    }

private:
    void readPoint()
    {
        const double x = m_text.finite("x"), y = m_text.finite("y"), z = m_text.finite("z");
        m_points.emplace_back(x, y, z);
        double value[3];
        int count = 0;
        for (; count < 3; ++count) {
            const std::string_view w = m_text.word();
            if (w.empty()) break;
            value[count] = m_text.number(w, "a colour");
        }
        if (count < 3) return; // none, or a weight
        m_colours.resize(m_points.size(), Vec3f(1.0f));
        m_colours.back() = {float(value[0]), float(value[1]), float(value[2])};
    }

    std::size_t indexOf(std::string_view word, std::size_t count, const char* what) const
    {
        const std::int64_t n = m_text.whole(word, what);
        const std::int64_t index = n < 0 ? std::int64_t(count) + n : n - 1;
        if (n == 0 || index < 0 || index >= std::int64_t(count))
            throw m_text.error(fmt::format("one of the {} {} above", count, what), inQuotes(word));
        return std::size_t(index);
    }

    void readLine()
    {
        Line line;
        line.group = m_group;
        while (true) {
            const std::string_view word = m_text.word();
            if (word.empty()) break;
            const std::size_t slash = word.find('/');
            line.points.push_back(indexOf(word.substr(0, slash), m_points.size(), "points"));
            if (line.points.size() == 1 && slash != std::string_view::npos
                && slash + 1 < word.size())
                line.uv = std::int64_t(
                    indexOf(word.substr(slash + 1), m_uvs.size(), "texture coordinates"));
        }
        if (line.points.size() < 2)
            throw m_text.error("at least two points of a line",
                               fmt::format("{}", line.points.size()));
        m_lines.push_back(std::move(line));
    }

    void startGroup()
    {
        const std::string name(m_text.restOfLine());
        m_group = m_named.emplace(name, std::int32_t(m_named.size())).first->second;
    }

    /// Lines of two points are edges of longer strands.
    void joinPairs()
    {
        std::vector<std::pair<std::size_t, std::size_t>> edges;
        std::map<std::size_t, const Line*> by_end; // (u,v) and group of the strand that it is in
        std::vector<Line> lines;
        for (const Line& line : m_lines)
            if (line.points.size() == 2) {
                edges.emplace_back(line.points[0], line.points[1]);
                by_end.emplace(line.points[0], &line);
                by_end.emplace(line.points[1], &line);
            } else lines.push_back(line);
        for (const std::vector<std::size_t>& points : chainEdges(edges, m_points.size())) {
            const Line& first = *by_end.at(points[0]);
            lines.push_back({points, points[0] == first.points[0] ? first.uv : -1, first.group});
        }
        m_lines = std::move(lines);
    }

    void addStrand(const Line& line)
    {
        CurveSet& set = m_read.set;
        for (const std::size_t p : line.points) {
            m_read.points.push_back(m_points[p]);
            if (m_colours.empty()) continue;
            set.colours.given = Given::per_point;
            set.colours.values.push_back(p < m_colours.size() ? m_colours[p] : Vec3f(1.0f));
        }
        set.ends.push_back(m_read.points.size());
        set.groups.push_back(line.group);
        if (m_uvs.empty()) return;
        set.root_uvs.push_back(line.uv < 0 ? Vec2f(0.0f, 0.0f) : m_uvs[std::size_t(line.uv)]);
    }

    MeshText m_text;
    std::vector<Vec3d> m_points;
    std::vector<Vec3f> m_colours; ///< of points; may be shorter
    std::vector<Vec2f> m_uvs;
    std::vector<Line> m_lines;
    std::map<std::string, std::int32_t> m_named; ///< numbers of groups
    std::int32_t m_group = 0;
    ReadStrands m_read;
};

} // namespace

ReadStrands readObjLines(const std::filesystem::path& file, std::string_view bytes)
{
    return ObjLines(file, bytes).read();
}

} // namespace volcomp
