// SPDX-License-Identifier: Apache-2.0
// The dome: light from all directions, such as that of the sky (MODEL section 5b).
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/base/words.h"
#include "volcomp/view/light.h"

namespace volcomp {

enum class DomeKind {
    constant, ///< the same everywhere
    gradient, ///< by the height over the horizon
    image     ///< a lat-long image
};
constexpr Word<DomeKind> kDomeKindWords[] = {
    {"constant", DomeKind::constant}, {"gradient", DomeKind::gradient}, {"image", DomeKind::image}};

struct LoadedDome;

/// The [dome] table. +y is up. The default is black.
struct Dome {
    DomeKind kind = DomeKind::constant;
    Vec3d colour{0.0}; ///< constant: radiance, linear RGB
    /// gradient: radiance straight up, at the horizon and below it. Between the first two it goes
    /// linearly with the angle.
    Vec3d zenith{0.0}, horizon{0.0}, ground{0.0};
    /// image: width = 2 height, all around. Its middle looks along -z and its right half towards
    /// +x, so u = 0 looks along +z.
    std::filesystem::path file;
    std::shared_ptr<const LoadedDome> image; ///< loadDome() sets it
    double rotate = 0;   ///< image: turns it around +y, from -z towards +x, radians
    double strength = 1; ///< factor on all of it, >= 0
    bool visible = true; ///< it is seen behind everything, instead of RenderParams::background

    /// Whether it shines nowhere. An image that is not loaded may shine.
    bool black() const;
    /// What comes from the direction `d` (unit, away from the scene) and lights the scene, linear
    /// RGB: of an image without its suns, which are lights. Of an image that is not loaded,
    /// nothing.
    Vec3d radiance(const Vec3d& d) const;
    /// The same, of an image as means over some 6 degrees: for those who look in a few directions.
    Vec3d softRadiance(const Vec3d& d) const;
    /// What is seen in the direction `d`: radiance(), with the suns in it.
    Vec3d seen(const Vec3d& d) const;
    /// Throws Error if a value is out of range or not finite.
    void validate() const;
};

/// Reads the image of a dome of kind image; does nothing for the others. Returns its suns, the
/// brightest first, as directional lights without names: each has a disc and the light that it
/// brought, which radiance() leaves out. Call it when strength and rotate are set, and give the
/// lights to render().
///
/// A sun is what is at most 5 x 5 degrees large, 50 times as bright as the mean and has at least
/// 5 % of the light (dome_suns.h). Throws Error as readImageFile() of base/image_file.h does, and
/// if the image is not twice as wide as high, has two channels of colours, or has values that are
/// negative, infinite or NaN.
std::vector<Light> loadDome(Dome& dome);

} // namespace volcomp
