#include "level_of_detail.h"

#include <cmath>
#include <limits>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

namespace volcomp {
namespace {

constexpr double kVoxelsPerPixel = 1.5; // at the distance where a level begins
constexpr double kEndless = std::numeric_limits<double>::infinity();

// The distances from the eye between which the volume lies.
void distances(const VoxelTree& tree, const Vec3d& eye, double& nearest, double& farthest)
{
    const Vec3d p = tree.toCorner(eye);
    const openvdb::CoordBBox& box = tree.bounds();
    double near = 0, far = 0;
    for (int a = 0; a < 3; ++a) {
        const double low = box.min()[a] - p[a], high = box.max()[a] + 1.0 - p[a];
        const double outside = std::max({low, -high, 0.0}), most = std::max(std::abs(low), std::abs(high));
        near += outside * outside;
        far += most * most;
    }
    nearest = std::sqrt(near) * tree.voxelSize();
    farthest = std::sqrt(far) * tree.voxelSize();
}

} // namespace

LevelOfDetail::LevelOfDetail(const VoxelTree& tree, const std::vector<Material>& part_materials, const std::vector<Light>& lights,
                             const RenderParams& params, const Camera& camera, const CameraRays& rays, const Crop& crop)
    : m_materials(part_materials), m_lights(lights), m_params(params)
{
    double nearest = 0, farthest = 0;
    if (!tree.empty()) distances(tree, camera.eye, nearest, farthest);
    // Where voxels of twice the width show a pixel each.
    const bool perspective = camera.projection == Projection::perspective;
    const double pixel = perspective ? 2 * std::tan(camera.field_of_view / 2) / params.width : camera.width / params.width;
    const auto startOf = [&](const VoxelTree& t) {
        const double width = t.voxelSize() * kVoxelsPerPixel;
        return perspective ? width / pixel : width <= pixel ? 0 : kEndless;
    };
    double start = 0;
    const VoxelTree* level = &tree;
    std::unique_ptr<const VoxelTree> own;
    while (params.lod && !tree.empty() && level->voxelCount() > 8) {
        const double change = 2 * startOf(*level); // a level up
        const double next_start = perspective ? change : 2 * level->voxelSize() * kVoxelsPerPixel <= pixel ? 0 : kEndless;
        if (!(next_start <= farthest)) break;
        auto coarser = std::make_unique<const VoxelTree>(VoxelTree::coarser(*level, params.tau));
        if (next_start > nearest && next_start > start) {
            addLevel(*level, std::move(own), start, next_start);
            start = next_start;
        }
        own = std::move(coarser);
        level = own.get();
    }
    addLevel(*level, std::move(own), start, kEndless);
    for (Level& l : m_levels)
        if (params.shadows == Shadows::sweep) sweep(l.own ? *l.own : tree, l, rays, crop);
}

void LevelOfDetail::addLevel(const VoxelTree& tree, std::unique_ptr<const VoxelTree> own, double start, double end)
{
    m_levels.emplace_back();
    Level& l = m_levels.back();
    l.start = start;
    l.end = end;
    l.own = std::move(own);
    l.integrator.emplace(tree, m_materials, m_lights, m_params);
}

// Light for the leaves that show in rays through every other pixel.
void LevelOfDetail::sweep(const VoxelTree& tree, Level& level, const CameraRays& rays, const Crop& crop)
{
    tbb::enumerable_thread_specific<std::vector<float>> local(std::vector<float>(tree.leafCount(), 0));
    tbb::parallel_for(0, (crop.height + 1) / 2, [&](int row) {
        for (int x = 0; x < crop.width; x += 2) {
            const CameraRay ray = rays.ray(crop.x + x + 0.5, crop.y + 2 * row + 0.5);
            level.integrator->markLeaves(ray.origin, ray.direction, level.start, level.end, local.local());
        }
    });
    std::vector<float> seen(tree.leafCount(), 0);
    for (const std::vector<float>& part : local)
        for (std::size_t i = 0; i < seen.size(); ++i) seen[i] = std::max(seen[i], part[i]);
    const Integrator& integrator = *level.integrator;
    level.sweep = std::make_unique<const ShadowSweep>(tree, m_lights, seen, integrator.extinction(), integrator.darkest(),
                                                      m_params.extinction == Extinction::fibre);
    level.integrator->useSweep(*level.sweep);
}

RaySample LevelOfDetail::trace(const Vec3d& origin, const Vec3d& direction, Integrator::Scratch& scratch) const
{
    RaySample sample;
    ++scratch.counts.rays;
    if (m_params.aovs) scratch.light_radiance.assign(m_lights.size(), Vec3d(0.0));
    for (const Level& l : m_levels) {
        if (l.start > 0 && sample.transmittance < m_params.cutoff) break;
        l.integrator->traceFurther(sample, origin, direction, l.start, l.end, scratch);
    }
    return sample;
}

std::size_t LevelOfDetail::memoryBytes() const
{
    std::size_t bytes = 0;
    for (const Level& l : m_levels) bytes += (l.own ? l.own->memoryBytes() : 0) + (l.sweep ? l.sweep->memoryBytes() : 0);
    return bytes;
}

} // namespace volcomp
