// SPDX-License-Identifier: Apache-2.0
// Any bytes as a volume file: read whole, as a box, and leaf by leaf as the renderer does.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include <openvdb/openvdb.h>
#include <unistd.h>

#include "volcomp/base/error.h"
#include "volcomp/compose/box_source.h"
#include "volcomp/render/tree/voxel_tree_io.h"
#include "volcomp/volume/packed_volume.h"
#include "volcomp/volume/vdb_io.h"

namespace {

namespace fs = std::filesystem;

/// A file in memory with the process's own name, removed at the end.
class FileInMemory {
public:
    FileInMemory()
    {
        std::error_code code;
        const fs::path folder =
            fs::is_directory("/dev/shm", code) ? fs::path("/dev/shm") : fs::temp_directory_path();
        m_path = folder / ("vdb_fuzzer." + std::to_string(::getpid()) + ".vdb");
    }
    ~FileInMemory()
    {
        std::error_code code;
        fs::remove(m_path, code);
    }
    const fs::path& path() const { return m_path; }

private:
    fs::path m_path;
};

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
    static const FileInMemory file;
    static const bool started = (openvdb::initialize(), true);
    static_cast<void>(started);
    std::ofstream(file.path(), std::ios::binary | std::ios::trunc)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    allowError([&] {
        const Volume volume = readVolume(file.path());
        for (const VolumePart& part : volume.parts) allowError([&] { packPart(part, "box"); });
        pack(volume);
    });
    allowError([&] { readVoxelTree(file.path()); });
    return 0;
}
