#include "volcomp/bake/bake.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/bake/rasterise.h"

namespace volcomp {
namespace {

constexpr double kVoxelsAcross = 256;

const Material& find(const std::vector<Material>& materials, const std::string& name,
                     const std::string& box)
{
    std::string known;
    for (const Material& m : materials) {
        if (m.name == name) return m;
        known += (known.empty() ? "" : ", ") + m.name;
    }
    throw Error(fmt::format("box {}: expected the name of a material ({}), found '{}'", box,
                            known.empty() ? "the scene has none" : known, name));
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

Box bake(const GrowthRule& primitive, const std::vector<Material>& materials, int variant,
         const Progress& progress)
{
    primitive.validate();
    if (variant < 0 || variant >= primitive.variants)
        throw Error(fmt::format("box {}: expected a variant from 0 to {}, found {}", primitive.name,
                                primitive.variants - 1, variant));
    for (const GrowthLevel& level : primitive.levels)
        find(materials, level.material.empty() ? primitive.material : level.material,
             primitive.name);
    Skeleton skeleton = grow(primitive, variant);
    report(progress, 0.2);
    const double voxel = primitive.voxel > 0 ? primitive.voxel : voxelFor(skeleton);
    double segments = 0, finished = 0;
    for (const SkeletonPart& part : skeleton) segments += double(part.segments.size());

    Box box;
    box.name = primitive.name;
    box.variant = variant;
    for (SkeletonPart& part : skeleton) {
        const double share = double(part.segments.size()) / std::max(1.0, segments);
        const Progress inner = [&](double f) {
            report(progress, 0.2 + 0.8 * (finished + f * share));
        };
        try {
            VolumePart result =
                rasterise(part.segments, part.material,
                          find(materials, part.material, primitive.name).kind, voxel, inner);
            if (result.density->activeVoxelCount() > 0 || skeleton.size() == 1)
                box.volume.parts.push_back(std::move(result));
        } catch (const Error& e) {
            throw Error(fmt::format("box {}: {}", primitive.name, e.what()));
        }
        part.segments = {};
        finished += share;
    }
    if (box.volume.parts
            .empty()) // nothing grew: an empty volume is right, a volume without parts is none
        box.volume.parts.push_back(
            rasterise({}, primitive.material,
                      find(materials, primitive.material, primitive.name).kind, voxel));
    report(progress, 1);
    return box;
}

openvdb::MetaMap boxMetadata(const GrowthRule& primitive, int variant)
{
    openvdb::MetaMap meta;
    meta.insertMeta("volcomp_box", openvdb::StringMetadata(primitive.name));
    meta.insertMeta("volcomp_variant", openvdb::Int32Metadata(variant + 1));
    meta.insertMeta("volcomp_seed",
                    openvdb::Int64Metadata(static_cast<std::int64_t>(primitive.seed)));
    meta.insertMeta("volcomp_primitive", openvdb::StringMetadata(primitive.source));
    return meta;
}

} // namespace volcomp
