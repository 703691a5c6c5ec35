// SPDX-License-Identifier: Apache-2.0
// Any bytes as a mesh: the first byte chooses the ending, the rest is the file. A mesh or an Error
// is well; anything else that leaves the function is a fault.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

#include "volcomp/base/error.h"
#include "volcomp/surface/mesh.h"

namespace {

namespace fs = std::filesystem;

/// Where the meshes are written: in memory if the machine has such a folder.
const fs::path& folder()
{
    static const fs::path path = [] {
        std::error_code code;
        const fs::path memory = "/dev/shm";
        const fs::path base = fs::is_directory(memory, code) ? memory : fs::temp_directory_path();
        fs::path made = base / ("volcomp_mesh_fuzzer_" + std::to_string(getpid()));
        fs::create_directories(made);
        std::atexit([] { fs::remove_all(folder()); });
        return made;
    }();
    return path;
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    if (size == 0) return 0;
    const char* const endings[] = {".obj", ".ply", ".off", ".stl"};
    const fs::path file = folder() / (std::string("mesh") + endings[data[0] % 4]);
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(data + 1), static_cast<std::streamsize>(size - 1));
    try {
        volcomp::Mesh mesh = volcomp::readMesh(file);
        prepareMesh(mesh, 1, volcomp::Vec3d(0.0), volcomp::Orientation::outward);
        if (mesh.normals.size() != mesh.points.size() || mesh.triangles.empty()) std::abort();
        for (const auto& triangle : mesh.triangles)
            for (const std::int32_t p : triangle)
                if (p < 0 || static_cast<std::size_t>(p) >= mesh.points.size()) std::abort();
    } catch (const volcomp::Error& e) {
        if (std::string(e.what()).find(file.string()) == std::string::npos) std::abort();
    }
    return 0;
}
