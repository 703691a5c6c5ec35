// SPDX-License-Identifier: Apache-2.0
// Any bytes as a volume file: read whole, as a box, and leaf by leaf as the renderer does.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include <openvdb/openvdb.h>

#include "tests/fuzz/scratch.h"
#include "volcomp/base/error.h"
#include "volcomp/compose/box_source.h"
#include "volcomp/render/tree/voxel_tree_io.h"
#include "volcomp/volume/packed_volume.h"
#include "volcomp/volume/vdb_io.h"

namespace {

/// Calls f; an Error is what it may end with.
template <class F>
void allowError(F&& f)
{
    try {
        f();
    } catch (const volcomp::Error&) { // a message
    }
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    using namespace volcomp;
    static const Scratch scratch;
    static const bool started = (openvdb::initialize(), true);
    static_cast<void>(started);
    const std::filesystem::path file = scratch.write("volume.vdb", data, size);
    allowError([&] {
        const Volume volume = readVolume(file);
        for (const VolumePart& part : volume.parts) allowError([&] { packPart(part, "box"); });
        pack(volume);
    });
    allowError([&] { readVoxelTree(file); });
    return 0;
}
