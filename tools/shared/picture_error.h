// SPDX-License-Identifier: Apache-2.0
// How far a picture is from an exact one that is known by samples.
#pragma once

#include <nlohmann/json.hpp>

#include "volcomp/view/image.h"

namespace volcomp {

/// How far a picture is from the exact one.
struct PictureError {
    double mean = 0;       ///< of the exact picture's R, G and B over all pixels
    double bias = 0;       ///< of the mean, relative to it
    double rmse = 0;       ///< over pixels and R, G, B, relative to the mean
    double block_rmse = 0; ///< the same of means over blocks
    // Of alpha, over the pixels in which one of the pictures has something; not relative.
    double alpha_mean = 0, alpha_bias = 0, alpha_rmse = 0, alpha_block_rmse = 0;
};

/// Compares R, G, B and A of a picture with an exact one of the same size, also in blocks of
/// `block` x `block` pixels. The exact one has half.R, half.G, half.B and half.A beside R, G, B and
/// A: the picture by one half of its samples. The noise of the exact picture is left out: with its
/// halves a and b the mean square is that of (x - a)(x - b), which may be below zero; its root is
/// then shown as negative. Throws Error if the sizes differ or a channel is missing.
PictureError pictureError(const Image& picture, const Image& exact, int block = 4);

/// The members by their names, as --stats and the charts' files have them.
nlohmann::json toJson(const PictureError& error);

} // namespace volcomp
