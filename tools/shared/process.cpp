#include "tools/shared/process.h"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "volcomp/base/error.h"

namespace volcomp {

namespace fs = std::filesystem;

ProcessResult runProcess(const std::vector<std::string>& arguments, bool shown)
{
    std::vector<char*> argv;
    argv.reserve(arguments.size() + 1);
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    int ends[2];
    if (pipe(ends) != 0) throw Error("a pipe cannot be made: " + std::string(std::strerror(errno)));
    const pid_t child = fork();
    if (child < 0) throw Error(arguments[0] + " cannot be started: " + std::strerror(errno));
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGTERM);
        close(ends[0]);
        if (!shown) {
            dup2(ends[1], STDOUT_FILENO);
            dup2(ends[1], STDERR_FILENO);
        }
        close(ends[1]);
        execvp(argv[0], argv.data());
        _exit(127);
    }
    close(ends[1]);
    ProcessResult result;
    char buffer[4096];
    for (ssize_t n = 0;
         (n = read(ends[0], buffer, sizeof buffer)) > 0 || (n < 0 && errno == EINTR);)
        if (n > 0) result.output.append(buffer, static_cast<std::size_t>(n));
    close(ends[0]);
    int status = 0;
    rusage usage{};
    while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) { }
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    result.cpu_seconds = double(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec)
        + 1e-6 * double(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
    if (result.status == 127) throw Error(arguments[0] + " cannot be started: is it installed?");
    return result;
}

bool hasProgram(const std::string& name)
{
    const char* path = std::getenv("PATH");
    std::istringstream directories(path ? path : "");
    for (std::string directory; std::getline(directories, directory, ':');)
        if (access((fs::path(directory.empty() ? "." : directory) / name).c_str(), X_OK) == 0)
            return true;
    return false;
}

fs::path ownDirectory() { return fs::read_symlink("/proc/self/exe").parent_path(); }

} // namespace volcomp
