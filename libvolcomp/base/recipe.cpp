// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/recipe.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <string_view>

#include <fmt/format.h>

#include "volcomp/base/hash.h"

namespace volcomp {
namespace {

constexpr const char* kBetween = " = ";

std::string onOneLine(std::string text)
{
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
    return text;
}

std::string hex(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

/// The values of each name, in their order.
std::map<std::string, std::vector<std::string>> byName(const Recipe& recipe)
{
    std::map<std::string, std::vector<std::string>> values;
    for (const auto& [name, value] : recipe.entries()) values[name].push_back(value);
    return values;
}

} // namespace

void Recipe::add(std::string name, std::string value)
{
    m_entries.emplace_back(onOneLine(std::move(name)), onOneLine(std::move(value)));
}

void Recipe::addLines(const std::string& prefix, const std::string& lines)
{
    std::string_view rest = lines;
    while (!rest.empty()) {
        const std::string_view line = rest.substr(0, rest.find('\n'));
        rest.remove_prefix(std::min(rest.size(), line.size() + 1));
        const std::size_t end = line.find(kBetween);
        if (end == line.npos) continue;
        add(prefix + std::string(line.substr(0, end)), std::string(line.substr(end + 3)));
    }
}

void Recipe::addFile(std::string name, const std::filesystem::path& file)
{
    std::error_code code;
    std::ifstream stream;
    if (std::filesystem::is_regular_file(file, code)) stream.open(file, std::ios::binary);
    std::array<char, 1 << 16> bytes;
    std::uint64_t hash = fnv1a("");
    while (stream.is_open() && stream.good()) {
        stream.read(bytes.data(), bytes.size());
        hash = fnv1a({bytes.data(), static_cast<std::size_t>(stream.gcount())}, hash);
    }
    add(std::move(name), stream.is_open() && stream.eof() ? hex(hash) : kUnknown);
}

std::string Recipe::text() const
{
    std::string text;
    for (const auto& [name, value] : m_entries) {
        text += name;
        text += kBetween;
        text += value;
        text += '\n';
    }
    return text;
}

Recipe Recipe::fromText(const std::string& text)
{
    Recipe recipe;
    recipe.addLines("", text);
    return recipe;
}

std::string Recipe::hash() const { return hex(fnv1a(text())); }

std::vector<RecipeDifference> differences(const Recipe& made, const Recipe& wanted)
{
    std::vector<RecipeDifference> result;
    auto made_values = byName(made);
    std::map<std::string, std::size_t> used;
    const auto unknown = [](const std::string& value) { return value == Recipe::kUnknown; };
    for (const auto& [name, value] : wanted.entries()) {
        const std::vector<std::string>& values = made_values[name];
        const std::size_t at = used[name]++;
        const std::string other = at < values.size() ? values[at] : "";
        if (other != value && !unknown(other) && !unknown(value))
            result.push_back({name, other, value});
    }
    std::map<std::string, std::size_t> seen;
    for (const auto& [name, value] : made.entries())
        if (seen[name]++ >= used[name] && !unknown(value)) result.push_back({name, value, ""});
    return result;
}

} // namespace volcomp
