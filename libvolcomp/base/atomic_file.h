// SPDX-License-Identifier: Apache-2.0
// Files that appear under their names only when they are complete.
#pragma once

#include <filesystem>
#include <functional>
#include <ostream>
#include <string>

namespace volcomp {

/// Calls write(temporary) with a name in the same directory and with the same extension, then
/// renames the result to `file`. Creates missing directories. Removes the temporary file if `write`
/// throws. A process that is killed leaves at most the temporary file. Throws Error if the
/// directory cannot be made or the file cannot be put in place; lets the exceptions of `write`
/// through.
void writeAtomically(const std::filesystem::path& file,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

/// Does the same for what `write` puts into a stream of bytes. Throws Error also if the stream
/// fails.
void writeStreamAtomically(const std::filesystem::path& file,
                           const std::function<void(std::ostream&)>& write);

/// Does the same for one text.
void writeTextAtomically(const std::filesystem::path& file, const std::string& text);

} // namespace volcomp
