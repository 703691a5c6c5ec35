// SPDX-License-Identifier: Apache-2.0
// What a box grows: the parameters of the recursive function (MODEL section 6).
//
// A growth rule is a list of levels. A level grows strands (stems, hairs, needles) or flat shapes
// (leaves, blades, petals) on the ground or on the strands of another level, and may grow on itself
// `depth` times. Hair is one level with one child.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "volcomp/base/vec.h"
#include "volcomp/grow/curves_spec.h"
#include "volcomp/grow/mesh_box.h"

namespace volcomp {

/// The outline of what a level grows, from root to tip. A stem is a round cone, the others are
/// flat.
enum class Outline {
    stem,
    blade, ///< as wide as at its root for most of the length, then pointed
    ellipse,
    ovate,  ///< widest near its root, pointed
    obovate ///< widest near its tip
};

/// Returns half the width of an outline at the fraction s of its length (0 to 1), as a part of its
/// greatest half width.
double outlineWidth(Outline outline, double s);

/// One level of the recursion. Fractions run along the parent from 0 at its root to 1 at its tip. A
/// span is a pair (low, high); the value is drawn evenly between the two.
struct GrowthLevel {
    using Span = std::pair<double, double>;

    std::string name;
    std::string parent; ///< name of a level, or "ground"
    std::string material;
    Outline outline = Outline::stem;
    int depth = 1;   ///< generations: strands of this level bear others of it that often
    Span fork{2, 2}; ///< how many of its own level a strand bears, below the last generation
    double fork_start = 0.3; ///< the fraction of the strand from which on it forks
    Span on_depth{1, 100};   ///< generations of the parent's level that bear this one, from 1 on

    Span count{1, 1};          ///< on the ground how many in all, otherwise how many on each parent
    int whorl = 1;             ///< how many stand at one node
    double start = 0, end = 1; ///< fractions of the parent where the first and the last stand
    double spread = 0;         ///< on the ground: radius of the disc where roots stand, metres
    double divergence = 137.50776 * kDegree; ///< turn about the parent from node to node, radians
    double divergence_variation = 0;         ///< standard deviation, radians
    bool planar = false; ///< they stand to the left and right of the parent only, in its plane

    Span angle{0, 0};            ///< from the parent's direction, radians
    double angle_tip = 1;        ///< factor on the angle at the parent's tip
    double length = 0;           ///< metres; 0 means length_ratio of the parent's
    double length_ratio = 0.5;   ///< of the parent's length; also where the level grows on itself
    double length_tip = 1;       ///< factor on the length at the parent's tip
    double length_variation = 0; ///< standard deviation, as a part of the length
    double radius = 0;           ///< metres; 0 means radius_ratio of the parent's there
    double radius_ratio = 0.6;
    double taper = 0.5;       ///< part of the radius that is lost from root to tip
    double width_ratio = 0.3; ///< of flat outlines: greatest width / length
    int segments = 8;         ///< pieces of each strand

    // Angles over the whole length of a strand, radians. Those of comb, gravity and light are for a
    // strand at right angles to where it turns; they shrink with the sine of the angle that is
    // left.
    double bend = 0;           ///< away from the parent's tip (down)
    double bend_variation = 0; ///< standard deviation of the bend
    double comb = 0;           ///< turn towards +X of the box
    double twist = 0;          ///< turn about the strand's own axis
    double wander = 0;         ///< standard deviation of random turns
    double gravity = 0;        ///< turn towards -Y
    double light = 0;          ///< turn towards +Y

    double facing = 0;      ///< how much a flat shape turns its face to +Y, 0 to 1
    double curl_radius = 0; ///< of the helix around the strand's line, metres
    double curl_turns = 3;  ///< of the helix over the length
    double frizz = 0;       ///< random shift to the sides, as a part of the length
    double clump = 0;       ///< on the ground: how much the tips of a clump meet, 0 to 1
    int clumps = 1;         ///< number of clumps; unused if `clump` is 0

    Vec3d colour_root{0.5}, colour_tip{0.5}; ///< linear RGB
    double colour_variation = 0; ///< standard deviation of a strand's brightness, as a part of it

    bool flat() const { return outline != Outline::stem; }
};

/// One kind of box, as a [box.NAME] table says: the levels of its recursive function, and its
/// voxels.
struct GrowthRule {
    std::string name;
    std::string material; ///< of the levels that name none
    int variants = 4;     ///< number of boxes, which differ by their random numbers only
    std::uint64_t seed = 1;
    double voxel = 0; ///< edge of a voxel, metres; 0 means as voxelFor() chooses
    double segment_limit =
        1e7; ///< a rule that may grow more segments is refused; at most 2^32 grow
    std::vector<GrowthLevel> levels;
    std::optional<CurvesSpec> curves; ///< instead of levels: strands of a file
    MeshBox mesh;                     ///< instead of levels, if it names a file
    /// Instead of levels: volumes of another program, one for each variant. They are not baked.
    std::vector<std::filesystem::path> files;
    /// The table as a scene has it, a line "KEY = VALUE" for each key, for recipes; may be empty.
    std::string source;

    /// Throws Error if a value is out of range or not finite, a parent is missing, or the bound of
    /// the segments exceeds the limit.
    void validate() const;

    /// Returns the most segments that the recursion can grow. It is computed without growing, so
    /// that 10^20 is a possible answer. What growing keeps besides (strands, guides of clumps that
    /// have strands) is less than as many segments.
    double segmentBound() const;

    /// Returns the index of the level that level `i` (below levels.size()) stands on, or -1 for the
    /// ground. Throws Error if the parent is missing.
    int parentOf(std::size_t i) const;

private:
    std::vector<double> segmentBounds() const; ///< of each level
    void checkSize() const;
};

} // namespace volcomp
