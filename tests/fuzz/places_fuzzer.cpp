// SPDX-License-Identifier: Apache-2.0
// Any bytes as a list of places: the first byte chooses the ending, the rest is the file. Places or
// an Error are well; anything else that leaves the function is a fault.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/fuzz/scratch.h"
#include "volcomp/base/error.h"
#include "volcomp/place/point_table.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    if (size == 0) return 0;
    const char* const endings[] = {".csv", ".json", ".ply"};
    static const volcomp::Scratch scratch;
    const std::filesystem::path file =
        scratch.write(std::string("places") + endings[data[0] % 3], data + 1, size - 1);
    try {
        for (const volcomp::GivenPlace& p : volcomp::readPlaces(file))
            if (!p.position.isFinite() || !(p.scale > 0) || !p.tint.isFinite()) std::abort();
    } catch (const volcomp::Error& e) {
        if (std::string(e.what()).find(file.string()) == std::string::npos) std::abort();
    }
    return 0;
}
