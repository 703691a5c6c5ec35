// A picture in memory, and its files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace volcomp {

/// Linear, scene-referred pixels, row by row from the top left, channels interleaved.
struct Image {
    int width = 0, height = 0;
    std::vector<std::string> channels; ///< names: R, G, B, A (premultiplied), Z, ...
    std::vector<float> pixels;         ///< width * height * channels.size()

    float* pixel(int x, int y)
    {
        return &pixels[(static_cast<std::size_t>(y) * width + x) * channels.size()];
    }
    const float* pixel(int x, int y) const
    {
        return &pixels[(static_cast<std::size_t>(y) * width + x) * channels.size()];
    }
};

/// True for .exr, false for .png. Throws Error for another ending: ask before the work, not after
/// it.
bool requirePictureName(const std::filesystem::path& file);

/// Reads a picture of any format that OpenImageIO knows, as it is stored: EXR is linear, PNG in
/// sRGB. Throws Error where that fails.
Image readImage(const std::filesystem::path& file);

/// Writes .exr (all channels, with `metadata`) or .png (R, G, B and A in sRGB, 8 bit), by the
/// name's ending; the file appears when it is complete. Throws Error for another ending or a file
/// that cannot be written.
void writeImage(const std::filesystem::path& file, const Image& image,
                const std::vector<std::pair<std::string, std::string>>& metadata = {});

} // namespace volcomp
