// SPDX-License-Identifier: Apache-2.0
// The outputs of a program overwrite neither its inputs nor each other.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace volcomp {

/// A file that a program reads or writes.
struct NamedFile {
    std::string
        name; ///< in messages: the option that names it ("--stats"), or what it is ("scene")
    std::filesystem::path file;
};

/// Throws Error, which names both, if an output is the same file as an input or as another output,
/// or if it would have to be the directory of another output. Files are compared by device and
/// inode, or, if there is none yet, by the path behind all symbolic links. Two outputs may go to
/// the same device or pipe. Files without a path are passed over.
void requireDistinct(const std::vector<NamedFile>& inputs, const std::vector<NamedFile>& outputs);

} // namespace volcomp
