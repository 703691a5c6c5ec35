#include "render.h"

#include <chrono>
#include <cmath>
#include <mutex>

#include <tbb/parallel_for.h>

#include "error.h"
#include "integrator.h"
#include "random.h"
#include "voxel_tree.h"

namespace volcomp {
namespace {

constexpr int kTile = 16; // pixels

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

Material materialOf(const VolumePart& part, const std::vector<Material>& materials)
{
    for (const Material& m : materials)
        if (part.material.empty() ? m.kind == part.kind : m.name == part.material) {
            if (m.kind != part.kind)
                throw Error("material '" + m.name + "' and the volume's part of that name differ in kind: one has tangents, the other normals");
            return m;
        }
    if (!part.material.empty()) throw Error("the volume has voxels of material '" + part.material + "', which the scene does not define; add [material." + part.material + "]");
    Material fallback;
    fallback.kind = part.kind;
    return fallback;
}

// Where the samples of a pixel lie: the centre, or a jittered grid, then what the grid has no room for at random.
Vec3d samplePosition(int x, int y, int sample, int samples, int width)
{
    if (samples == 1) return {x + 0.5, y + 0.5, 0};
    const int side = int(std::sqrt(double(samples)) + 1e-9);
    Random random(hashKey(hashKey(0x5eed, std::uint64_t(y) * width + x), sample));
    const double u = random.uniform(), v = random.uniform();
    if (sample >= side * side) return {x + u, y + v, 0};
    return {x + (sample % side + u) / side, y + (sample / side + v) / side, 0};
}

} // namespace

Image render(const Volume& volume, const std::vector<Material>& materials, const Camera& camera, const std::vector<Light>& lights, const RenderParams& params,
             const Progress& progress, RenderStats* stats)
{
    camera.validate();
    params.validate();
    for (const Light& light : lights) light.validate();
    const double start = seconds();
    const VoxelTree tree(volume);
    std::vector<Material> part_materials;
    for (const VolumePart& part : volume.parts) part_materials.push_back(materialOf(part, materials));
    const Integrator integrator(tree, part_materials, lights, params);
    const double prepared = seconds();

    Image image;
    const Crop crop = params.crop.width > 0 ? params.crop : Crop{0, 0, params.width, params.height};
    image.width = crop.width;
    image.height = crop.height;
    image.channels = {"R", "G", "B", "A"};
    image.pixels.resize(std::size_t(4) * crop.width * crop.height);
    const CameraRays rays(camera, params.width, params.height);
    const int columns = (crop.width + kTile - 1) / kTile, tiles = columns * ((crop.height + kTile - 1) / kTile);
    std::mutex mutex;
    RayCounts counts;
    int done = 0;
    tbb::parallel_for(0, tiles, [&](int tile) {
        Integrator::Scratch scratch;
        const int x0 = tile % columns * kTile, y0 = tile / columns * kTile;
        for (int y = y0; y < std::min(y0 + kTile, crop.height); ++y)
            for (int x = x0; x < std::min(x0 + kTile, crop.width); ++x) {
                Vec3d radiance(0.0);
                double alpha = 0;
                for (int s = 0; s < params.samples; ++s) {
                    const Vec3d at = samplePosition(crop.x + x, crop.y + y, s, params.samples, params.width);
                    const CameraRay ray = rays.ray(at[0], at[1]);
                    const RaySample sample = integrator.trace(ray.origin, ray.direction, scratch);
                    radiance += sample.radiance + sample.transmittance * params.background;
                    alpha += 1 - sample.transmittance;
                }
                float* p = image.pixel(x, y);
                for (int c = 0; c < 3; ++c) p[c] = float(radiance[c] / params.samples);
                const bool has_background = params.background.lengthSqr() > 0;
                p[3] = has_background ? 1.0f : float(alpha / params.samples);
            }
        const std::lock_guard<std::mutex> lock(mutex);
        counts.rays += scratch.counts.rays;
        counts.shadow_rays += scratch.counts.shadow_rays;
        counts.shaded_voxels += scratch.counts.shaded_voxels;
        report(progress, double(++done) / tiles);
    });
    if (stats) {
        stats->rays = counts.rays;
        stats->shadow_rays = counts.shadow_rays;
        stats->shaded_voxels = counts.shaded_voxels;
        stats->active_voxels = tree.voxelCount();
        stats->prepare_seconds = prepared - start;
        stats->march_seconds = seconds() - prepared;
    }
    return image;
}

} // namespace volcomp
