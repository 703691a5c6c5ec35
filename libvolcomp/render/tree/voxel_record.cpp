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

VoxelRecord::VoxelRecord(const Vec3f& direction, const Vec3f& colour, float colour_scale, int part)
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
        m_bits |= std::uint64_t(std::min(1.0, level) * 1023 + 0.5) << (30 + 10 * c);
    }
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
    for (int c = 0; c < 3; ++c) {
        const double level = double(m_bits >> (30 + 10 * c) & 1023) / 1023;
        content.colour[c] = level * level * colour_scale;
    }
    return content;
}

FibreFactors::FibreFactors()
{
    // The mean square of the cosine c between a ray and fibres of spread s about a mean tangent
    // (cosine m) is (m^2 (1-s^2) + s^2) / (1+2s^2). The mean sine is taken as the root of the mean
    // square sine, scaled so that its mean over all rays is pi / 4 for every s.
    for (int code = 0; code < kSpreadCodes; ++code) {
        const double s2 = spreadOf(code) * spreadOf(code), a = (1 + s2) / (1 + 2 * s2),
                     b = (1 - s2) / (1 + 2 * s2);
        // The integral of sqrt(a - b m^2) over m from 0 to 1.
        const double mean = b > 1e-9 ? 0.5
                * (std::sqrt(a - b) + a / std::sqrt(b) * std::asin(std::sqrt(std::min(1.0, b / a))))
                                     : std::sqrt(a);
        m_a[code] = a / (mean * mean);
        m_b[code] = b / (mean * mean);
    }
}

} // namespace volcomp
