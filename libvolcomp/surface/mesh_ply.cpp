// SPDX-License-Identifier: Apache-2.0
// PLY (Turk, The PLY Polygon File Format, 1994), of text and binary, with the texture coordinates
// that MeshLab, Blender and photogrammetry write.
#include "volcomp/surface/mesh_soup.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>

#include <fmt/format.h>

#include "volcomp/surface/mesh_text.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };
constexpr std::size_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};

struct Property {
    std::string name;
    Type type = Type::f32;
    bool is_list = false;
    Type count_type = Type::u8; ///< of a list
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
    /// The index of the property that has one of the names; -1: none.
    int find(std::initializer_list<const char*> names, bool list) const
    {
        for (std::size_t i = 0; i < properties.size(); ++i)
            for (const char* const wanted : names)
                if (properties[i].name == wanted && properties[i].is_list == list)
                    return static_cast<int>(i);
        return -1;
    }
};

enum class Format { text, little, big };

struct Header {
    Format format = Format::text;
    std::vector<Element> elements;
    std::vector<MeshMaterial> materials; ///< from MeshLab's comments
    std::size_t size = 0;                ///< bytes
    std::size_t lines = 0;
};

Type readType(const MeshText& text, std::string_view w)
{
    const char* const names[][2] = {{"char", "int8"},     {"uchar", "uint8"},   {"short", "int16"},
                                    {"ushort", "uint16"}, {"int", "int32"},     {"uint", "uint32"},
                                    {"float", "float32"}, {"double", "float64"}};
    for (int t = 0; t < 8; ++t)
        if (w == names[t][0] || w == names[t][1]) return static_cast<Type>(t);
    throw text.error("a type of PLY (char, uchar, short, ushort, int, uint, float or double)",
                     w.empty() ? "none" : inQuotes(w));
}

Format readFormat(MeshText& text)
{
    const std::string_view w = text.word();
    if (w == "ascii") return Format::text;
    if (w == "binary_little_endian") return Format::little;
    if (w == "binary_big_endian") return Format::big;
    throw text.error("the format ascii, binary_little_endian or binary_big_endian", inQuotes(w));
}

Property readProperty(MeshText& text)
{
    Property p;
    std::string_view w = text.word();
    p.is_list = w == "list";
    if (p.is_list) {
        p.count_type = readType(text, text.word());
        if (p.count_type >= Type::f32) throw text.error("whole numbers as counts", "others");
        w = text.word();
    }
    p.type = readType(text, w);
    p.name = text.word();
    if (p.name.empty()) throw text.error("a property's name", "none");
    return p;
}

Header readHeader(const fs::path& file, std::string_view content)
{
    MeshText text(file, content, MeshText::Style::plain);
    Header h;
    if (text.word() != "ply")
        throw fileError(file, "line 1", "the word ply", "something else",
                        "Is the file what its ending says?");
    bool has_format = false;
    while (text.nextLine()) {
        const std::string_view key = text.word();
        if (key == "end_header") {
            if (!has_format) throw text.error("a line 'format' before", "none");
            h.lines = text.line();
            // A CR LF only if the first line ends so too: in a binary file the next byte is data.
            const std::size_t first = content.find_first_of("\r\n"),
                              last = content.find_first_of("\r\n", text.position());
            const std::size_t length = content.substr(first, 2) == "\r\n" ? 2 : 1;
            h.size =
                last == content.npos ? content.size() : std::min(last + length, content.size());
            return h;
        }
        if (key == "format") h.format = readFormat(text), has_format = true;
        else if (key == "element") {
            const std::string name(text.word());
            const std::string_view count = text.word();
            const std::int64_t n = text.whole(count, "the number of elements");
            if (n < 0) throw text.error("the number of elements", inQuotes(count));
            h.elements.push_back({name, static_cast<std::size_t>(n), {}});
        } else if (key == "property") {
            if (h.elements.empty()) throw text.error("an element before its properties", "none");
            h.elements.back().properties.push_back(readProperty(text));
        } else if (key == "comment") {
            if (text.word() == "TextureFile")
                h.materials.emplace_back().texture =
                    file.parent_path() / std::string(text.restOfLine());
        } else if (key != "obj_info" && !key.empty())
            throw text.error("a line of a PLY header (element, property, end_header)",
                             inQuotes(key));
    }
    throw text.error("end_header", "the end of the file", "Is the file complete?");
}

/// The values of a text file.
class TextValues {
public:
    TextValues(const fs::path& file, std::string_view body, std::size_t lines)
        : m_text(file, body, MeshText::Style::plain), m_lines(lines)
    {
    }
    double next(Type)
    {
        const std::string_view w = m_text.anyWord();
        if (w.empty()) throw error("more values", "the end of the file");
        return m_text.number(w, "a property");
    }
    /// How many bytes a value has at least, with the blank behind it.
    static std::size_t least(Type) { return 2; }
    std::size_t bytesLeft() const { return m_text.bytesLeft() + 1; } // the last has no blank
    Error error(const std::string& expected, const std::string& found) const
    {
        return fileError(m_text.file(), fmt::format("line {}", m_lines + m_text.line()), expected,
                         found, "Is the file complete?");
    }

private:
    MeshText m_text;
    std::size_t m_lines;
};

/// The values of a binary file.
class BinaryValues {
public:
    BinaryValues(const fs::path& file, std::string_view body, bool big)
        : m_file(file), m_body(body), m_big(big)
    {
    }
    double next(Type type)
    {
        const std::size_t size = kBytes[static_cast<int>(type)];
        if (size > m_body.size()) throw error("more values", "the end of the file");
        std::uint64_t bits = 0;
        for (std::size_t i = 0; i < size; ++i)
            bits = bits << 8 | static_cast<unsigned char>(m_body[m_big ? i : size - 1 - i]);
        m_body.remove_prefix(size);
        switch (type) {
        case Type::i8:
            return static_cast<std::int8_t>(bits);
        case Type::i16:
            return static_cast<std::int16_t>(bits);
        case Type::i32:
            return static_cast<std::int32_t>(bits);
        case Type::f32: {
            const auto low = static_cast<std::uint32_t>(bits);
            float x;
            std::memcpy(&x, &low, 4);
            return x;
        }
        case Type::f64: {
            double x;
            std::memcpy(&x, &bits, 8);
            return x;
        }
        default:
            return static_cast<double>(bits);
        }
    }
    static std::size_t least(Type type) { return kBytes[static_cast<int>(type)]; }
    std::size_t bytesLeft() const { return m_body.size(); }
    Error error(const std::string& expected, const std::string& found) const
    {
        return fileError(m_file, fmt::format("{} bytes before its end", m_body.size()), expected,
                         found, "Is the file complete?");
    }

private:
    fs::path m_file;
    std::string_view m_body;
    bool m_big;
};

/// Reads the body of a file, whose values `Values` gives one after the other.
template <class Values>
class Body {
public:
    Body(const Header& header, Values values, PolygonSoup& soup)
        : m_header(header), m_values(std::move(values)), m_soup(soup)
    {
    }
    void read()
    {
        for (const Element& e : m_header.elements) {
            checkSize(e);
            if (e.properties.empty()) continue; // takes no bytes, however many they are
            if (e.name == "vertex") readVertices(e);
            else if (e.name == "face") readFaces(e);
            else
                for (std::size_t i = 0; i < e.count; ++i)
                    for (const Property& p : e.properties) skip(p);
        }
    }

private:
    /// A header's count that the file cannot hold ends here, before memory is taken for it.
    void checkSize(const Element& e) const
    {
        std::size_t least = 0;
        for (const Property& p : e.properties)
            least += Values::least(p.is_list ? p.count_type : p.type);
        if (least > 0 && e.count > m_values.bytesLeft() / least)
            throw m_values.error(fmt::format("{} of element '{}'", e.count, e.name),
                                 "a file that is too short for them");
    }

    std::size_t listSize(const Property& p)
    {
        const double n = m_values.next(p.count_type);
        if (!(n >= 0 && n <= double(m_values.bytesLeft()) && n == std::floor(n)))
            throw m_values.error(fmt::format("how many '{}' follow", p.name), fmt::format("{}", n));
        return static_cast<std::size_t>(n);
    }
    void skip(const Property& p)
    {
        const std::size_t n = p.is_list ? listSize(p) : 1;
        for (std::size_t k = 0; k < n; ++k) m_values.next(p.type);
    }

    void readVertices(const Element& e)
    {
        const int at[8] = {e.find({"x"}, false),
                           e.find({"y"}, false),
                           e.find({"z"}, false),
                           e.find({"nx"}, false),
                           e.find({"ny"}, false),
                           e.find({"nz"}, false),
                           e.find({"u", "s", "texture_u", "texture_s"}, false),
                           e.find({"v", "t", "texture_v", "texture_t"}, false)};
        if (at[0] < 0 || at[1] < 0 || at[2] < 0)
            throw m_values.error("properties x, y and z of 'vertex'", "others");
        m_has_normals = at[3] >= 0 && at[4] >= 0 && at[5] >= 0;
        m_has_uv = at[6] >= 0 && at[7] >= 0;
        std::vector<int> slot(e.properties.size(), 8);
        for (int k = 0; k < 8; ++k)
            if (at[k] >= 0) slot[at[k]] = k;
        double value[9] = {};
        for (std::size_t i = 0; i < e.count; ++i) {
            for (std::size_t k = 0; k < slot.size(); ++k)
                if (e.properties[k].is_list) skip(e.properties[k]);
                else value[slot[k]] = m_values.next(e.properties[k].type);
            if (!std::isfinite(value[0]) || !std::isfinite(value[1]) || !std::isfinite(value[2]))
                throw m_values.error(fmt::format("finite coordinates of vertex {}", i),
                                     "NaN or infinity");
            m_soup.points.emplace_back(value[0], value[1], value[2]);
            if (m_has_normals)
                m_soup.normals.emplace_back(float(value[3]), float(value[4]), float(value[5]));
            if (m_has_uv) addUv(value[6], value[7]);
        }
    }

    void addUv(double u, double v)
    {
        m_soup.uvs.emplace_back(float(u), float(v));
        if (!std::isfinite(m_soup.uvs.back()[0]) || !std::isfinite(m_soup.uvs.back()[1]))
            throw m_values.error("finite texture coordinates", "NaN or infinity");
    }

    void readFaces(const Element& e)
    {
        const int indices = e.find({"vertex_indices", "vertex_index"}, true),
                  uvs = e.find({"texcoord"}, true), texture = e.find({"texnumber"}, false);
        if (indices < 0)
            throw m_values.error("a list 'vertex_indices' or 'vertex_index' of 'face'", "none");
        double number = -1;
        std::vector<double> face_uv;
        for (std::size_t f = 0; f < e.count; ++f) {
            const std::size_t first = m_soup.corners.size();
            face_uv.clear();
            for (int k = 0; k < static_cast<int>(e.properties.size()); ++k) {
                const Property& p = e.properties[k];
                if (k == indices) readCorners(p);
                else if (k == uvs) {
                    for (std::size_t n = listSize(p); n > 0; --n)
                        face_uv.push_back(m_values.next(p.type));
                } else if (k == texture) {
                    const double read = m_values.next(p.type);
                    if (read != number) m_soup.startRange("", materialOf(read));
                    number = read;
                } else skip(p);
            }
            if (const std::size_t n = m_soup.corners.size() - first; face_uv.size() == 2 * n)
                for (std::size_t k = 0; k < n; ++k) {
                    m_soup.corners[first + k].uv = static_cast<std::int32_t>(m_soup.uvs.size());
                    addUv(face_uv[2 * k], face_uv[2 * k + 1]);
                }
            m_soup.endFace();
        }
    }

    std::int32_t materialOf(double number) const
    {
        return number >= 0 && number < double(m_header.materials.size())
            ? static_cast<std::int32_t>(number)
            : -1;
    }

    void readCorners(const Property& p)
    {
        for (std::size_t n = listSize(p); n > 0; --n) {
            const double x = m_values.next(p.type);
            if (!(x >= 0 && x <= INT32_MAX && x == std::floor(x)))
                throw m_values.error("the number of a vertex", fmt::format("{}", x));
            const auto point = static_cast<std::int32_t>(x);
            m_soup.corners.push_back({point});
        }
    }

public:
    /// What the file says for each vertex becomes what its corners have.
    void finish()
    {
        for (PolygonSoup::Corner& c : m_soup.corners) {
            if (m_has_normals) c.normal = c.point;
            if (m_has_uv && c.uv < 0) c.uv = c.point;
        }
    }

private:
    const Header& m_header;
    Values m_values;
    PolygonSoup& m_soup;
    bool m_has_normals = false, m_has_uv = false;
};

/// Throws Error if the file has points or strips alone.
void checkElements(const fs::path& file, const Header& h)
{
    std::string names;
    int vertices = 0, faces = 0;
    for (const Element& e : h.elements) {
        names += (names.empty() ? "" : ", ") + inQuotes(e.name);
        vertices += e.name == "vertex";
        faces += e.name == "face";
    }
    if (vertices != 1 || faces != 1)
        throw fileError(file, "", "one element 'vertex' and one element 'face'",
                        names.empty() ? "no element" : names,
                        "Points alone and strips of triangles are not supported: export faces, or "
                        "an OBJ.");
}

} // namespace

PolygonSoup readPly(const fs::path& file, std::string_view content)
{
    const Header h = readHeader(file, content);
    checkElements(file, h);
    const std::string_view bytes = content.substr(h.size);
    PolygonSoup soup;
    soup.materials = h.materials;
    const auto read = [&](auto values) {
        Body body(h, std::move(values), soup);
        body.read();
        body.finish();
    };
    if (h.format == Format::text) read(TextValues(file, bytes, h.lines));
    else read(BinaryValues(file, bytes, h.format == Format::big));
    return soup;
}

} // namespace volcomp
