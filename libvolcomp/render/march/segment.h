// SPDX-License-Identifier: Apache-2.0
// The light of one segment of a ray: all ways to integrate add to the picture through addSegment().
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "volcomp/render/march/march_scene.h"
#include "volcomp/render/march/shading.h"
#include "volcomp/view/haze.h"

namespace volcomp {

/// What a ray brings.
struct RaySample {
    Vec3d radiance{0.0};      ///< of the volume and skins, without the background and the haze
    Vec3d ambient{0.0};       ///< the part of it that comes from all around
    Vec3d haze{0.0};          ///< radiance of the haze in front of the volume and skins
    double transmittance = 1; ///< of volume and skins to the ray's end; that of the haze is apart
    // With RenderParams::aovs, each the sum of what the voxels have, weighted by how much of them
    // the ray sees:
    Vec3d albedo{0.0}; ///< alpha c_b
    Vec3d normal{0.0}; ///< direction, turned to the eye
    double depth = 0;  ///< distance from the ray's origin, world units
};

/// How much work a render was.
struct RayCounts {
    std::uint64_t rays = 0, shadow_rays = 0;
    std::uint64_t shaded_voxels = 0; ///< segments that were shaded
};

/// A piece of a ray inside one voxel (exact, box filter), inside one cell between voxel centres
/// (exact, trilinear filter), or one sample of a sum (riemann), which has no length: t = end is its
/// place.
struct RaySegment {
    double delta;         ///< its own optical depth, > 0
    double t, end;        ///< along the ray, voxels
    Vec3d p_begin, p_end; ///< corner coordinates
    int cell[3];          ///< the voxel that holds its middle, lowest corner
    /// Density along it over its mean: the sum of profile[n] u^n, u from 0 at its begin to 1 at its
    /// end.
    double profile[4] = {1, 0, 0, 0};
};

/// What an observer learns of one light in one segment.
struct SeenLight {
    std::size_t light;
    Vec3d from_light;     ///< Shading::from_light
    double transmittance; ///< mean from the light to the segment, weighted by what the ray sees
    Vec3d radiance;       ///< added to RaySample::radiance for light that is scattered once
    Vec3d scattered{0.0}; ///< the same for light that is scattered more often
};
/// What an observer learns of one segment.
struct SeenSegment {
    const MarchScene& scene; ///< of the level of detail that the segment lies in
    const RaySegment& segment;
    const Shading& shading;
    double transmittance; ///< from the ray's origin to the segment; for a sum to behind the sample
    double weight;        ///< share of the pixel that shows this segment, but for haze
    std::vector<SeenLight> lights; ///< those of which the segment shows something
    Vec3d ambient;                 ///< radiance added for RenderParams::ambient and its dome
};
using RayObserver = std::function<void(const SeenSegment&)>;

/// One light along one camera ray, from segment to segment.
struct LightOnRay {
    /// The optical depth to the light where it was looked up last in the middle of a segment, and
    /// how fast it changed to there from the time before.
    struct Before {
        double t, depth; ///< t along the ray, voxels
        double slope;    ///< per voxel; not finite at the first place
    };
    std::optional<Before> before;
    /// What the sweep said without marching, and where on the ray.
    struct Approximate {
        double t, transmittance;
        bool fine; ///< the sweep could have been asked for more
    };
    std::optional<Approximate> approximate;
};

/// The light of one lamp in many rays, as sums of R, G and B.
struct LightSum {
    double offered = 0; ///< what the picture would show of it if nothing kept it away
    double arrived = 0; ///< what it shows of it that was scattered once
    double shown = 0;   ///< all that it shows of it
};

/// Which sample of a picture a ray is: what it draws at random is a function of this.
struct SampleNumber {
    std::uint64_t pixel = 0; ///< row by row over the whole picture
    int number = 0;          ///< of the pixel's samples
};

/// What a thread keeps while it traces rays. Each thread has its own.
struct RayScratch {
    SampleNumber sample; ///< the ray's; whoever traces it sets it
    RayCounts counts;
    std::vector<LightSum> light_sums;      ///< by light, of all rays so far
    double ambient_sum = 0;                ///< of RaySample::ambient, R + G + B
    HazeRay haze;                          ///< of the ray at hand
    std::vector<Vec3d> light_radiance;     ///< by light: its part of RaySample::radiance; with aovs
    const RayObserver* observer = nullptr; ///< called for each segment, if set

    // From segment to segment of one ray:
    std::vector<LightOnRay> lights;
    Shading shading; ///< of the segment at hand

    /// Forgets the segments of the last ray, not its counts and sums.
    void startRay(std::size_t light_count);
    /// Adds to light_sums: radiances in the pixel, `scattered` what was scattered more than once.
    void addLight(std::size_t light, const Vec3d& offered, const Vec3d& arrived,
                  const Vec3d& scattered)
    {
        const double once = arrived[0] + arrived[1] + arrived[2];
        light_sums[light].offered += offered[0] + offered[1] + offered[2];
        light_sums[light].arrived += once;
        light_sums[light].shown += once + scattered[0] + scattered[1] + scattered[2];
    }
};

/// Adds a segment with the shading in `scratch.shading` to the sample, behind what that has seen.
///
/// Exact: its light is summed over it by segment_light.h. Sums: the printed sum (4), whose sample
/// is attenuated by its own optical depth.
void addSegment(const MarchScene& scene, const RaySegment& segment, RaySample& sample,
                RayScratch& scratch);

struct WayToLight {
    Vec3d direction; ///< unit, grid axes; zero at the light itself
    double length;   ///< voxels; infinite for a directional light
};
/// The way from p (corner coordinates) to a light of MarchScene::grid_lights.
WayToLight wayToLight(const Light& light, const Vec3d& p);

/// Optical depth from p (corner coordinates), in voxel `cell` or on its faces, to a light: swept if
/// the sweep is used and knows it, otherwise along a ray. 0 at the light itself.
double depthToLight(const MarchScene& scene, std::size_t light, const int* cell, const Vec3d& p,
                    RayCounts& counts);

/// The same from a place `start` voxels nearer to the light (Shading::light_start), 0 if that is
/// behind it. Without a start, `cell` counts.
double depthFromStart(const MarchScene& scene, std::size_t light, double start, const int* cell,
                      const Vec3d& p, RayCounts& counts);

/// (1 - e^-x) / x e^-a without overflow, 1 at a = x = 0: the light of a segment of optical depth
/// delta, over delta, if the optical depth to the light goes linearly from a to a + x - delta.
double segmentLight(double a, double x);

} // namespace volcomp
