// SPDX-License-Identifier: Apache-2.0
#include "volcomp/base/plain_name.h"

#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"
#include "volcomp/view/image.h"

using namespace volcomp;

namespace fs = std::filesystem;

TEST(PlainName, LeadsToTheFileWithoutAQuestionMark)
{
    const TemporaryFolder folder;
    fs::create_directories(folder / "a?b=c");
    for (const char* file : {"a.txt", "a?b=c/a.txt", "a?b=c/a?.txt", "a?.txt"}) {
        folder.write(file, file);
        const PlainName name(folder / file);
        EXPECT_EQ(name.text().find('?'), std::string::npos);
        std::ifstream stream(name.text());
        EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}), file);
    }
    EXPECT_EQ(PlainName("none?/a.txt").text(), "none?/a.txt");
    EXPECT_EQ(PlainName("a.txt").text(), "a.txt");
}

TEST(PlainName, PicturesHaveAnyName)
{
    const TemporaryFolder folder;
    fs::create_directories(folder / "a?b");
    Image image;
    image.width = image.height = 1;
    image.channels = {"R", "G", "B", "A"};
    image.pixels = {0.25f, 0.5f, 0.75f, 1.0f};
    for (const char* file : {"a?b/a.exr", "a?b/a?b.exr", "*?=&.exr"}) {
        writeImage(folder / file, image);
        EXPECT_EQ(readImage(folder / file).pixels, image.pixels) << file;
    }
}
