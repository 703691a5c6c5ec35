// SPDX-License-Identifier: Apache-2.0
// Reads a TOML table key by key, and knows at the end which keys nobody has read.
//
// Each key is read once, with its default, range, unit and meaning. The same calls read a file and,
// on a reader made by describing(), list the keys for the documentation; so the documentation
// cannot differ from what the parser accepts. Every failure is an Error with the file, the line,
// the value underlined and what was expected.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "volcomp/base/interval.h"
#include "volcomp/scene/key_docs.h"
#include "volcomp/base/vec.h"
#include "volcomp/base/words.h"

namespace volcomp {

// Ranges that a key's value may lie in.
constexpr Interval kAny{-kInfinity, kInfinity};
constexpr Interval kUnit{0, 1};
constexpr Interval kNotNegative{0, kInfinity};
constexpr Interval kPositive{std::numeric_limits<double>::min(), kInfinity}; ///< printed as "> 0"

/// What the files of one scene may still hold, all together: what reads a file takes from it what
/// the file holds. So a scene of any bytes is read, or refused, in seconds and in memory that is
/// known.
struct ReadBudget {
    std::size_t bytes = 32 << 20;
    std::size_t tables = 200'000;
};

/// Name and documentation of one key. `unit` may be empty.
struct Key {
    const char* name;
    const char* unit;
    const char* meaning;
};

/// Whether a text may name something: it is part of the names of files, grids and channels. It has
/// letters (of any language), digits, '_' and '-', and single spaces between them, and at most 100
/// bytes.
bool isName(const std::string& text);

struct Setting;

/// One table of the file.
class TableReader {
public:
    /// The root table of a file, or of what comes through a pipe (/dev/stdin, /dev/fd/N). Throws
    /// Error if the file is missing, unreadable or not TOML, or holds more than the budget.
    static TableReader open(const std::filesystem::path& file, ReadBudget& budget);
    static TableReader open(const std::filesystem::path& file);

    /// A reader of no file. Every call adds a row to `docs` and returns its default; for a required
    /// key it returns the low end of the range, or zero.
    static TableReader describing(std::vector<KeyDoc>& docs);

    /// Changes the root table of a file as a setting says (scene_settings.h), whose value moves
    /// over. Throws Error if there is no such table in an array.
    void set(Setting& setting);
    /// Whether the root table of a file has the named table, or the table of that name in an array,
    /// that a setting is about.
    bool holds(const Setting& setting) const;
    /// Lets the tables of these keys of an included file count: a key that is in none of ours comes
    /// from there. If `whole` is set, none comes to a table that we have. Throws Error if there are
    /// more tables of one key than anyone can look through.
    void share(const TableReader& included, const char* key, bool whole = false);

    TableReader(TableReader&&) noexcept;
    ~TableReader();

    bool has(const char* name) const; ///< whether the table has the key; false while describing
    bool isDescribing() const;

    // Each of these returns the value of a key, or `fallback` if the table does not have it.
    // Without a fallback (std::nullopt) the key is required. Throws Error for a missing required
    // key, another type and a value outside of the range. Numbers may be written as integers or
    // floats, and must be finite.
    double number(const Key&, std::optional<double> fallback, Interval range);
    int integer(const Key&, std::optional<int> fallback, Interval range);
    /// A whole number from 0 to 2^63 - 1, for random numbers.
    std::uint64_t seed(const Key&, std::uint64_t fallback);
    bool flag(const Key&, bool fallback);
    std::string text(const Key&, std::optional<std::string> fallback);
    /// A name as isName() allows.
    std::string name(const Key&, std::optional<std::string> fallback);
    /// A path relative to the scene file's folder. A fallback of "" stays empty.
    std::filesystem::path path(const Key&, std::optional<std::string> fallback);
    /// One such path or an array of them.
    std::vector<std::filesystem::path> paths(const Key&,
                                             std::vector<std::filesystem::path> fallback);
    /// An array of any length.
    std::vector<double> numbers(const Key&, std::vector<double> fallback, Interval range);

    /// `count` whole numbers.
    std::vector<int> integers(const Key&, std::vector<int> fallback, Interval range);

    /// Three numbers. A single number is not accepted.
    Vec3d vector(const Key&, std::optional<Vec3d> fallback, Interval range = kAny);
    /// Linear RGB: three numbers, or one for grey, or "#rrggbb", which is sRGB and is converted.
    Vec3d colour(const Key&, std::optional<Vec3d> fallback, Interval range = kNotNegative);
    /// A vector that is not zero; it is returned at unit length.
    Vec3d direction(const Key&, std::optional<Vec3d> fallback);
    /// [low, high] with low <= high, or one number for both.
    std::pair<double, double> span(const Key&, std::optional<std::pair<double, double>> fallback,
                                   Interval range);

    /// One of a list of words.
    template <class E, std::size_t N>
    E choice(const Key& key, std::optional<E> fallback, const Word<E> (&words)[N])
    {
        std::vector<std::string> names;
        std::optional<int> index;
        for (const auto& [name, value] : words) {
            if (fallback && value == *fallback) index = static_cast<int>(names.size());
            names.push_back(name);
        }
        return words[word(key, index, names)].second;
    }

    /// A table inside this one. If it is absent, an empty table, whose required keys then fail; use
    /// has() if the table is optional.
    TableReader table(const Key&);
    /// The array of tables [[name]]; none if it is absent. While describing: one.
    std::vector<TableReader> tables(const Key&);
    /// The tables [name.X] with their X, sorted by it. While describing: one, called NAME.
    std::vector<std::pair<std::string, TableReader>> named(const Key&);

    /// Lets the table of the list that the key names count where this one has no key; finish() then
    /// also looks for unknown keys in it. The key is no part of the record. Throws Error if there
    /// is none of that name, or if it has this key itself.
    void inherit(const Key&, const std::vector<std::pair<std::string, const TableReader*>>& from);

    /// Throws an Error that points at the key's value unless `holds`. Does nothing while
    /// describing.
    void require(bool holds, const char* name, const std::string& expected) const;

    /// Throws Error for the first key that was not read, with the nearest known key. Call it last.
    void finish() const;

    /// Calls f(), which checks what was read. An Error that it throws becomes one that begins with
    /// place(). Does nothing while describing.
    void check(const std::function<void()>& f) const;

    /// "scene.toml:12: [material.fur]", for messages about the table as a whole.
    std::string place() const;
    const std::filesystem::path& file() const;
    /// What relative paths in the file start from: its folder; for a pipe the current folder.
    std::filesystem::path folder() const;

    /// The keys that were read so far, a line "KEY = VALUE" for each in the order of reading, with
    /// the defaults of absent ones and those of inner tables (level.1.length). Tables that mean the
    /// same have the same record, whatever their form in the file. Empty for the root of a file and
    /// while describing.
    std::string record() const;

private:
    struct State;
    explicit TableReader(std::unique_ptr<State>);
    int word(const Key&, std::optional<int> fallback, const std::vector<std::string>& words);
    std::unique_ptr<State> m_state;
};

} // namespace volcomp
