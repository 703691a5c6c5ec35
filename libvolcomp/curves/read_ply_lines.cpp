// SPDX-License-Identifier: Apache-2.0
// Lines of a PLY (Turk, The PLY Polygon File Format, 1994): elements `edge` of vertex1 and vertex2,
// and lists `vertex_indices` of any other element but faces.
#include "volcomp/curves/curve_readers.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/srgb.h"
#include "volcomp/surface/mesh_text.h"

namespace volcomp {
namespace {

struct Type {
    std::size_t bytes;
    char kind; ///< i, u or f
};
constexpr double kMostIndex = 1e15;

struct Property {
    std::string name;
    Type type, count_type; ///< of a list: of its values and of their number
    bool is_list;
};

struct Element {
    std::string name;
    std::size_t count;
    std::vector<Property> properties;

    int find(std::initializer_list<const char*> names, bool list) const
    {
        for (std::size_t i = 0; i < properties.size(); ++i)
            for (const char* const wanted : names)
                if (properties[i].name == wanted && properties[i].is_list == list)
                    return static_cast<int>(i);
        return -1;
    }
};

Type readType(const MeshText& text, std::string_view w)
{
    const struct {
        const char *name, *other;
        Type type;
    } types[] = {{"char", "int8", {1, 'i'}},     {"uchar", "uint8", {1, 'u'}},
                 {"short", "int16", {2, 'i'}},   {"ushort", "uint16", {2, 'u'}},
                 {"int", "int32", {4, 'i'}},     {"uint", "uint32", {4, 'u'}},
                 {"float", "float32", {4, 'f'}}, {"double", "float64", {8, 'f'}}};
    for (const auto& t : types)
        if (w == t.name || w == t.other) return t.type;
    throw text.error("a type of PLY (char, uchar, short, ushort, int, uint, float or double)",
                     w.empty() ? "none" : inQuotes(w));
}

/// Gives the values of a file one after the other.
class Values {
public:
    enum class Format { text, little, big };

    Values(const std::filesystem::path& file, std::string_view body, Format format)
        : m_text(file, format == Format::text ? body : "", MeshText::Style::plain), m_body(body),
          m_format(format)
    {
    }
    double next(Type type)
    {
        if (m_format != Format::text) return nextBinary(type);
        const std::string_view w = m_text.anyWord();
        if (w.empty()) throw error("more values", "the end of the file");
        return m_text.number(w, "a property");
    }
    std::size_t bytesLeft() const
    {
        return m_format == Format::text ? m_text.bytesLeft() + 1 : m_body.size();
    }
    /// How many bytes a value has at least.
    std::size_t least(Type type) const { return m_format == Format::text ? 2 : type.bytes; }
    Error error(const std::string& expected, const std::string& found) const
    {
        return fileError(m_text.file(), fmt::format("{} bytes before its end", bytesLeft()),
                         expected, found, "Is the file complete?");
    }

private:
    double nextBinary(Type type)
    {
        if (type.bytes > m_body.size()) throw error("more values", "the end of the file");
        std::uint64_t bits = 0;
        for (std::size_t i = 0; i < type.bytes; ++i)
            bits = bits << 8
                | static_cast<unsigned char>(
                       m_body[m_format == Format::big ? i : type.bytes - 1 - i]);
        m_body.remove_prefix(type.bytes);
        if (type.kind == 'u') return double(bits);
        if (type.kind == 'i') { // the sign is the highest of its bits
            const std::uint64_t sign = std::uint64_t(1) << (8 * type.bytes - 1);
            return bits & sign ? double(bits) - 2 * double(sign) : double(bits);
        }
        if (type.bytes == 8) {
            double x;
            std::memcpy(&x, &bits, 8);
            return x;
        }
        const auto low = static_cast<std::uint32_t>(bits);
        float x;
        std::memcpy(&x, &low, 4);
        return double(x);
    }

    MeshText m_text;
    std::string_view m_body;
    Format m_format;
};

struct Header {
    Values::Format format = Values::Format::text;
    std::vector<Element> elements;
    std::size_t size = 0; ///< bytes
};

Property readProperty(MeshText& text)
{
    Property p{};
    std::string_view w = text.word();
    p.is_list = w == "list";
    if (p.is_list) {
        p.count_type = readType(text, text.word());
        if (p.count_type.kind == 'f') throw text.error("whole numbers as counts", "others");
        w = text.word();
    }
    p.type = readType(text, w);
    p.name = text.word();
    return p;
}

/// How long the line's end at a place is. CR LF is one only if the file's first line ends so too:
/// in a binary file the next byte is data.
std::size_t endLength(std::string_view content)
{
    return content.substr(content.find_first_of("\r\n"), 2) == "\r\n" ? 2 : 1;
}

Header readHeader(const std::filesystem::path& file, std::string_view content)
{
    MeshText text(file, content, MeshText::Style::plain);
    if (text.word() != "ply")
        throw fileError(file, "line 1", "the word ply", "something else",
                        "Is the file what its ending says?");
    Header h;
    while (text.nextLine()) {
        const std::string_view key = text.word();
        if (key == "format") {
            const std::string_view w = text.word();
            if (w == "binary_little_endian") h.format = Values::Format::little;
            else if (w == "binary_big_endian") h.format = Values::Format::big;
            else if (w != "ascii") throw text.error("a format of PLY", inQuotes(w));
        } else if (key == "element") {
            const std::string name(text.word());
            const std::int64_t n = text.whole(text.word(), "the number of elements");
            if (n < 0) throw text.error("the number of elements", fmt::format("{}", n));
            h.elements.push_back({name, std::size_t(n), {}});
        } else if (key == "property") {
            if (h.elements.empty()) throw text.error("an element before its properties", "none");
            h.elements.back().properties.push_back(readProperty(text));
        } else if (key == "end_header") {
            const std::size_t end = content.find_first_of("\r\n", text.position());
            h.size = end == content.npos ? content.size()
                                         : std::min(end + endLength(content), content.size());
            return h;
        } else if (key != "comment" && key != "obj_info" && !key.empty())
            throw text.error("a line of a PLY header (element, property, end_header)",
                             inQuotes(key));
    }
    throw text.error("end_header", "the end of the file", "Is the file complete?");
}

class PlyLines {
public:
    PlyLines(const Header& header, Values values)
        : m_header(header), m_values(std::move(values)) { }

    ReadStrands read()
    {
        for (const Element& e : m_header.elements) {
            checkSize(e);
            const int list = e.find({"vertex_indices", "vertex_index"}, true);
            if (e.properties.empty()) continue; // takes no bytes, however many they are
            if (e.name == "vertex") readVertices(e);
            else if (e.name == "edge" && list < 0) readEdges(e);
            else readLists(e, e.name == "face" ? -1 : list);
        }
        for (const auto& line : m_lines) addStrand(line);
        for (const auto& line : chainEdges(m_edges, m_points.size())) addStrand(line);
        return std::move(m_read);
    }

private:
    /// A header's count that the file cannot hold ends here, before memory is taken for it.
    void checkSize(const Element& e) const
    {
        std::size_t least = 0;
        for (const Property& p : e.properties)
            least += m_values.least(p.is_list ? p.count_type : p.type);
        if (least > 0 && e.count > m_values.bytesLeft() / least)
            throw m_values.error(fmt::format("{} of element '{}'", e.count, inQuotes(e.name)),
                                 "a file that is too short for them");
    }
    std::size_t listSize(const Property& p)
    {
        const double n = m_values.next(p.count_type);
        if (!(n >= 0 && n <= double(m_values.bytesLeft()) && n == std::floor(n)))
            throw m_values.error("how many values a list has", fmt::format("{}", n));
        return static_cast<std::size_t>(n);
    }
    void skip(const Property& p)
    {
        for (std::size_t n = p.is_list ? listSize(p) : 1; n > 0; --n) m_values.next(p.type);
    }
    std::size_t vertex(double x) const
    {
        if (!(x >= 0 && x < kMostIndex && x == std::floor(x) && x < double(m_points.size())))
            throw m_values.error(
                fmt::format("the number of one of {} vertices above", m_points.size()),
                fmt::format("{}", x));
        return static_cast<std::size_t>(x);
    }

    void readVertices(const Element& e)
    {
        const int radius = e.find({"radius"}, false),
                  width = radius >= 0 ? radius : e.find({"width", "thickness", "diameter"}, false);
        const int at[9] = {e.find({"x"}, false),
                           e.find({"y"}, false),
                           e.find({"z"}, false),
                           width,
                           e.find({"red", "r"}, false),
                           e.find({"green", "g"}, false),
                           e.find({"blue", "b"}, false),
                           e.find({"u", "s", "texture_u", "texture_s"}, false),
                           e.find({"v", "t", "texture_v", "texture_t"}, false)};
        if (at[0] < 0 || at[1] < 0 || at[2] < 0)
            throw m_values.error("properties x, y and z of 'vertex'", "others");
        m_has_colour = at[4] >= 0 && at[5] >= 0 && at[6] >= 0;
        m_has_width = at[3] >= 0;
        m_has_uv = at[7] >= 0 && at[8] >= 0;
        std::vector<double> values(e.properties.size());
        for (std::size_t i = 0; i < e.count; ++i) {
            for (std::size_t k = 0; k < values.size(); ++k)
                if (e.properties[k].is_list) skip(e.properties[k]);
                else values[k] = m_values.next(e.properties[k].type);
            const auto value = [&](int k) { return values[std::size_t(at[k])]; };
            m_points.emplace_back(value(0), value(1), value(2));
            if (m_has_width) m_widths.push_back(float(radius >= 0 ? 2 * value(3) : value(3)));
            if (m_has_uv) m_uvs.emplace_back(float(value(7)), float(value(8)));
            if (!m_has_colour) continue;
            Vec3f& colour = m_colours.emplace_back();
            for (int c = 0; c < 3; ++c)
                colour[c] = colourOf(value(4 + c), e.properties[std::size_t(at[4 + c])].type);
        }
    }
    /// Whole numbers are sRGB, as images have them, and others linear.
    static float colourOf(double value, Type type)
    {
        if (type.kind == 'f') return float(value);
        return float(linearFromSrgb(value / (type.bytes == 1 ? 255 : 65535)));
    }

    void readEdges(const Element& e)
    {
        const int a = e.find({"vertex1"}, false), b = e.find({"vertex2"}, false);
        if (a < 0 || b < 0)
            throw m_values.error("properties vertex1 and vertex2 of 'edge'", "others");
        double ends[2] = {};
        for (std::size_t i = 0; i < e.count; ++i) {
            for (int k = 0; k < static_cast<int>(e.properties.size()); ++k) {
                const Property& p = e.properties[std::size_t(k)];
                if (k == a || k == b) ends[k == b] = m_values.next(p.type);
                else skip(p);
            }
            m_edges.emplace_back(vertex(ends[0]), vertex(ends[1]));
        }
    }

    /// Strands of the property `list`; -1: nothing is of use.
    void readLists(const Element& e, int list)
    {
        for (std::size_t i = 0; i < e.count; ++i)
            for (int k = 0; k < static_cast<int>(e.properties.size()); ++k) {
                const Property& p = e.properties[std::size_t(k)];
                if (k != list) {
                    skip(p);
                    continue;
                }
                std::vector<std::size_t>& line = m_lines.emplace_back();
                for (std::size_t n = listSize(p); n > 0; --n)
                    line.push_back(vertex(m_values.next(p.type)));
            }
    }

    void addStrand(const std::vector<std::size_t>& line)
    {
        if (line.empty()) return;
        CurveSet& set = m_read.set;
        for (const std::size_t p : line) {
            m_read.points.push_back(m_points[p]);
            if (m_has_width) set.widths.values.push_back(m_widths[p]);
            if (m_has_colour) set.colours.values.push_back(m_colours[p]);
        }
        if (m_has_width) set.widths.given = Given::per_point;
        if (m_has_colour) set.colours.given = Given::per_point;
        if (m_has_uv) set.root_uvs.push_back(m_uvs[line[0]]);
        set.ends.push_back(m_read.points.size());
    }

    const Header& m_header;
    Values m_values;
    std::vector<Vec3d> m_points;
    std::vector<float> m_widths;
    std::vector<Vec3f> m_colours;
    std::vector<Vec2f> m_uvs;
    std::vector<std::pair<std::size_t, std::size_t>> m_edges;
    std::vector<std::vector<std::size_t>> m_lines;
    bool m_has_colour = false, m_has_width = false, m_has_uv = false;
    ReadStrands m_read;
};

} // namespace

ReadStrands readPlyLines(const std::filesystem::path& file, std::string_view bytes)
{
    const Header h = readHeader(file, bytes);
    return PlyLines(h, Values(file, bytes.substr(h.size), h.format)).read();
}

} // namespace volcomp
