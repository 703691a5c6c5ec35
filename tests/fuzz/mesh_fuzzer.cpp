// SPDX-License-Identifier: Apache-2.0
// Any bytes as a mesh: the first byte chooses the ending (254 and 255 those of glTF), the rest is
// the file. A mesh or an Error is well; anything else that leaves the function is a fault.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/fuzz/scratch.h"
#include "volcomp/base/error.h"
#include "volcomp/surface/mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    if (size == 0) return 0;
    const char* const endings[] = {".obj", ".ply", ".off", ".stl"};
    const std::string ending = data[0] == 255 ? ".glb"
        : data[0] == 254                      ? ".gltf"
                                              : endings[data[0] % 4];
    static const volcomp::Scratch scratch;
    const std::filesystem::path file = scratch.write("mesh" + ending, data + 1, size - 1);
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
