// SPDX-License-Identifier: Apache-2.0
#include "volcomp/bake/bake.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "volcomp/bake/mesh_model.h"
#include "volcomp/bake/rasterise.h"
#include "volcomp/bake/rasterise_mesh.h"
#include "volcomp/base/error.h"
#include "volcomp/base/text.h"
#include "volcomp/curves/curve_pieces.h"

namespace volcomp {
namespace {

constexpr double kVoxelsAcross =
    256; ///< at most, along the longest side, if the rule gives no voxel

const Material& find(const std::vector<Material>& materials, const std::string& name,
                     const std::string& box)
{
    for (const Material& m : materials)
        if (m.name == name) return m;
    throw Error(fmt::format("box {}: expected the name of a material ({}), found '{}'", box,
                            materials.empty() ? "the scene has none" : joined(namesOf(materials)),
                            name));
}

} // namespace

double voxelFor(const Skeleton& skeleton)
{
    Vec3f low(1e30f), high(-1e30f);
    std::vector<std::pair<double, double>> widths; // width, length
    double total = 0;
    for (const SkeletonPart& part : skeleton)
        for (const Segment& s : part.segments) {
            low = openvdb::math::minComponent(low, openvdb::math::minComponent(s.a, s.b));
            high = openvdb::math::maxComponent(high, openvdb::math::maxComponent(s.a, s.b));
            const double length = (s.b - s.a).length();
            widths.emplace_back(double(s.size_a) + double(s.size_b), length);
            total += length;
        }
    if (widths.empty()) return 0.01;
    std::sort(widths.begin(), widths.end());
    double below = 0, thin = 0;
    for (const auto& [width, length] : widths) {
        thin = width;
        if ((below += length) >= 0.25 * total) break;
    }
    const Vec3d extent(high - low);
    const double longest = std::max({extent[0], extent[1], extent[2], thin});
    return std::max({0.5 * thin, longest / kVoxelsAcross, kSmallestVoxel});
}

namespace {

/// A box from a mesh file.
Box bakeMesh(const GrowthRule& rule, const std::vector<Material>& materials,
             const Progress& progress)
{
    const MeshModel model = loadMeshModel(rule, materials);
    report(progress, 0.2);
    Box box;
    box.name = rule.name;
    box.volume.warnings = model.warnings;
    const double voxel = rule.voxel > 0 ? rule.voxel : voxelFor(model);
    double finished = 0;
    for (const MeshModelPart& part : model.parts) {
        const double share = double(part.triangles.size()) / double(model.triangleCount());
        try {
            box.volume.parts.push_back(rasteriseMesh(model, part, voxel, [&](double f) {
                report(progress, 0.2 + 0.8 * (finished + f * share));
            }));
        } catch (const Error& e) {
            throw Error(fmt::format("box {}: {}", rule.name, e.what()));
        }
        finished += share;
    }
    if (box.volume.parts.empty())
        throw fileError(rule.mesh.file, "box " + rule.name, "triangles that have an area", "none");
    report(progress, 1);
    return box;
}

} // namespace

Box bake(const GrowthRule& rule, const std::vector<Material>& materials, int variant,
         const Progress& progress)
{
    rule.validate();
    if (variant < 0 || variant >= rule.variants)
        throw Error(fmt::format("box {}: expected a variant from 0 to {}, found {}", rule.name,
                                rule.variants - 1, variant));
    if (!rule.mesh.file.empty()) return bakeMesh(rule, materials, progress);
    for (const GrowthLevel& level : rule.levels)
        find(materials, level.material.empty() ? rule.material : level.material, rule.name);
    return bakeSkeleton(BoxContents(rule).skeleton(variant), rule, materials, variant, rule.voxel,
                        progress);
}

Box bakeSkeleton(Skeleton skeleton, const GrowthRule& rule, const std::vector<Material>& materials,
                 int variant, double voxel, const Progress& progress)
{
    report(progress, 0.2);
    if (!(voxel > 0)) voxel = voxelFor(skeleton);
    double segments = 0, finished = 0;
    for (const SkeletonPart& part : skeleton) segments += double(part.segments.size());

    Box box;
    box.name = rule.name;
    box.variant = variant;
    for (SkeletonPart& part : skeleton) {
        const double share = double(part.segments.size()) / std::max(1.0, segments);
        const Progress inner = [&](double f) {
            report(progress, 0.2 + 0.8 * (finished + f * share));
        };
        try {
            VolumePart result =
                rasterise(part.segments, part.material,
                          find(materials, part.material, rule.name).kind, voxel, inner);
            if (result.density->activeVoxelCount() > 0 || skeleton.size() == 1)
                box.volume.parts.push_back(std::move(result));
        } catch (const Error& e) {
            throw Error(fmt::format("box {}: {}", rule.name, e.what()));
        }
        part.segments = {};
        finished += share;
    }
    if (box.volume.parts.empty()) // nothing grew: the volume is empty, but it has a part
        box.volume.parts.push_back(
            rasterise({}, rule.material, find(materials, rule.material, rule.name).kind, voxel));
    report(progress, 1);
    return box;
}

openvdb::MetaMap boxMetadata(const GrowthRule& rule, int variant)
{
    openvdb::MetaMap meta;
    meta.insertMeta("volcomp_box", openvdb::StringMetadata(rule.name));
    meta.insertMeta("volcomp_variant", openvdb::Int32Metadata(variant + 1));
    meta.insertMeta("volcomp_seed", openvdb::Int64Metadata(static_cast<std::int64_t>(rule.seed)));
    return meta;
}

} // namespace volcomp
