// SPDX-License-Identifier: Apache-2.0
// Strands as another program has made them: polylines from root to tip, and what their file says of
// them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/grow/curves_spec.h"
#include "volcomp/surface/mesh.h" // Vec2f

namespace volcomp {

/// How often a file gives a quantity.
enum class Given { never, once, per_strand, per_point };

/// Lists of one value for the whole set, for each strand or for each point, as `given` says.
template <class T>
struct PerCurve {
    Given given = Given::never;
    std::vector<T> values;

    /// The value at a point of a strand; `given` must not be `never`.
    const T& at(std::size_t strand, std::size_t point) const
    {
        return values[given == Given::once ? 0 : given == Given::per_strand ? strand : point];
    }
};

/// The strands of one file. Places and widths are in the file's units and axes.
struct CurveSet {
    /// Taken off all points in double, so that strands far from the origin keep their shape.
    Vec3d offset{0.0};
    std::vector<Vec3f> points;     ///< of all strands, each from root to tip; finite
    std::vector<std::size_t> ends; ///< for each strand the index behind its last point

    PerCurve<float> widths;      ///< diameters, finite and at least 0; Given::once: a default that
                                 ///< the key `width` of a scene goes before
    PerCurve<Vec3f> colours;     ///< linear RGB, finite and at least 0
    std::vector<Vec2f> root_uvs; ///< for each strand (u,v) of the skin at its root; may be empty
    std::vector<std::int32_t> groups; ///< for each strand; may be empty, then all are of group 0
    std::vector<char> guides;         ///< for each strand whether it is a guide; may be empty

    double unit = 0;                   ///< metres in one unit of the file; 0: it does not say
    UpAxis up = UpAxis::y;             ///< as the file says
    bool says_up = false;              ///< whether it does
    std::vector<std::string> warnings; ///< whole sentences

    std::size_t size() const { return ends.size(); }
    std::size_t first(std::size_t strand) const { return strand == 0 ? 0 : ends[strand - 1]; }
    std::size_t segmentCount() const { return points.size() - ends.size(); }
};

/// Reads a file of strands, by its ending: .hair (Yuksel's HAIR, with the sidecar of
/// volcomp-import beside it if there is one), .tfx (TressFX 4), .ply (edges, or lists of vertices)
/// or .obj (lines). Strands of a single point are left out, with a warning. Takes memory in
/// proportion to the file, whatever its header says. Throws Error with the file and the place for
/// anything that it does not read right.
CurveSet readCurves(const std::filesystem::path& file);

/// The file that volcomp-import writes beside a .hair file, for what that format has no place for:
/// groups, guides, (u,v) of roots, the unit and the up axis. It need not exist.
std::filesystem::path sidecarOf(const std::filesystem::path& file);

} // namespace volcomp
