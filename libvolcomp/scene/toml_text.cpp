// SPDX-License-Identifier: Apache-2.0
#include <sstream>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "volcomp/scene/toml_file.h"

namespace volcomp {
namespace {

std::string quotedText(std::string_view text)
{
    std::string result = "\"";
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (c == '"' || c == '\\') result += std::string("\\") + c;
        else if (c == '\n') result += "\\n";
        else if (byte < 0x20 || byte == 0x7f) result += fmt::format("\\u{:04x}", byte);
        else result += c;
    }
    return result + '"';
}

std::string keyText(std::string_view key)
{
    constexpr std::string_view kBare =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
    const bool bare = !key.empty() && key.find_first_not_of(kBare) == key.npos;
    return bare ? std::string(key) : quotedText(key);
}

std::string valueText(const toml::node& value);

std::string tableText(const toml::table& table)
{
    std::string text;
    for (const auto& [key, value] : table)
        text += (text.empty() ? "" : ", ") + keyText(key.str()) + " = " + valueText(value);
    return "{" + text + "}";
}

std::string arrayText(const toml::array& array)
{
    std::string text;
    for (const toml::node& value : array) text += (text.empty() ? "" : ", ") + valueText(value);
    return "[" + text + "]";
}

std::string valueText(const toml::node& value)
{
    if (const auto* table = value.as_table()) return tableText(*table);
    if (const auto* array = value.as_array()) return arrayText(*array);
    if (const auto* text = value.as_string()) return quotedText(text->get());
    if (const auto* flag = value.as_boolean()) return flag->get() ? "true" : "false";
    if (const auto* whole = value.as_integer()) return std::to_string(whole->get());
    if (const auto* real = value.as_floating_point())
        return fmt::format("{}", real->get() == 0 ? 0.0 : real->get()); // -0 is 0
    std::ostringstream text; // dates and times, which no key takes
    if (const auto* date = value.as_date()) text << date->get();
    if (const auto* time = value.as_time()) text << time->get();
    if (const auto* both = value.as_date_time()) text << both->get();
    return text.str();
}

void addLines(const toml::table& table, const std::string& prefix, std::string& lines);

/// Appends the lines of one key, whose name with all that stands before it is `name`.
void addKey(const toml::node& value, const std::string& name, std::string& lines)
{
    const toml::array* array = value.as_array();
    if (const toml::table* table = value.as_table(); table && !table->empty())
        return addLines(*table, name + ".", lines);
    if (!array || array->empty() || !array->is_homogeneous(toml::node_type::table)) {
        lines += name + " = " + valueText(value) + "\n";
        return;
    }
    std::size_t number = 0;
    for (const toml::node& element : *array)
        addKey(element, fmt::format("{}.{}", name, ++number), lines);
}

void addLines(const toml::table& table, const std::string& prefix, std::string& lines)
{
    for (const auto& [key, value] : table) addKey(value, prefix + keyText(key.str()), lines);
}

} // namespace

std::string canonicalToml(const toml::table& table)
{
    std::string lines;
    addLines(table, "", lines);
    return lines;
}

} // namespace volcomp
