// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

namespace {

/// What toml++ asserts. Without this, a release build takes what is asserted for granted, and
/// toml++ 3.3.0 asserts what the bytes of a file can break.
constexpr void requireOfToml(bool holds)
{
    if (!holds) throw std::logic_error("toml++ does not understand it");
}

} // namespace

#undef NDEBUG
#define TOML_ASSERT(expr) requireOfToml(static_cast<bool>(expr))
#define TOML_IMPLEMENTATION
#include "volcomp/scene/toml_file.h"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/scene/scene_text.h"
#include "volcomp/scene/toml_check.h"
#include "volcomp/scene/toml_reader.h"

namespace volcomp {
namespace {

constexpr std::size_t kShownLine = 100, kShownValue = 60;

/// Returns the number of bytes of the character (UTF-8) at `at`; 0 if there is none.
std::size_t characterSize(const std::string& text, std::size_t at)
{
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
    };
    const unsigned first = byte(at), second = byte(at + 1);
    const std::size_t size = first < 0x80 ? 1
        : first >= 0xc2 && first < 0xe0   ? 2
        : first >= 0xe0 && first < 0xf0   ? 3
        : first >= 0xf0 && first < 0xf5   ? 4
                                          : 0;
    for (std::size_t i = 1; i < size; ++i)
        if ((byte(at + i) & 0xc0) != 0x80) return 0;
    const bool overlong = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90);
    const bool beyond = (first == 0xed && second >= 0xa0) || (first == 0xf4 && second >= 0x90);
    return overlong || beyond ? 0 : size;
}

/// Returns the characters of a text, each a text of its own; control characters and damaged bytes
/// as '?', a tab as a space.
std::vector<std::string> characters(const std::string& text)
{
    std::vector<std::string> result;
    for (std::size_t i = 0; i < text.size();) {
        const std::size_t size = characterSize(text, i);
        const auto c = static_cast<unsigned char>(text[i]);
        const bool control = c < 0x20 || c == 0x7f
            || (size == 2 && c == 0xc2 && static_cast<unsigned char>(text[i + 1]) < 0xa0);
        result.push_back(c == '\t' ? " " : control || size == 0 ? "?" : text.substr(i, size));
        i += std::max<std::size_t>(size, 1);
    }
    return result;
}

/// Returns the first `count` characters of a text as it is shown, and "..." if there are more.
std::string firstOf(const std::string& text, std::size_t count)
{
    const auto all = characters(text.substr(0, 4 * (count + 1)));
    std::string result;
    for (std::size_t i = 0; i < std::min(count, all.size()); ++i) result += all[i];
    return result + (all.size() > count ? "..." : "");
}

/// Returns what is left of a text without its first `count` characters.
std::string without(const std::string& text, std::size_t count)
{
    std::size_t at = 0;
    for (; count > 0 && at < text.size(); --count)
        at += std::max<std::size_t>(characterSize(text, at), 1);
    return text.substr(std::min(at, text.size()));
}

/// A text without spaces at its ends.
std::string trimmed(const std::string& text)
{
    const std::size_t first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
    return first == text.npos ? std::string() : text.substr(first, last - first + 1);
}

/// One part of a dotted key, in quotation marks if it needs them.
std::string keyPart(const std::string& part)
{
    constexpr const char* kBare =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";
    return !part.empty() && part.find_first_not_of(kBare) == part.npos ? part : '"' + part + '"';
}

/// A dotted key as TOML wants it. One with quotation marks stays as it is.
std::string dottedKey(const std::string& key)
{
    if (key.find_first_of("\"'") != key.npos) return key;
    std::string result;
    for (std::size_t at = 0; at <= key.size();) {
        const std::size_t end = std::min(key.find('.', at), key.size());
        if (at > 0) result += '.';
        result += keyPart(key.substr(at, end - at));
        at = end + 1;
    }
    return result;
}

Error notToml(const TomlFile& file, const toml::parse_error& error)
{
    std::string what(error.description());
    if (what.find("utf-8") != what.npos) what = "a byte that is not UTF-8; save the file as UTF-8";
    return Error(file.pointed(fmt::format("{}:{}: not valid TOML: {}", file.file.string(),
                                          error.source().begin.line, what),
                              error.source(), "here"));
}

} // namespace

std::string printable(const std::string& text) { return firstOf(text, kShownValue); }

const TomlFile& TomlFile::of(const toml::source_region& at) const
{
    if (at.path)
        for (const auto& other : others)
            if (other->file.string() == *at.path) return *other;
    return *this;
}

std::string TomlFile::placeOf(const toml::source_region& at) const
{
    const TomlFile& from = of(at);
    return from.is_setting ? from.file.string()
                           : fmt::format("{}:{}", from.file.string(), at.begin.line);
}

std::string TomlFile::line(std::size_t number) const
{
    std::size_t begin = 0;
    for (std::size_t i = 1; i < number && begin != text.npos; ++i)
        if (begin = text.find('\n', begin); begin != text.npos) ++begin;
    if (number == 0 || begin == text.npos) return {};
    std::size_t end = std::min(text.find('\n', begin), text.size());
    if (end > begin && text[end - 1] == '\r') --end;
    if (begin == 0 && text.rfind("\xef\xbb\xbf", 0) == 0) begin = std::min<std::size_t>(3, end);
    return text.substr(begin, end - begin);
}

std::string TomlFile::pointed(const std::string& message, const toml::source_region& at,
                              const std::string& note) const
{
    if (at.begin.line == 0 || at.begin.column == 0) return message;
    if (&of(at) != this) return of(at).pointed(message, at, note);
    const std::size_t column = at.begin.column - 1,
                      from = column < kShownLine - 20 ? 0 : column - 20;
    const std::string shown = firstOf(without(line(at.begin.line), from), kShownLine);
    const std::string lead = from > 0 ? "..." : "", number = std::to_string(at.begin.line),
                      margin(number.size() + 2, ' ');
    const std::size_t length = characters(shown).size(), begin = column - from;
    const std::size_t end =
        at.end.line > at.begin.line ? length : std::max(at.end.column, 1u) - 1 - from;
    const std::size_t width = std::max(std::min(end, length), begin + 1) - begin;
    return fmt::format("{}\n{}|\n {} | {}{}\n{}| {}^{} {}", message, margin, number, lead, shown,
                       margin, std::string(lead.size() + begin, ' '), std::string(width - 1, '~'),
                       note);
}

std::string TomlFile::shown(const toml::source_region& at) const
{
    if (at.begin.line == 0 || at.begin.column == 0) return "a value";
    if (&of(at) != this) return of(at).shown(at);
    const std::string rest = without(line(at.begin.line), at.begin.column - 1);
    if (at.end.line > at.begin.line) return firstOf(rest, kShownValue) + "...";
    const std::size_t length = at.end.column - std::min(at.begin.column, at.end.column);
    return firstOf(rest.substr(0, rest.size() - without(rest, length).size()), kShownValue);
}

std::shared_ptr<TomlFile> parseToml(const std::filesystem::path& file, ReadBudget& budget)
{
    auto result = std::make_shared<TomlFile>();
    result->file = file;
    result->text = readSceneText(file, budget.bytes);
    budget.bytes -= result->text.size();
    requireFlat(*result, budget);
    try {
        result->table = toml::parse(std::string_view(result->text), file.string());
    } catch (const toml::parse_error& error) {
        throw notToml(*result, error);
    } catch (const std::logic_error& error) {
        throw Error(file.string() + ": not valid TOML: " + error.what());
    }
    if (result->table.empty())
        throw fileError(file, "", "a scene", "an empty file",
                        "scenes/README.md shows what a scene holds.");
    return result;
}

std::shared_ptr<TomlFile> parseSetting(const std::string& text)
{
    auto result = std::make_shared<TomlFile>();
    result->file = "--set " + printable(text);
    result->is_setting = true;
    const auto fail = [&](const std::string& found) {
        return Error(result->file.string()
                     + ": expected KEY=VALUE, such as light.rim.strength=\"#ffcc88\" or "
                       "render.samples=4, found "
                     + found);
    };
    const std::size_t equals = text.find('=');
    if (equals == text.npos || equals == 0 || text[0] == '[')
        throw fail(equals == 0 ? "no key" : equals == text.npos ? "no =" : "a bracket first");
    const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20; };
    if (std::any_of(text.begin(), text.end(), control)) throw fail("control characters");
    const std::string key = dottedKey(trimmed(text.substr(0, equals))),
                      value = trimmed(text.substr(equals + 1));
    for (const bool as_word : {false, true}) {
        if (as_word && value.find_first_of("\"'\\\n") != value.npos) break;
        result->text = key + '=' + (as_word ? '"' + value + '"' : value);
        ReadBudget budget;
        requireFlat(*result, budget);
        try {
            result->table = toml::parse(std::string_view(result->text), result->file.string());
            if (!result->table.empty()) return result;
        } catch (const std::exception&) { // then it is a word, or nothing
        }
    }
    throw fail("what is no value of TOML");
}

} // namespace volcomp
