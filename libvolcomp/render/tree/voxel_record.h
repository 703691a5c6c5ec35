// SPDX-License-Identifier: Apache-2.0
// What a VoxelTree keeps of a voxel's particles beside their density, in 8 bytes.
//
//     bits 0 to 23    direction, sign free: two coordinates of 12 bits, off by less than 7e-4 rad
//     bits 24 to 29   spread of the directions, off by less than 0.0081; 63: no direction
//     bits 30 to 56   colour: 3 times 9 bits of the square root of colour over the brightest
//                     colour in the leaf, off by less than 0.2 % of that
//     bits 57 to 59   square root of the own share (volume.h), off by less than 0.072
//     bits 60 to 63   part; 15: the record names a range of a list instead, one entry for each part
//
// So a volume of one part pays nothing for the places where parts meet.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "volcomp/base/vec.h"
#include "volcomp/volume/material.h"

namespace volcomp {

constexpr int kSpreadCodes = 63; ///< codes of a spread are 0 to 62
/// The spread of the directions in a voxel, 0 to 1, from its code.
inline double spreadOf(int code) { return code / double(kSpreadCodes - 1); }

/// One part's particles in one voxel, unpacked.
struct VoxelContent {
    int part = 0;
    float density = 0; ///< of this part, 1 / world length
    bool directed = false;
    int spread_code = 0;  ///< see spreadOf(); kSpreadCodes, if not directed
    Vec3d direction{0.0}; ///< unit length, if directed
    Vec3d colour{1.0};
    double own_share = 0; ///< VolumePart::own_share
};

/// The particles of a voxel, packed.
class VoxelRecord {
public:
    static constexpr std::size_t kMostParts = 15; ///< parts that a record can name

    VoxelRecord() = default;
    /// `direction` has the length 1 - spread; 0 or not finite: none. `colour_scale` is the
    /// brightest component of the leaf's colours. A part of a list's entry may be any number: the
    /// list keeps it.
    VoxelRecord(const Vec3f& direction, const Vec3f& colour, float colour_scale, int part,
                float own_share = 0);
    /// Entries `start` to `start + count - 1` of the tree's list.
    static VoxelRecord list(std::uint32_t start, std::uint32_t count)
    {
        VoxelRecord r;
        r.m_bits = kList << 60 | std::uint64_t(count) << 32 | start;
        return r;
    }

    bool isList() const { return m_bits >> 60 == kList; }
    std::uint32_t listStart() const { return std::uint32_t(m_bits); }
    std::uint32_t listCount() const { return std::uint32_t(m_bits >> 32 & 0xffff); }

    // The following are for a record that is not a list.
    int part() const { return int(m_bits >> 60); }
    double ownShare() const { return double(m_bits >> 57 & 7) * double(m_bits >> 57 & 7) / 49; }
    int spreadCode() const { return int(m_bits >> 24 & 63); }
    bool directed() const { return spreadCode() != kSpreadCodes; }
    Vec3d direction() const ///< unit length; only if directed
    {
        const double u = (double(m_bits & 4095) - 2047) / 2047,
                     v = (double(m_bits >> 12 & 4095) - 2047) / 2047;
        const double x = 0.5 * (u + v), y = 0.5 * (u - v), z = 1 - std::abs(x) - std::abs(y);
        const double s = 1 / std::sqrt(x * x + y * y + z * z);
        return {x * s, y * s, z * s};
    }
    VoxelContent content(float density, float colour_scale) const;

private:
    static constexpr std::uint64_t kList = 15;
    std::uint64_t m_bits = 0;
};
static_assert(sizeof(VoxelRecord) == 8);

/// An entry of a record's list: one part's particles in a voxel where several parts meet.
struct ListedRecord {
    VoxelRecord record;
    float density;
    std::int32_t part;
};

/// How much light the fibres or sheets of a voxel stop, over what they would stop if they had every
/// direction (MODEL sections 3 and 8): sqrt(a + b c^2), where c is the cosine of the ray with their
/// mean tangent or normal. The mean over all rays is 1 for every spread.
class DirectionFactors {
public:
    DirectionFactors();
    double at(MaterialKind kind, int spread_code, double cosine) const
    {
        const Line& l = m_lines[kind == MaterialKind::fibre ? 0 : 1][spread_code];
        return std::sqrt(std::max(0.0, l.a + l.b * cosine * cosine));
    }

private:
    struct Line {
        double a = 0, b = 0;
    };
    std::array<std::array<Line, 64>, 2> m_lines{}; ///< by kind and spread code
};

} // namespace volcomp
