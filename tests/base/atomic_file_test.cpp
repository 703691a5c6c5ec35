// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/atomic_file.h"

#include <cstring>
#include <ctime>
#include <fstream>
#include <future>
#include <regex>
#include <stdexcept>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

using namespace volcomp;

namespace fs = std::filesystem;

namespace {

std::ptrdiff_t files(const fs::path& folder)
{
    return std::distance(fs::directory_iterator(folder), {});
}

bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

mode_t modeOf(const fs::path& file)
{
    struct stat found { };
    EXPECT_EQ(lstat(file.c_str(), &found), 0) << file;
    return found.st_mode & 07777;
}

/// Sets when a file was changed last.
void makeOld(const fs::path& file, std::time_t seconds)
{
    const timespec then{std::time(nullptr) - seconds, 0}, both[2] = {then, then};
    ASSERT_EQ(utimensat(AT_FDCWD, file.c_str(), both, 0), 0);
}

/// Reads a pipe until its writer has closed it.
std::future<std::string> readLater(const fs::path& pipe)
{
    return std::async(std::launch::async, [pipe] {
        std::ifstream stream(pipe, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(stream), {});
    });
}

/// Another user during its lifetime, in a process that is root's.
class AsNobody {
public:
    AsNobody() { EXPECT_EQ(seteuid(65534), 0); }
    ~AsNobody() { EXPECT_EQ(seteuid(0), 0); }
};

} // namespace

TEST(AtomicFile, AppearsWhenItIsComplete)
{
    const TemporaryFolder folder;
    const fs::path file = folder / "new/folder/a.txt";
    writeAtomically(file, [&](const fs::path& temporary) {
        EXPECT_EQ(temporary.parent_path(), file.parent_path());
        EXPECT_EQ(temporary.extension(), ".txt");
        std::ofstream(temporary) << "text";
        EXPECT_FALSE(fs::exists(file));
    });
    EXPECT_EQ(folder.read("new/folder/a.txt"), "text");
    writeTextAtomically(file, "other\r\n");
    EXPECT_EQ(folder.read("new/folder/a.txt"), "other\r\n");
    EXPECT_EQ(files(file.parent_path()), 1);
}

TEST(AtomicFile, AFailureLeavesWhatWasThere)
{
    const TemporaryFolder folder;
    const fs::path file = folder.write("a.txt", "old");
    EXPECT_THROW(writeStreamAtomically(file,
                                       [](std::ostream& stream) {
                                           stream << "half";
                                           throw std::runtime_error("stop");
                                       }),
                 std::runtime_error);
    EXPECT_NE(messageOf([&] {
                  writeStreamAtomically(file,
                                        [](std::ostream& s) { s.setstate(std::ios::failbit); });
              }).find("a.txt"),
              std::string::npos);
    // The error of the work is its own, not one of putting the file in place.
    EXPECT_THROW(
        writeAtomically(file, [&](const fs::path&) { fs::copy_file(folder / "none", file); }),
        fs::filesystem_error);
    EXPECT_NE(messageOf([&] {
                  writeAtomically(file, [](const fs::path& temporary) { fs::remove(temporary); });
              }).find("could not be put in place"),
              std::string::npos);
    EXPECT_EQ(folder.read("a.txt"), "old");
    EXPECT_EQ(files(folder.path()), 1);
}

TEST(AtomicFile, SaysWhereItCannotWrite)
{
    const TemporaryFolder folder;
    const fs::path file = folder.write("a.txt", "");
    EXPECT_NE(messageOf([&] { writeTextAtomically(folder.path(), ""); }).find("a directory"),
              std::string::npos);
    EXPECT_NE(messageOf([&] { writeTextAtomically(file / "b.txt", ""); }).find("could not be made"),
              std::string::npos);
}

TEST(AtomicFile, TheTemporaryNameIsNewEachTime)
{
    const TemporaryFolder folder;
    const std::regex pattern("\\.volcomp-[a-z2-7]{16}\\.part\\.txt");
    std::string last;
    for (int i = 0; i < 2; ++i)
        writeAtomically(folder / "a.txt", [&](const fs::path& temporary) {
            const std::string name = temporary.filename().string();
            EXPECT_TRUE(std::regex_match(name, pattern)) << name;
            EXPECT_NE(name, last);
            last = name;
            // It is ours, and nobody else can lock it.
            const int fd = open(temporary.c_str(), O_RDONLY);
            EXPECT_EQ(flock(fd, LOCK_EX | LOCK_NB), -1);
            close(fd);
        });
}

// Whoever can write into the folder may put a link in the temporary file's place; what it leads to
// must not become the output.
TEST(AtomicFile, AReplacedTemporaryFileIsNotPutInPlace)
{
    const TemporaryFolder folder;
    folder.write("other.txt", "other");
    const std::string message = messageOf([&] {
        writeAtomically(folder / "a.txt", [&](const fs::path& temporary) {
            fs::remove(temporary);
            fs::create_symlink(folder / "other.txt", temporary);
        });
    });
    EXPECT_TRUE(has(message, "removed or replaced its temporary file")) << message;
    EXPECT_FALSE(fs::exists(fs::symlink_status(folder / "a.txt")));
    EXPECT_EQ(files(folder.path()), 1);
}

TEST(AtomicFile, RemovesOldLeftoversThatNobodyLocks)
{
    constexpr std::time_t kDay = 24 * 60 * 60;
    const TemporaryFolder folder;
    const fs::path old = folder.write(".volcomp-abcdefghijklmnop.part.vdb", "half"),
                   young = folder.write(".volcomp-bbcdefghijklmnop.part.vdb", "half"),
                   locked = folder.write(".volcomp-cbcdefghijklmnop.part.vdb", "half");
    makeOld(old, kDay + 60);
    makeOld(young, kDay - 60);
    makeOld(locked, kDay + 60);
    const int fd = open(locked.c_str(), O_RDONLY);
    ASSERT_EQ(flock(fd, LOCK_EX), 0);
    std::vector<fs::path> foreign;
    for (const char* name :
         {".volcomp-abcdefghijklmnop.part~", ".volcomp-abcdefghijklmno.part.vdb",
          ".volcomp-abcdefghijklmnoP.part.vdb", "volcomp-abcdefghijklmnop.part.vdb",
          ".volcomp-abcdefghijklmnop.vdb", "picture.1234.part.exr"})
        foreign.push_back(folder.write(name, "mine"));
    const fs::path link = folder / ".volcomp-dbcdefghijklmnop.part.vdb";
    fs::create_symlink(foreign[0], link);
    for (const fs::path& file : foreign) makeOld(file, 10 * kDay);

    writeTextAtomically(folder / "a.txt", "new");
    close(fd);
    EXPECT_FALSE(fs::exists(old));
    EXPECT_TRUE(fs::exists(young));
    EXPECT_TRUE(fs::exists(locked));
    EXPECT_TRUE(fs::is_symlink(link));
    for (const fs::path& file : foreign) EXPECT_TRUE(fs::exists(file)) << file;
}

TEST(AtomicFile, ALinkStaysAndItsTargetIsReplaced)
{
    const TemporaryFolder folder, other;
    const fs::path target = other.write("target.txt", "old");
    fs::create_symlink(target, folder / "link.txt");
    fs::create_symlink("link.txt", folder / "link_to_link.txt");
    writeTextAtomically(folder / "link_to_link.txt", "new");
    EXPECT_TRUE(fs::is_symlink(folder / "link_to_link.txt"));
    EXPECT_TRUE(fs::is_symlink(folder / "link.txt"));
    EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(target)));
    EXPECT_EQ(other.read("target.txt"), "new");

    fs::create_symlink("made/later.txt", folder / "dangling.txt");
    requireWritable(folder / "dangling.txt");
    writeTextAtomically(folder / "dangling.txt", "made");
    EXPECT_TRUE(fs::is_symlink(folder / "dangling.txt"));
    EXPECT_EQ(folder.read("made/later.txt"), "made");

    fs::create_symlink("round.txt", folder / "round.txt");
    EXPECT_TRUE(has(messageOf([&] { requireWritable(folder / "round.txt"); }), "end nowhere"));
}

TEST(AtomicFile, OtherHardLinksKeepWhatWasThere)
{
    const TemporaryFolder folder;
    folder.write("a.txt", "old");
    fs::create_hard_link(folder / "a.txt", folder / "b.txt");
    writeTextAtomically(folder / "a.txt", "new");
    EXPECT_EQ(folder.read("a.txt"), "new");
    EXPECT_EQ(folder.read("b.txt"), "old");
}

TEST(AtomicFile, PermissionsAreKept)
{
    const TemporaryFolder folder;
    const mode_t before = umask(027);
    writeTextAtomically(folder / "new.txt", "");
    EXPECT_EQ(modeOf(folder / "new.txt"), 0640u);
    for (const mode_t mode : {0600u, 0666u, 0751u, 0200u}) {
        chmod((folder / "new.txt").c_str(), mode);
        writeAtomically(folder / "new.txt", [&](const fs::path& temporary) {
            EXPECT_EQ(modeOf(temporary) & 0077 & ~mode, 0u) << "not more open than the old file";
            std::ofstream(temporary) << "text";
        });
        EXPECT_EQ(modeOf(folder / "new.txt"), mode);
    }
    umask(0777); // even then the file can be opened by its name while it is written
    writeTextAtomically(folder / "closed.txt", "text");
    EXPECT_EQ(modeOf(folder / "closed.txt"), 0u);
    umask(before);
}

TEST(AtomicFile, TheOwnerIsKept)
{
    if (geteuid() != 0) GTEST_SKIP() << "only root may give files away";
    const TemporaryFolder folder;
    const fs::path file = folder.write("a.txt", "old");
    ASSERT_EQ(chown(file.c_str(), 1234, 5678), 0);
    writeTextAtomically(file, "new");
    struct stat found { };
    ASSERT_EQ(stat(file.c_str(), &found), 0);
    EXPECT_EQ(found.st_uid, 1234u);
    EXPECT_EQ(found.st_gid, 5678u);
}

TEST(AtomicFile, AFileThatNobodyMayWriteIsRefused)
{
    const TemporaryFolder folder;
    const fs::path file = folder.write("a.txt", "old");
    chmod(file.c_str(), 0444);
    for (const auto& check : {std::function<void()>([&] { requireWritable(file); }),
                              std::function<void()>([&] { writeTextAtomically(file, "new"); })}) {
        const std::string message = messageOf(check);
        EXPECT_TRUE(has(message, "a.txt: expected the name of a file to write, found one that"))
            << message;
    }
    EXPECT_EQ(folder.read("a.txt"), "old");
    EXPECT_EQ(modeOf(file), 0444u);
}

TEST(AtomicFile, WhatAnotherUserMayNotWriteIsRefusedEarly)
{
    if (geteuid() != 0) GTEST_SKIP() << "only root can be another user";
    const TemporaryFolder folder;
    chmod(folder.path().c_str(), 0755);
    const fs::path file = folder.write("a.txt", "old");
    const AsNobody nobody;
    EXPECT_TRUE(has(messageOf([&] { requireWritable(file); }), "cannot be written"));
    EXPECT_TRUE(has(messageOf([&] { requireWritable(folder / "b.txt"); }), "no file can be made"));
    EXPECT_TRUE(
        has(messageOf([&] { requireWritable(folder / "new/b.txt"); }), "could not be made"));
}

TEST(AtomicFile, WhatCannotBeWrittenIsRefusedEarly)
{
    const TemporaryFolder folder;
    const fs::path file = folder.write("a.txt", "");
    EXPECT_TRUE(has(messageOf([&] { requireWritable(folder.path()); }), "a directory"));
    EXPECT_TRUE(has(messageOf([&] { requireWritable(folder / "new/"); }), "a directory"));
    EXPECT_TRUE(has(messageOf([&] { requireWritable(file / "b.txt"); }), "could not be made"));
    EXPECT_TRUE(
        has(messageOf([&] { requireWritable("/proc/none/b.txt"); }), "none at /proc/none."));
    const std::string long_name(300, 'n');
    EXPECT_TRUE(
        has(messageOf([&] { requireWritable(folder / long_name); }), "a name of 300 bytes"));
    EXPECT_TRUE(has(messageOf([&] { requireWritable(folder / long_name / "a.txt"); }),
                    "a name of 300 bytes"));
    for (const char* name : {"a.txt", "b.txt", "new/folder/b.txt"}) requireWritable(folder / name);
    requireWritable(folder / std::string(255, 'n'));
    writeTextAtomically(folder / (std::string(251, 'n') + ".txt"), "");
    EXPECT_EQ(files(folder.path()), 2) << "nothing is left, and no folder is made";
}

TEST(AtomicFile, APipeGetsTheBytes)
{
    const TemporaryFolder folder;
    const fs::path pipe = folder / "pipe.txt";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    requireWritable(pipe);               // does not wait for a reader
    const std::string text(300000, 'x'); // more than a pipe holds
    std::future<std::string> read = readLater(pipe);
    writeTextAtomically(pipe, text);
    EXPECT_TRUE(read.get() == text);
    EXPECT_TRUE(fs::is_fifo(pipe));
    read = readLater(pipe);
    EXPECT_THROW(writeAtomically(pipe,
                                 [&](const fs::path& temporary) {
                                     EXPECT_EQ(temporary.extension(), ".txt");
                                     EXPECT_NE(temporary.parent_path(), folder.path());
                                     throw std::runtime_error("stop");
                                 }),
                 std::runtime_error);
    writeTextAtomically(pipe, ""); // lets the reader go
    EXPECT_EQ(read.get(), "");
    EXPECT_EQ(files(folder.path()), 1);
}

TEST(AtomicFile, ATerminalGetsTheBytes)
{
    const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
    ASSERT_TRUE(terminal >= 0 && grantpt(terminal) == 0 && unlockpt(terminal) == 0);
    const fs::path name = ptsname(terminal);
    const int keep = open(name.c_str(), O_RDWR | O_NOCTTY);
    writeTextAtomically(name, "text");
    char bytes[16] = {};
    ASSERT_EQ(::read(terminal, bytes, sizeof bytes), 4);
    EXPECT_STREQ(bytes, "text");
    EXPECT_TRUE(fs::is_character_file(name));
    close(keep);
    close(terminal);
}

// The device is a copy of /dev/null and of /dev/full, so that the machine's own are in no danger.
TEST(AtomicFile, ADeviceStaysADevice)
{
    const TemporaryFolder folder;
    const fs::path null = folder / "null.txt", full = folder / "full.txt";
    if (mknod(null.c_str(), S_IFCHR | 0666, makedev(1, 3)) != 0
        || mknod(full.c_str(), S_IFCHR | 0666, makedev(1, 7)) != 0
        || open(null.c_str(), O_WRONLY | O_CLOEXEC) < 0)
        GTEST_SKIP() << "this user cannot make devices here: " << std::strerror(errno);
    chmod(null.c_str(), 0666);
    fs::create_symlink("null.txt", folder / "link.txt");
    requireWritable(null);
    writeTextAtomically(null, "text");
    writeTextAtomically(folder / "link.txt", "text");
    EXPECT_TRUE(has(messageOf([&] { writeTextAtomically(full, "text"); }), "No space left"));
    EXPECT_TRUE(fs::is_character_file(fs::symlink_status(null)));
    EXPECT_TRUE(fs::is_character_file(fs::symlink_status(full)));
    EXPECT_TRUE(fs::is_symlink(folder / "link.txt"));
    EXPECT_EQ(modeOf(null), 0666u);
    EXPECT_EQ(files(folder.path()), 3);
}

// What /dev/stdout stands for may be a file whose name is gone, and a shell still has it open.
TEST(AtomicFile, AnOpenFileOfProcGetsTheBytes)
{
    const TemporaryFolder folder;
    const fs::path file = folder.write("a.txt", "before\n");
    const int fd = open(file.c_str(), O_WRONLY);
    struct stat before {
    }, after{};
    ASSERT_EQ(fstat(fd, &before), 0);
    fs::create_symlink("/proc/self/fd/" + std::to_string(fd), folder / "out.txt");
    writeTextAtomically(folder / "out.txt", "text\n");
    EXPECT_EQ(folder.read("a.txt"), "before\ntext\n");
    ASSERT_EQ(stat(file.c_str(), &after), 0);
    EXPECT_EQ(before.st_ino, after.st_ino);
    close(fd);
}

TEST(AtomicFile, LinkTargetIsTheEndOfAllLinks)
{
    const TemporaryFolder folder;
    fs::create_symlink("b.txt", folder / "a.txt");
    EXPECT_EQ(linkTarget(folder / "a.txt"), folder / "b.txt");
    EXPECT_EQ(linkTarget(folder / "b.txt"), folder / "b.txt");
    EXPECT_EQ(linkTarget("b.txt"), "b.txt");
}
