// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/point_table.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uintmax_t kMostBytes = std::uintmax_t(16) << 30;

/// What the columns of a table mean.
enum Column {
    kX,
    kY,
    kZ,
    kNX,
    kNY,
    kNZ,
    kQX,
    kQY,
    kQZ,
    kQW,
    kScale,
    kVariant,
    kRed,
    kGreen,
    kBlue,
    kBox,
    kColumns
};
constexpr const char* kNames[kColumns] = {"x",   "y",     "z",    "nx", "ny",    "nz",
                                          "qx",  "qy",    "qz",   "qw", "scale", "variant",
                                          "red", "green", "blue", "box"};

int columnOf(std::string_view name)
{
    for (int c = 0; c < kColumns; ++c)
        if (name == kNames[c]) return c;
    return -1;
}

/// The numbers of one place, those that its table has.
struct Numbers {
    std::array<double, kColumns> value{};
    std::array<bool, kColumns> has{};

    bool hasAll(int first, int last) const
    {
        return std::all_of(has.begin() + first, has.begin() + last + 1, [](bool b) { return b; });
    }
    Vec3d vector(int first) const
    {
        const auto i = std::size_t(first);
        return {value[i], value[i + 1], value[i + 2]};
    }
};

/// Two axes from what may be neither unit nor at right angles.
std::pair<Vec3d, Vec3d> axesOf(const fs::path& file, const std::string& place, Vec3d x, Vec3d y)
{
    const double length = y.length();
    if (length > 0) y /= length;
    x -= y * x.dot(y);
    if (!(length > 1e-9 && x.length() > 1e-9))
        throw fileError(file, place, "two axes of different directions", "others");
    return {x / x.length(), y};
}

std::pair<Vec3d, Vec3d> axesOf(const fs::path& file, const std::string& place, const Numbers& n)
{
    double x = n.value[kQX], y = n.value[kQY], z = n.value[kQZ], w = n.value[kQW];
    const double length = std::sqrt(x * x + y * y + z * z + w * w);
    if (!(length > 1e-9))
        throw fileError(file, place, "a rotation (a quaternion) that is not 0", "0");
    x /= length, y /= length, z /= length, w /= length;
    return {Vec3d(1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)),
            Vec3d(2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w))};
}

/// Checks the numbers and makes a place of them.
GivenPlace placeOf(const fs::path& file, const std::string& place, const Numbers& n)
{
    for (std::size_t c = 0; c < kColumns; ++c)
        if (n.has[c] && !std::isfinite(n.value[c]))
            throw fileError(file, place, fmt::format("a finite '{}'", kNames[c]), "another one");
    if (!n.hasAll(kX, kZ)) throw fileError(file, place, "a position x, y, z", "none");
    GivenPlace p;
    p.position = n.vector(kX);
    if (n.hasAll(kNX, kNZ)) {
        const Vec3d normal = n.vector(kNX);
        if (!(normal.length() > 1e-9)) throw fileError(file, place, "a normal of some length", "0");
        p.normal = normal / normal.length();
    }
    if (n.hasAll(kQX, kQW)) p.axes = axesOf(file, place, n);
    if (n.has[kScale]) p.scale = n.value[kScale];
    if (!(p.scale > 1e-9 && p.scale < 1e9))
        throw fileError(file, place, "a scale above 0", fmt::format("{:g}", p.scale));
    if (n.has[kVariant]) {
        const double variant = n.value[kVariant];
        if (!(variant >= 1 && variant <= 65536 && variant == std::floor(variant)))
            throw fileError(file, place, "a variant, counted from 1", fmt::format("{:g}", variant));
        p.variant = int(variant) - 1;
    }
    if (n.hasAll(kRed, kBlue)) {
        p.tint = Vec3f(n.vector(kRed));
        for (int k = 0; k < 3; ++k)
            if (!(p.tint[k] >= 0 && p.tint[k] <= 1e30f))
                throw fileError(file, place, "a colour of numbers from 0 to 1e30",
                                fmt::format("{:g}", n.vector(kRed)[k]));
    }
    return p;
}

// ---- CSV

std::string_view trimmed(std::string_view text)
{
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '"'; };
    while (!text.empty() && blank(text.front())) text.remove_prefix(1);
    while (!text.empty() && blank(text.back())) text.remove_suffix(1);
    return text;
}

std::vector<std::string_view> fieldsOf(std::string_view line)
{
    std::vector<std::string_view> fields;
    for (std::size_t from = 0;;) {
        const std::size_t comma = std::min(line.find(',', from), line.size());
        fields.push_back(trimmed(line.substr(from, comma - from)));
        if (comma == line.size()) return fields;
        from = comma + 1;
    }
}

double numberOf(const fs::path& file, const std::string& place, std::string_view text)
{
    double value = 0;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (code != std::errc() || end != text.data() + text.size())
        throw fileError(file, place, "a number", "'" + std::string(text.substr(0, 40)) + "'");
    return value;
}

std::vector<GivenPlace> readCsv(const fs::path& file, std::string_view content)
{
    std::vector<GivenPlace> places;
    std::vector<int> columns;
    std::size_t line_number = 0;
    for (std::size_t from = 0; from < content.size();) {
        const std::size_t end = std::min(content.find('\n', from), content.size());
        const std::string_view line = trimmed(content.substr(from, end - from));
        from = end + 1;
        ++line_number;
        if (line.empty() || line.front() == '#') continue;
        const std::vector<std::string_view> fields = fieldsOf(line);
        const std::string place = fmt::format("line {}", line_number);
        if (columns.empty()) {
            for (const std::string_view name : fields) columns.push_back(columnOf(name));
            for (const int c : {kX, kY, kZ})
                if (std::find(columns.begin(), columns.end(), c) == columns.end())
                    throw fileError(file, place,
                                    "a line of names with x, y and z, separated by commas",
                                    "'" + std::string(line.substr(0, 60)) + "'");
            continue;
        }
        if (fields.size() != columns.size())
            throw fileError(file, place, fmt::format("{} values", columns.size()),
                            std::to_string(fields.size()));
        Numbers n;
        std::string_view box;
        for (std::size_t i = 0; i < fields.size(); ++i) {
            if (columns[i] < 0) continue;
            if (columns[i] == kBox) {
                box = fields[i];
                continue;
            }
            n.value[std::size_t(columns[i])] = numberOf(file, place, fields[i]);
            n.has[std::size_t(columns[i])] = true;
        }
        places.push_back(placeOf(file, place, n));
        places.back().box = box;
    }
    if (columns.empty()) throw fileError(file, "", "a line of names with x, y and z", "none");
    return places;
}

// ---- JSON

void takeArray(const fs::path& file, const std::string& place, const json& object, const char* key,
               int first, int count, Numbers& n)
{
    if (!object.contains(key)) return;
    const auto values = object.at(key).get<std::vector<double>>();
    if (values.size() != std::size_t(count))
        throw fileError(file, place, fmt::format("{} numbers as '{}'", count, key),
                        std::to_string(values.size()));
    for (int k = 0; k < count; ++k) {
        const auto at = std::size_t(first) + std::size_t(k);
        n.value[at] = values[std::size_t(k)];
        n.has[at] = true;
    }
}

Vec3d vectorOf(const json& object, const char* key)
{
    const auto v = object.at(key).get<std::array<double, 3>>();
    return {v[0], v[1], v[2]};
}

std::vector<GivenPlace> readJson(const fs::path& file, std::string_view content)
{
    std::vector<GivenPlace> places;
    std::string place;
    try {
        const json all = json::parse(content);
        if (!all.is_array()) throw fileError(file, "", "an array of objects", "something else");
        for (std::size_t i = 0; i < all.size(); ++i) {
            place = fmt::format("place {}", i + 1);
            const json& object = all[i];
            Numbers n;
            takeArray(file, place, object, "position", kX, 3, n);
            takeArray(file, place, object, "normal", kNX, 3, n);
            takeArray(file, place, object, "rotation", kQX, 4, n);
            takeArray(file, place, object, "tint", kRed, 3, n);
            for (const int c : {kScale, kVariant})
                if (object.contains(kNames[c])) {
                    n.value[std::size_t(c)] = object.at(kNames[c]).get<double>();
                    n.has[std::size_t(c)] = true;
                }
            places.push_back(placeOf(file, place, n));
            GivenPlace& p = places.back();
            if (object.contains("x_axis") && object.contains("y_axis"))
                p.axes =
                    axesOf(file, place, vectorOf(object, "x_axis"), vectorOf(object, "y_axis"));
            p.box = object.value("box", "");
        }
    } catch (const json::exception& e) {
        throw fileError(file, place, "places as volcomp-compose --placements writes them",
                        std::string(e.what()).substr(0, 200));
    }
    return places;
}

// ---- PLY

struct PlyType {
    int size;
    char kind; ///< i, u or f
};

PlyType plyType(std::string_view name)
{
    static const std::map<std::string_view, PlyType> kTypes = {
        {"char", {1, 'i'}},  {"int8", {1, 'i'}},    {"uchar", {1, 'u'}},  {"uint8", {1, 'u'}},
        {"short", {2, 'i'}}, {"int16", {2, 'i'}},   {"ushort", {2, 'u'}}, {"uint16", {2, 'u'}},
        {"int", {4, 'i'}},   {"int32", {4, 'i'}},   {"uint", {4, 'u'}},   {"uint32", {4, 'u'}},
        {"float", {4, 'f'}}, {"float32", {4, 'f'}}, {"double", {8, 'f'}}, {"float64", {8, 'f'}}};
    const auto at = kTypes.find(name);
    return at == kTypes.end() ? PlyType{0, 0} : at->second;
}

struct PlyProperty {
    PlyType type;
    int column;
};

struct PlyHeader {
    bool ascii = false, big = false;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;
    std::map<int, std::string> boxes;
    std::size_t end = 0; ///< where the numbers begin
};

std::vector<std::string_view> wordsOf(std::string_view line)
{
    std::vector<std::string_view> words;
    for (std::size_t from = line.find_first_not_of(" \t"); from < line.size();) {
        const std::size_t end = std::min(line.find_first_of(" \t", from), line.size());
        words.push_back(line.substr(from, end - from));
        from = line.find_first_not_of(" \t", end);
    }
    return words;
}

PlyHeader plyHeader(const fs::path& file, std::string_view content)
{
    PlyHeader h;
    int element = 0;
    bool format = false;
    for (std::size_t from = 0, number = 1;; ++number) {
        const std::size_t end = content.find('\n', from);
        if (end == content.npos || number > 100'000)
            throw fileError(file, "the header", "a line 'end_header'", "none");
        std::string_view line = content.substr(from, end - from);
        while (!line.empty() && line.back() == '\r') line.remove_suffix(1);
        from = end + 1;
        const auto words = wordsOf(line);
        const std::string place = fmt::format("line {}", number);
        const auto fail = [&](const char* expected) {
            return fileError(file, place, expected, "'" + std::string(line.substr(0, 60)) + "'");
        };
        if (number == 1 && line != "ply") throw fail("ply");
        if (words.empty() || words[0] == "ply") continue;
        if (words[0] == "end_header") {
            h.end = from;
            break;
        }
        if (words[0] == "comment" && words.size() >= 4 && words[1] == "box") {
            int box = 0;
            std::from_chars(words[2].data(), words[2].data() + words[2].size(), box);
            h.boxes[box] = std::string(line.substr(std::size_t(words[3].data() - line.data())));
        } else if (words[0] == "format" && words.size() >= 2) {
            h.ascii = words[1] == "ascii";
            h.big = words[1] == "binary_big_endian";
            format = h.ascii || h.big || words[1] == "binary_little_endian";
        } else if (words[0] == "element" && words.size() == 3) {
            if (element++ == 0) {
                const auto [last, code] =
                    std::from_chars(words[2].data(), words[2].data() + words[2].size(), h.count);
                if (words[1] != "vertex" || code != std::errc()
                    || last != words[2].data() + words[2].size())
                    throw fail("element vertex and their number first");
            }
        } else if (words[0] == "property" && element == 1) {
            if (words.size() != 3 || plyType(words[1]).size == 0)
                throw fail("a property of one number");
            h.properties.push_back({plyType(words[1]), columnOf(words[2])});
        }
    }
    if (!format) throw fileError(file, "the header", "a format that is known", "none");
    if (h.properties.empty() && h.count > 0)
        throw fileError(file, "the header", "properties of vertices", "none");
    return h;
}

double plyNumber(const char* p, PlyType type, bool big)
{
    char bytes[8] = {};
    for (int k = 0; k < type.size; ++k) bytes[k] = p[big ? type.size - 1 - k : k];
    const auto as = [&](auto value) {
        std::memcpy(&value, bytes, sizeof value);
        return double(value);
    };
    if (type.kind == 'f') return type.size == 4 ? as(float()) : as(double());
    if (type.kind == 'u')
        return type.size == 1 ? as(std::uint8_t())
            : type.size == 2  ? as(std::uint16_t())
                              : as(std::uint32_t());
    return type.size == 1 ? as(std::int8_t())
        : type.size == 2  ? as(std::int16_t())
                          : as(std::int32_t());
}

std::vector<GivenPlace> readPly(const fs::path& file, std::string_view content)
{
    const PlyHeader h = plyHeader(file, content);
    std::string_view rest = content.substr(h.end);
    std::size_t stride = 0;
    for (const PlyProperty& p : h.properties) stride += std::size_t(p.type.size);
    const std::uint64_t least = h.ascii ? 2 * h.properties.size() : stride;
    if (least > 0 && h.count > (rest.size() + 1) / least)
        throw fileError(file, "", fmt::format("{} vertices", h.count), "fewer",
                        "Is the file complete?");
    std::vector<GivenPlace> places;
    places.reserve(h.count);
    for (std::uint64_t i = 0; i < h.count; ++i) {
        const std::string place = fmt::format("vertex {}", i + 1);
        Numbers n;
        for (const PlyProperty& p : h.properties) {
            double value = 0;
            if (h.ascii) {
                const std::size_t from = std::min(rest.find_first_not_of(" \t\r\n"), rest.size());
                const std::size_t end = std::min(rest.find_first_of(" \t\r\n", from), rest.size());
                value = numberOf(file, place, rest.substr(from, end - from));
                rest.remove_prefix(end);
            } else {
                value = plyNumber(rest.data(), p.type, h.big);
                rest.remove_prefix(std::size_t(p.type.size));
            }
            if (p.column < 0) continue;
            if (p.column >= kRed && p.column <= kBlue && p.type.kind != 'f')
                value /= std::pow(2.0, 8 * p.type.size - (p.type.kind == 'i' ? 1 : 0)) - 1;
            n.value[std::size_t(p.column)] = value;
            n.has[std::size_t(p.column)] = true;
        }
        places.push_back(placeOf(file, place, n));
        if (n.has[kBox])
            if (const auto box = h.boxes.find(int(std::clamp(n.value[kBox], -1.0, 1e9)));
                box != h.boxes.end())
                places.back().box = box->second;
    }
    return places;
}

} // namespace

std::vector<GivenPlace> readPlaces(const fs::path& file)
{
    std::error_code code;
    if (!fs::is_regular_file(file, code))
        throw fileError(file, "", "places (PLY, CSV or JSON)", "no file", "Check the path.");
    if (fs::file_size(file, code) > kMostBytes) throw fileError(file, "", "at most 16 GB", "more");
    std::ifstream in(file, std::ios::binary);
    const std::string content{std::istreambuf_iterator<char>(in), {}};
    std::string ending = file.extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    if (ending == ".csv") return readCsv(file, content);
    if (ending == ".json") return readJson(file, content);
    if (ending == ".ply") return readPly(file, content);
    throw fileError(file, "", "a name that ends in .ply, .csv or .json",
                    "'" + file.extension().string() + "'");
}

} // namespace volcomp
