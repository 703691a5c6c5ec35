// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/voxel_record.h"

namespace volcomp {
namespace {

// Half an octahedron: the direction is turned to z >= 0, projected to the square |x| + |y| <= 1,
// and that is turned by 45 degrees to fill [-1,1]^2.
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

VoxelRecord::VoxelRecord(const Vec3f& direction, const Vec3f& colour, float colour_scale, int part,
                         float own_share)
    : m_bits(std::uint64_t(kSpreadCodes) << 24)
{
    const double length = Vec3d(direction).length();
    if (length > 1e-6 && std::isfinite(length)) {
        const double spread = std::min(1.0, std::max(0.0, 1 - length));
        m_bits = packDirection(direction) | std::uint64_t(spread * (kSpreadCodes - 1) + 0.5) << 24;
    }
    for (int c = 0; c < 3; ++c) {
        const double level = colour_scale > 0 && std::isfinite(colour[c])
            ? std::sqrt(std::max(0.0, double(colour[c]) / colour_scale))
            : 0;
        m_bits |= std::uint64_t(std::min(1.0, level) * 511 + 0.5) << (30 + 9 * c);
    }
    if (own_share > 0)
        m_bits |= std::uint64_t(std::sqrt(std::min(1.0f, own_share)) * 7 + 0.5f) << 57;
    m_bits |= std::uint64_t(std::min(part, int(kMostParts) - 1)) << 60;
}

VoxelContent VoxelRecord::content(float density, float colour_scale) const
{
    VoxelContent content;
    content.part = part();
    content.density = density;
    content.spread_code = spreadCode();
    content.directed = directed();
    if (content.directed) content.direction = direction();
    content.own_share = ownShare();
    for (int c = 0; c < 3; ++c) {
        const double level = double(m_bits >> (30 + 9 * c) & 511) / 511;
        content.colour[c] = level * level * colour_scale;
    }
    return content;
}

DirectionFactors::DirectionFactors()
{
    // The mean square of the cosine c between a ray and directions of spread s about a mean one
    // (cosine m) is (m^2 (1-s^2) + s^2) / (1+2s^2). A fibre covers its sine, a sheet its cosine.
    // The mean of either is taken as the root of the mean square, and scaled so that its mean over
    // all rays is 1 for every s.
    for (int code = 0; code < kSpreadCodes; ++code) {
        const double s2 = spreadOf(code) * spreadOf(code), d = 1 + 2 * s2, b = (1 - s2) / d;
        const double fibre = (1 + s2) / d, sheet = s2 / d;
        // The integrals of sqrt(fibre - b m^2) and sqrt(sheet + b m^2) over m from 0 to 1.
        const double root = std::sqrt(b);
        const double fibre_mean = b > 1e-9 ? 0.5
                * (std::sqrt(fibre - b)
                   + fibre / root * std::asin(std::sqrt(std::min(1.0, b / fibre))))
                                           : std::sqrt(fibre);
        const double sheet_mean = b > 1e-9 ? 0.5
                * (std::sqrt(sheet + b)
                   + (sheet > 0 ? sheet / root * std::asinh(root / std::sqrt(sheet)) : 0))
                                           : std::sqrt(sheet);
        m_lines[0][code] = {fibre / (fibre_mean * fibre_mean), -b / (fibre_mean * fibre_mean)};
        m_lines[1][code] = {sheet / (sheet_mean * sheet_mean), b / (sheet_mean * sheet_mean)};
    }
}

} // namespace volcomp
