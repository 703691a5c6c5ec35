// SPDX-License-Identifier: Apache-2.0
// A file of TOML with its text, which messages show. Private to the reader, and the only header
// that includes toml++, whose functions are compiled in toml_file.cpp.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#define TOML_HEADER_ONLY 0
#include <toml++/toml.h>

namespace volcomp {

struct ReadBudget;

/// A file that was parsed. `lines` are counted from 1, columns are characters from 1, as in toml++.
struct TomlFile {
    std::filesystem::path file;
    std::string text;
    toml::table table;

    /// Returns a line without its end; an empty text if there is none of that number.
    std::string line(std::size_t number) const;
    /// Returns the message with the line of the file below it, and `note` under the region. At most
    /// 100 characters of the line are shown, those around the region's beginning.
    std::string pointed(const std::string& message, const toml::source_region& at,
                        const std::string& note) const;
    /// Returns what the file says in a region: at most 60 characters of its first line.
    std::string shown(const toml::source_region& at) const;
};

/// Reads a file and takes what it holds from the budget. Throws Error if it cannot be read, is no
/// TOML, holds no key, or exceeds the budget or the depth that toml_check.h allows.
std::shared_ptr<const TomlFile> parseToml(const std::filesystem::path& file, ReadBudget& budget);

/// Returns a text for a message: at most 60 characters, control characters and damaged UTF-8 as
/// '?'.
std::string printable(const std::string& text);

} // namespace volcomp
