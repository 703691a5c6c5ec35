// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/toml_reader.h"

#include <string_view>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/text.h"
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

bool TableReader::has(const char* name) const
{
    return m_state->value && m_state->value->contains(name);
}
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
    return TableReader(m_state->child(name, v ? v->as_table() : nullptr));
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
    const toml::node* v = m_state->value ? m_state->value->get(name) : nullptr;
    if (v) m_state->fail(*v, name, expected);
    throw Error(fmt::format("{}: {}: expected {}", place(), m_state->path(name), expected));
}

void TableReader::finish() const
{
    if (m_state->docs || !m_state->value) return;
    const auto& known = m_state->known;
    const toml::key* first = nullptr; // in the file
    for (const auto& [key, v] : *m_state->value)
        if (std::find(known.begin(), known.end(), key.str()) == known.end()
            && (!first || key.source().begin < first->source().begin))
            first = &key;
    if (!first) return;
    const std::string name(first->str()), hint = spellingHint(name, known);
    const std::string advice =
        hint.empty() ? "known keys here: " + joined(known, ", ") : "did you mean '" + hint + "'?";
    const toml::source_region& at = first->source();
    throw Error(m_state->source->pointed(
        fmt::format("{}:{}: unknown key '{}'; {}", file().string(), at.begin.line,
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
