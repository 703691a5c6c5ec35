// SPDX-License-Identifier: Apache-2.0
// How a picture is computed: every approximation has its switch here.
#pragma once

#include "volcomp/base/vec.h"
#include "volcomp/base/words.h"
#include "volcomp/view/dome.h"
#include "volcomp/view/haze.h"

namespace volcomp {

enum class Integration { exact, riemann };
enum class Filter { box, trilinear };
enum class Extinction { isotropic, directed };
enum class Shadows { exact, sweep, none };
/// Whether a strand's or leaf's own particles shade it, where baking knows them (MODEL section 3).
enum class OwnShade { left_out, counted };
/// How often light is scattered between a light and the eye (MODEL section 5b).
enum class Scattering {
    single,  ///< once, as the paper has it: equation (10) as printed
    multiple ///< any number of times; the diffuse light of fibres is normalised
};
/// How a voxel without direction is shaded (MODEL section 4).
enum class Undirected { isotropic, gradient };
enum class PixelFilter { box, gaussian, blackman_harris };

constexpr Word<Integration> kIntegrationWords[] = {{"exact", Integration::exact},
                                                   {"riemann", Integration::riemann}};
constexpr Word<Filter> kFilterWords[] = {{"box", Filter::box}, {"trilinear", Filter::trilinear}};
constexpr Word<Extinction> kExtinctionWords[] = {{"isotropic", Extinction::isotropic},
                                                 {"directed", Extinction::directed}};
constexpr Word<Shadows> kShadowsWords[] = {
    {"exact", Shadows::exact}, {"sweep", Shadows::sweep}, {"none", Shadows::none}};
constexpr Word<OwnShade> kOwnShadeWords[] = {{"left_out", OwnShade::left_out},
                                             {"counted", OwnShade::counted}};
constexpr Word<Scattering> kScatteringWords[] = {{"single", Scattering::single},
                                                 {"multiple", Scattering::multiple}};
constexpr Word<Undirected> kUndirectedWords[] = {{"isotropic", Undirected::isotropic},
                                                 {"gradient", Undirected::gradient}};
constexpr Word<PixelFilter> kPixelFilterWords[] = {
    {"box", PixelFilter::box},
    {"gaussian", PixelFilter::gaussian},
    {"blackman-harris", PixelFilter::blackman_harris}};

/// A rectangle of pixels, counted from the picture's top left corner. Width 0 means the whole
/// picture; any other rectangle lies inside it.
struct Crop {
    int x = 0, y = 0, width = 0, height = 0;
};

/// The settings of render(), as the [render] table says.
struct RenderParams {
    int width = 640, height = 480;               ///< pixels
    Crop crop;                                   ///< the image holds only these pixels
    int samples = 1;                             ///< per pixel
    PixelFilter pixel_filter = PixelFilter::box; ///< weight of the samples, if there are several
    double pixel_radius = 0; ///< of that filter, pixels; 0 means 0.5 for box, 1.5 for the others
    double tau = 1;          ///< extinction per density, >= 0
    Integration integration = Integration::exact;
    double step = 1; ///< of riemann integration, voxels
    Filter filter = Filter::box;
    Extinction extinction = Extinction::directed;
    Shadows shadows = Shadows::exact;
    OwnShade own_shade = OwnShade::left_out;
    Scattering scattering = Scattering::single;
    /// Rays end where less than this fraction of light passes; 0 means never. No radiance is off by
    /// more than the cutoff times the brightest that a voxel shows.
    double cutoff = 0.001;
    bool lod = false; ///< level of detail: coarser voxels where voxels are smaller than pixels
    Undirected undirected = Undirected::isotropic;
    /// Hard lights that a soft one stands for (soft_light.h), if there are several samples a pixel:
    /// each sample sees one of them. With one sample a pixel it is its middle alone.
    int light_samples = 8;
    /// Adds Z, N.X, N.Y, N.Z, albedo.R, .G, .B, and R, G, B of each light and of ambient,
    /// background and haze.
    bool aovs = false;
    Vec3d background{0}; ///< radiance behind everything if no dome is seen, linear RGB
    Vec3d ambient{0};    ///< radiance from all around, linear RGB
    Dome dome;           ///< the sky and what else is far away; adds to `ambient`
    Haze haze;           ///< air between the eye and what it sees; lights are not weakened by it

    /// Whether something is seen behind everything, so that alpha is 1: the dome, if it is visible
    /// and shines, or the background.
    bool hasBackdrop() const;
    /// What is seen of it in the direction `d` (unit), linear RGB.
    Vec3d backdrop(const Vec3d& d) const;

    /// Throws Error if a value is out of range or not finite.
    void validate() const;
};

} // namespace volcomp
