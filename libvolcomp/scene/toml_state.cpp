// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/toml_state.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/text.h"

namespace volcomp {

std::string recordText(double x) { return fmt::format("{}", x + 0.0); } // -0 is 0
std::string recordText(const std::string& text)
{
    std::string line = '"' + text + '"';
    std::replace_if(
        line.begin(), line.end(), [](unsigned char c) { return c < 0x20; }, ' ');
    return line;
}
std::string recordText(const Vec3d& v)
{
    return fmt::format("[{}, {}, {}]", v[0] + 0.0, v[1] + 0.0, v[2] + 0.0);
}
std::string recordText(const std::pair<double, double>& span)
{
    return fmt::format("[{}, {}]", span.first + 0.0, span.second + 0.0);
}
std::string recordText(const std::vector<double>& numbers)
{
    return fmt::format("[{}]", fmt::join(numbers, ", "));
}
std::string recordText(const std::vector<int>& numbers)
{
    return fmt::format("[{}]", fmt::join(numbers, ", "));
}

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

std::string spellingHint(const std::string& word, const std::vector<std::string>& known)
{
    return word.size() > 100 ? std::string() : nearestSpelling(word, known);
}

const toml::node* TableReader::State::find(const Key& key) const
{
    if (std::find(known.begin(), known.end(), key.name) == known.end())
        known.emplace_back(key.name);
    return look(key.name);
}

const toml::node* TableReader::State::look(std::string_view key) const
{
    if (const toml::node* v = value ? value->get(key) : nullptr) return v;
    for (const toml::table* table : inherited)
        if (const toml::node* v = table->get(key)) return v;
    return nullptr;
}

std::string TableReader::State::at(const toml::node& v) const
{
    return source->placeOf(v.source());
}

std::string TableReader::State::path(const char* key) const
{
    return name.empty() ? key : name + "." + key;
}

std::unique_ptr<TableReader::State> TableReader::State::child(std::string full_name,
                                                              const toml::table* table) const
{
    auto state = std::make_unique<State>();
    state->file = file;
    state->source = source;
    // The tables of the file have a record each, and what is in them adds to it.
    state->record = name.empty() ? std::make_shared<std::string>() : record;
    if (!name.empty()) state->prefix = prefix + full_name.substr(name.size() + 1) + '.';
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

void TableReader::State::fail(const toml::node& at, const char* key,
                              const std::string& expected) const
{
    const std::string found = at.is_table() ? "a table" : source->shown(at.source());
    throw Error(source->pointed(
        fmt::format("{}: {}: expected {}, found {}", this->at(at), path(key), expected, found),
        at.source(), "expected " + expected));
}

void TableReader::State::missing(const Key& key, const std::string& type) const
{
    if (docs) return;
    const std::string expected =
        fmt::format("{} ({}{}{})", type, key.meaning, *key.unit ? ", " : "", key.unit);
    std::string advice = fmt::format("add {} = ... to this table", key.name);
    if (value)
        for (const auto& [other, v] : *value) // close enough to be the key, misspelt
            if (other.str().size() <= 2 * std::strlen(key.name)
                && editDistance(std::string(other.str()), key.name) <= std::strlen(key.name) / 3)
                advice = fmt::format("is '{}' meant to be '{}'?", other.str(), key.name);
    if (value && value->source().begin.line > 0 && !name.empty())
        throw Error(source->pointed(fmt::format("{}: [{}]: the key '{}' is missing; expected {}",
                                                at(*value), name, key.name, expected),
                                    value->source(), advice));
    throw Error(fmt::format("{}: the key '{}' is missing; expected {}", file.string(),
                            path(key.name), expected));
}

double TableReader::State::real(const toml::node& v, const char* key, Interval range,
                                const std::string& expected) const
{
    double x = 0;
    if (v.is_integer()) x = static_cast<double>(v.as_integer()->get());
    else if (v.is_floating_point()) x = v.as_floating_point()->get();
    else fail(v, key, expected);
    if (!std::isfinite(x) || x < range.low || x > range.high) fail(v, key, expected);
    return x;
}

std::vector<double> TableReader::State::reals(const toml::node& v, const char* key, Interval range,
                                              const std::string& expected) const
{
    if (!v.is_array()) fail(v, key, expected);
    std::vector<double> result;
    for (const toml::node& x : *v.as_array()) result.push_back(real(x, key, range, expected));
    return result;
}

} // namespace volcomp
