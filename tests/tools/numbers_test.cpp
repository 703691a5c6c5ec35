// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/numbers.h"

#include <gtest/gtest.h>

#include "tools/render/render_options.h"
#include "tests/support/message_of.h"

using namespace volcomp;

namespace {

/// What render options make of one option, or their message.
RenderParams applied(const std::string& option)
{
    CLI::App app;
    const RenderOptions options(app);
    app.parse(option);
    RenderParams params;
    options.apply(params);
    return params;
}

void expectParts(const std::string& message, std::initializer_list<std::string> parts)
{
    for (const std::string& part : parts)
        EXPECT_NE(message.find(part), std::string::npos) << part << " in " << message;
}

} // namespace

TEST(Numbers, RealNumbersAreFiniteAndInTheRange)
{
    const CLI::Validator any = realNumber(0), range = realNumber(0.5, 2);
    for (const char* text : {"0", "1e300", "0.25", "1e-300"}) EXPECT_EQ(any(text), "") << text;
    for (const char* text : {"nan", "inf", "-inf", "1e999", "-1", "-nan", "", "1 2", "2m", "0x"})
        expectParts(any(text), {"expected a finite number >= 0", std::string("'") + text + "'"});
    for (const char* text : {"0.5", "2", "1"}) EXPECT_EQ(range(text), "") << text;
    for (const char* text : {"0.49", "2.01", "nan", "inf"})
        expectParts(range(text), {"from 0.5 to 2", text});
}

TEST(Numbers, WholeNumbersAreWholeAndInTheRange)
{
    const CLI::Validator range = wholeNumber(1, 65536);
    for (const char* text : {"1", "65536", "007"}) EXPECT_EQ(range(text), "") << text;
    for (const char* text :
         {"0", "65537", "-1", "1.5", "1e3", "99999999999999999999", "nan", "", "3 "})
        expectParts(range(text), {"a whole number from 1 to 65536", std::string("'") + text + "'"});
}

TEST(Numbers, SizesAndCropsAreWholeNumbers)
{
    EXPECT_EQ(applied("--size 640x480").height, 480);
    EXPECT_EQ(applied("--crop 10,5,1,8").crop.width, 1);
    for (const char* text : {"640", "640x", "x480", "640x480x1", "640.5x480", "nanxnan", "0x480",
                             "640x0", "-640x480", "640,480", "6e2x480", "640x480 "})
        expectParts(messageOf([&] { applied(std::string("--size '") + text + "'"); }),
                    {"--size: expected WIDTHxHEIGHT", std::string("'") + text + "'"});
    for (const char* text :
         {"1,2,3", "1,2,3,4,5", "1,2,3,", "1.5,2,3,4", "nan,0,1,1", "0,0,inf,1", "", "1;2;3;4"})
        if (*text)
            expectParts(messageOf([&] { applied(std::string("--crop '") + text + "'"); }),
                        {"--crop: expected X,Y,WIDTH,HEIGHT", std::string("'") + text + "'"});
    for (const char* text : {"10,5,0,8", "10,5,8,0", "0,0,0,0", "1,2,-3,4"})
        expectParts(messageOf([&] { applied(std::string("--crop '") + text + "'"); }),
                    {"--crop: expected a width and a height of at least 1 pixel", text});
    // 2^32 + 8 is 8 to a reader that forgets what is above.
    expectParts(messageOf([&] { applied("--crop 0,0,4294967304,8"); }),
                {"--crop", "4294967304", "2147483647"});
    expectParts(messageOf([&] { applied("--size 4294967304x8"); }),
                {"--size", "4294967304", "2147483647"});
    expectParts(messageOf([&] { readPixel("--explain", "4294967304,8"); }),
                {"--explain", "4294967304", "2147483647"});
}
