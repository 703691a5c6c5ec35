// SPDX-License-Identifier: Apache-2.0
#include "volcomp/surface/gltf_buffers.h"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMostBytes = std::uintmax_t(4) << 30; ///< of a file of numbers

int hexDigit(char c)
{
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

/// Nothing if a character is none of base64's.
bool decodeBase64(std::string_view text, std::string& out)
{
    std::uint32_t bits = 0;
    int count = 0;
    out.reserve(text.size() / 4 * 3);
    for (const char c : text) {
        std::uint32_t value = 0;
        if (c >= 'A' && c <= 'Z') value = std::uint32_t(c - 'A');
        else if (c >= 'a' && c <= 'z') value = std::uint32_t(c - 'a') + 26;
        else if (c >= '0' && c <= '9') value = std::uint32_t(c - '0') + 52;
        else if (c == '+') value = 62;
        else if (c == '/') value = 63;
        else if (c == '=') break;
        else return false;
        bits = bits << 6 | value;
        if (++count % 4 == 1) continue;
        out.push_back(static_cast<char>(bits >> (6 - 2 * ((count - 1) % 4)) & 0xff));
    }
    return true;
}

std::size_t bytesOf(int component)
{
    switch (component) {
    case 5120:
    case 5121:
        return 1;
    case 5122:
    case 5123:
        return 2;
    case 5125:
    case 5126:
        return 4;
    default:
        return 0;
    }
}

std::size_t widthOf(const std::string& type)
{
    if (type == "SCALAR") return 1;
    if (type.size() == 4 && type.rfind("VEC", 0) == 0 && type[3] >= '2' && type[3] <= '4')
        return std::size_t(type[3] - '0');
    return 0;
}

template <class T>
double as(const char* p)
{
    T value;
    std::memcpy(&value, p, sizeof value);
    return double(value);
}

double numberAt(const char* p, int component, bool normalised)
{
    switch (component) {
    case 5120:
        return normalised ? std::max(-1.0, as<std::int8_t>(p) / 127) : as<std::int8_t>(p);
    case 5121:
        return normalised ? as<std::uint8_t>(p) / 255 : as<std::uint8_t>(p);
    case 5122:
        return normalised ? std::max(-1.0, as<std::int16_t>(p) / 32767) : as<std::int16_t>(p);
    case 5123:
        return normalised ? as<std::uint16_t>(p) / 65535 : as<std::uint16_t>(p);
    case 5125:
        return as<std::uint32_t>(p);
    default:
        return as<float>(p);
    }
}

} // namespace

fs::path gltfPath(const fs::path& file, const std::string& uri)
{
    std::string name;
    for (std::size_t i = 0; i < uri.size(); ++i) {
        const int high = uri[i] == '%' && i + 2 < uri.size() ? hexDigit(uri[i + 1]) : -1,
                  low = high >= 0 ? hexDigit(uri[i + 2]) : -1;
        if (low >= 0) i += 2;
        name.push_back(low >= 0 ? static_cast<char>(16 * high + low) : uri[i]);
    }
    return file.parent_path() / name;
}

std::string gltfBytes(const fs::path& file, const std::string& place, const std::string& uri)
{
    if (uri.rfind("data:", 0) == 0) {
        const std::size_t comma = uri.find(',');
        std::string bytes;
        if (comma == uri.npos || uri.rfind(";base64", comma) == uri.npos
            || !decodeBase64(std::string_view(uri).substr(comma + 1), bytes))
            throw fileError(file, place, "data in base64", "something else");
        return bytes;
    }
    const fs::path path = gltfPath(file, uri);
    std::error_code code;
    if (!fs::is_regular_file(path, code))
        throw fileError(file, place, "the file '" + path.string() + "'", "no file",
                        "Keep the files of the mesh together.");
    if (fs::file_size(path) > kMostBytes) throw fileError(path, "", "at most 4 GB", "more");
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

GltfBuffers::GltfBuffers(const fs::path& file, const nlohmann::json& json, std::string_view binary)
    : m_file(file), m_json(json), m_binary(binary)
{
}

std::string_view GltfBuffers::buffer(std::uint64_t index)
{
    const nlohmann::json& buffers = m_json.at("buffers");
    const nlohmann::json& buffer = buffers.at(index);
    const std::string place = fmt::format("buffer {}", index);
    std::string_view bytes = m_binary;
    if (buffer.contains("uri")) {
        m_read.resize(buffers.size());
        if (m_read[index].empty())
            m_read[index] = gltfBytes(m_file, place, buffer.at("uri").get<std::string>());
        bytes = m_read[index];
    } else if (index != 0) {
        throw fileError(m_file, place, "an address of its bytes", "none");
    }
    const auto length = buffer.at("byteLength").get<std::uint64_t>();
    if (length > bytes.size())
        throw fileError(m_file, place, fmt::format("{} bytes", length),
                        std::to_string(bytes.size()), "Is the file complete?");
    return bytes.substr(0, length);
}

std::string_view GltfBuffers::view(std::uint64_t index)
{
    const nlohmann::json& view = m_json.at("bufferViews").at(index);
    const std::string_view bytes = buffer(view.at("buffer").get<std::uint64_t>());
    const std::uint64_t offset = view.value("byteOffset", std::uint64_t(0)),
                        length = view.at("byteLength").get<std::uint64_t>();
    if (offset > bytes.size() || length > bytes.size() - offset)
        throw fileError(m_file, fmt::format("buffer view {}", index),
                        fmt::format("a piece of the {} bytes of its buffer", bytes.size()),
                        fmt::format("{} bytes from {} on", length, offset));
    return bytes.substr(offset, length);
}

GltfBuffers::Span GltfBuffers::span(std::uint64_t index, std::size_t width)
{
    const nlohmann::json& accessor = m_json.at("accessors").at(index);
    const std::string place = fmt::format("accessor {}", index);
    if (accessor.contains("sparse") || !accessor.contains("bufferView"))
        throw fileError(m_file, place, "numbers in a buffer view",
                        "sparse ones, which are not supported");
    Span s{};
    s.component = accessor.at("componentType").get<int>();
    s.normalised = accessor.value("normalized", false);
    s.width = widthOf(accessor.at("type").get<std::string>());
    const std::size_t size = bytesOf(s.component) * s.width;
    if (size == 0 || s.width < width)
        throw fileError(m_file, place, fmt::format("{} numbers for each element", width),
                        fmt::format("type {} of components {}",
                                    accessor.at("type").get<std::string>(), s.component));
    const auto view_index = accessor.at("bufferView").get<std::uint64_t>();
    const std::string_view bytes = view(view_index);
    const std::uint64_t stride =
        m_json.at("bufferViews").at(view_index).value("byteStride", std::uint64_t(size));
    const std::uint64_t offset = accessor.value("byteOffset", std::uint64_t(0)),
                        count = accessor.at("count").get<std::uint64_t>();
    const bool fits = stride >= size && stride <= 4096 && offset <= bytes.size()
        && (count == 0
            || (size <= bytes.size() - offset
                && count - 1 <= (bytes.size() - offset - size) / stride));
    if (!fits)
        throw fileError(
            m_file, place,
            fmt::format("elements inside the {} bytes of buffer view {}", bytes.size(), view_index),
            fmt::format("{} elements {} bytes apart from byte {} on", count, stride, offset),
            "Is the file complete?");
    s.first = bytes.data() + offset;
    s.count = count;
    s.stride = stride;
    return s;
}

std::vector<double> GltfBuffers::numbers(std::uint64_t accessor, std::size_t width)
{
    const Span s = span(accessor, width);
    const std::size_t size = bytesOf(s.component);
    std::vector<double> result;
    result.reserve(s.count * width);
    for (std::size_t i = 0; i < s.count; ++i)
        for (std::size_t k = 0; k < width; ++k)
            result.push_back(
                numberAt(s.first + i * s.stride + k * size, s.component, s.normalised));
    return result;
}

std::vector<std::uint32_t> GltfBuffers::indices(std::uint64_t accessor)
{
    const Span s = span(accessor, 1);
    if (s.component != 5121 && s.component != 5123 && s.component != 5125)
        throw fileError(m_file, fmt::format("accessor {}", accessor),
                        "whole numbers without a sign", fmt::format("components {}", s.component));
    std::vector<std::uint32_t> result;
    result.reserve(s.count);
    for (std::size_t i = 0; i < s.count; ++i)
        result.push_back(
            static_cast<std::uint32_t>(numberAt(s.first + i * s.stride, s.component, false)));
    return result;
}

} // namespace volcomp
