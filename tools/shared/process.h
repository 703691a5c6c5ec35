// SPDX-License-Identifier: Apache-2.0
// Other programs, run as processes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace volcomp {

struct ProcessResult {
    int status = 0;         ///< its exit status, or 128 + the number of the signal that ended it
    double cpu_seconds = 0; ///< user and system, of the program and of the children it waited for
    std::string output;     ///< what it wrote to stdout and stderr
};

/// Runs a program and waits for its end. arguments[0] is its name; a name without a slash is looked
/// for in PATH. Its stdin is empty. Ctrl-C on a terminal ends it as well as us. Throws Error if it
/// cannot be started; an exit status of 127 is the program's own. May be called from several
/// threads.
ProcessResult runProcess(const std::vector<std::string>& arguments);

/// Returns true if a directory of PATH has a program of that name.
bool hasProgram(const std::string& name);

/// Returns the directory of the program that runs.
std::filesystem::path ownDirectory();

} // namespace volcomp
