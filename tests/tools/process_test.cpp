// SPDX-License-Identifier: Apache-2.0
// Programs are run with what they are given, and nothing of ours stays open in them or in us.
#include "tools/shared/process.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <set>

#include <fcntl.h>
#include <gtest/gtest.h>

#include "volcomp/base/error.h"

using namespace volcomp;

namespace {

std::ptrdiff_t openFiles()
{
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
}

} // namespace

TEST(Process, GivesStatusAndOutput)
{
    const ProcessResult result = runProcess({"sh", "-c", "echo out; echo err >&2; cat; exit 3"});
    EXPECT_EQ(result.status, 3);
    EXPECT_EQ(result.output, "out\nerr\n");
    EXPECT_EQ(runProcess({"sh", "-c", "kill -9 $$"}).status, 128 + 9);
    EXPECT_EQ(runProcess({"sh", "-c", "exit 127"}).status, 127) << "its own, not a failed start";
    EXPECT_EQ(runProcess({"echo", "a b", "$HOME"}).output, "a b $HOME\n") << "no shell between";
}

TEST(Process, CountsWorkAndNotWaiting)
{
    const ProcessResult busy =
        runProcess({"sh", "-c", "i=0; while [ $i -lt 200000 ]; do i=$((i+1)); done"});
    EXPECT_GT(busy.cpu_seconds, runProcess({"sleep", "0.5"}).cpu_seconds);
}

TEST(Process, SaysWhatCannotBeStarted)
{
    for (const char* name : {"no-such-program-anywhere", "/etc/passwd"}) try {
            runProcess({name});
            ADD_FAILURE() << name;
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find(std::string(name) + " cannot be started"),
                      std::string::npos)
                << e.what();
        }
    EXPECT_FALSE(hasProgram("no-such-program-anywhere"));
    EXPECT_TRUE(hasProgram("sh"));
}

TEST(Process, LeaksNoFiles)
{
    const auto before = openFiles();
    runProcess({"true"});
    EXPECT_THROW(runProcess({"no-such-program-anywhere"}), Error);
    EXPECT_EQ(openFiles(), before);

    // The child has what we had without O_CLOEXEC, its own stdin, stdout and stderr, and the folder
    // that ls reads.
    std::set<int> expected{0, 1, 2};
    for (int fd = 3; fd < 1024; ++fd)
        if (const int flags = fcntl(fd, F_GETFD); flags >= 0 && !(flags & FD_CLOEXEC))
            expected.insert(fd);
    const std::string listing = runProcess({"ls", "/proc/self/fd"}).output;
    EXPECT_EQ(std::count(listing.begin(), listing.end(), '\n'),
              static_cast<std::ptrdiff_t>(expected.size() + 1))
        << listing;
}
