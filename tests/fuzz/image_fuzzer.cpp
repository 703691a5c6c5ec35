// SPDX-License-Identifier: Apache-2.0
// A fuzzer of the readers of images: any bytes end in an image or in an Error. The first byte
// chooses the file's ending, the others are the file.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

#include "volcomp/base/error.h"
#include "volcomp/surface/texture.h"
#include "volcomp/view/image.h"

namespace {

/// The file that the readers get; it is in memory, and goes when the fuzzer ends.
struct Scratch {
    std::string folder;
    Scratch() : folder("/dev/shm/volcomp_image_fuzzer_XXXXXX")
    {
        if (!mkdtemp(folder.data())) std::abort();
    }
    ~Scratch() { std::filesystem::remove_all(folder); }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;
};

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    static constexpr std::array<const char*, 9> kEndings{"png", "exr", "tif", "jpg", "hdr",
                                                         "tga", "bmp", "pgm", "gif"};
    static const Scratch scratch;
    if (size < 1) return 0;
    const std::filesystem::path file =
        scratch.folder + "/image." + kEndings.at(data[0] % kEndings.size());
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(data) + 1, static_cast<std::streamsize>(size - 1));
    for (const bool map : {true, false}) {
        try {
            if (map) {
                const volcomp::Texture t = volcomp::readTexture(file, (data[0] & 128) != 0);
                (void)t.sample(0.3, 0.7, 0, volcomp::Wrap::repeat);
                (void)t.colour(-0.3, 1.7, volcomp::Wrap::black);
            } else (void)volcomp::readImage(file);
        } catch (const volcomp::Error&) { // what damaged files are answered with
        }
    }
    std::filesystem::remove(file);
    return 0;
}
