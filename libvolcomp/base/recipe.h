// SPDX-License-Identifier: Apache-2.0
// A recipe: what a file was made from. Each output carries its own, so that a program can tell
// whether the file is what the scene would make today, and say what has changed if it is not.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace volcomp {

/// Names and values in the order in which they were added, such as ("box.fur.variants", "4") or
/// ("surface.body.mesh content", the hash of a file). Two outputs of equal recipes are equal.
class Recipe {
public:
    /// Adds a name and its value. Line breaks in them become spaces.
    void add(std::string name, std::string value);
    /// Adds a text of lines "NAME = VALUE", each name with `prefix` in front.
    void addLines(const std::string& prefix, const std::string& lines);
    /// Adds the hash of a file's content, or kUnknown if it cannot be read.
    void addFile(std::string name, const std::filesystem::path& file);

    const std::vector<std::pair<std::string, std::string>>& entries() const { return m_entries; }
    bool empty() const { return m_entries.empty(); }

    /// One line "NAME = VALUE" for each entry, as fromText() reads it.
    std::string text() const;
    static Recipe fromText(const std::string& text);

    /// 16 hexadecimal digits that differ, but for one case in 2^64, if the text differs.
    std::string hash() const;

    /// The value of an entry that nobody can compare, such as that of a file that is not there. It
    /// agrees with every other value.
    static constexpr const char* kUnknown = "?";

private:
    std::vector<std::pair<std::string, std::string>> m_entries;
};

/// An entry in which two recipes differ. A value is empty if its recipe has no such entry.
struct RecipeDifference {
    std::string name, made, wanted;
};

/// What differs between the recipe that a file was made by and the one that is wanted: first the
/// entries of `wanted` in their order, then those that only `made` has. Entries of one name are
/// compared in their order.
std::vector<RecipeDifference> differences(const Recipe& made, const Recipe& wanted);

} // namespace volcomp
