// SPDX-License-Identifier: Apache-2.0
#include "tools/volcomp/compare.h"

#include <filesystem>
#include <iostream>
#include <string>

#include <fmt/format.h>

#include "tools/shared/numbers.h"
#include "tools/shared/tool.h"
#include "volcomp/base/error.h"
#include "volcomp/inspect/picture_difference.h"
#include "volcomp/view/image.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

struct Options {
    fs::path a, b, output;
    double gain = 0;
};

std::string colourText(const float (&c)[3])
{
    return fmt::format("({:.4g} {:.4g} {:.4g})", c[0], c[1], c[2]);
}

std::string report(const PictureDifference& d)
{
    if (d.equal) return "the pictures are equal\n";
    const char* of = d.mean_b > 0 ? " %" : "";
    const double factor = d.mean_b > 0 ? 100 : 1;
    std::string text = fmt::format("mean           {:.6g} and {:.6g}\n", d.mean_a, d.mean_b)
        + fmt::format("bias           {:+.3g}{}\n", factor * d.bias, of)
        + fmt::format("RMSE           {:.3g}{}\n", factor * d.rmse, of)
        + fmt::format("  4x4 blocks   {:.3g}{}\n", factor * d.block_rmse, of);
    if (d.alpha_rmse > 0) text += fmt::format("alpha, RMSE    {:.3g}\n", d.alpha_rmse);
    for (const DifferentPixel& p : d.worst)
        text += fmt::format("{:<14} {} and {}\n", fmt::format("at {},{}", p.x, p.y),
                            colourText(p.a), colourText(p.b));
    return text;
}

nlohmann::json asJson(const PictureDifference& d)
{
    nlohmann::json worst = nlohmann::json::array();
    for (const DifferentPixel& p : d.worst)
        worst.push_back({{"x", p.x}, {"y", p.y}, {"difference", p.difference}});
    return {{"mean_a", d.mean_a}, {"mean_b", d.mean_b},         {"bias", d.bias},
            {"rmse", d.rmse},     {"block_rmse", d.block_rmse}, {"alpha_rmse", d.alpha_rmse},
            {"equal", d.equal},   {"worst", std::move(worst)}};
}

void compare(Tool& tool, const Options& options)
{
    if (requirePictureName(options.a) != requirePictureName(options.b))
        throw Error(
            "expected two pictures of one kind, found an .exr, which is linear, and a .png, "
            "which is as a screen shows it");
    if (!options.output.empty()) requirePictureName(options.output);
    tool.requireFiles({{"A", options.a}, {"B", options.b}}, {{"-o", options.output}});
    const Image a = readImage(options.a), b = readImage(options.b);
    const PictureDifference difference = differenceOf(a, b);
    tool.stats["difference"] = asJson(difference);
    std::cout << report(difference);
    if (!std::cout.flush()) throw Error("the numbers could not be written to the output");
    if (options.output.empty()) return;
    writeImage(options.output,
               differencePicture(a, b, "A: " + options.a.filename().string(),
                                 "B: " + options.b.filename().string(), options.gain));
    tool.say("wrote " + options.output.string());
}

} // namespace

int compareMain(int argc, char** argv)
{
    Tool tool("volcomp compare",
              "Says how far picture A is from picture B: bias, RMSE, the same of blocks, and the "
              "pixels that differ most.");
    Options options;
    tool.app.add_option("A", options.a, "Picture, .exr or .png")->required()->type_name("PICTURE");
    tool.app.add_option("B", options.b, "Picture that it is compared with, of the same kind")
        ->required()
        ->type_name("PICTURE");
    tool.app
        .add_option("-o,--output", options.output,
                    "Also write A, B and their difference beside each other")
        ->type_name("FILE.png");
    tool.app
        .add_option(
            "--gain", options.gain,
            "Factor on the difference in that picture; 0: so that 1 pixel in 1000 is at its "
            "brightest")
        ->capture_default_str()
        ->check(realNumber(0));
    return tool.main(argc, argv, [&] { compare(tool, options); });
}

} // namespace volcomp
