// SPDX-License-Identifier: Apache-2.0
// The strands of a file, cut by their roots into pieces that are baked one by one (MODEL section
// 6).
#pragma once

#include <string>
#include <vector>

#include "volcomp/curves/curve_set.h"
#include "volcomp/grow/grow.h"
#include "volcomp/grow/growth_rule.h"
#include "volcomp/surface/texture.h"

namespace volcomp {

/// The pieces of a rule with curves: rule.variants of them. Strands that are neighbours by their
/// roots, along a Hilbert curve, are in one piece, and all pieces have about as many segments. With
/// fewer strands than pieces some are empty.
///
/// A piece of a groom keeps its directions, and stands at origin(); a tuft of a box is moved and
/// turned so that its roots' middle is the origin and the mean of their directions is +Y.
class CurvePieces {
public:
    /// Reads the file and the map of a rule that has curves. Throws Error as readCurves() and
    /// readTexture() do, and with the file and the key if no strand is left, widths are missing, or
    /// the map has no (u,v).
    explicit CurvePieces(const GrowthRule& rule);

    int count() const { return static_cast<int>(m_ends.size()); }
    /// Where a piece of a groom stands, world units; 0 for a tuft.
    const Vec3d& origin(int piece) const { return m_origins[std::size_t(piece)]; }
    /// The strands of a piece, metres, from its origin. Pieces of zero length are left out. One
    /// part, which may have no segments.
    Skeleton skeleton(int piece) const;

    /// All strands that are taken, pieces of zero length included.
    std::size_t segmentCount() const { return m_segments; }
    std::size_t strandCount() const { return m_strands.size(); }
    /// Calls visit(point, half the width) in the world for all points of a groom.
    template <class F>
    void forPoints(const F& visit) const
    {
        for (const std::size_t s : m_strands)
            for (std::size_t p = m_set.first(s); p < m_set.ends[s]; ++p)
                visit(m_middle + turned(m_set.points[p]) * m_scale, radius(s, p));
    }
    const std::vector<std::string>& warnings() const { return m_set.warnings; }

private:
    void choose();
    void cut(int pieces);
    void findOrigins();
    void checkKeys() const;
    Vec3d turned(const Vec3f& v) const;
    double radius(std::size_t strand, std::size_t point) const; ///< metres
    Vec3f colour(std::size_t strand, std::size_t point) const;
    std::size_t firstOf(int piece) const { return piece == 0 ? 0 : m_ends[std::size_t(piece) - 1]; }

    CurvesSpec m_spec;
    std::string m_material;
    CurveSet m_set;
    Texture m_map;
    double m_scale = 1; ///< metres in one unit of the file
    UpAxis m_up = UpAxis::y;
    Vec3d m_middle{0.0}; ///< of the file's offset in the world
    std::size_t m_segments = 0;
    std::vector<std::size_t> m_strands; ///< those that are taken, piece by piece
    std::vector<std::size_t> m_ends;    ///< for each piece the index in m_strands behind its last
    std::vector<Vec3d> m_origins;
    struct Frame {
        Vec3d root{0.0};                          ///< from m_middle, metres
        Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}; ///< axes of the piece, in the world
    };
    std::vector<Frame> m_frames; ///< of pieces
};

/// What the variants of a box are made of, grown or cut from curves: the file is read once.
class BoxContents {
public:
    /// Throws Error as CurvePieces does. The rule must outlive it.
    explicit BoxContents(const GrowthRule& rule);
    /// Throws Error as grow() does.
    Skeleton skeleton(int variant) const;
    /// Null if it grows.
    const CurvePieces* curves() const { return m_curves ? &*m_curves : nullptr; }

private:
    const GrowthRule& m_rule;
    std::optional<CurvePieces> m_curves;
};

} // namespace volcomp
