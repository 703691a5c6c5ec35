// SPDX-License-Identifier: Apache-2.0
// Options that take one of a table's words.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "volcomp/base/text.h"
#include "volcomp/base/words.h"

namespace volcomp {

/// Adds an option that takes one of a table's words and sets `value`, which must outlive the
/// parsing. Another word is a wrong argument.
template <class E, std::size_t N, class Value>
CLI::Option* addChoice(CLI::App& app, const std::string& name, Value& value,
                       const std::string& meaning, const Word<E> (&words)[N])
{
    std::vector<std::string> allowed;
    for (const auto& word : words) allowed.emplace_back(word.first);
    const std::string names = joined(allowed, "|");
    return app
        .add_option_function<std::string>(
            name,
            [&value, &words, names, name](const std::string& text) {
                for (const auto& word : words)
                    if (text == word.first) {
                        value = word.second;
                        return;
                    }
                throw CLI::ValidationError(name, "expected " + names + ", found '" + text + "'");
            },
            meaning)
        ->type_name(names);
}

} // namespace volcomp
