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

/// Optical depths of the columns of voxels along an axis.
std::vector<double> depthsOf(const Volume& v, int axis)
{
    std::map<std::pair<int, int>, double> columns;
    for (auto it = v.parts[0].density->cbeginValueOn(); it; ++it) {
        const Coord c = it.getCoord();
        columns[{c[(axis + 1) % 3], c[(axis + 2) % 3]}] += *it * v.voxelSize();
    }
    std::vector<double> depths;
    for (const auto& [place, depth] : columns) depths.push_back(depth);
    return depths;
}

/// The integral of 1 - transmittance over all rays along an axis: the shade that the volume casts.
double shadeOf(const Volume& v, int axis)
{
    double shade = 0;
    for (const double depth : depthsOf(v, axis)) shade += -std::expm1(-depth);
    return shade * v.voxelSize() * v.voxelSize();
}

/// Parts of the interval [place, place + 1] in the cells [ratio i, ratio (i + 1)], over `ratio`.
std::vector<double> partsOf(double place, double ratio)
{
    std::vector<double> parts;
    for (int i = 0; ratio * i < place + 1; ++i)
        parts.push_back(
            std::max(0.0, std::min(place + 1, ratio * (i + 1)) - std::max(place, ratio * i))
            / ratio);
    return parts;
}

/// The shade of a column of edge 1 and of the given optical depth after it has been spread over
/// columns of edge `ratio`, averaged over its place among them.
double spreadShade(double depth, double ratio)
{
    constexpr int kPlaces = 16;
    double shade = 0;
    for (int u = 0; u < kPlaces; ++u)
        for (int v = 0; v < kPlaces; ++v)
            for (const double x : partsOf((u + 0.5) / kPlaces * ratio, ratio))
                for (const double y : partsOf((v + 0.5) / kPlaces * ratio, ratio))
                    shade += -std::expm1(-depth * x * y);
    return shade * ratio * ratio / (kPlaces * kPlaces);
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

TEST(PlacedBox, SpreadsTheShadeNoFurtherThanItsCubes)
{
    // A turn about the ray's direction does not change the shade of the box itself. Composing
    // spreads each column of voxels over the columns that its cubes overlap. As 1 - exp(-depth) is
    // concave and 0 at 0, this increases the shade, and shades of columns that are spread into each
    // other are at most the sum of the shades of each alone. docs/composing.md has the figures.
    for (const double depth : {0.3, 2.0}) {
        const Box box = tuft(depth);
        for (const int axis : {0, 1}) {
            const double own = shadeOf(box.volume, axis);
            for (const double ratio : {0.5, 1.0, 2.0, 4.0}) {
                const double shade = composedShade(box, axis, ratio);
                double most = 0;
                for (const double d : depthsOf(box.volume, axis))
                    most += spreadShade(d, ratio) * kVoxel * kVoxel;
                EXPECT_GT(shade, own) << depth << " " << ratio << " " << axis;
                EXPECT_LT(shade, most * 1.01) << depth << " " << ratio << " " << axis;
                const Coord size = box.volume.parts[0].density->evalActiveVoxelDim();
                const double area =
                    double(size[(axis + 1) % 3]) * size[(axis + 2) % 3] * kVoxel * kVoxel;
                RecordProperty("T_" + std::to_string(depth) + "_" + std::to_string(ratio) + "_"
                                   + "xyz"[axis],
                               std::to_string(1 - own / area) + ", composed "
                                   + std::to_string(1 - shade / area) + ", at least "
                                   + std::to_string(1 - most / area));
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
