// A file that appears under its name only when it is complete.
#pragma once

#include <filesystem>
#include <functional>

namespace volcomp {

/// Calls write(temporary) with a name in the same directory and the same extension, then renames
/// the result to `file`. Creates missing directories. Removes the temporary file where `write`
/// throws. A killed process leaves at most the temporary file. Throws Error where the directory
/// cannot be made or the file cannot be put in place.
void writeAtomically(const std::filesystem::path& file,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

} // namespace volcomp
