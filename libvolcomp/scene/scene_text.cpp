// SPDX-License-Identifier: Apache-2.0
#include "volcomp/scene/scene_text.h"

#include <cerrno>
#include <charconv>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExpected = "a scene file (TOML)";

Error unreadable(const fs::path& file)
{
    return fileError(file, "", kExpected, "no readable file",
                     "Check the path (" + std::generic_category().message(errno) + ").");
}

/// A descriptor that is closed at the end of its life, if it is ours.
class Descriptor {
public:
    explicit Descriptor(const fs::path& file) : m_ours(streamOf(file) < 0)
    {
        // Without O_NONBLOCK, opening a FIFO waits for its writer.
        m_number = m_ours ? ::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY)
                          : streamOf(file);
        if (m_number < 0) throw unreadable(file);
    }
    ~Descriptor()
    {
        if (m_ours) ::close(m_number);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;

    bool isOurs() const { return m_ours; }
    int number() const { return m_number; }

private:
    int m_number = -1;
    bool m_ours;
};

/// Throws Error if what was opened is nothing that can be read to an end.
void requireReadable(const fs::path& file, const Descriptor& descriptor)
{
    struct stat status { };
    if (::fstat(descriptor.number(), &status) != 0) throw unreadable(file);
    if (S_ISDIR(status.st_mode)) throw fileError(file, "", kExpected, "a directory");
    if (!descriptor.isOurs() || S_ISREG(status.st_mode)) return;
    throw fileError(file, "", kExpected, S_ISFIFO(status.st_mode) ? "a FIFO" : "a device",
                    "A scene that is no file is read from a pipe, as /dev/stdin.");
}

} // namespace

int streamOf(const fs::path& file)
{
    const std::string name = file.string();
    if (name == "/dev/stdin") return 0;
    for (const std::string folder : {"/dev/fd/", "/proc/self/fd/"}) {
        if (name.rfind(folder, 0) != 0) continue;
        int number = -1;
        const char *begin = name.data() + folder.size(), *end = name.data() + name.size();
        const auto [rest, error] = std::from_chars(begin, end, number);
        if (error == std::errc() && rest == end && number >= 0) return number;
    }
    return -1;
}

std::string readSceneText(const fs::path& file, std::size_t most)
{
    const Descriptor descriptor(file);
    requireReadable(file, descriptor);
    std::string text;
    constexpr std::size_t kBlock = 1 << 16;
    for (std::size_t size = 0;;) {
        text.resize(size + kBlock);
        const ssize_t got = ::read(descriptor.number(), text.data() + size, kBlock);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) throw unreadable(file);
        size += static_cast<std::size_t>(got);
        if (size > most)
            throw fileError(file, "",
                            fmt::format("a scene whose files hold at most {} bytes in all", most),
                            "more", "Meshes and images belong into files of their own.");
        if (got > 0) continue;
        text.resize(size);
        text.shrink_to_fit(); // a scene may have thousands of files
        return text;
    }
}

} // namespace volcomp
