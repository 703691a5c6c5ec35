// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/atomic_file.h"

#include <fstream>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

using namespace volcomp;

namespace fs = std::filesystem;

namespace {

std::ptrdiff_t files(const fs::path& folder)
{
    return std::distance(fs::directory_iterator(folder), {});
}

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
                  writeAtomically(file, [](const fs::path&) {});
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
