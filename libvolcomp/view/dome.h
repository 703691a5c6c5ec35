// SPDX-License-Identifier: Apache-2.0
// The dome: light from all directions, such as that of the sky (MODEL section 5b).
#pragma once

#include <filesystem>
#include <memory>

#include "volcomp/base/vec.h"
#include "volcomp/base/words.h"

namespace volcomp {

enum class DomeKind {
    constant, ///< the same everywhere
    gradient, ///< by the height over the horizon
    image     ///< a lat-long image
};
constexpr Word<DomeKind> kDomeKindWords[] = {
    {"constant", DomeKind::constant}, {"gradient", DomeKind::gradient}, {"image", DomeKind::image}};

struct DomeImage;

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
    std::shared_ptr<const DomeImage> image; ///< loadDome() sets it
    double rotate = 0;   ///< image: turns it around +y, from -z towards +x, radians
    double strength = 1; ///< factor on all of it, >= 0
    bool visible = true; ///< it is seen behind everything, instead of RenderParams::background

    /// Whether it shines nowhere.
    bool black() const;
    /// What comes from the direction `d` (unit, away from the scene), linear RGB. Of an image that
    /// is not loaded, nothing.
    Vec3d radiance(const Vec3d& d) const;
    /// Throws Error if a value is out of range or not finite.
    void validate() const;
};

} // namespace volcomp
