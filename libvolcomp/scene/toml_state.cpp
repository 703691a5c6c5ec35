// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/toml_state.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/text.h"

namespace volcomp {
namespace {

/// The value as a message shows it, at most 60 characters.
std::string found(const toml::value& v)
{
    std::string text = toml::format(v);
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
    if (text.size() > 60) text = text.substr(0, 57) + "...";
    if (v.is_table()) return "a table";
    return text;
}

} // namespace

std::string rangeText(Interval r)
{
    const bool low = std::isfinite(r.low), high = std::isfinite(r.high);
    if (r.low == kPositive.low) return high ? fmt::format("> 0, <= {:g}", r.high) : "> 0";
    if (low && high) return fmt::format("{:g} to {:g}", r.low, r.high);
    if (low) return fmt::format(">= {:g}", r.low);
    if (high) return fmt::format("<= {:g}", r.high);
    return {};
}

std::string withRange(const std::string& type, Interval r)
{
    const std::string range = rangeText(r);
    return range.empty() ? type : type + " " + range;
}

std::string pointed(const std::string& message, const toml::value& at, const std::string& note)
{
    const std::string text = toml::format_error(message, at, note), prefix = "[error] ";
    return text.rfind(prefix, 0) == 0 ? text.substr(prefix.size()) : text;
}

const toml::value* TableReader::State::find(const Key& key) const
{
    known.emplace_back(key.name);
    if (!value || !value->contains(key.name)) return nullptr;
    return &value->as_table().at(key.name);
}

std::string TableReader::State::path(const char* key) const
{
    return name.empty() ? key : name + "." + key;
}

std::unique_ptr<TableReader::State> TableReader::State::child(std::string full_name,
                                                              const toml::value* table) const
{
    auto state = std::make_unique<State>();
    state->file = file;
    state->root = root;
    state->name = std::move(full_name);
    state->docs = docs;
    state->value = table;
    return state;
}

void TableReader::State::describe(const Key& key, std::string type, std::string fallback,
                                  std::string range) const
{
    if (docs)
        docs->push_back({name, key.name, std::move(type), std::move(fallback), std::move(range),
                         key.unit, key.meaning});
}

void TableReader::State::fail(const toml::value& at, const char* key,
                              const std::string& expected) const
{
    throw Error(pointed(fmt::format("{}:{}: {}: expected {}, found {}", file.string(),
                                    at.location().line(), path(key), expected, found(at)),
                        at, "expected " + expected));
}

void TableReader::State::missing(const Key& key, const std::string& type) const
{
    if (docs) return;
    const std::string expected =
        fmt::format("{} ({}{}{})", type, key.meaning, *key.unit ? ", " : "", key.unit);
    std::string advice = fmt::format("add {} = ... to this table", key.name);
    if (value)
        for (const auto& [other, v] : value->as_table()) // close enough to be the key, misspelt
            if (editDistance(other, key.name) <= std::strlen(key.name) / 3)
                advice = fmt::format("is '{}' meant to be '{}'?", other, key.name);
    if (value && value->location().line() > 0 && !name.empty())
        throw Error(
            pointed(fmt::format("{}:{}: [{}]: the key '{}' is missing; expected {}", file.string(),
                                value->location().line(), name, key.name, expected),
                    *value, advice));
    throw Error(fmt::format("{}: the key '{}' is missing; expected {}", file.string(),
                            path(key.name), expected));
}

double TableReader::State::real(const toml::value& v, const char* key, Interval range,
                                const std::string& expected) const
{
    double x = 0;
    if (v.is_integer()) x = static_cast<double>(v.as_integer());
    else if (v.is_floating()) x = v.as_floating();
    else fail(v, key, expected);
    if (!std::isfinite(x) || x < range.low || x > range.high) fail(v, key, expected);
    return x;
}

std::vector<double> TableReader::State::reals(const toml::value& v, const char* key, Interval range,
                                              const std::string& expected) const
{
    if (!v.is_array()) fail(v, key, expected);
    std::vector<double> result;
    for (const toml::value& x : v.as_array()) result.push_back(real(x, key, range, expected));
    return result;
}

} // namespace volcomp
