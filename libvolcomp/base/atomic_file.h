// SPDX-License-Identifier: Apache-2.0
// Files that appear under their names only when they are complete.
//
// A file is written under a temporary name in its own directory and then renamed. The temporary
// name is ".volcomp-", 16 random letters and digits, ".part" and the file's extension. Nobody can
// guess it, it is made only if there is nothing of that name (O_EXCL, no symbolic link is
// followed), and it is locked (flock) while its program lives. A killed program leaves it. The next
// one that writes into the directory removes those of the same user that nobody locks and that are
// older than a day.
//
// - A symbolic link stays; what it points to is replaced, or made.
// - A device, a pipe or a terminal stays, too (also /dev/stdout): the file is made in the directory
//   for temporary files, and its bytes are copied.
// - A file that is replaced keeps its permissions and its owner (its owner only if the process may
//   give files away, its access lists and other attributes not); a new one gets those that the
//   umask leaves. A file that nobody may write to is refused, also if the user is root.
// - If the file has other hard links, these keep what was there.
#pragma once

#include <filesystem>
#include <functional>
#include <ostream>
#include <string>

namespace volcomp {

/// Calls write(temporary) with the name of an empty file that has the same extension and, unless
/// `file` is a device or a pipe, lies in the same directory. `write` opens it by its name and fills
/// it; it must not make it anew. When the bytes are on the disk, the file is renamed to `file`.
/// Creates missing directories. Removes the temporary file if `write` throws. Throws Error if the
/// directory cannot be made, or the file not be put in place; lets the exceptions of `write`
/// through.
void writeAtomically(const std::filesystem::path& file,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

/// Does the same for what `write` puts into a stream of bytes. Throws Error also if the stream
/// fails.
void writeStreamAtomically(const std::filesystem::path& file,
                           const std::function<void(std::ostream&)>& write);

/// Does the same for one text.
void writeTextAtomically(const std::filesystem::path& file, const std::string& text);

/// Throws the Error that writeAtomically() would throw now, without writing anything: for a
/// directory, a file or directory without the right to write, a directory that cannot be made, a
/// name that is too long. Programs call it for each of their outputs before they begin to work.
/// Directories are not made yet.
void requireWritable(const std::filesystem::path& file);

/// Returns the path that a chain of symbolic links ends at, whether there is a file or not; the
/// path itself if it is no link. Throws Error for links that end nowhere (a loop).
std::filesystem::path linkTarget(const std::filesystem::path& file);

} // namespace volcomp
