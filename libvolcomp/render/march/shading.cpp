// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/march/shading.h"

#include <algorithm>
#include <cmath>

namespace volcomp {
namespace {

// The direction against the density's gradient (central differences): unit length, world axes; zero
// if the density is flat.
Vec3d gradientNormal(const VoxelTree& tree, const int* c)
{
    const Vec3d g(tree.density(c[0] - 1, c[1], c[2]) - tree.density(c[0] + 1, c[1], c[2]),
                  tree.density(c[0], c[1] - 1, c[2]) - tree.density(c[0], c[1] + 1, c[2]),
                  tree.density(c[0], c[1], c[2] - 1) - tree.density(c[0], c[1], c[2] + 1));
    const double length = g.length();
    return length > 0 ? tree.directionToWorld(g / length) : Vec3d(0.0);
}

// A part's particles in a voxel as they are shaded.
struct ShadedPart {
    const VoxelContent& content;
    const Material& material;
    const Lobe& lobe;
    Vec3d normal; ///< of the density's gradient, if that is wanted and known; else zero
    double share; ///< of what the ray sees in the segment
    double own;   ///< share of the voxel's density that is the same strand
};

// How far towards the light a strand's own particles reach, voxels: the thickness of what a strand
// or a leaf fills, across it, over the light's slant. Both numbers were measured over the furs and
// plants of benchmarks/truth.
double lightStart(const ShadedPart& part, const Vec3d& L)
{
    if (part.own == 0) return 0;
    const bool fibre = part.material.kind == MaterialKind::fibre;
    const double thickness = fibre ? 0.45 : 1.6, most = 2 * thickness;
    double across = 0.25; // mean square sine (fibre) or cosine (surface) of the light
    if (part.content.directed) {
        const double cosine = part.content.direction.dot(L), s2 = part.lobe.spread_square;
        across = (cosine * cosine * (1 - s2) + s2) / (1 + 2 * s2);
        if (fibre) across = 1 - across;
    }
    return part.own * std::min(most, thickness / std::sqrt(std::max(across, 1e-6)));
}

// How much of the light from L fibres meet, over the mean of all directions (MODEL section 5b); 1
// for all else, of which the fit was made so.
double met(const ShadedPart& part, const Vec3d& L)
{
    if (!part.content.directed || part.material.kind != MaterialKind::fibre) return 1;
    const double cosine = part.content.direction.dot(L), s2 = part.lobe.spread_square;
    return 4 / kPi * std::sqrt(1 - (cosine * cosine * (1 - s2) + s2) / (1 + 2 * s2));
}

Reflection reflection(const ShadedPart& part, const Vec3d& V, const Vec3d& L)
{
    if (part.content.directed)
        return part.material.kind == MaterialKind::fibre
            ? reflectFibre(part.lobe, part.content.direction, V, L)
            : reflectSurface(part.lobe, part.content.direction, V, L);
    return part.normal.lengthSqr() > 0 ? reflectSided(part.lobe, part.normal, V, L)
                                       : reflectIsotropic(part.lobe);
}

void addSky(const MarchScene& scene, const ShadedPart& part, const Vec3d& p, const Vec3d& V,
            Shading& shading)
{
    using Kind = SkyResponse::Kind;
    if (!shading.sky) shading.sky = skyAt(scene.sky, scene.openness, scene.tree.toWorld(p));
    const Material& m = part.material;
    SkyResponse response{Kind::even, part.content.direction, part.lobe.spread_square};
    if (part.content.directed)
        response.kind = m.kind == MaterialKind::fibre ? Kind::fibre : Kind::surface;
    else if (part.normal.lengthSqr() > 0) {
        response.kind = Kind::sided;
        response.direction = part.normal;
    }
    shading.ambient += part.share
        * showSky(scene.sky, *shading.sky, response, m.alpha * part.content.colour,
                  m.transmission * part.content.colour, V, scene.bounces());
}

void shadePart(const MarchScene& scene, const SeenVoxel& seen, const ShadedPart& part,
               const Vec3d& p, const Vec3d& V, Shading& shading)
{
    const VoxelContent& content = part.content;
    const Material& material = part.material;
    if (scene.params.aovs) {
        shading.albedo += part.share * material.alpha * content.colour;
        shading.normal += (content.direction.dot(V) < 0 ? -part.share : part.share)
            * (content.directed ? content.direction : part.normal);
    }
    const bool bounces = scene.bounces();
    if (bounces)
        shading.bounced +=
            part.share * (Vec3d(material.alpha) + material.transmission) * content.colour;
    if (scene.hasSky()) addSky(scene, part, p, V, shading);
    for (std::size_t l = 0; l < scene.lights.size(); ++l) {
        // Distances are in voxels here; the weight of a point light needs them in world units.
        Illumination in = illuminate(scene.grid_lights[l], p, 0.5);
        if (scene.lights[l].kind != LightKind::directional)
            in.weight /= scene.tree.voxelSize() * scene.tree.voxelSize();
        if (!(in.weight > 0)) continue;
        const Vec3d L = scene.tree.directionToWorld(in.L);
        if (bounces)
            shading.arriving[l] +=
                scene.lights[l].strength * (in.weight * part.share * std::sqrt(met(part, L)));
        if (scene.params.own_shade == OwnShade::left_out)
            shading.light_start[l] += part.share * lightStart(part, L);
        if (scene.params.shadows != Shadows::none)
            in.weight *= scene.tree.scatterRatio(seen.leaf, seen.voxel, V, L);
        const Reflection f = reflection(part, V, L);
        shading.from_light[l] += f.colour(material, content.colour) * scene.lights[l].strength
            * (in.weight * part.share);
    }
}

} // namespace

void Shading::start(std::size_t lights)
{
    ambient = albedo = normal = Vec3d(0.0);
    sky.reset();
    from_light.assign(lights, Vec3d(0.0));
    light_start.assign(lights, 0.0);
    bounced = Vec3d(0.0);
    arriving.assign(lights, Vec3d(0.0));
    voxels.clear();
}

void shadeVoxel(const MarchScene& scene, const SeenVoxel& seen, const Vec3d& p, const Vec3d& V,
                Shading& shading)
{
    if (shading.keep_voxels) shading.voxels.push_back(seen);
    const VoxelTree& tree = scene.tree;
    const auto factor = [&](const VoxelContent& content) {
        return scene.directed ? tree.directionFactor(content, V) : 1.0;
    };
    double total = 0;
    tree.contents(seen.leaf, seen.voxel,
                  [&](const VoxelContent& content) { total += content.density * factor(content); });
    if (!(total > 0)) return;
    const bool gradient = scene.params.undirected == Undirected::gradient;
    tree.contents(seen.leaf, seen.voxel, [&](const VoxelContent& content) {
        const ShadedPart part{content,
                              scene.materials[content.part],
                              scene.lobe(content.part, content.spread_code),
                              gradient && !content.directed ? gradientNormal(tree, seen.cell)
                                                            : Vec3d(0.0),
                              seen.share * content.density * factor(content) / total,
                              content.own_share * content.density * factor(content) / total};
        shadePart(scene, seen, part, p, V, shading);
    });
}

} // namespace volcomp
