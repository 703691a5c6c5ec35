// SPDX-License-Identifier: Apache-2.0
// A fuzzer of the readers of images: any bytes end in an image or in an Error. The first byte
// chooses the file's ending, the others are the file.
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/fuzz/scratch.h"
#include "volcomp/base/error.h"
#include "volcomp/surface/texture.h"
#include "volcomp/view/dome.h"
#include "volcomp/view/image.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    static constexpr std::array<const char*, 9> kEndings{"png", "exr", "tif", "jpg", "hdr",
                                                         "tga", "bmp", "pgm", "gif"};
    static const volcomp::Scratch scratch;
    if (size < 1) return 0;
    const std::filesystem::path file = scratch.write(
        std::string("image.") + kEndings.at(data[0] % kEndings.size()), data + 1, size - 1);
    enum class Use { map, picture, dome };
    for (const Use use : {Use::map, Use::picture, Use::dome}) {
        try {
            if (use == Use::map) {
                const volcomp::Texture t = volcomp::readTexture(file, (data[0] & 128) != 0);
                (void)t.sample(0.3, 0.7, 0, volcomp::Wrap::repeat);
                (void)t.colour(-0.3, 1.7, volcomp::Wrap::black);
            } else if (use == Use::picture) {
                (void)volcomp::readImage(file);
            } else {
                volcomp::Dome dome;
                dome.kind = volcomp::DomeKind::image;
                dome.file = file;
                for (const volcomp::Light& sun : volcomp::loadDome(dome)) sun.validate();
                (void)dome.seen(volcomp::Vec3d(0.6, 0.8, 0));
            }
        } catch (const volcomp::Error&) { // what damaged files are answered with
        }
    }
    std::filesystem::remove(file);
    return 0;
}
