// SPDX-License-Identifier: Apache-2.0
// Any bytes as strands: the first byte chooses the ending, the rest is the file; with the fifth the
// file is the sidecar of a small HAIR. Strands or an Error that names the file are well; anything
// else that leaves the function is a fault.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/fuzz/scratch.h"
#include "volcomp/base/error.h"
#include "volcomp/curves/curve_pieces.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

/// A HAIR of two strands of two points.
std::string smallHair()
{
    std::string text = "HAIR";
    for (const char count : {2, 4, 2, 1}) text += std::string(1, count) + std::string(3, '\0');
    text.resize(128);
    for (int i = 0; i < 12; ++i) text += std::string("\0\0", 2) + char(i) + "A"; // about 8
    return text;
}

void abortIf(bool fault)
{
    if (fault) std::abort();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    if (size == 0) return 0;
    const char* const endings[] = {".hair", ".tfx", ".ply", ".obj"};
    static const volcomp::Scratch scratch, with_sidecar;
    std::filesystem::path file;
    if (data[0] % 5 == 4) {
        const std::string hair = smallHair();
        file = with_sidecar.write("a.hair", reinterpret_cast<const std::uint8_t*>(hair.data()),
                                  hair.size());
        with_sidecar.write("a.hair.json", data + 1, size - 1);
    } else file = scratch.write(std::string("curves") + endings[data[0] % 5], data + 1, size - 1);
    volcomp::GrowthRule rule;
    rule.variants = 3;
    rule.curves.emplace().file = file;
    rule.curves->groom = data[0] % 2 == 0;
    rule.curves->width = 0.001;
    rule.curves->use_guides = true;
    try {
        const volcomp::CurvePieces pieces(rule);
        abortIf(pieces.strandCount() == 0);
        for (int k = 0; k < pieces.count(); ++k)
            for (const volcomp::SkeletonPart& part : pieces.skeleton(k))
                for (const volcomp::Segment& s : part.segments)
                    abortIf(!(s.size_a >= 0 && s.size_b >= 0) || std::isnan(s.a[0])
                            || std::isnan(s.b[1]));
    } catch (const volcomp::Error& e) {
        abortIf(std::string(e.what()).find(file.string()) == std::string::npos);
    }
    return 0;
}
