// SPDX-License-Identifier: Apache-2.0
// The mean over what a picture shows.
#pragma once

#include "volcomp/view/image.h"

namespace volcomp {

/// The mean of a channel over the mean of alpha, channel 3: that of what covers the pixels.
inline double meanOfCovered(const Image& image, int channel = 0)
{
    double sum = 0, alpha = 0;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            sum += image.pixel(x, y)[channel];
            alpha += image.pixel(x, y)[3];
        }
    return sum / alpha;
}

} // namespace volcomp
