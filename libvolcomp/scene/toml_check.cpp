// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/toml_check.h"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/scene/toml_file.h"
#include "volcomp/scene/toml_reader.h"

namespace volcomp {
namespace {

constexpr int kDeepest = 32;

/// Returns the place behind the string that begins at `at` with a quotation mark; the end of the
/// text if it has no end, and the end of the line for a string of one line.
std::size_t behindString(std::string_view text, std::size_t at)
{
    const char quote = text[at];
    const std::string_view triple = quote == '"' ? "\"\"\"" : "'''";
    const bool lines = text.substr(at, 3) == triple;
    for (std::size_t i = at + (lines ? 3 : 1); i < text.size(); ++i) {
        if (quote == '"' && text[i] == '\\') ++i;
        else if (lines && text.substr(i, 3) == triple) return i + 3;
        else if (!lines && text[i] == quote) return i + 1;
        else if (!lines && text[i] == '\n') return i;
    }
    return text.size();
}

[[noreturn]] void fail(const TomlFile& file, std::size_t at, const std::string& what,
                       const std::string& note = "one too many")
{
    const std::string_view before = std::string_view(file.text).substr(0, at);
    const auto line =
        static_cast<toml::source_index>(1 + std::count(before.begin(), before.end(), '\n'));
    const std::size_t begin = before.rfind('\n') + 1;    // 0 if this is the first line
    const auto column = static_cast<toml::source_index>( // bytes that begin a character
        1
        + std::count_if(before.begin() + static_cast<std::ptrdiff_t>(begin), before.end(),
                        [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
    const toml::source_region region{{line, column}, {line, column + 1}, {}};
    throw Error(
        file.pointed(fmt::format("{}:{}: {}", file.file.string(), line, what), region, note));
}

[[noreturn]] void failMore(const TomlFile& file, std::size_t at, const std::string& most)
{
    fail(file, at, "expected at most " + most + ", found more");
}

/// Throws Error if the table's header that begins with the bracket at `at` has no name. toml++
/// 3.3.0 would go on as if there were one.
void requireHeader(const TomlFile& file, std::size_t at)
{
    const std::string_view text = file.text;
    std::size_t i = at + 1;
    if (i < text.size() && text[i] == '[') ++i;
    while (i < text.size() && (text[i] == ' ' || text[i] == '\t')) ++i;
    constexpr std::string_view kFirst =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-\"'";
    if (i == text.size() || kFirst.find(text[i]) == kFirst.npos)
        fail(file, std::min(i, text.size() - 1), "not valid TOML: expected a table's name", "here");
}

} // namespace

void requireFlat(const TomlFile& file, ReadBudget& budget)
{
    const std::string_view text = file.text;
    int open = 0, dots = 0;
    bool line_begins = true;
    for (std::size_t i = 0; i < text.size();) {
        const char c = text[i];
        if (c == '"' || c == '\'') {
            i = behindString(text, i);
            line_begins = false;
            continue;
        }
        if (c == '#') {
            i = std::min(text.find('\n', i), text.size());
            continue;
        }
        if (c == '[' && line_begins && open == 0) requireHeader(file, i);
        if (c == '{' || (c == '[' && line_begins)) {
            if (budget.tables == 0)
                failMore(file, i, fmt::format("{} tables in all", ReadBudget().tables));
            --budget.tables;
        }
        if (c == '[' || c == '{') ++open;
        if (c == ']' || c == '}') open = std::max(0, open - 1);
        if (open > kDeepest) failMore(file, i, fmt::format("{} open brackets", kDeepest));
        if (c == '.') ++dots;
        else if (std::string_view("=,[]{}\n").find(c) != std::string_view::npos) dots = 0;
        if (dots >= kDeepest) failMore(file, i, fmt::format("{} parts of a key", kDeepest));
        line_begins = c == '\n' || (line_begins && (c == ' ' || c == '\t'));
        ++i;
    }
}

} // namespace volcomp
