// SPDX-License-Identifier: Apache-2.0
// One strand of the recursion: where it stands, and the line that it follows. Private to growing.
#pragma once

#include <cstdint>
#include <vector>

#include "volcomp/base/random.h"
#include "volcomp/base/vec.h"
#include "volcomp/grow/growth_rule.h"

namespace volcomp {

/// The orthonormal frame of a strand: t points along it, n is its upper side.
struct Frame {
    Vec3d t, n;

    Vec3d b() const { return t.cross(n); } ///< to the left

    /// Makes t and n orthonormal; t keeps its direction and must not be zero.
    void orthonormalize();

    /// Turns the frame about a unit vector by an angle in radians.
    void turn(const Vec3d& axis, double angle);

    /// Turns the frame so that t moves towards the unit vector `goal`, by `angle` times the sine of
    /// the angle between them.
    void turnTowards(const Vec3d& goal, double angle);

    /// Turns n towards +Y as far as t allows: 0 not at all, 1 entirely.
    void faceUp(double amount);
};

/// A strand that is to grow: all that the parameters of its level do not say. Box space, metres.
struct Strand {
    Vec3d root{0.0};
    Frame frame{Vec3d(0, 1, 0), Vec3d(0, 0, 1)};
    double length = 0, radius = 0;
    std::uint64_t key = 0; ///< of its random numbers
    int generation = 1;    ///< 1 on the ground or on another level, then counted up by forks
    /// The clump that it belongs to, for levels on the ground and their forks.
    int clump = 0;
    /// The part of its clump's guide that it follows: where it starts, and how much it passes until
    /// its tip. 1 is the whole guide.
    double guide_start = 0, guide_span = 1;
};

/// A point of a strand's line.
struct Node {
    Vec3d p;
    Frame frame;
    double radius;
};

/// Draws a whole number from the span [first, second], all of them with the same probability if its
/// ends are whole. If both ends are 1.9, it draws 1 or 2, on the average 1.9.
int drawCount(const GrowthLevel::Span& span, Random& random);

/// Returns the largest number that drawCount() may draw.
double mostDrawn(const GrowthLevel::Span& span);

/// Returns the value times a normal number of mean 1 and the given deviation, clamped to 0.1 to 2.
double varied(double value, double deviation, Random& random);

/// Sets `nodes` to the line of a strand, level.segments + 1 nodes. A plain line has no curl and no
/// frizz: the guides of clumps are plain.
void trace(const GrowthLevel& level, const Strand& strand, bool plain, std::vector<Node>& nodes);

/// Bends a strand towards the guide of its clump, the more the nearer to the tip (MODEL section 6).
/// `guide` has as many points as the strand has nodes; beyond its tip it runs on straight.
void gather(const GrowthLevel& level, const Strand& strand, const std::vector<Vec3d>& guide,
            std::vector<Node>& nodes);

/// Turns the frames of nodes that have been moved into the direction of the line through them.
void alignFrames(std::vector<Node>& nodes);

/// Returns the node at the fraction u of the line, 0 to 1, interpolated between two nodes.
Node nodeAt(const std::vector<Node>& nodes, double u);

/// Returns half the width of an outline at the nodes of `segments` pieces, as a part of about its
/// greatest half width: scaled so that the pieces have the area of the smooth outline.
std::vector<double> nodeWidths(Outline outline, int segments);

} // namespace volcomp
