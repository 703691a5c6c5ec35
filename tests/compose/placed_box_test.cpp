// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/placed_box.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/boxes.h"
#include "volcomp/base/error.h"

namespace volcomp {
namespace {

using openvdb::Coord;

constexpr double kVoxel = 0.01;

/// A tuft of one-voxel strands whose optical depth across a voxel is `depth`.
Box tuft(double depth)
{
    Box box{"tuft", 0, {}};
    VolumePart& part = box.volume.parts.emplace_back(emptyPart(kVoxel));
    for (int s = 0; s < 40; ++s) {
        Random random(hashKey(3, s));
        double x = random.uniform(-12, 12), z = random.uniform(-12, 12);
        const double dx = random.symmetric() * 0.2, dz = random.symmetric() * 0.2;
        for (int y = 0; y < 48; ++y, x += dx, z += dz)
            part.density->tree().setValue(Coord(int(std::lround(x)), y, int(std::lround(z))),
                                          float(depth / kVoxel));
    }
    return box;
}

/// The integral of 1 - transmittance over all rays along an axis: the shade that the volume casts.
double shadeOf(const Volume& v, int axis)
{
    std::map<std::pair<int, int>, double> columns;
    for (auto it = v.parts[0].density->cbeginValueOn(); it; ++it) {
        const Coord c = it.getCoord();
        columns[{c[(axis + 1) % 3], c[(axis + 2) % 3]}] += *it * v.voxelSize();
    }
    double shade = 0;
    for (const auto& [place, depth] : columns) shade += -std::expm1(-depth);
    return shade * v.voxelSize() * v.voxelSize();
}

/// Overlaps of the interval of the given middle and width with the cells [i, i + 1].
std::vector<double> overlaps(double middle, double width)
{
    const double low = middle - width / 2, high = middle + width / 2;
    std::vector<double> parts;
    for (double i = std::floor(low); i < high; ++i)
        parts.push_back(std::min(high, i + 1) - std::max(low, i));
    return parts;
}

TEST(PlacedBox, AStrandCastsTheShadeOfItsCubesAlongIt)
{
    // Seen along it, a straight strand is a square of the optical depth of all its voxels.
    // Composed, it is spread evenly over the square that its cubes cover, whatever the turn about
    // the ray: one voxel wide, or as many as have been summed along an edge for a coarse target.
    constexpr int kLength = 16;
    for (const double depth : {0.3, 20.0}) {
        Box box{"strand", 0, {}};
        VolumePart& part = box.volume.parts.emplace_back(emptyPart(kVoxel));
        for (int y = 0; y < kLength; ++y)
            part.density->tree().setValue(Coord(0, y, 0), float(depth / kLength / kVoxel));
        for (const double ratio : {0.3, 0.5, 1.0, 1.4, 2.0, 3.0, 4.0})
            for (int k = 0; k < 8; ++k) {
                Random random(hashKey(5, k));
                // Below 1 / 1.5 the turned parts of a voxel no longer make up a square.
                const double angle = ratio < 0.67 ? k * kPi / 2 : random.uniform(0, 2 * kPi);
                const Vec3d place(random.symmetric(), random.symmetric(), random.symmetric());
                const double summed = ratio >= 4 ? 4 : ratio >= 2 ? 2 : 1, h = kVoxel * ratio;
                double expected = 0;
                for (const double x : overlaps(place[0] / h + 0.5, summed / ratio))
                    for (const double z : overlaps(place[2] / h + 0.5, summed / ratio))
                        expected += -std::expm1(-depth * x * z / (summed * summed)) * h * h;
                const Volume v = composed({box}, {turned({0, 1, 0}, angle, place)}, voxel(h));
                // Places and edges are rounded to 1/4096 voxel.
                EXPECT_NEAR(shadeOf(v, 1) / expected, 1, 2e-3) << depth << " " << ratio;
            }
    }
}

/// The mean shade of the box after it has been turned about an axis, shifted and composed.
double composedShade(const Box& box, int axis, double ratio)
{
    constexpr int kTurns = 8;
    double sum = 0;
    for (int turn = 0; turn < kTurns; ++turn) {
        Random random(hashKey(4, turn));
        Vec3d along(0.0);
        along[axis] = 1;
        const double angle = random.uniform(0, 2 * kPi);
        const Placement p =
            turned(along, angle, Vec3d(random.uniform(), random.uniform(), random.uniform()));
        sum += shadeOf(composed({box}, {p}, voxel(kVoxel * ratio)), axis);
    }
    return sum / kTurns;
}

TEST(PlacedBox, ComposingSpreadsTheShadeTheMoreTheCoarserTheVoxel)
{
    // A turn about the ray's direction does not change the shade of the box itself. Composing keeps
    // the integral of the optical depth and spreads it, and 1 - exp(-depth) is concave, so the
    // shade grows. docs/composing.md has the figures, which the properties of this test give.
    for (const double depth : {0.3, 2.0}) {
        const Box box = tuft(depth);
        for (const int axis : {0, 1}) {
            const double own = shadeOf(box.volume, axis);
            const Coord size = box.volume.parts[0].density->evalActiveVoxelDim();
            const double area =
                double(size[(axis + 1) % 3]) * size[(axis + 2) % 3] * kVoxel * kVoxel;
            double finer = own;
            for (const double ratio : {0.5, 1.0, 2.0, 4.0}) {
                const double shade = composedShade(box, axis, ratio);
                EXPECT_GT(shade, finer) << depth << " " << ratio << " " << axis;
                finer = shade;
                RecordProperty("T_" + std::to_string(depth) + "_" + std::to_string(ratio) + "_"
                                   + "xyz"[axis],
                               std::to_string(1 - own / area) + ", composed "
                                   + std::to_string(1 - shade / area));
            }
        }
    }
}

TEST(PlacedBox, ReachesEveryTileThatComposingFills)
{
    const Box box = tuft(1);
    const SourcePart part = packPart(box.volume.parts[0], "tuft");
    Placement p;
    p.position = Vec3d(0.305, -1.2, 0.7);
    p.scale = 1.3f;
    std::vector<Coord> tiles;
    PlacedBox(p, part, 0.007).forTiles([&](const Coord& t) { tiles.push_back(t); });
    const PackedVolume volume = compose({box}, {p}, voxel(0.007));
    for (const PackedBlock& b : volume.parts[0].blocks) {
        const Coord tile(b.origin[0] >> TileAccumulator::kLog2,
                         b.origin[1] >> TileAccumulator::kLog2,
                         b.origin[2] >> TileAccumulator::kLog2);
        EXPECT_NE(std::find(tiles.begin(), tiles.end(), tile), tiles.end()) << tile;
    }
    p.position[0] = 1e9;
    EXPECT_THROW(PlacedBox(p, part, 0.007).forTiles([](const Coord&) {}), Error);
}

} // namespace
} // namespace volcomp
