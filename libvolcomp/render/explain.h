// SPDX-License-Identifier: Apache-2.0
// What the ray of one pixel met: every interval, its particles and the light of each lamp.
//
// The terms add up to the pixel of a render with one sample. Nothing is computed a second way: the
// terms are what the renderer itself adds along the ray (RayObserver).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <openvdb/Types.h>

#include "volcomp/render/render_params.h"
#include "volcomp/view/camera.h"
#include "volcomp/view/light.h"
#include "volcomp/volume/material.h"

namespace volcomp {

class SkinTracer;
struct VoxelLevel;

/// The particles of one material in one voxel that an interval shows.
struct ExplainedPart {
    openvdb::Coord voxel;
    std::string material; ///< empty if the volume names none
    MaterialKind kind = MaterialKind::fibre;
    double density = 0; ///< of these particles, 1 / world length
    double share = 0;   ///< of what the interval shows; the shares of an interval add up to 1
    bool directed = false;
    Vec3d direction{0.0}; ///< tangent or normal, world, unit length; zero if not directed
    double spread = 0;    ///< of the directions, 0 to 1 (volume.h)
    Vec3d colour{0.0};    ///< diffuse colour c_b, linear RGB
};

/// One light in one interval.
struct ExplainedLight {
    std::size_t light;    ///< number in the list of lights
    Vec3d strength;       ///< what arrives in the interval's middle if nothing shades it
    Vec3d reflected;      ///< what the interval would show of that if it were opaque
    double transmittance; ///< of the way to the light: 1 without shadows
    Vec3d adds; ///< radiance that this adds to the pixel: weight x transmittance x reflected, and
                ///< what the haze in front of it lets through
    Vec3d scattered{0.0}; ///< radiance that its light adds which is scattered more than once
};

/// A voxel (exact integration, box filter), a cell between eight voxel centres (exact, trilinear),
/// or one sample of a sum (riemann).
struct ExplainedInterval {
    std::size_t level = 0;     ///< of detail: number in the list of levels
    double voxel_size = 0;     ///< of that level, world units
    openvdb::Coord voxel;      ///< that holds the interval's middle, grid index in that level
    double begin = 0, end = 0; ///< distances from the ray's origin, world units; equal in a sum
    double depth = 0;          ///< the interval's own optical depth
    double transmittance = 1;  ///< from the ray's origin to the interval
    double weight = 0;         ///< of the pixel's light: how much of it comes from here
    std::vector<ExplainedPart> parts;
    std::vector<ExplainedLight> lights; ///< those of which the interval reflects something
    Vec3d ambient{0.0};                 ///< radiance that light from all around adds to the pixel
};

/// A skin that is a mesh, which the ray has met. World space and world units.
struct ExplainedSkin {
    std::string surface, material; ///< their names
    double distance = 0;           ///< from the ray's origin
    double transmittance = 1;      ///< from the ray's origin to it, the share of the pixel
    Vec3d position{0.0};
    Vec3d normal{0.0};                  ///< smooth, unit, turned to the eye
    Vec3d colour{0.0};                  ///< diffuse colour c_b, linear RGB
    std::vector<ExplainedLight> lights; ///< those of which it reflects something
    Vec3d ambient{0.0};                 ///< radiance that light from all around adds to the pixel
};

/// The intervals in order and the sums over them. Colours are radiance, linear RGB.
struct RayExplanation {
    int x = 0, y = 0;                  ///< pixel of the whole picture
    Vec3d origin{0.0}, direction{0.0}; ///< world; the direction is unit length
    std::vector<ExplainedInterval> intervals;
    std::optional<ExplainedSkin> skin; ///< on which the ray ends
    std::vector<Vec3d> light_sums;     ///< by light
    Vec3d ambient{0.0};                ///< sum
    double transmittance = 1;          ///< to the ray's end
    Vec3d background{0.0};             ///< what the dome or the background adds
    Vec3d haze{0.0};                   ///< what the haze adds before all of these
    Vec3d radiance{0.0};               ///< sum of all: the pixel's R, G, B
    double alpha = 0;                  ///< the pixel's A
};

/// Throws Error, with a message that begins with `option`, if the pixel (x, y) lies outside of the
/// picture that these settings make, or of its crop. Pixels are counted from the whole picture's
/// top left corner also if there is a crop.
void requirePixel(const RenderParams& params, int x, int y, const std::string& option);

/// Explains the pixel (x, y), counted as above, of the picture that render() makes with these
/// arguments and one sample: soft lights are as their middles. Swept light is prepared for the
/// whole picture (or its crop), so that it is the picture's. Throws Error as render() and
/// requirePixel().
RayExplanation explain(const std::vector<VoxelLevel>& levels,
                       const std::vector<Material>& materials, const Camera& camera,
                       const std::vector<Light>& lights, const RenderParams& params, int x, int y,
                       const SkinTracer* skins = nullptr);

/// A table of an explanation for people. Distances are world units, `lod` is the number of the
/// level, `transmitted` the transmittance in front of the interval; `lights` as given to explain().
std::string explanationTable(const RayExplanation& explanation, const std::vector<Light>& lights);

} // namespace volcomp
