// SPDX-License-Identifier: Apache-2.0
// Any bytes as the state of a stopped render. A state or an Error that names the file is well;
// anything else that leaves the function is a fault. The bytes are read twice: as the file, and, if
// they are JSON, as the fingerprint in a complete file, since mutations seldom keep its checksum.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "tests/fuzz/scratch.h"
#include "tools/render/checkpoint.h"
#include "volcomp/base/error.h"

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// What the render that goes on would be, with a member of each kind.
const json& fingerprint()
{
    static const json print = {{"version", "1"},
                               {"settings", {{"samples", 4}, {"tau", 0.5}, {"filter", "box"}}},
                               {"camera", {0, {1.0, 2.0, 3.0}}}};
    return print;
}

void read(const fs::path& file)
{
    try {
        volcomp::readCheckpoint(file, fingerprint());
    } catch (const volcomp::Error& e) {
        if (std::string(e.what()).find(file.string()) == std::string::npos) std::abort();
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    static const volcomp::Scratch scratch;
    const fs::path file = scratch.write("state", data, size);
    read(file);

    // A complete checkpoint of another render: its fingerprint is these bytes, if they are JSON.
    const json other = json::parse(reinterpret_cast<const char*>(data),
                                   reinterpret_cast<const char*>(data) + size, nullptr, false);
    if (other.is_discarded()) return 0;
    volcomp::RenderState state;
    state.sums.assign(size % 7, 0.25);
    state.samples.assign(size % 3, 4);
    volcomp::writeCheckpoint(file, other, state);
    read(file);
    if (other != fingerprint()) return 0;
    const volcomp::RenderState same = volcomp::readCheckpoint(file, fingerprint());
    if (same.sums != state.sums || same.samples != state.samples) std::abort();
    return 0;
}
