// SPDX-License-Identifier: Apache-2.0
// What a TableReader knows, and the texts of its messages. Private to the reader.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "volcomp/scene/toml_file.h"
#include "volcomp/scene/toml_reader.h"

namespace volcomp {

/// What isName() wants, for messages.
constexpr const char* kNameRule =
    "a name of letters, digits, '_' and '-', with single spaces between them";

/// An interval as the documentation shows it; empty if it has no bounds.
std::string rangeText(Interval range);
/// "TYPE RANGE", or the type alone if the interval has no bounds.
std::string withRange(const std::string& type, Interval range);
/// The known word that a misspelt one may mean; an empty text if there is none, or if the word is
/// so long that comparing it takes time.
std::string spellingHint(const std::string& word, const std::vector<std::string>& known);

// The values of a record: the shortest texts that differ if the values do.
std::string recordText(double x);
std::string recordText(const std::string& text);
std::string recordText(const Vec3d& v);
std::string recordText(const std::pair<double, double>& span);
std::string recordText(const std::vector<double>& numbers);
std::string recordText(const std::vector<int>& numbers);
inline std::string recordText(int x) { return std::to_string(x); }
inline std::string recordText(std::uint64_t x) { return std::to_string(x); }
inline std::string recordText(bool x) { return x ? "true" : "false"; }

struct TableReader::State {
    std::filesystem::path file;
    std::string name;                       ///< dotted, as the documentation shows it
    const toml::table* value = nullptr;     ///< the table; null if it is absent
    std::shared_ptr<TomlFile> source;       ///< keeps `value` alive; null while describing
    std::vector<KeyDoc>* docs = nullptr;    ///< not null while describing
    mutable std::vector<std::string> known; ///< the keys that were read
    std::shared_ptr<std::string> record;    ///< TableReader::record(), with that of inner tables
    std::string prefix;                     ///< of this table's keys in the record

    /// Tables whose keys count where `value` has none, the first first.
    std::vector<const toml::table*> inherited;
    /// Of the root of a file: the tables of included files by the name of their key, each with the
    /// file that it is in.
    std::map<std::string, std::vector<std::pair<const toml::table*, std::shared_ptr<TomlFile>>>>
        shared;

    /// The value of a key, here or inherited; null if it is absent.
    const toml::node* look(std::string_view key) const;
    /// The value of a key, which counts as read from then on; null if it is absent.
    const toml::node* find(const Key& key) const;
    /// "table.key", as messages show it.
    std::string path(const char* key) const;
    /// "FILE:LINE", the line of a value.
    std::string at(const toml::node& v) const;
    /// The state of a table inside this one.
    std::unique_ptr<State> child(std::string full_name, const toml::table* table) const;
    /// Adds a row to the documentation while describing.
    void describe(const Key& key, std::string type, std::string fallback, std::string range) const;

    /// Throws the Error that points at a value.
    [[noreturn]] void fail(const toml::node& at, const char* key,
                           const std::string& expected) const;
    /// Throws the Error for an absent required key, unless describing.
    void missing(const Key& key, const std::string& type) const;

    /// Adds a key and the value that it reads as to the record, and returns the value.
    template <class T>
    T noted(const Key& key, T meant) const
    {
        if (record && !docs) *record += prefix + key.name + " = " + recordText(meant) + '\n';
        return meant;
    }

    /// The number or numbers of a value. Throws as fail() does if it is of another type, not finite
    /// or out of range.
    double real(const toml::node& v, const char* key, Interval range,
                const std::string& expected) const;
    std::vector<double> reals(const toml::node& v, const char* key, Interval range,
                              const std::string& expected) const;
};

} // namespace volcomp
