#include "volcomp/render/tree/voxel_tree.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

// Half octahedron: the direction is turned to z >= 0, and the square |x| + |y| <= 1 turned by 45
// degrees fills [-1,1]^2.
std::uint64_t packDirection(Vec3d d)
{
    d /= std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]);
    if (d[2] < 0) d = -d;
    const auto code = [](double u) {
        return std::uint64_t(std::min(1.0, std::max(-1.0, u)) * 2047 + 2047.5);
    };
    return code(d[0] + d[1]) | code(d[0] - d[1]) << 12;
}

} // namespace

std::uint64_t VoxelTree::pack(const Vec3f& direction, const Vec3f& colour, float colour_scale,
                              int part)
{
    std::uint64_t record = std::uint64_t(kSpreadCodes) << 24; // no direction
    const double length = Vec3d(direction).length();
    if (length > 1e-6 && std::isfinite(length)) {
        const double spread = std::min(1.0, std::max(0.0, 1 - length));
        record = packDirection(direction) | std::uint64_t(spread * (kSpreadCodes - 1) + 0.5) << 24;
    }
    for (int c = 0; c < 3; ++c) {
        const double level = colour_scale > 0 && std::isfinite(colour[c])
            ? std::sqrt(std::max(0.0, double(colour[c]) / colour_scale))
            : 0;
        record |= std::uint64_t(std::min(1.0, level) * 1023 + 0.5) << (30 + 10 * c);
    }
    return record | std::uint64_t(std::min(part, 14)) << 60;
}

void VoxelTree::readTransform(const Volume& volume)
{
    if (volume.parts.empty()) throw Error("the volume has no parts: there is nothing to render");
    const openvdb::math::Transform& transform = volume.parts[0].density->transform();
    m_voxel = transform.voxelSize()[0];
    Vec3d axes[3];
    const Vec3d zero = transform.indexToWorld(Vec3d(0.0));
    for (int a = 0; a < 3; ++a) {
        Vec3d e(0.0);
        e[a] = 1;
        axes[a] = (transform.indexToWorld(e) - zero) / m_voxel;
    }
    for (int a = 0; a < 3; ++a)
        if (!transform.isLinear() || !(m_voxel > 0)
            || !(std::abs(axes[a].length() - 1) < 1e-6
                 && std::abs(axes[a].dot(axes[(a + 1) % 3])) < 1e-6))
            throw Error(
                "the volume's voxels are not cubes (a non-uniform, sheared or perspective transform); resample it with uniform scale");
    for (const VolumePart& part : volume.parts)
        for (const openvdb::GridBase::Ptr& grid :
             {openvdb::GridBase::Ptr(part.density), openvdb::GridBase::Ptr(part.direction),
              openvdb::GridBase::Ptr(part.colour), openvdb::GridBase::Ptr(part.scatter_ratio)})
            if (grid && grid->transform() != transform)
                throw Error("the volume's grids have different transforms; resample them to one");
    m_rotation.setRows(axes[0], axes[1], axes[2]);
    m_origin = transform.indexToWorld(Vec3d(-0.5));
    for (const VolumePart& part : volume.parts) {
        m_parts.push_back({part.material, part.kind});
        m_is_fibre.push_back(part.kind == MaterialKind::fibre);
    }
    // The mean square of the cosine c between a ray and fibres of spread s about a mean tangent
    // (cosine m) is (m^2 (1-s^2) + s^2) / (1+2s^2). The mean sine is taken as the root of the mean
    // square sine, scaled so that its mean over all rays is pi / 4 for every s.
    for (int code = 0; code < kSpreadCodes; ++code) {
        const double s2 = spreadOf(code) * spreadOf(code), a = (1 + s2) / (1 + 2 * s2),
                     b = (1 - s2) / (1 + 2 * s2);
        // integral over m from 0 to 1 of sqrt(a - b m^2)
        const double mean = b > 1e-9 ? 0.5
                * (std::sqrt(a - b) + a / std::sqrt(b) * std::asin(std::sqrt(std::min(1.0, b / a))))
                                     : std::sqrt(a);
        m_factor_a[code] = a / (mean * mean);
        m_factor_b[code] = b / (mean * mean);
    }
}

Vec3d VoxelTree::toCorner(const Vec3d& p) const { return m_rotation * (p - m_origin) / m_voxel; }

std::size_t VoxelTree::memoryBytes() const
{
    return m_slots.size() * sizeof(Slot) + m_children.size() * sizeof(std::int32_t)
        + m_leaves.size() * sizeof(Leaf) + densityBytes() + m_records.size() * sizeof(std::uint64_t)
        + m_shared.size() * sizeof(Shared) + m_scatter_ratio.size() * sizeof(ScatterRatio);
}

VoxelContent VoxelTree::unpack(std::uint64_t record, float density, float colour_scale)
{
    VoxelContent content;
    content.part = int(record >> 60);
    content.density = density;
    content.spread_code = int(record >> 24 & 63);
    content.directed = content.spread_code != kSpreadCodes;
    if (content.directed) content.direction = unpackDirection(record);
    for (int c = 0; c < 3; ++c) {
        const double level = double(record >> (30 + 10 * c) & 1023) / 1023;
        content.colour[c] = level * level * colour_scale;
    }
    return content;
}

double VoxelTree::fibreFactor(const VoxelContent& content, const Vec3d& d) const
{
    if (!content.directed || !m_is_fibre[content.part]) return 1;
    const double cosine = content.direction.dot(d);
    return std::sqrt(std::max(
        0.0, m_factor_a[content.spread_code] - m_factor_b[content.spread_code] * cosine * cosine));
}

double VoxelTree::sharedFactor(std::uint64_t record, const Vec3d& d) const
{
    const std::uint64_t start = record & 0xffffffff, count = record >> 32 & 0xffff;
    double sum = 0, weighted = 0;
    for (std::uint64_t i = start; i < start + count; ++i) {
        sum += m_shared[i].density;
        weighted += m_shared[i].density * recordFactor(m_shared[i].record, m_shared[i].part, d);
    }
    return weighted / sum;
}

} // namespace volcomp
