// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/scene_settings.h"

#include <utility>
#include <vector>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/base/text.h"

namespace volcomp {
namespace {

/// The names of an array's tables: their own, or the array's with their numbers from 1, as the
/// reader names them.
std::vector<std::string> namesIn(const std::string& key, const toml::array& array)
{
    std::vector<std::string> names;
    names.reserve(array.size());
    for (const toml::node& element : array) {
        const toml::node* name = element.is_table() ? element.as_table()->get("name") : nullptr;
        names.push_back(name && name->is_string() ? name->as_string()->get()
                                                  : key + std::to_string(names.size() + 1));
    }
    return names;
}

/// The number from 0 of the table that a name or a number from 1 means; the size if there is none.
std::size_t findIn(const std::vector<std::string>& names, std::string_view name)
{
    for (std::size_t i = 0; i < names.size(); ++i)
        if (names[i] == name) return i;
    for (std::size_t i = 0; i < names.size(); ++i)
        if (std::to_string(i + 1) == name) return i;
    return names.size();
}

bool holdsTables(const toml::node* node)
{
    return node && node->is_array() && !node->as_array()->empty()
        && node->as_array()->get(0)->is_table();
}

void merge(toml::table& into, toml::table& from, const TomlFile& setting);

/// Merges the members of a table into the tables of an array that have their names.
void mergeNamed(const std::string& key, toml::array& into, toml::table& from,
                const TomlFile& setting)
{
    const std::vector<std::string> names = namesIn(key, into);
    for (auto&& [name, value] : from) {
        const std::size_t at = findIn(names, name.str());
        const std::string hint = nearestSpelling(std::string(name.str()), names);
        if (at == names.size())
            throw Error(setting.pointed(
                fmt::format("{}: {}: expected the name of a [[{}]] or its number ({}), found '{}'",
                            setting.file.string(), key, key, joined(names, ", "), name.str()),
                name.source(), hint.empty() ? "no such name" : "did you mean '" + hint + "'?"));
        if (!value.is_table())
            throw Error(setting.pointed(fmt::format("{}: expected a key of [[{}]] after the name",
                                                    setting.file.string(), key),
                                        name.source(), "expected a key after it"));
        merge(*into.get(at)->as_table(), *value.as_table(), setting);
    }
}

void merge(toml::table& into, toml::table& from, const TomlFile& setting)
{
    for (auto&& [key, value] : from) {
        toml::node* there = into.get(key);
        if (value.is_table() && there && there->is_table())
            merge(*there->as_table(), *value.as_table(), setting);
        else if (value.is_table() && holdsTables(there))
            mergeNamed(std::string(key.str()), *there->as_array(), *value.as_table(), setting);
        else {
            const toml::key& name = key;
            std::move(value).visit(
                [&](auto&& v) { into.insert_or_assign(name, std::forward<decltype(v)>(v)); });
        }
    }
}

} // namespace

Setting readSetting(const std::string& text)
{
    Setting setting{parseSetting(text)};
    if (setting.file->table.contains("include"))
        throw Error(setting.file->file.string()
                    + ": expected a key of the scene, found 'include', which only a file can say");
    return setting;
}

void applySetting(toml::table& root, Setting& setting)
{
    merge(root, setting.file->table, *setting.file);
}

bool holdsSetting(const toml::table& root, const Setting& setting)
{
    const std::string table(setting.file->table.cbegin()->first.str());
    const toml::table* inner = setting.file->table.get_as<toml::table>(table);
    const toml::node* there = root.get(table);
    if (!there || !inner || inner->empty()) return false;
    const std::string name(inner->cbegin()->first.str());
    if (holdsTables(there)) {
        const auto names = namesIn(table, *there->as_array());
        return findIn(names, name) < names.size();
    }
    return there->is_table() && there->as_table()->contains(name);
}

} // namespace volcomp
