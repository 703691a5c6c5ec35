#include "render.h"

#include <chrono>
#include <cmath>
#include <mutex>
#include <optional>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "error.h"
#include "integrator.h"
#include "random.h"
#include "voxel_tree.h"

namespace volcomp {
namespace {

constexpr int kTile = 16;             // pixels

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

Material materialOf(const VoxelTree::Part& part, const std::vector<Material>& materials)
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

// The leaves that show in rays through every other pixel, for the sweep.
std::vector<float> seenLeaves(const Integrator& integrator, const VoxelTree& tree, const CameraRays& rays, const Crop& crop)
{
    std::vector<float> seen(tree.leafCount(), 0);
    tbb::enumerable_thread_specific<std::vector<float>> local(seen);
    tbb::parallel_for(0, (crop.height + 1) / 2, [&](int row) {
        for (int x = 0; x < crop.width; x += 2) {
            const CameraRay ray = rays.ray(crop.x + x + 0.5, crop.y + 2 * row + 0.5);
            integrator.markLeaves(ray.origin, ray.direction, local.local());
        }
    });
    for (const std::vector<float>& part : local)
        for (std::size_t i = 0; i < seen.size(); ++i) seen[i] = std::max(seen[i], part[i]);
    return seen;
}

} // namespace

Image render(const Volume& volume, const std::vector<Material>& materials, const Camera& camera, const std::vector<Light>& lights, const RenderParams& params,
             const Progress& progress, RenderStats* stats)
{
    return render(VoxelTree(volume), materials, camera, lights, params, progress, stats);
}

Image render(const VoxelTree& tree, const std::vector<Material>& materials, const Camera& camera, const std::vector<Light>& lights, const RenderParams& params,
             const Progress& progress, RenderStats* stats)
{
    camera.validate();
    params.validate();
    for (const Light& light : lights) light.validate();
    const Crop crop = params.crop.width > 0 ? params.crop : Crop{0, 0, params.width, params.height};
    const double start = seconds();
    std::vector<Material> part_materials;
    for (const VoxelTree::Part& part : tree.parts()) part_materials.push_back(materialOf(part, materials));
    Integrator integrator(tree, part_materials, lights, params);
    const CameraRays rays(camera, params.width, params.height);
    std::optional<ShadowSweep> sweep;
    if (params.shadows == Shadows::sweep) {
        sweep.emplace(tree, lights, seenLeaves(integrator, tree, rays, crop), integrator.extinction(), integrator.darkest(), params.extinction == Extinction::fibre);
        integrator.useSweep(*sweep);
    }
    const double prepared = seconds();

    Image image;
    image.width = crop.width;
    image.height = crop.height;
    image.channels = {"R", "G", "B", "A"};
    if (params.aovs) {
        for (const char* name : {"Z", "N.X", "N.Y", "N.Z", "albedo.R", "albedo.G", "albedo.B"}) image.channels.push_back(name);
        for (std::size_t l = 0; l < lights.size(); ++l)
            for (const char* c : {".R", ".G", ".B"}) image.channels.push_back((lights[l].name.empty() ? "light" + std::to_string(l + 1) : lights[l].name) + c);
    }
    const std::size_t channels = image.channels.size();
    image.pixels.resize(channels * crop.width * crop.height);
    const int columns = (crop.width + kTile - 1) / kTile, tiles = columns * ((crop.height + kTile - 1) / kTile);
    const bool has_background = params.background.lengthSqr() > 0;
    std::mutex mutex;
    RayCounts counts;
    int done = 0;
    tbb::parallel_for(0, tiles, [&](int tile) {
        Integrator::Scratch scratch;
        const int x0 = tile % columns * kTile, y0 = tile / columns * kTile;
        for (int y = y0; y < std::min(y0 + kTile, crop.height); ++y)
            for (int x = x0; x < std::min(x0 + kTile, crop.width); ++x) {
                std::vector<double> sum(channels); // as the channels, background included
                const auto add = [&](std::size_t channel, const Vec3d& v) {
                    for (int c = 0; c < 3; ++c) sum[channel + c] += v[c];
                };
                for (int s = 0; s < params.samples; ++s) {
                    const Vec3d at = samplePosition(crop.x + x, crop.y + y, s, params.samples, params.width);
                    const CameraRay ray = rays.ray(at[0], at[1]);
                    const RaySample sample = integrator.trace(ray.origin, ray.direction, scratch);
                    add(0, sample.radiance + sample.transmittance * params.background);
                    sum[3] += has_background ? 1 : 1 - sample.transmittance;
                    if (!params.aovs) continue;
                    sum[4] += sample.depth;
                    add(5, sample.normal);
                    add(8, sample.albedo);
                    for (std::size_t l = 0; l < lights.size(); ++l) add(11 + 3 * l, scratch.light_radiance[l]);
                }
                float* p = image.pixel(x, y);
                for (std::size_t c = 0; c < channels; ++c) p[c] = float(sum[c] / params.samples);
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
