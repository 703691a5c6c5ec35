// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/level_of_detail.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/clock.h"
#include "volcomp/base/error.h"
#include "volcomp/base/random.h"

namespace volcomp {

namespace {

constexpr double kMostShift = 1.4142135623730951;

} // namespace

double levelShift(int x, int y, int sample, int samples)
{
    if (samples <= 1) return 1;
    const std::uint64_t pixel = std::uint64_t(std::uint32_t(y)) << 32 | std::uint32_t(x);
    const auto turned =
        (std::uint64_t(sample) + (mix64(pixel ^ 0x6c6576656cULL) >> 8)) % std::uint64_t(samples);
    return std::exp2((double(turned) + 0.5) / samples - 0.5);
}

LevelOfDetail::LevelOfDetail(const std::vector<VoxelLevel>& levels,
                             const std::vector<Material>& part_materials,
                             const std::vector<Light>& lights, const RenderParams& params,
                             const CameraRays& rays, const SkinTracer* skins)
    : m_materials(part_materials), m_soft(lights, params), m_params(params),
      m_skins(skins && !skins->empty() ? skins : nullptr)
{
    for (const VoxelLevel& level : levels) {
        Level& l = m_levels.emplace_back();
        static_cast<VoxelLevel&>(l) = level;
        if (l.tree->tiles() && params.filter == Filter::trilinear)
            throw Error("filter: expected \"box\" where the voxels are made on the way, found "
                        "\"trilinear\". Compose a volume file for it with volcomp-compose.");
        l.integrator.emplace(*l.tree, m_materials, m_soft.lights(0), m_params);
        if (m_skins && params.shadows != Shadows::none && !l.tree->empty()) {
            l.skin_shadow =
                std::make_unique<const SkinShadow>(*m_skins, *l.tree, m_soft.all(), params.shadows);
            l.integrator->useSkinShadow(*l.skin_shadow);
        }
    }
    if (params.shadows == Shadows::sweep) {
        mark(rays);
        for (Level& l : m_levels) sweep(l);
    }
    makeOpenness(rays);
    for (Level& l : m_levels) // last: they copy all that is above
        for (int part = 1; part < m_soft.parts(); ++part)
            l.other_parts.emplace_back(*l.integrator)
                .useLights(m_soft.lights(part), m_soft.numbers(part));
}

void LevelOfDetail::makeOpenness(const CameraRays& rays)
{
    if (m_levels.empty() || !m_levels[0].integrator->scene().wantsOpenness()) return;
    const double start = wallSeconds();
    for (Level& l : m_levels) {
        if (budget()) budget()->relieve();
        if (l.around || m_openness.empty()) m_openness.push_back(opennessAround(l, rays));
        l.integrator->useOpenness(*m_openness.back());
    }
    m_openness_seconds = wallSeconds() - start;
}

// The voxels around a level, of its `around` if it has one, that hold what the picture looks at
// through it, whatever the sample, and what stands near that: a quarter as far as it is looked at.
openvdb::CoordBBox LevelOfDetail::lookedAt(const Level& level, const CameraRays& rays) const
{
    constexpr double kBeside = 0.25;
    const VoxelTree& tree = level.around ? *level.around : *level.tree;
    if (!(level.end < kInfinity)) return tree.bounds();
    const double nearest = level.start / kMostShift, farthest = level.end * kMostShift,
                 beside = kBeside * level.end / tree.voxelSize();
    Vec3d low(kInfinity), high(-kInfinity);
    for (const double x : {0.0, 0.5 * m_params.width, double(m_params.width)})
        for (const double y : {0.0, 0.5 * m_params.height, double(m_params.height)}) {
            const CameraRay ray = rays.ray(x, y);
            for (const double distance : {nearest, farthest}) {
                const Vec3d p = tree.toCorner(ray.origin + ray.direction * distance);
                low = openvdb::math::minComponent(low, p - Vec3d(beside));
                high = openvdb::math::maxComponent(high, p + Vec3d(beside));
            }
        }
    openvdb::CoordBBox box = tree.bounds();
    for (int a = 0; a < 3; ++a) {
        box.min()[a] = std::max(box.min()[a], int(std::max(-1e9, low[a])) & ~7);
        box.max()[a] = std::min(box.max()[a], int(std::min(1e9, high[a])) | 7);
    }
    return box;
}

// The openness of the places of a level. Of a tree that is made on the way it reaches as far as the
// level is looked at, and a bit further.
std::shared_ptr<const Openness> LevelOfDetail::opennessAround(const Level& level,
                                                              const CameraRays& rays) const
{
    constexpr std::size_t kMostCells = std::size_t(1) << 21; // of each level of a tree of tiles
    const VoxelTree& tree = level.around ? *level.around : *level.tree;
    const MarchScene& scene = level.integrator->scene();
    Openness::Cells cells{tree.bounds(), kLeafDim};
    std::size_t most_cells = Openness::kMostCells;
    if (tree.tiles()) {
        cells.box = lookedAt(level, rays);
        const double across = kLeafDim * level.tree->voxelSize() / tree.voxelSize();
        cells.width = std::max(1, int(std::lround(across)));
        most_cells = kMostCells;
        tree.tiles()->make(cells.box);
    }
    // Light from all around and skins ask for directions, multiple scattering for P alone.
    return std::make_shared<const Openness>(tree, cells, m_params.tau * tree.voxelSize(), m_skins,
                                            scene.hasSky() || m_skins, most_cells);
}

// Marks what a ray sees of the levels: the volume as far as a skin, and the leaf in which that
// lies.
void LevelOfDetail::markLeaves(const CameraRay& ray, double shift,
                               std::vector<std::vector<float>>& seen) const
{
    std::optional<SkinTracer::Meeting> skin;
    if (m_skins) skin = m_skins->meeting(ray.origin, ray.direction, 0, kInfinity);
    const double end = skin ? skin->distance : kInfinity;
    double depth = 0;
    std::size_t last = 0;
    for (std::size_t n = 0; n < m_levels.size(); ++n) {
        const Level& l = m_levels[n];
        const double from = shift * l.start;
        if (from >= end) break;
        last = n;
        depth = l.integrator->markLeaves(ray.origin, ray.direction, from,
                                         std::min(shift * l.end, end), depth, seen[n]);
        if (depth >= l.integrator->darkest()) return;
    }
    const VoxelTree& tree = *m_levels[last].tree;
    if (!skin || tree.empty()) return;
    const Vec3d p = tree.toCorner(ray.origin + ray.direction * skin->distance);
    for (int a = 0; a < 3; ++a)
        if (!(p[a] >= tree.bounds().min()[a] && p[a] < tree.bounds().max()[a] + 1.0)) return;
    const int voxel[3] = {floorToInt(p[0]), floorToInt(p[1]), floorToInt(p[2])};
    const int node = tree.node(voxel[0], voxel[1], voxel[2]);
    if (node == VoxelTree::kEmpty) return;
    const int leaf = tree.leafIn(node, voxel[0], voxel[1], voxel[2]);
    if (leaf == VoxelTree::kEmpty) return;
    const std::size_t place = tree.place(node, leaf, voxel);
    if (place >= seen[last].size()) seen[last].resize(tree.placeCount(), 0);
    seen[last][place] = std::max(seen[last][place], float(std::exp(-depth)));
}

// Marks the leaves that rays through every other pixel see; of the whole picture, so that a crop
// has its light.
void LevelOfDetail::mark(const CameraRays& rays)
{
    std::vector<std::vector<float>> none(m_levels.size());
    for (std::size_t n = 0; n < none.size(); ++n) none[n].resize(m_levels[n].tree->placeCount(), 0);
    tbb::enumerable_thread_specific<std::vector<std::vector<float>>> local(none);
    const bool shifts =
        m_params.samples > 1 && m_levels.size() > 1 && m_levels[0].around != nullptr;
    const auto markRow = [&](int row) {
        for (int x = 0; x < m_params.width; x += 2) {
            const CameraRay ray = rays.ray(x + 0.5, 2 * row + 0.5);
            if (!shifts) markLeaves(ray, 1, local.local());
            for (const double shift : {1 / kMostShift, kMostShift})
                if (shifts) markLeaves(ray, shift, local.local());
        }
    };
    std::vector<char> done(std::size_t(m_params.height + 1) / 2, 0);
    for (bool all = false; !all;) { // again after each time that tiles were let go of
        std::atomic<bool> left_out{false};
        tbb::parallel_for(std::size_t(0), done.size(), [&](std::size_t row) {
            if (done[row]) return;
            if (budget() && budget()->isFull()) {
                left_out = true;
                return;
            }
            markRow(int(row));
            done[row] = 1;
        });
        if (budget()) budget()->relieve();
        all = !left_out;
    }
    for (const auto& by_level : local)
        for (std::size_t n = 0; n < m_levels.size(); ++n) {
            std::vector<float>& seen = m_levels[n].seen;
            seen.resize(std::max(seen.size(), by_level[n].size()), 0);
            for (std::size_t i = 0; i < by_level[n].size(); ++i)
                seen[i] = std::max(seen[i], by_level[n][i]);
        }
    for (Level& l : m_levels) l.seen.resize(l.tree->placeCount(), 0);
}

// Sweeps light for the leaves that are marked.
void LevelOfDetail::sweep(Level& level)
{
    const Integrator& integrator = *level.integrator;
    level.sweep = std::make_unique<const ShadowSweep>(
        *level.tree, m_soft.all(), level.seen, integrator.extinction(),
        integrator.scene().darkestToLight(), m_params.extinction == Extinction::directed,
        level.around.get());
    level.integrator->useSweep(*level.sweep);
    std::vector<float>().swap(level.seen);
}

RaySample LevelOfDetail::trace(const Vec3d& origin, const Vec3d& direction,
                               Integrator::Scratch& scratch, std::optional<SeenSkin>* seen,
                               int part, double shift) const
{
    RaySample sample;
    ++scratch.counts.rays;
    if (m_params.aovs) scratch.light_radiance.assign(m_soft.numbers(0).size(), Vec3d(0.0));
    scratch.haze = HazeRay(m_params.haze, origin, direction);
    std::optional<SkinHit> skin;
    if (m_skins) skin = m_skins->hit(origin, direction);
    const double end = skin ? skin->distance : kInfinity;
    if (!m_levels.front().around) shift = 1;
    const Level* last = &m_levels.front();
    for (const Level& l : m_levels) {
        const double from = shift * l.start;
        if (from > 0 && (sample.transmittance < m_params.cutoff || from >= end)) break;
        l.byPart(part).traceFurther(sample, origin, direction, from, std::min(shift * l.end, end),
                                    scratch);
        last = &l;
    }
    if (skin)
        addSkin(last->byPart(part).scene(), *m_skins, *skin, -direction, sample, scratch, seen);
    scratch.ambient_sum += sample.ambient[0] + sample.ambient[1] + sample.ambient[2];
    return sample;
}

TileBudget* LevelOfDetail::budget() const
{
    for (const Level& l : m_levels)
        if (l.tree->tiles()) return &l.tree->tiles()->budget();
    return nullptr;
}

std::size_t LevelOfDetail::skinShadowBytes() const
{
    std::size_t bytes = 0;
    for (const Level& l : m_levels)
        if (l.skin_shadow) bytes += l.skin_shadow->memoryBytes();
    return bytes;
}

std::size_t LevelOfDetail::opennessBytes() const
{
    std::size_t bytes = 0;
    for (const auto& openness : m_openness) bytes += openness->memoryBytes();
    return bytes;
}

} // namespace volcomp
