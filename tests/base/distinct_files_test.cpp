// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/distinct_files.h"

#include <gtest/gtest.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

using namespace volcomp;

namespace fs = std::filesystem;

TEST(DistinctFiles, AnOutputIsNoInput)
{
    const TemporaryFolder folder;
    const fs::path scene = folder.write("scene.toml", "text");
    fs::create_directory(folder / "d");
    fs::create_symlink("../scene.toml", folder / "d/link.toml");
    fs::create_hard_link(scene, folder / "hard.toml");
    for (const char* name : {"scene.toml", "./d/../scene.toml", "d/link.toml", "hard.toml"}) {
        const std::string message = messageOf([&] {
            requireDistinct({{"the scene", scene}}, {{"--stats", folder / name}});
        });
        for (const char* part : {"--stats", "read as the scene", "scene.toml", name})
            EXPECT_NE(message.find(part), std::string::npos) << message;
    }
    requireDistinct({{"the scene", scene}, {"a box", {}}},
                    {{"--stats", folder / "scene2.toml"}, {"-o", {}}, {"--sheet", {}}});
    // Two inputs may be one file, and one that is not there yet is no input of that name.
    requireDistinct({{"a map", scene}, {"another map", scene}}, {});
}

TEST(DistinctFiles, TwoOutputsAreNotOne)
{
    const TemporaryFolder folder;
    fs::create_directory(folder / "d");
    fs::create_symlink("../new/a.exr", folder / "d/link.exr");
    for (const char* name :
         {"new/a.exr", "d/../new/a.exr", "new/./a.exr", "d/link.exr", "new/a.exr/b.json"}) {
        const std::string message = messageOf([&] {
            requireDistinct({}, {{"-o", folder / "new/a.exr"}, {"--stats", folder / name}});
        });
        for (const char* part : {"--stats", "-o", "new/a.exr"})
            EXPECT_NE(message.find(part), std::string::npos) << message;
    }
    requireDistinct({}, {{"-o", folder / "new/a.exr"}, {"-o", folder / "new/a.exr2"}});
    requireDistinct({}, {{"-o", "/dev/null"}, {"--stats", "/dev/null"}});
}
