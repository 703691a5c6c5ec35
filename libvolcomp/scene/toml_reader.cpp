// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/toml_reader.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include <fmt/format.h>
#include <toml.hpp>

#include "volcomp/base/error.h"
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

/// What a key that is absent reads as while describing.
double lowest(Interval r) { return std::isfinite(r.low) ? r.low : 0; }

} // namespace

TableReader::TableReader(std::unique_ptr<State> state) : m_state(std::move(state)) { }
TableReader::TableReader(TableReader&&) noexcept = default;
TableReader::~TableReader() = default;

TableReader TableReader::open(const fs::path& file)
{
    std::error_code code;
    if (fs::is_directory(file, code))
        throw fileError(file, "", "a scene file (TOML)", "a directory");
    std::ifstream stream(file, std::ios::binary);
    if (!stream)
        throw fileError(file, "", "a scene file (TOML)", "no readable file", "Check the path.");
    auto state = std::make_unique<State>();
    state->file = file;
    try {
        auto root = std::make_shared<toml::value>(toml::parse(stream, file.string()));
        state->value = root.get();
        state->root = std::move(root);
    } catch (
        const std::exception& e) { // toml::syntax_error, and out_of_range for numbers that overflow
        throw Error(file.string() + ": not valid TOML.\n" + e.what());
    }
    if (!state->value->is_table() || state->value->as_table().empty())
        throw fileError(file, "", "a scene", "an empty file",
                        "scenes/README.md shows what a scene holds.");
    return TableReader(std::move(state));
}

TableReader TableReader::describing(std::vector<KeyDoc>& docs)
{
    auto state = std::make_unique<State>();
    state->file = "scene.toml";
    state->docs = &docs;
    return TableReader(std::move(state));
}

bool TableReader::has(const char* name) const
{
    return m_state->value && m_state->value->contains(name);
}
bool TableReader::isDescribing() const { return m_state->docs != nullptr; }
const fs::path& TableReader::file() const { return m_state->file; }
std::string TableReader::toml() const
{
    return m_state->value ? toml::format(*m_state->value) : std::string();
}

double TableReader::number(const Key& key, std::optional<double> fallback, Interval range)
{
    m_state->describe(key, "number", fallback ? fmt::format("{:g}", *fallback) : "required",
                      rangeText(range));
    const std::string expected = withRange("a number", range);
    if (const auto* v = m_state->find(key)) return m_state->real(*v, key.name, range, expected);
    if (!fallback) m_state->missing(key, expected);
    return fallback.value_or(lowest(range));
}

int TableReader::integer(const Key& key, std::optional<int> fallback, Interval range)
{
    range.high = std::min(range.high, double(std::numeric_limits<int>::max()));
    range.low = std::max(range.low, double(std::numeric_limits<int>::min()));
    const bool unlimited = range.high == std::numeric_limits<int>::max();
    const Interval shown{range.low, unlimited ? kInfinity : range.high};
    m_state->describe(key, "integer", fallback ? std::to_string(*fallback) : "required",
                      rangeText(shown));
    const std::string expected = withRange("a whole number", shown);
    if (const auto* v = m_state->find(key)) {
        if (!v->is_integer()) m_state->fail(*v, key.name, expected);
        return static_cast<int>(m_state->real(*v, key.name, range, expected));
    }
    if (!fallback) m_state->missing(key, expected);
    return fallback.value_or(static_cast<int>(lowest(range)));
}

bool TableReader::flag(const Key& key, bool fallback)
{
    m_state->describe(key, "boolean", fallback ? "true" : "false", "");
    const auto* v = m_state->find(key);
    if (v && !v->is_boolean()) m_state->fail(*v, key.name, "true or false");
    return v ? v->as_boolean() : fallback;
}

std::string TableReader::text(const Key& key, std::optional<std::string> fallback)
{
    m_state->describe(key, "string", fallback ? '"' + *fallback + '"' : "required", "");
    if (const auto* v = m_state->find(key)) {
        if (!v->is_string()) m_state->fail(*v, key.name, "a string");
        return v->as_string().str;
    }
    if (!fallback) m_state->missing(key, "a string");
    return fallback.value_or("");
}

std::vector<std::string> TableReader::texts(const Key& key, std::vector<std::string> fallback)
{
    m_state->describe(key, "strings", fallback.empty() ? "[]" : joined(fallback, ", "), "");
    const auto* v = m_state->find(key);
    if (!v) return fallback;
    if (v->is_string()) return {v->as_string().str};
    if (!v->is_array()) m_state->fail(*v, key.name, "a string or an array of strings");
    std::vector<std::string> result;
    for (const toml::value& x : v->as_array()) {
        if (!x.is_string()) m_state->fail(x, key.name, "a string");
        result.push_back(x.as_string().str);
    }
    return result;
}

fs::path TableReader::path(const Key& key, std::optional<std::string> fallback)
{
    m_state->describe(key, "path", fallback ? '"' + *fallback + '"' : "required", "");
    std::string given;
    if (const auto* v = m_state->find(key)) {
        if (!v->is_string() || v->as_string().str.empty()) m_state->fail(*v, key.name, "a path");
        given = v->as_string().str;
    } else {
        if (!fallback) m_state->missing(key, "a path, relative to the scene file");
        given = fallback.value_or("");
    }
    return given.empty() ? fs::path() : m_state->file.parent_path() / given;
}

std::vector<double> TableReader::numbers(const Key& key, std::vector<double> fallback,
                                         Interval range)
{
    m_state->describe(key, "array of numbers", fmt::format("[{}]", fmt::join(fallback, ", ")),
                      rangeText(range));
    const auto* v = m_state->find(key);
    return v ? m_state->reals(*v, key.name, range, withRange("an array of numbers", range))
             : fallback;
}

Vec3d TableReader::vector(const Key& key, std::optional<Vec3d> fallback, Interval range)
{
    m_state->describe(key, "vector", fallback ? vectorText(*fallback) : "required",
                      rangeText(range));
    const std::string expected = withRange("three numbers [x, y, z]", range);
    if (const auto* v = m_state->find(key)) {
        const auto x = m_state->reals(*v, key.name, range, expected);
        if (x.size() != 3) m_state->fail(*v, key.name, expected);
        return {x[0], x[1], x[2]};
    }
    if (!fallback) m_state->missing(key, expected);
    return fallback.value_or(Vec3d(lowest(range)));
}

Vec3d TableReader::colour(const Key& key, std::optional<Vec3d> fallback, Interval range)
{
    m_state->describe(key, "colour", fallback ? vectorText(*fallback) : "required",
                      rangeText(range));
    const std::string expected =
        withRange("a colour, [r, g, b] (linear) or \"#rrggbb\" (sRGB),", range);
    if (const auto* v = m_state->find(key)) {
        if (v->is_string()) {
            const std::string& s = v->as_string().str;
            if (s.size() != 7 || s[0] != '#'
                || s.find_first_not_of("0123456789abcdefABCDEF", 1) != s.npos)
                m_state->fail(*v, key.name, expected);
            const unsigned long rgb = std::stoul(s.substr(1), nullptr, 16);
            return {linearFromSrgb((rgb >> 16) / 255.0), linearFromSrgb((rgb >> 8 & 255) / 255.0),
                    linearFromSrgb((rgb & 255) / 255.0)};
        }
        const auto x = m_state->reals(*v, key.name, range, expected);
        if (x.size() != 3) m_state->fail(*v, key.name, expected);
        return {x[0], x[1], x[2]};
    }
    if (!fallback) m_state->missing(key, expected);
    return fallback.value_or(Vec3d(lowest(range)));
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
    return d / d.length();
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
            return {x, x};
        }
        const auto x = m_state->reals(*v, key.name, range, expected);
        if (x.size() != 2 || x[0] > x[1]) m_state->fail(*v, key.name, expected);
        return {x[0], x[1]};
    }
    if (!fallback) m_state->missing(key, expected);
    return fallback.value_or(std::pair(lowest(range), lowest(range)));
}

int TableReader::word(const Key& key, std::optional<int> fallback,
                      const std::vector<std::string>& words)
{
    m_state->describe(key, "word", fallback ? '"' + words[*fallback] + '"' : "required",
                      joined(words, ", "));
    const std::string expected = "one of \"" + joined(words, "\", \"") + "\"";
    if (const auto* v = m_state->find(key)) {
        if (!v->is_string()) m_state->fail(*v, key.name, expected);
        const auto it = std::find(words.begin(), words.end(), v->as_string().str);
        if (it == words.end()) {
            const std::string hint = nearestSpelling(v->as_string().str, words);
            m_state->fail(*v, key.name,
                          hint.empty() ? expected : expected + " (did you mean \"" + hint + "\"?)");
        }
        return static_cast<int>(it - words.begin());
    }
    if (!fallback) m_state->missing(key, expected);
    return fallback.value_or(0);
}

TableReader TableReader::table(const Key& key)
{
    const std::string name = m_state->path(key.name);
    if (m_state->docs) m_state->docs->push_back({name, "", "table", "", "", "", key.meaning});
    const auto* v = m_state->find(key);
    if (v && !v->is_table()) m_state->fail(*v, key.name, fmt::format("a table [{}]", name));
    return TableReader(m_state->child(name, v));
}

std::vector<TableReader> TableReader::tables(const Key& key)
{
    std::vector<TableReader> result;
    const auto add = [&](const toml::value* v) {
        result.push_back(TableReader(m_state->child(m_state->path(key.name), v)));
    };
    if (m_state->docs) {
        m_state->docs->push_back(
            {m_state->path(key.name), "", "array of tables", "", "", "", key.meaning});
        add(nullptr);
    }
    if (const auto* v = m_state->find(key)) {
        const std::string expected = fmt::format("tables [[{}]]", m_state->path(key.name));
        if (!v->is_array()) m_state->fail(*v, key.name, expected);
        for (const toml::value& x : v->as_array()) {
            if (!x.is_table()) m_state->fail(x, key.name, expected);
            add(&x);
        }
    }
    return result;
}

std::vector<std::pair<std::string, TableReader>> TableReader::named(const Key& key)
{
    std::vector<std::pair<std::string, TableReader>> result;
    const auto add = [&](const std::string& name, const toml::value* v) {
        result.emplace_back(name,
                            TableReader(m_state->child(m_state->path(key.name) + "." + name, v)));
    };
    if (m_state->docs) {
        m_state->docs->push_back(
            {m_state->path(key.name) + ".NAME", "", "named table", "", "", "", key.meaning});
        add("NAME", nullptr);
    }
    if (const auto* v = m_state->find(key)) {
        if (!v->is_table())
            m_state->fail(*v, key.name, fmt::format("tables [{}.NAME]", m_state->path(key.name)));
        std::vector<std::pair<std::string, const toml::value*>> sorted;
        for (const auto& [name, x] : v->as_table()) sorted.emplace_back(name, &x);
        std::sort(sorted.begin(), sorted.end());
        for (const auto& [name, x] : sorted) {
            if (!x->is_table())
                m_state->fail(*x, key.name,
                              fmt::format("a table [{}.{}]", m_state->path(key.name), name));
            if (name.find_first_not_of(
                    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-")
                != name.npos)
                m_state->fail(*x, key.name,
                              "a name of letters, digits, '_' and '-', not '" + name + "',");
            add(name, x);
        }
    }
    return result;
}

void TableReader::require(bool holds, const char* name, const std::string& expected) const
{
    if (holds || m_state->docs) return;
    if (m_state->value && m_state->value->contains(name))
        m_state->fail(m_state->value->as_table().at(name), name, expected);
    throw Error(fmt::format("{}: {}: expected {}", place(), m_state->path(name), expected));
}

void TableReader::finish() const
{
    if (m_state->docs || !m_state->value) return;
    for (const auto& [name, v] : m_state->value->as_table()) {
        if (std::find(m_state->known.begin(), m_state->known.end(), name) != m_state->known.end())
            continue;
        const std::string hint = nearestSpelling(name, m_state->known);
        const std::string advice = hint.empty() ? "known keys here: " + joined(m_state->known, ", ")
                                                : "did you mean '" + hint + "'?";
        throw Error(pointed(fmt::format("{}:{}: unknown key '{}'; {}", file().string(),
                                        v.location().line(), m_state->path(name.c_str()), advice),
                            v, advice));
    }
}

std::string TableReader::place() const
{
    std::string where = m_state->file.string();
    if (m_state->value && !m_state->name.empty())
        where += fmt::format(":{}: [{}]", m_state->value->location().line(), m_state->name);
    return where;
}

} // namespace volcomp
