// Other programs, run as processes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace volcomp {

struct ProcessResult {
    int status = 0;         ///< of its exit; 128 + the signal where one ended it
    double cpu_seconds = 0; ///< user and system
    std::string output;     ///< stdout and stderr, unless they were shown
};

/// Runs a program and waits for it. A name without a slash is looked for in PATH. With `shown`, its
/// output goes where ours goes. It ends when we end. Throws Error where it cannot be started.
ProcessResult runProcess(const std::vector<std::string>& arguments, bool shown = false);

/// True where PATH has a program of that name.
bool hasProgram(const std::string& name);

/// The directory of the program that runs.
std::filesystem::path ownDirectory();

} // namespace volcomp
