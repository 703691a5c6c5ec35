// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/atomic_file.h"

#include <algorithm>
#include <cerrno>
#include <climits>
#include <ctime>
#include <fstream>
#include <mutex>
#include <set>
#include <string_view>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPrefix = ".volcomp-", kMark = ".part";
constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz234567"; // 5 bits each
constexpr std::size_t kRandomLetters = 16;
constexpr std::time_t kLeftoverSeconds = 24 * 60 * 60;
constexpr mode_t kOwnRights = S_IRUSR | S_IWUSR, kPermissions = S_IRWXU | S_IRWXG | S_IRWXO,
                 kUsualMode = kOwnRights | S_IRGRP | S_IWGRP | S_IROTH | S_IWOTH;

std::string lastReason() { return std::error_code(errno, std::generic_category()).message(); }

std::string randomName(const fs::path& extension)
{
    unsigned char bytes[kRandomLetters];
    for (std::size_t done = 0; done < sizeof bytes;) {
        const ssize_t n = getrandom(bytes + done, sizeof bytes - done, 0);
        if (n < 0 && errno != EINTR) throw Error("no random numbers: " + lastReason() + ".");
        if (n > 0) done += static_cast<std::size_t>(n);
    }
    std::string name(kPrefix);
    for (const unsigned char b : bytes) name += kLetters[b % kLetters.size()];
    return name.append(kMark) + extension.string();
}

bool isTemporaryName(const std::string& name)
{
    const std::size_t letters = kPrefix.size(), mark = letters + kRandomLetters,
                      end = mark + kMark.size();
    return name.size() >= end && name.compare(0, letters, kPrefix) == 0
        && name.compare(mark, kMark.size(), kMark) == 0
        && name.find_first_not_of(kLetters, letters) == mark
        && (name.size() == end || name[end] == '.');
}

/// An open file that is closed at the end.
class Opened {
public:
    Opened(const fs::path& path, int flags, mode_t mode = 0)
        : m_fd(::open(path.c_str(), flags | O_CLOEXEC | O_NOCTTY, mode))
    {
    }
    Opened(const Opened&) = delete;
    Opened& operator=(const Opened&) = delete;
    ~Opened()
    {
        if (m_fd >= 0) ::close(m_fd);
    }
    int get() const { return m_fd; }
    bool isOpen() const { return m_fd >= 0; }
    bool lock() const { return flock(m_fd, LOCK_EX | LOCK_NB) == 0; }
    /// Whether `path` names this very file, and not a link to it.
    bool isNamed(const fs::path& path) const
    {
        struct stat here {
        }, there{};
        return fstat(m_fd, &here) == 0 && lstat(path.c_str(), &there) == 0
            && here.st_dev == there.st_dev && here.st_ino == there.st_ino;
    }

private:
    int m_fd;
};

void removeLeftover(const fs::path& path)
{
    struct stat found { };
    if (lstat(path.c_str(), &found) != 0 || !S_ISREG(found.st_mode) || found.st_uid != geteuid()
        || found.st_mtime > std::time(nullptr) - kLeftoverSeconds)
        return;
    const Opened file(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK);
    if (file.isOpen() && file.lock() && file.isNamed(path)) ::unlink(path.c_str());
}

/// Removes what killed programs have left in a directory; looks once in the life of a process.
void removeLeftovers(const fs::path& directory)
{
    static std::mutex mutex;
    static std::set<fs::path> seen;
    std::error_code code;
    const fs::path whole = fs::absolute(directory, code);
    {
        const std::lock_guard lock(mutex);
        if (!seen.insert(whole).second) return;
    }
    fs::directory_iterator entry(directory, code);
    for (const fs::directory_iterator end; !code && entry != end; entry.increment(code))
        if (isTemporaryName(entry->path().filename().string())) removeLeftover(entry->path());
}

/// What a file's name leads to.
struct Target {
    fs::path path; ///< behind all symbolic links
    bool exists = false;
    bool through = false; ///< a device, a pipe, or what /dev/stdout stands for: the bytes go there
    struct stat found { };
};

bool liesInProc(const fs::path& path)
{
    std::error_code code;
    const fs::path directory =
        fs::canonical(path.has_parent_path() ? path.parent_path() : ".", code);
    return !code && directory.native().compare(0, 6, "/proc/") == 0;
}

/// Follows symbolic links; sets `in_proc` if one of them is of the kind of /proc/self/fd/1, whose
/// text is no path.
fs::path follow(const fs::path& file, bool& in_proc)
{
    constexpr int kMostLinks = 40; // as in the kernel
    fs::path path = file;
    std::error_code code;
    for (int i = 0; i < kMostLinks; ++i) {
        if (!fs::is_symlink(path, code)) return path;
        in_proc = liesInProc(path);
        if (in_proc) return path;
        const fs::path next = fs::read_symlink(path, code);
        if (code) return path;
        path = next.is_absolute() ? next : path.parent_path() / next;
    }
    throw fileError(file, "", "the name of a file to write", "symbolic links that end nowhere");
}

fs::path directoryOf(const fs::path& path)
{
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

Error noDirectory(const fs::path& file, const fs::path& directory)
{
    return fileError(file, "", "a directory to write into", "none at " + directory.string(),
                     "It could not be made; check the path and your rights.");
}

/// Returns what a file's name leads to. Throws Error if it cannot be written because of what is
/// there already.
Target targetOf(const fs::path& file)
{
    const auto refused = [&](const std::string& found, const std::string& hint = {}) {
        return fileError(file, "", "the name of a file to write", found, hint);
    };
    if (file.filename().empty()) throw refused("a directory");
    Target target;
    target.path = follow(file, target.through);
    if (target.path.filename().empty()) throw refused("a link to a directory");
    for (const fs::path& part : target.path)
        if (part.native().size() > NAME_MAX)
            throw refused(fmt::format("a name of {} bytes, of which {} are allowed",
                                      part.native().size(), NAME_MAX));
    target.exists = ::stat(file.c_str(), &target.found) == 0;
    if (!target.exists) return target;
    const mode_t mode = target.found.st_mode;
    if (S_ISDIR(mode)) throw refused("a directory");
    if (S_ISSOCK(mode)) throw refused("a socket");
    if (!S_ISREG(mode)) target.through = true;
    if (::faccessat(AT_FDCWD, file.c_str(), W_OK, AT_EACCESS) != 0)
        throw refused("one that cannot be written (" + lastReason() + ")", "Check your rights.");
    if (S_ISREG(mode) && !(mode & (S_IWUSR | S_IWGRP | S_IWOTH)))
        throw refused("one that nobody may write to",
                      "Remove it, or give the right to write (chmod u+w).");
    return target;
}

/// An empty file of a random name, locked and removed at the end unless it was renamed.
class Temporary {
public:
    /// Leaves isOpen() false, and errno, if the file cannot be made.
    Temporary(const fs::path& directory, const fs::path& extension, mode_t mode)
        : m_path(directory / randomName(extension)),
          m_file(m_path, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW, mode)
    {
        if (!m_file.isOpen()) return;
        m_file.lock();
        struct stat made { };
        if (fstat(m_file.get(), &made) == 0) m_mode = made.st_mode & kPermissions;
        // It has to be opened by its name, whatever the umask says.
        if ((m_mode & kOwnRights) != kOwnRights) fchmod(m_file.get(), m_mode | kOwnRights);
    }
    ~Temporary() { remove(); }
    Temporary(const Temporary&) = delete;
    Temporary& operator=(const Temporary&) = delete;

    const fs::path& path() const { return m_path; }
    const Opened& file() const { return m_file; }
    /// Gives it the permissions that the umask leaves to a new file. False and errno if that fails.
    bool takeUsualMode() const { return fchmod(m_file.get(), m_mode) == 0; }
    void remove()
    {
        if (m_file.isOpen() && !m_gone) ::unlink(m_path.c_str());
        m_gone = true;
    }
    /// Renames it. Returns false, and errno, if that fails.
    bool renameTo(const fs::path& path)
    {
        m_gone = ::rename(m_path.c_str(), path.c_str()) == 0;
        return m_gone;
    }

private:
    fs::path m_path;
    Opened m_file;
    mode_t m_mode = 0; ///< what the umask has left
    bool m_gone = false;
};

void requireOwnFile(const fs::path& file, const Temporary& temporary)
{
    if (!temporary.file().isNamed(temporary.path()))
        throw Error(file.string()
                    + ": could not be put in place: another program has removed or "
                      "replaced its temporary file "
                    + temporary.path().string() + ".");
}

/// Copies the bytes of an open file to a device or pipe, which is opened as it is.
void copyInto(const fs::path& file, const Opened& from)
{
    const auto failed = [&] {
        return fileError(file, "", "a device or pipe that takes what is written",
                         "an error (" + lastReason() + ")");
    };
    const Opened to(file, O_WRONLY | O_APPEND);
    if (!to.isOpen()) throw failed();
    std::string buffer(1 << 16, '\0');
    off_t at = 0;
    for (;;) {
        const ssize_t n = pread(from.get(), buffer.data(), buffer.size(), at);
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) throw failed();
        if (n == 0) return;
        at += n;
        for (ssize_t done = 0; done < n;) {
            const ssize_t written = ::write(to.get(), buffer.data() + done, std::size_t(n - done));
            if (written < 0 && errno != EINTR) throw failed();
            if (written > 0) done += written;
        }
    }
}

void writeThrough(const fs::path& file, const std::function<void(const fs::path&)>& write)
{
    const fs::path directory = fs::temp_directory_path();
    removeLeftovers(directory);
    Temporary temporary(directory, file.extension(), kOwnRights);
    if (!temporary.file().isOpen())
        throw Error(file.string() + ": is a device or a pipe, and what goes there is made in "
                    + directory.string() + " first, where no file can be made: " + lastReason()
                    + ".");
    write(temporary.path());
    requireOwnFile(file, temporary);
    temporary.remove(); // it is still open, and a reader who goes away may end us
    copyInto(file, temporary.file());
}

/// Gives the temporary file the permissions and the owner of the file that it replaces.
bool takeAttributes(const Opened& file, const struct stat& from)
{
    // Whoever may not give files away keeps the file, and as much of its group as is allowed.
    if (fchown(file.get(), from.st_uid, from.st_gid) != 0) {
        const int ignored = fchown(file.get(), uid_t(-1), from.st_gid);
        static_cast<void>(ignored);
    }
    return fchmod(file.get(), from.st_mode & kPermissions) == 0;
}

/// Waits until the bytes are on the disk; true also for file systems that cannot.
bool sync(int fd) { return fsync(fd) == 0 || errno == EINVAL || errno == ENOTSUP; }

} // namespace

void writeAtomically(const fs::path& file, const std::function<void(const fs::path&)>& write)
{
    const Target target = targetOf(file);
    if (target.through) {
        writeThrough(file, write);
        return;
    }
    const fs::path directory = directoryOf(target.path);
    std::error_code code;
    fs::create_directories(directory, code);
    if (!fs::is_directory(directory, code)) throw noDirectory(file, directory);
    removeLeftovers(directory);
    // While it is written, it is no more open to others than what it replaces.
    Temporary temporary(directory, file.extension(),
                        target.exists ? (target.found.st_mode & kUsualMode) | kOwnRights
                                      : kUsualMode);
    const auto failed = [&] {
        return Error(file.string() + ": could not be put in place: " + lastReason() + ".");
    };
    if (!temporary.file().isOpen()) throw failed();
    write(temporary.path());
    requireOwnFile(file, temporary);
    if (!(target.exists ? takeAttributes(temporary.file(), target.found)
                        : temporary.takeUsualMode()))
        throw failed();
    if (!sync(temporary.file().get()) || !temporary.renameTo(target.path)) throw failed();
    const Opened folder(directory, O_RDONLY | O_DIRECTORY);
    if (folder.isOpen()) sync(folder.get()); // the name is in place in any case
}

void writeStreamAtomically(const fs::path& file, const std::function<void(std::ostream&)>& write)
{
    writeAtomically(file, [&](const fs::path& temporary) {
        std::ofstream stream(temporary, std::ios::binary);
        write(stream);
        if (!stream.flush())
            throw fileError(file, "", "a file to write", "an error", "Is the disk full?");
    });
}

void writeTextAtomically(const fs::path& file, const std::string& text)
{
    writeStreamAtomically(file, [&](std::ostream& stream) { stream << text; });
}

void requireWritable(const fs::path& file)
{
    const Target target = targetOf(file);
    if (target.through) return;
    const fs::path directory = directoryOf(target.path);
    fs::path existing = directory; // or what there is of it
    std::error_code code;
    while (!fs::exists(existing, code) && existing.has_relative_path())
        existing = directoryOf(existing);
    if (!fs::is_directory(existing, code)) throw noDirectory(file, directory);
    const Temporary trial(existing, file.extension(), kOwnRights);
    if (trial.file().isOpen()) return;
    const std::string reason = lastReason();
    if (existing != directory) throw noDirectory(file, directory);
    throw fileError(file, "", "a directory to write into",
                    directory.string() + ", where no file can be made (" + reason + ")",
                    "Check the path and your rights.");
}

fs::path linkTarget(const fs::path& file)
{
    bool in_proc = false;
    return follow(file, in_proc);
}

} // namespace volcomp
