// SPDX-License-Identifier: Apache-2.0
// How two pictures differ, in numbers and as a picture.
#pragma once

#include <string>
#include <vector>

#include "volcomp/view/image.h"

namespace volcomp {

/// A pixel in which two pictures differ.
struct DifferentPixel {
    int x = 0, y = 0;           ///< from the top left corner
    float a[3] = {}, b[3] = {}; ///< R, G, B
    double difference = 0;      ///< root of the mean square over R, G, B
};

/// The difference of picture A from picture B, over R, G and B of all pixels.
struct PictureDifference {
    double mean_a = 0, mean_b = 0;
    /// Of the means, of pixels, and of means over blocks of pixels; relative to B's mean, or as
    /// they are if that is 0. What fills no whole block is left out of the last.
    double bias = 0, rmse = 0, block_rmse = 0;
    double alpha_rmse = 0; ///< of A; not relative. 0 if a picture has none
    /// The pixels that differ most, the worst first, no two of them near each other.
    std::vector<DifferentPixel> worst;
    bool equal = false; ///< in all bytes of R, G, B and A
};

/// Compares two pictures, also in blocks of `block` x `block` pixels. Throws Error if their sizes
/// differ or R, G or B is missing.
PictureDifference differenceOf(const Image& a, const Image& b, int block = 4, int worst = 5);

/// A, B and their difference beside each other, with labels and marks around the worst pixels. The
/// difference is red where A is brighter and blue where B is, `gain` times as strong as it is; with
/// 0 it is chosen so that 1 pixel in 1000 is at its brightest, at most. Throws Error as
/// differenceOf(), or if the font DejaVu Sans is not installed.
Image differencePicture(const Image& a, const Image& b, const std::string& name_a,
                        const std::string& name_b, double gain = 0);

} // namespace volcomp
