#include "volcomp/render/render.h"

#include <atomic>
#include <cmath>
#include <mutex>

#include <tbb/parallel_for.h>

#include "volcomp/base/clock.h"
#include "volcomp/base/error.h"
#include "volcomp/render/tree/level_of_detail.h"
#include "volcomp/render/pixel_filter.h"

namespace volcomp {
namespace {

constexpr int kTile = 16; // pixels

Material materialOf(const VoxelTree::Part& part, const std::vector<Material>& materials)
{
    for (const Material& m : materials)
        if (part.material.empty() ? m.kind == part.kind : m.name == part.material) {
            if (m.kind != part.kind)
                throw Error(
                    "material '" + m.name
                    + "' and the volume's part of that name differ in kind: one has tangents, the other normals");
            return m;
        }
    if (!part.material.empty())
        throw Error("the volume has voxels of material '" + part.material
                    + "', which the scene does not define; add [material." + part.material + "]");
    Material fallback;
    fallback.kind = part.kind;
    return fallback;
}

std::vector<std::string> channelNames(const RenderParams& params, const std::vector<Light>& lights)
{
    std::vector<std::string> names{"R", "G", "B", "A"};
    if (!params.aovs) return names;
    names.insert(names.end(), {"Z", "N.X", "N.Y", "N.Z", "albedo.R", "albedo.G", "albedo.B"});
    for (std::size_t l = 0; l < lights.size(); ++l)
        for (const char* c : {".R", ".G", ".B"})
            names.push_back(
                (lights[l].name.empty() ? "light" + std::to_string(l + 1) : lights[l].name) + c);
    return names;
}

// The picture tile by tile. A tile adds samples to its pixels in their order, however often it is
// called: nothing depends on when or where.
class TileRenderer {
public:
    static constexpr int kCoarse = -1, kStride = 4; // of the coarse pass, pixels

    TileRenderer(const LevelOfDetail& tracer, const CameraRays& rays, const Crop& crop,
                 const RenderParams& params, const std::vector<Light>& lights, RenderState& state)
        : m_tracer(tracer), m_rays(rays), m_sampler(params), m_crop(crop), m_params(params),
          m_lights(lights.size()), m_names(channelNames(params, lights)),
          m_channels(m_names.size()), m_columns((crop.width + kTile - 1) / kTile),
          m_has_background(params.background.lengthSqr() > 0), m_state(state)
    {
        const std::size_t pixels = std::size_t(crop.width) * crop.height,
                          tiles = std::size_t(m_columns) * ((crop.height + kTile - 1) / kTile);
        if (m_state.sums.empty()) {
            m_state.sums.resize(pixels * m_channels);
            m_state.samples.resize(tiles);
        }
        if (m_state.sums.size() != pixels * m_channels || m_state.samples.size() != tiles)
            throw Error("the state of the render is one of another picture");
    }

    int tiles() const { return int(m_state.samples.size()); }
    bool reached(int tile, int target) const
    {
        return m_state.samples[tile] >= target && (m_state.samples[tile] != 0 || target == 0);
    }

    // Brings a tile to `target` samples, or to kCoarse.
    void advance(int tile, int target, Integrator::Scratch& scratch)
    {
        const int x0 = tile % m_columns * kTile, y0 = tile / m_columns * kTile,
                  before = m_state.samples[tile];
        for (int y = y0; y < std::min(y0 + kTile, m_crop.height); ++y)
            for (int x = x0; x < std::min(x0 + kTile, m_crop.width); ++x) {
                const bool coarse = x % kStride == 0 && y % kStride == 0;
                const int from = before == kCoarse ? coarse : before,
                          to = target == kCoarse ? coarse : target;
                for (int s = from; s < to; ++s) addSample(x, y, s, scratch);
            }
        m_state.samples[tile] = target;
    }

    // What there is to see: pixels without a sample show the coarse one beside them, if that has
    // one.
    Image image() const
    {
        Image image;
        image.width = m_crop.width;
        image.height = m_crop.height;
        image.channels = m_names;
        image.pixels.resize(m_state.sums.size());
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x) {
                const int samples = m_state.samples[y / kTile * m_columns + x / kTile];
                if (samples == 0) continue;
                const std::size_t from = samples > 0
                    ? std::size_t(y) * m_crop.width + x
                    : std::size_t(y - y % kStride) * m_crop.width + (x - x % kStride);
                for (std::size_t c = 0; c < m_channels; ++c)
                    image.pixel(x, y)[c] =
                        float(m_state.sums[from * m_channels + c] / std::max(1, samples));
            }
        return image;
    }

private:
    void addSample(int x, int y, int s, Integrator::Scratch& scratch)
    {
        double* sum =
            &m_state.sums[(std::size_t(y) * m_crop.width + x) * m_channels]; // background included
        const auto add = [&](std::size_t channel, const Vec3d& v) {
            for (int c = 0; c < 3; ++c) sum[channel + c] += v[c];
        };
        const Vec3d at = m_sampler.position(m_crop.x + x, m_crop.y + y, s);
        const CameraRay ray = m_rays.ray(at[0], at[1]);
        const RaySample sample = m_tracer.trace(ray.origin, ray.direction, scratch);
        add(0, sample.radiance + sample.transmittance * m_params.background);
        sum[3] += m_has_background ? 1 : 1 - sample.transmittance;
        if (!m_params.aovs) return;
        sum[4] += sample.depth;
        add(5, sample.normal);
        add(8, sample.albedo);
        for (std::size_t l = 0; l < m_lights; ++l) add(11 + 3 * l, scratch.light_radiance[l]);
    }

    const LevelOfDetail& m_tracer;
    const CameraRays& m_rays;
    const PixelSampler m_sampler;
    const Crop m_crop;
    const RenderParams& m_params;
    const std::size_t m_lights;
    const std::vector<std::string> m_names;
    const std::size_t m_channels;
    const int m_columns;
    const bool m_has_background;
    RenderState& m_state;
};

// All tiles to all samples, in passes, with pauses for the watch.
RayCounts renderTiles(TileRenderer& tiles, const RenderParams& params, const Progress& progress,
                      RenderWatch* watch)
{
    std::vector<int> targets;
    if (watch && watch->preview)
        for (int samples = TileRenderer::kCoarse; samples < params.samples;
             samples = samples < 1 ? 1 : 2 * samples)
            targets.push_back(samples);
    targets.push_back(params.samples);
    std::mutex mutex;
    RayCounts counts;
    const auto part = [&](int tile) { // done
        const int samples = watch ? watch->state.samples[tile] : 0;
        return samples < 0 ? 1.0 / 16 : double(samples);
    };
    double done = 0, updated = wallSeconds();
    for (int t = 0; t < tiles.tiles(); ++t) done += part(t);
    const auto stopped = [&] { return watch && watch->stop && watch->stop->load(); };
    for (const int target : targets)
        for (bool all = false; !all;) {
            std::atomic<bool> left_out{false};
            tbb::parallel_for(0, tiles.tiles(), [&](int tile) {
                if (tiles.reached(tile, target)) return;
                if (watch
                    && (stopped()
                        || (watch->update && wallSeconds() - updated > watch->every_seconds))) {
                    left_out = true;
                    return;
                }
                Integrator::Scratch scratch;
                const double before = part(tile);
                tiles.advance(tile, target, scratch);
                const std::lock_guard<std::mutex> lock(mutex);
                counts.rays += scratch.counts.rays;
                counts.shadow_rays += scratch.counts.shadow_rays;
                counts.shaded_voxels += scratch.counts.shaded_voxels;
                done += watch ? part(tile) - before : params.samples;
                report(progress, std::min(1.0, done / (double(tiles.tiles()) * params.samples)));
            });
            all = !left_out;
            if (watch && watch->update
                && (left_out || (watch->preview && target != params.samples))) {
                watch->update(watch->state, tiles.image());
                updated = wallSeconds();
            }
            if (left_out && stopped())
                throw Stopped(
                    "stopped after "
                    + std::to_string(int(100 * done / (double(tiles.tiles()) * params.samples)))
                    + " % of the render");
        }
    return counts;
}

} // namespace

Image render(const Volume& volume, const std::vector<Material>& materials, const Camera& camera,
             const std::vector<Light>& lights, const RenderParams& params, const Progress& progress,
             RenderStats* stats)
{
    return render(VoxelTree(volume), materials, camera, lights, params, progress, stats);
}

Image render(const VoxelTree& tree, const std::vector<Material>& materials, const Camera& camera,
             const std::vector<Light>& lights, const RenderParams& params, const Progress& progress,
             RenderStats* stats)
{
    camera.validate();
    params.validate();
    const double start = wallSeconds();
    const std::shared_ptr<const VoxelTree> finest(std::shared_ptr<void>(), &tree); // not owned
    const std::vector<VoxelLevel> levels = voxelLevels(finest, camera, params);
    const double made = wallSeconds();
    Image image = render(levels, materials, camera, lights, params, progress, stats);
    if (stats) stats->prepare_seconds += made - start;
    return image;
}

Image render(const std::vector<VoxelLevel>& levels, const std::vector<Material>& materials,
             const Camera& camera, const std::vector<Light>& lights, const RenderParams& params,
             const Progress& progress, RenderStats* stats, RenderWatch* watch)
{
    camera.validate();
    params.validate();
    for (const Light& light : lights) light.validate();
    const Crop crop = params.crop.width > 0 ? params.crop : Crop{0, 0, params.width, params.height};
    const double start = wallSeconds();
    std::vector<Material> part_materials;
    for (const VoxelTree::Part& part : levels.at(0).tree->parts())
        part_materials.push_back(materialOf(part, materials));
    const CameraRays rays(camera, params.width, params.height);
    const LevelOfDetail tracer(levels, part_materials, lights, params, rays, crop);
    const double prepared = wallSeconds();

    RenderState own;
    TileRenderer tiles(tracer, rays, crop, params, lights, watch ? watch->state : own);
    const RayCounts counts = renderTiles(tiles, params, progress, watch);
    if (stats) {
        stats->rays = counts.rays;
        stats->shadow_rays = counts.shadow_rays;
        stats->shaded_voxels = counts.shaded_voxels;
        stats->active_voxels = levels[0].tree->voxelCount();
        stats->prepare_seconds = prepared - start;
        stats->march_seconds = wallSeconds() - prepared;
    }
    return tiles.image();
}

} // namespace volcomp
