// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/toml_reader.h"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/text.h"
#include "volcomp/scene/scene_settings.h"
#include "volcomp/scene/scene_text.h"
#include "volcomp/scene/toml_state.h"

namespace volcomp {

namespace fs = std::filesystem;

bool isName(const std::string& text)
{
    if (text.empty() || text.size() > 100 || text.front() == ' ' || text.back() == ' ')
        return false;
    if (text.find("  ") != text.npos || text.find("\u2028") != text.npos
        || text.find("\u2029") != text.npos) // line breaks of Unicode
        return false;
    constexpr std::string_view kPlain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_- ";
    for (std::size_t i = 0; i < text.size(); ++i) {
        const auto c = static_cast<unsigned char>(text[i]);
        const bool control = c == 0xc2 && static_cast<unsigned char>(text[i + 1]) < 0xa0;
        if (control || (c < 0x80 && kPlain.find(text[i]) == kPlain.npos)) return false;
    }
    return true;
}
TableReader::TableReader(std::unique_ptr<State> state) : m_state(std::move(state)) { }
TableReader::TableReader(TableReader&&) noexcept = default;
TableReader::~TableReader() = default;

TableReader TableReader::open(const fs::path& file, ReadBudget& budget)
{
    auto state = std::make_unique<State>();
    state->file = file;
    state->source = parseToml(file, budget);
    state->value = &state->source->table;
    return TableReader(std::move(state));
}

TableReader TableReader::open(const fs::path& file)
{
    ReadBudget budget;
    return open(file, budget);
}

TableReader TableReader::describing(std::vector<KeyDoc>& docs)
{
    auto state = std::make_unique<State>();
    state->file = "scene.toml";
    state->docs = &docs;
    return TableReader(std::move(state));
}

bool TableReader::has(const char* name) const { return m_state->look(name) != nullptr; }
bool TableReader::isDescribing() const { return m_state->docs != nullptr; }
const fs::path& TableReader::file() const { return m_state->file; }
fs::path TableReader::folder() const
{
    return streamOf(m_state->file) < 0 ? m_state->file.parent_path() : fs::path();
}
std::string TableReader::record() const { return m_state->record ? *m_state->record : ""; }

TableReader TableReader::table(const Key& key)
{
    const std::string name = m_state->path(key.name);
    if (m_state->docs) m_state->docs->push_back({name, "", "table", "", "", "", key.meaning});
    const auto* v = m_state->find(key);
    if (v && !v->is_table()) m_state->fail(*v, key.name, fmt::format("a table [{}]", name));
    auto child = m_state->child(name, v ? v->as_table() : nullptr);
    if (const auto shared = m_state->shared.find(key.name); shared != m_state->shared.end())
        for (const auto& [table, source] : shared->second) child->inherited.push_back(table);
    return TableReader(std::move(child));
}

void TableReader::set(Setting& setting)
{
    m_state->source->others.push_back(setting.file);
    applySetting(m_state->source->table, setting);
}

bool TableReader::holds(const Setting& setting) const
{
    return m_state->value && holdsSetting(*m_state->value, setting);
}

void TableReader::share(const TableReader& included, const char* key, bool whole)
{
    constexpr std::size_t kMost = 32;
    auto& ours = m_state->shared[key];
    if (whole && (has(key) || !ours.empty())) return;
    const auto add = [&](const toml::table* table, const std::shared_ptr<TomlFile>& source) {
        const auto is_it = [&](const auto& other) { return other.first == table; };
        if (std::any_of(ours.begin(), ours.end(), is_it)) return;
        require(ours.size() < kMost, "include",
                fmt::format("at most {} included files with a table [{}]", kMost, key));
        ours.emplace_back(table, source);
        m_state->source->others.push_back(source);
    };
    const State& theirs = *included.m_state;
    const toml::node* own = theirs.value->get(key);
    if (own && own->is_table()) add(own->as_table(), theirs.source);
    if (const auto more = theirs.shared.find(key); more != theirs.shared.end() && !(whole && own))
        for (const auto& [table, source] : more->second) {
            if (whole && !ours.empty()) break;
            add(table, source);
        }
}

void TableReader::inherit(const Key& key,
                          const std::vector<std::pair<std::string, const TableReader*>>& from)
{
    m_state->describe(key, "string", "\"\"", "");
    const toml::node* v = m_state->find(key);
    if (!v) return;
    if (!v->is_string()) m_state->fail(*v, key.name, "a string");
    std::vector<std::string> names;
    names.reserve(from.size());
    for (const auto& [name, table] : from) {
        names.push_back(name);
        if (name != v->as_string()->get()) continue;
        if (const toml::node* nested = table->m_state->look(key.name))
            table->m_state->fail(*nested, key.name, "no such key in what is used itself");
        m_state->inherited.push_back(table->m_state->value);
        m_state->source->others.push_back(table->m_state->source);
        return;
    }
    const std::string hint = spellingHint(v->as_string()->get(), names);
    m_state->fail(*v, key.name,
                  hint.empty() ? "a name that there is: "
                          + (names.empty() ? "there is none" : joined(names, ", "))
                               : "a name that there is (did you mean '" + hint + "'?)");
}

std::vector<TableReader> TableReader::tables(const Key& key)
{
    std::vector<TableReader> result;
    const auto add = [&](const toml::table* v) {
        result.push_back(TableReader(m_state->child(m_state->path(key.name), v)));
        State& child = *result.back().m_state;
        if (!child.prefix.empty()) child.prefix += std::to_string(result.size()) + '.';
    };
    if (m_state->docs) {
        m_state->docs->push_back(
            {m_state->path(key.name), "", "array of tables", "", "", "", key.meaning});
        add(nullptr);
    }
    if (const auto* v = m_state->find(key)) {
        const std::string expected = fmt::format("tables [[{}]]", m_state->path(key.name));
        if (!v->is_array()) m_state->fail(*v, key.name, expected);
        for (const toml::node& x : *v->as_array()) {
            if (!x.is_table()) m_state->fail(x, key.name, expected);
            add(x.as_table());
        }
    }
    return result;
}

std::vector<std::pair<std::string, TableReader>> TableReader::named(const Key& key)
{
    std::vector<std::pair<std::string, TableReader>> result;
    const auto add = [&](const std::string& name, const toml::table* v) {
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
        for (const auto& [k, x] : *v->as_table()) { // sorted
            const std::string name(k.str()), path = m_state->path(key.name);
            if (!x.is_table())
                m_state->fail(x, key.name, fmt::format("a table [{}.{}]", path, printable(name)));
            if (!isName(name))
                m_state->fail(x, key.name,
                              fmt::format("{}, not '{}',", kNameRule, printable(name)));
            add(name, x.as_table());
        }
    }
    return result;
}

void TableReader::require(bool holds, const char* name, const std::string& expected) const
{
    if (holds || m_state->docs) return;
    if (const toml::node* v = m_state->look(name)) m_state->fail(*v, name, expected);
    throw Error(fmt::format("{}: {}: expected {}", place(), m_state->path(name), expected));
}

void TableReader::finish() const
{
    if (m_state->docs) return;
    const auto& known = m_state->known;
    const toml::key* first = nullptr; // in the file
    const auto look = [&](const toml::table& table) {
        for (const auto& [key, v] : table)
            if (std::find(known.begin(), known.end(), key.str()) == known.end()
                && (!first || key.source().begin < first->source().begin))
                first = &key;
    };
    if (m_state->value) look(*m_state->value);
    for (const toml::table* table : m_state->inherited)
        if (!first) look(*table);
    if (!first) return;
    const std::string name(first->str()), hint = spellingHint(name, known);
    const std::string advice =
        hint.empty() ? "known keys here: " + joined(known, ", ") : "did you mean '" + hint + "'?";
    const toml::source_region& at = first->source();
    throw Error(m_state->source->pointed(
        fmt::format("{}: unknown key '{}'; {}", m_state->source->placeOf(at),
                    m_state->path(printable(name).c_str()), advice),
        at, advice));
}

void TableReader::check(const std::function<void()>& f) const
{
    if (m_state->docs) return;
    try {
        f();
    } catch (const Error& e) {
        throw Error(place() + ": " + e.what());
    }
}

std::string TableReader::place() const
{
    if (!m_state->value || m_state->name.empty()) return m_state->file.string();
    return m_state->at(*m_state->value) + ": [" + m_state->name + "]";
}

} // namespace volcomp
