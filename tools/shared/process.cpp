// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/process.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

/// Owns a file descriptor.
class Descriptor {
public:
    explicit Descriptor(int fd) : m_fd(fd) { }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor() { close(); }

    int get() const { return m_fd; }
    void close()
    {
        if (m_fd >= 0) ::close(m_fd);
        m_fd = -1;
    }

private:
    int m_fd;
};

/// What becomes of the standard files of the new process.
class FileActions {
public:
    explicit FileActions(int output)
    {
        posix_spawn_file_actions_init(&m_actions);
        posix_spawn_file_actions_addopen(&m_actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
        posix_spawn_file_actions_adddup2(&m_actions, output, STDOUT_FILENO);
        posix_spawn_file_actions_adddup2(&m_actions, output, STDERR_FILENO);
    }
    FileActions(const FileActions&) = delete;
    FileActions& operator=(const FileActions&) = delete;
    ~FileActions() { posix_spawn_file_actions_destroy(&m_actions); }

    const posix_spawn_file_actions_t* get() const { return &m_actions; }

private:
    posix_spawn_file_actions_t m_actions;
};

/// Starts the program with its output in `output`. glibc gives the reason if exec fails.
pid_t start(const std::vector<std::string>& arguments, int output)
{
    std::vector<char*> argv;
    argv.reserve(arguments.size() + 1);
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    const FileActions actions(output);
    pid_t child = 0;
    const int failure = posix_spawnp(&child, argv[0], actions.get(), nullptr, argv.data(), environ);
    if (failure == ENOENT) throw Error(arguments[0] + " cannot be started: is it installed?");
    if (failure != 0) throw Error(arguments[0] + " cannot be started: " + std::strerror(failure));
    return child;
}

std::string readAll(int fd)
{
    std::string text;
    char buffer[4096];
    for (;;) {
        const ssize_t n = read(fd, buffer, sizeof buffer);
        if (n > 0) text.append(buffer, static_cast<std::size_t>(n));
        else if (n == 0 || errno != EINTR) return text;
    }
}

} // namespace

ProcessResult runProcess(const std::vector<std::string>& arguments)
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        throw Error("a pipe cannot be made: " + std::string(std::strerror(errno)));
    Descriptor from(ends[0]), to(ends[1]);
    const pid_t child = start(arguments, to.get());
    to.close(); // otherwise reading would not end
    ProcessResult result;
    result.output = readAll(from.get());
    int status = 0;
    rusage usage{};
    while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) { }
    result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    const auto seconds = [](const timeval& t) {
        return double(t.tv_sec) + 1e-6 * double(t.tv_usec);
    };
    result.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
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
