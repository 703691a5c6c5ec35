#include "volcomp/compose/placed_box.h"

#include <algorithm>
#include <cmath>
#include <map>

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
    const double h = v.voxelSize();
    std::map<std::pair<int, int>, double> columns;
    for (auto it = v.parts[0].density->cbeginValueOn(); it; ++it) {
        const Coord c = it.getCoord();
        columns[{c[(axis + 1) % 3], c[(axis + 2) % 3]}] += *it * h;
    }
    double shade = 0;
    for (const auto& [place, depth] : columns) shade += -std::expm1(-depth) * h * h;
    return shade;
}

TEST(PlacedBox, spreadsTheShadeAsTheDocumentationSays)
{
    // A turn about the ray's direction does not change the shade, so the box's own voxels are the
    // reference. The figures are docs/composing.md's: spreading a thin strand lets it cover more,
    // most where rays run along it.
    struct Case {
        double depth, ratio, from_side, along; ///< composed shade / the box's
    };
    const Case cases[] = {{0.3, 0.5, 1.019, 1.111}, {0.3, 1, 1.037, 1.209}, {0.3, 2, 1.070, 1.428},
                          {0.3, 4, 1.092, 1.624},   {2, 0.5, 1.073, 1.261}, {2, 1, 1.141, 1.482},
                          {2, 2, 1.248, 1.984},     {2, 4, 1.339, 2.566}};
    for (const Case& k : cases) {
        const Box box = tuft(k.depth);
        for (const int axis : {0, 1}) {
            double sum = 0;
            for (int turn = 0; turn < 8; ++turn) {
                Random random(hashKey(4, turn));
                Vec3d along(0.0);
                along[axis] = 1;
                const double angle = random.uniform(0, 2 * kPi);
                const Placement p = turned(
                    along, angle, Vec3d(random.uniform(), random.uniform(), random.uniform()));
                sum += shadeOf(composed({box}, {p}, voxel(kVoxel * k.ratio)), axis) / 8;
            }
            const double own = shadeOf(box.volume, axis);
            EXPECT_NEAR(sum / own / (axis == 0 ? k.from_side : k.along), 1, 0.02)
                << k.depth << " " << k.ratio;
            const Coord size = box.volume.parts[0].density->evalActiveVoxelDim();
            const double area =
                double(size[(axis + 1) % 3]) * size[(axis + 2) % 3] * kVoxel * kVoxel;
            RecordProperty(std::to_string(k.depth) + "_" + std::to_string(k.ratio) + "_"
                               + "xyz"[axis],
                           "transmittance " + std::to_string(1 - own / area) + ", composed "
                               + std::to_string(1 - sum / area));
        }
    }
}

TEST(PlacedBox, itsTilesAreThoseThatItReaches)
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
