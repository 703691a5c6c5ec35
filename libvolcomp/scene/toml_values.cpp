// SPDX-License-Identifier: Apache-2.0
// The values that a TableReader reads: a function for each type.
#include "volcomp/scene/toml_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "volcomp/base/srgb.h"
#include "volcomp/base/text.h"
#include "volcomp/scene/toml_state.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

std::string vectorText(const Vec3d& v)
{
    return fmt::format("[{:g}, {:g}, {:g}]", v[0], v[1], v[2]);
}

/// A range of whole numbers, in full.
std::string wholeRange(Interval r) { return fmt::format("{:.0f} to {:.0f}", r.low, r.high); }

/// Whether a text can be the path of a file and be printed.
bool isPath(const std::string& text)
{
    return !text.empty() && std::none_of(text.begin(), text.end(), [](char c) {
        return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
    });
}

/// What a key that is absent reads as while describing.
double lowest(Interval r) { return std::isfinite(r.low) ? r.low : 0; }

} // namespace

double TableReader::number(const Key& key, std::optional<double> fallback, Interval range)
{
    m_state->describe(key, "number", fallback ? fmt::format("{:g}", *fallback) : "required",
                      rangeText(range));
    const std::string expected = withRange("a number", range);
    if (const auto* v = m_state->find(key))
        return m_state->noted(key, m_state->real(*v, key.name, range, expected));
    if (!fallback) m_state->missing(key, expected);
    return m_state->noted(key, fallback.value_or(lowest(range)));
}

int TableReader::integer(const Key& key, std::optional<int> fallback, Interval range)
{
    range.high = std::min(range.high, double(std::numeric_limits<int>::max()));
    range.low = std::max(range.low, double(std::numeric_limits<int>::min()));
    m_state->describe(key, "integer", fallback ? std::to_string(*fallback) : "required",
                      wholeRange(range));
    const std::string expected = "a whole number, " + wholeRange(range);
    if (const auto* v = m_state->find(key)) {
        if (!v->is_integer()) m_state->fail(*v, key.name, expected);
        return m_state->noted(key, static_cast<int>(m_state->real(*v, key.name, range, expected)));
    }
    if (!fallback) m_state->missing(key, expected);
    return m_state->noted(key, fallback.value_or(static_cast<int>(lowest(range))));
}

std::uint64_t TableReader::seed(const Key& key, std::uint64_t fallback)
{
    m_state->describe(key, "integer", std::to_string(fallback), ">= 0");
    const auto* v = m_state->find(key);
    if (!v) return m_state->noted(key, fallback);
    if (!v->is_integer() || v->as_integer()->get() < 0)
        m_state->fail(*v, key.name, "a whole number >= 0");
    return m_state->noted(key, static_cast<std::uint64_t>(v->as_integer()->get()));
}

bool TableReader::flag(const Key& key, bool fallback)
{
    m_state->describe(key, "boolean", fallback ? "true" : "false", "");
    const auto* v = m_state->find(key);
    if (v && !v->is_boolean()) m_state->fail(*v, key.name, "true or false");
    return m_state->noted(key, v ? v->as_boolean()->get() : fallback);
}

std::string TableReader::text(const Key& key, std::optional<std::string> fallback)
{
    m_state->describe(key, "string", fallback ? '"' + *fallback + '"' : "required", "");
    if (const auto* v = m_state->find(key)) {
        if (!v->is_string()) m_state->fail(*v, key.name, "a string");
        return m_state->noted(key, v->as_string()->get());
    }
    if (!fallback) m_state->missing(key, "a string");
    return m_state->noted(key, fallback.value_or(std::string()));
}

std::string TableReader::name(const Key& key, std::optional<std::string> fallback)
{
    std::string text = this->text(key, std::move(fallback));
    require(!has(key.name) || isName(text), key.name, kNameRule);
    return text;
}

fs::path TableReader::path(const Key& key, std::optional<std::string> fallback)
{
    m_state->describe(key, "path", fallback ? '"' + *fallback + '"' : "required", "");
    std::string given;
    fs::path from = folder();
    if (const auto* v = m_state->find(key)) {
        if (!v->is_string() || !isPath(v->as_string()->get()))
            m_state->fail(*v, key.name, "a path of printable characters");
        given = v->as_string()->get();
        const TomlFile& file = m_state->source->of(v->source()); // it may be inherited
        if (&file != m_state->source.get() && !file.is_setting) from = file.file.parent_path();
    } else {
        if (!fallback) m_state->missing(key, "a path, relative to the scene file");
        given = fallback.value_or("");
    }
    m_state->noted(key, given);
    return given.empty() ? fs::path() : from / given;
}

std::vector<fs::path> TableReader::paths(const Key& key, std::vector<fs::path> fallback)
{
    m_state->describe(key, "paths", "[]", "");
    const auto* v = m_state->find(key);
    if (!v) return fallback;
    const char* expected = "a path of printable characters, or an array of such paths";
    if (!v->is_string() && !v->is_array()) m_state->fail(*v, key.name, expected);
    std::vector<fs::path> result;
    const auto add = [&](const toml::node& x) {
        if (!x.is_string() || !isPath(x.as_string()->get())) m_state->fail(x, key.name, expected);
        result.push_back(folder() / x.as_string()->get());
    };
    if (v->is_string()) add(*v);
    else
        for (const toml::node& x : *v->as_array()) add(x);
    return result;
}

std::vector<double> TableReader::numbers(const Key& key, std::vector<double> fallback,
                                         Interval range)
{
    m_state->describe(key, "array of numbers", fmt::format("[{}]", fmt::join(fallback, ", ")),
                      rangeText(range));
    const auto* v = m_state->find(key);
    return m_state->noted(
        key,
        v ? m_state->reals(*v, key.name, range, withRange("an array of numbers", range))
          : fallback);
}

std::vector<int> TableReader::integers(const Key& key, std::vector<int> fallback, Interval range)
{
    m_state->describe(key, "array of integers", fmt::format("[{}]", fmt::join(fallback, ", ")),
                      wholeRange(range));
    const auto* v = m_state->find(key);
    if (!v) return m_state->noted(key, fallback);
    const std::string expected =
        fmt::format("{} whole numbers, {}", fallback.size(), wholeRange(range));
    if (!v->is_array() || v->as_array()->size() != fallback.size())
        m_state->fail(*v, key.name, expected);
    for (const toml::node& x : *v->as_array())
        if (!x.is_integer()) m_state->fail(x, key.name, expected);
    const std::vector<double> numbers = m_state->reals(*v, key.name, range, expected);
    return m_state->noted(key, std::vector<int>(numbers.begin(), numbers.end()));
}

Vec3d TableReader::vector(const Key& key, std::optional<Vec3d> fallback, Interval range)
{
    m_state->describe(key, "vector", fallback ? vectorText(*fallback) : "required",
                      rangeText(range));
    const std::string expected = withRange("three numbers [x, y, z]", range);
    if (const auto* v = m_state->find(key)) {
        const auto x = m_state->reals(*v, key.name, range, expected);
        if (x.size() != 3) m_state->fail(*v, key.name, expected);
        return m_state->noted(key, Vec3d(x[0], x[1], x[2]));
    }
    if (!fallback) m_state->missing(key, expected);
    return m_state->noted(key, fallback.value_or(Vec3d(lowest(range))));
}

Vec3d TableReader::colour(const Key& key, std::optional<Vec3d> fallback, Interval range)
{
    m_state->describe(key, "colour", fallback ? vectorText(*fallback) : "required",
                      rangeText(range));
    const std::string expected = withRange(
        "a colour, [r, g, b] or one number for grey (linear), or \"#rrggbb\" (sRGB),", range);
    if (const auto* v = m_state->find(key)) {
        if (v->is_string()) {
            const std::string& s = v->as_string()->get();
            if (s.size() != 7 || s[0] != '#'
                || s.find_first_not_of("0123456789abcdefABCDEF", 1) != s.npos)
                m_state->fail(*v, key.name, expected);
            const unsigned long rgb = std::stoul(s.substr(1), nullptr, 16);
            return m_state->noted(key,
                                  Vec3d(linearFromSrgb((rgb >> 16) / 255.0),
                                        linearFromSrgb((rgb >> 8 & 255) / 255.0),
                                        linearFromSrgb((rgb & 255) / 255.0)));
        }
        if (v->is_number())
            return m_state->noted(key, Vec3d(m_state->real(*v, key.name, range, expected)));
        const auto x = m_state->reals(*v, key.name, range, expected);
        if (x.size() != 3) m_state->fail(*v, key.name, expected);
        return m_state->noted(key, Vec3d(x[0], x[1], x[2]));
    }
    if (!fallback) m_state->missing(key, expected);
    return m_state->noted(key, fallback.value_or(Vec3d(lowest(range))));
}

Vec3d TableReader::direction(const Key& key, std::optional<Vec3d> fallback)
{
    m_state->describe(key, "direction", fallback ? vectorText(*fallback) : "required", "not zero");
    const char* expected = "a direction [x, y, z] that is not zero";
    Vec3d d = fallback.value_or(Vec3d(0, 1, 0));
    if (const auto* v = m_state->find(key)) {
        const auto x = m_state->reals(*v, key.name, {-1e100, 1e100}, expected);
        if (x.size() != 3) m_state->fail(*v, key.name, expected);
        d = {x[0], x[1], x[2]};
        const double largest = std::max({std::abs(d[0]), std::abs(d[1]), std::abs(d[2])});
        if (!(largest > 0)) m_state->fail(*v, key.name, expected);
        d /= largest;
    } else if (!fallback) m_state->missing(key, expected);
    return m_state->noted(key, d / d.length());
}

std::pair<double, double>
TableReader::span(const Key& key, std::optional<std::pair<double, double>> fallback, Interval range)
{
    m_state->describe(key, "span",
                      fallback ? fmt::format("[{:g}, {:g}]", fallback->first, fallback->second)
                               : "required",
                      rangeText(range));
    const std::string expected = withRange("a number or [low, high] with low <= high,", range);
    if (const auto* v = m_state->find(key)) {
        if (!v->is_array()) {
            const double x = m_state->real(*v, key.name, range, expected);
            return m_state->noted(key, std::pair(x, x));
        }
        const auto x = m_state->reals(*v, key.name, range, expected);
        if (x.size() != 2 || x[0] > x[1]) m_state->fail(*v, key.name, expected);
        return m_state->noted(key, std::pair(x[0], x[1]));
    }
    if (!fallback) m_state->missing(key, expected);
    return m_state->noted(key, fallback.value_or(std::pair(lowest(range), lowest(range))));
}

int TableReader::word(const Key& key, std::optional<int> fallback,
                      const std::vector<std::string>& words)
{
    m_state->describe(key, "word", fallback ? '"' + words[*fallback] + '"' : "required",
                      joined(words, ", "));
    const std::string expected = "one of \"" + joined(words, "\", \"") + "\"";
    if (const auto* v = m_state->find(key)) {
        if (!v->is_string()) m_state->fail(*v, key.name, expected);
        const auto it = std::find(words.begin(), words.end(), v->as_string()->get());
        if (it == words.end()) {
            const std::string hint = spellingHint(v->as_string()->get(), words);
            m_state->fail(*v, key.name,
                          hint.empty() ? expected : expected + " (did you mean \"" + hint + "\"?)");
        }
        m_state->noted(key, *it);
        return static_cast<int>(it - words.begin());
    }
    if (!fallback) m_state->missing(key, expected);
    if (fallback) m_state->noted(key, words[*fallback]);
    return fallback.value_or(0);
}

} // namespace volcomp
