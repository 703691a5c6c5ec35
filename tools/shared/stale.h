// SPDX-License-Identifier: Apache-2.0
// The option --allow-stale of the programs that read what others of ours have made.
#pragma once

#include <filesystem>
#include <string>

#include "tools/shared/tool.h"
#include "volcomp/base/recipe.h"

namespace volcomp {

/// What a program does with a file that the scene would make otherwise.
enum class Stale {
    refused,
    allowed ///< it is used, with a warning
};

/// Adds the option, which sets `stale`; it must outlive the parsing.
void addAllowStale(CLI::App& app, Stale& stale);

/// Compares the recipe of a file with the one that the scene asks for. If they differ it throws
/// Error, or warns if that is allowed; both name what differs. A file without a recipe, which
/// another program or an older version made, passes. `advice` says how to make the file anew.
void requireFresh(const Tool& tool, const std::filesystem::path& file, const Recipe& made,
                  const Recipe& wanted, Stale stale, const std::string& advice);

} // namespace volcomp
