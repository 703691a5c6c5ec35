// What a box grows: the parameters of the recursive function (MODEL section 6).
//
// A primitive is a list of levels. A level grows strands (stems, hairs, needles) or flat shapes
// (leaves, blades, petals) on the ground or on the strands of another level, and may grow on itself
// `depth` times. Hair is one level with one child.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "volcomp/base/vec.h"

namespace volcomp {

/// The outline of what a level grows, root to tip. `stem` is a round cone, the others are flat.
enum class Outline {
    stem,
    blade, ///< as wide as at its root for most of the length, then pointed
    ellipse,
    ovate,  ///< widest near its root, pointed
    obovate ///< widest near its tip
};

/// Half the width of an outline at the fraction s of its length, as a part of its greatest half
/// width: 0 to 1.
double outlineWidth(Outline outline, double s);

/// One level of the recursion. Fractions run along the parent (0 root, 1 tip); a span is [low,
/// high], drawn evenly.
struct GrowthLevel {
    using Span = std::pair<double, double>;

    std::string name;
    std::string parent; ///< name of a level, or "ground"
    std::string material;
    Outline outline = Outline::stem;
    int depth =
        1; ///< generations: strands of this level bear others of it until the depth is reached
    Span fork{2, 2}; ///< how many of its own level a strand bears, below the last generation
    double fork_start = 0.3; ///< from which fraction on
    Span on_depth{1, 100}; ///< generations of the parent's level that bear this one, the first is 1

    Span count{1, 1};          ///< on the ground: in all; otherwise on each parent
    int whorl = 1;             ///< how many stand at one node
    double start = 0, end = 1; ///< fractions of the parent
    double spread = 0;         ///< on the ground: radius of the disc where roots stand
    double divergence = 137.50776 * kDegree; ///< turn about the parent from node to node, radians
    double divergence_variation = 0;         ///< standard deviation, radians
    bool planar = false; ///< to the left and right of the parent only, in its plane

    Span angle{0, 0};            ///< from the parent's direction, radians
    double angle_tip = 1;        ///< factor on the angle at the parent's tip
    double length = 0;           ///< metres; 0: length_ratio of the parent's
    double length_ratio = 0.5;   ///< of the parent's length; also where the level grows on itself
    double length_tip = 1;       ///< factor on the length at the parent's tip
    double length_variation = 0; ///< standard deviation, part of the length
    double radius = 0;           ///< metres; 0: radius_ratio of the parent's at the fork
    double radius_ratio = 0.6;
    double taper = 0.5;       ///< part of the radius that is lost to the tip
    double width_ratio = 0.3; ///< flat outlines: greatest width / length
    int segments = 8;         ///< pieces of each strand

    double bend = 0; ///< over the length, away from the parent's tip (down), radians
    double bend_variation = 0;
    double comb = 0;        ///< over the length, towards +X of the box, radians
    double twist = 0;       ///< about its own axis over the length, radians
    double wander = 0;      ///< random turns over the length, standard deviation, radians
    double gravity = 0;     ///< turn towards -Y over the length, radians, for a level strand
    double light = 0;       ///< turn towards +Y over the length, radians, for a level strand
    double facing = 0;      ///< how much a flat shape turns its normal to +Y, 0 to 1
    double curl_radius = 0; ///< metres
    double curl_turns = 3;  ///< over the length
    double frizz = 0;       ///< random sideways shift, part of the length
    double clump = 0;       ///< on the ground: how much tips meet, 0 to 1
    int clumps = 1;

    Vec3d colour_root{0.5}, colour_tip{0.5}; ///< linear RGB
    double colour_variation = 0; ///< standard deviation of a strand's brightness, part of it

    bool flat() const { return outline != Outline::stem; }
};

/// One kind of box, as a [box.NAME] table says: the levels of its recursive function, and its
/// voxels.
struct GrowthRule {
    std::string name;
    std::string material; ///< of the levels that name none
    int variants = 4;     ///< boxes baked, which differ by their random numbers only
    std::uint64_t seed = 1;
    double voxel = 0; ///< edge of a voxel, metres; 0: from the thinnest feature worth showing
    double segment_limit = 1e7;
    std::vector<GrowthLevel> levels;
    std::string source; ///< the table as the scene has it (TOML), for the box's file; empty where
                        ///< there was none

    /// Throws Error where a value is out of range or not finite, a parent is missing, or the
    /// segments exceed the limit.
    void validate() const;

    /// The most segments that the recursion can grow; computed, not grown, so that 10^20 is an
    /// answer.
    double segmentBound() const;

    /// Index of the level that level `i` stands on; -1 is the ground.
    int parentOf(std::size_t i) const;
};

} // namespace volcomp
