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
#include "tests/support/message_of.h"
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
double composedShade(const Box& box, int axis, double ratio, Kept keep = Kept::integral)
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
        ComposeParams params = voxel(kVoxel * ratio);
        params.keep = keep;
        sum += shadeOf(composed({box}, {p}, params), axis);
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
    PlacedBox(p, part, 0.007).forTiles(nullptr, [&](const Coord& t) { tiles.push_back(t); });
    const PackedVolume volume = compose({box}, {p}, voxel(0.007));
    for (const PackedBlock& b : volume.parts[0].blocks) {
        const Coord tile(b.origin[0] >> TileAccumulator::kLog2,
                         b.origin[1] >> TileAccumulator::kLog2,
                         b.origin[2] >> TileAccumulator::kLog2);
        EXPECT_NE(std::find(tiles.begin(), tiles.end(), tile), tiles.end()) << tile;
    }
    p.position[0] = 1e9;
    EXPECT_THROW(PlacedBox(p, part, 0.007).forTiles(nullptr, [](const Coord&) {}), Error);
}

/// A voxel list of a run at random places, as a tile sees it after a random turn.
struct TurnedRun {
    std::vector<float> place[3];
    BoxInTile box{};

    TurnedRun(std::uint64_t key, int divisions)
    {
        Random r(key);
        const Placement p = randomPlacement(key, 1);
        const Vec3f* axes[3] = {&p.x_axis, &p.y_axis, &p.z_axis};
        const double step = divisions - 0.4;
        Vec3d middle(0.0);
        for (int a = 0; a < 3; ++a) {
            for (int k = 0; k < SourcePart::kRun; ++k)
                place[a].push_back(float(std::floor(r.uniform(5, 8))));
            const double inside = r.uniform(4.5, 7.5); // what lies at the tile's middle
            for (int i = 0; i < 3; ++i) {
                box.turn[a][i] = (*axes[a])[i];
                box.axes[a][i] = float(double((*axes[a])[i]) * step);
                middle[i] += box.axes[a][i] * inside;
            }
            box.place[a] = place[a].data();
        }
        for (int i = 0; i < 3; ++i) box.root[i] = float(8 - middle[i]);
        box.divisions = divisions;
        box.width = 1;
        box.voxel_count = SourcePart::kRun - 2;
    }

    /// Whether a part's cube overlaps the tile.
    bool reaches(int voxel, const int (&part)[3]) const
    {
        for (int i = 0; i < 3; ++i) {
            double x = box.root[i] - 8;
            for (int a = 0; a < 3; ++a)
                x += box.axes[a][i] * (place[a][voxel] + (part[a] + 0.5) / box.divisions - 0.5);
            if (std::abs(x) > 8.5) return false;
        }
        return true;
    }
};

bool holds(const ReachedParts& reached, int axis, int part)
{
    for (int r = 0; r < reached.count[axis]; ++r)
        if (part >= reached.ranges[axis][r].begin && part < reached.ranges[axis][r].end)
            return true;
    return false;
}

TEST(PlacedBox, PartsOfDividedVoxelsThatReachATileAreAllFound)
{
    std::size_t found = 0;
    for (std::uint64_t key = 0; key < 40; ++key) {
        const TurnedRun run(key, 2 + int(key));
        const ReachedParts reached = reachedParts(run.box, 0);
        int part[3];
        for (int voxel = 0; voxel < int(run.box.voxel_count); ++voxel)
            for (part[0] = 0; part[0] < run.box.divisions; ++part[0])
                for (part[1] = 0; part[1] < run.box.divisions; ++part[1])
                    for (part[2] = 0; part[2] < run.box.divisions; ++part[2])
                        if (run.reaches(voxel, part)) {
                            ++found;
                            for (int a = 0; a < 3; ++a)
                                ASSERT_TRUE(holds(reached, a, part[a])) << key;
                        }
    }
    EXPECT_GT(found, 10000U);
}

TEST(PlacedBox, PartsThatATileNeedNotVisitAreLeftOut)
{
    for (std::uint64_t key = 0; key < 100; ++key) {
        const int divisions = key % 2 ? 1000 : 100000;
        const ReachedParts reached = reachedParts(TurnedRun(key, divisions).box, 0);
        double parts = 1;
        for (int a = 0; a < 3; ++a) {
            double along = 0;
            for (int r = 0; r < reached.count[a]; ++r)
                along += reached.ranges[a][r].end - reached.ranges[a][r].begin;
            parts *= along;
        }
        // The bounds of a turned tile are up to 17 sqrt(3) wide, places far away have the rounding
        // of floats around them, and a tile at a voxel's corner sees eight voxels.
        EXPECT_LE(parts, std::pow(divisions > 1000 ? 100 : 70, 3)) << key;
    }
}

TEST(PlacedBox, ComposingKeepsTheBlockedLight)
{
    // The mean over the axes of the shade stays what it is in the box; with the integral kept it
    // grows by up to 3.4 times.
    for (const double depth : {0.3, 4.6}) {
        const Box box = tuft(depth);
        for (const double ratio : {0.6, 1.0, 1.7, 3.0, 4.5}) {
            double own = 0, kept = 0, spread = 0;
            for (int axis = 0; axis < 3; ++axis) {
                own += shadeOf(box.volume, axis);
                kept += composedShade(box, axis, ratio, Kept::blocked_light);
                spread += composedShade(box, axis, ratio);
            }
            EXPECT_NEAR(kept / own, 1, 0.05) << depth << " " << ratio << ", " << spread / own;
            EXPECT_GT(spread / own, ratio < 1 ? 1.02 : 1.05) << depth << " " << ratio;
        }
    }
}

TEST(PlacedBox, AStrandIsAloneInItsVoxelsWhateverTheirSize)
{
    // Own shares: 1 for a strand by itself, 1 / 2 where two meet that are equal. If these are
    // spread over voxels beside each other, they count for fewer.
    Box box{"strand", 0, {}};
    VolumePart& part = box.volume.parts.emplace_back(emptyPart(kVoxel));
    part.own_share = openvdb::FloatGrid::create(0.0f);
    part.own_share->setTransform(part.density->transform().copy());
    part.direction = openvdb::Vec3SGrid::create(Vec3f(0.0f));
    part.direction->setTransform(part.density->transform().copy());
    for (int y = 0; y < 32; ++y) {
        part.density->tree().setValue(Coord(0, y, 0), 50);
        part.own_share->tree().setValue(Coord(0, y, 0), 1);
        part.direction->tree().setValue(Coord(0, y, 0), Vec3f(0, 1, 0));
    }
    for (const Kept keep : {Kept::integral, Kept::blocked_light})
        for (const double ratio : {0.5, 1.0, 1.7, 2.0, 4.0}) {
            ComposeParams params = voxel(kVoxel * ratio);
            params.keep = keep;
            const Placement p = turned(
                {1, 0, 0}, 0, Vec3d(0.5 * (ratio - 1) * kVoxel, 0, 0.5 * (ratio - 1) * kVoxel));
            for (const int strands : {1, 2}) {
                const Volume v =
                    composed({box}, std::vector<Placement>(std::size_t(strands), p), params);
                for (auto it = v.parts[0].own_share->cbeginValueOn(); it; ++it) {
                    // The ends are cut.
                    const double y = it.getCoord()[1] * ratio;
                    if (y > 2 * ratio && y < 32 - 3 * ratio) {
                        EXPECT_LE(*it, 1) << ratio << " " << it.getCoord();
                        EXPECT_GE(*it, 0.98 / strands) << ratio << " " << it.getCoord();
                        if (ratio <= 1) {
                            EXPECT_NEAR(*it, 1.0 / strands, 0.02) << ratio;
                        }
                    }
                }
            }
        }
}

TEST(PlacedBox, DividedVoxelsKeepTheIntegral)
{
    Box box{"block", 0, {}};
    box.volume.parts.push_back(emptyPart(0.5));
    Random random(3);
    double sum = 0;
    for (int k = 0; k < 20; ++k) {
        const float rho = float(random.uniform(1, 2));
        const Coord c(k % 3, k / 3 % 3, k / 9);
        box.volume.parts[0].density->tree().setValue(c, rho);
        sum += rho * 0.125;
    }
    const Placement p = turned({1, 2, 3}, 0.7, {0.1, 0.2, 0.3});
    const Volume v = composed({box}, {p}, voxel(0.016));
    double composed_sum = 0;
    for (auto it = v.parts[0].density->cbeginValueOn(); it; ++it)
        composed_sum += double(*it) * 0.016 * 0.016 * 0.016;
    EXPECT_NEAR(composed_sum / sum, 1, 1e-4);
}

TEST(PlacedBox, ABoxOfMoreThan32BitsOfVoxelsIsRefusedBeforeTheyAreMade)
{
    VolumePart part = emptyPart(0.5);
    part.density->tree().addTile(3, Coord(0, 0, 0), 1.0f, true); // 4096^3 voxels in one tile
    const std::string message = messageOf([&] { packPart(part, "sea"); });
    EXPECT_NE(message.find("box 'sea': expected at most 4294967040 voxels, found 68719476736"),
              std::string::npos)
        << message;
}

} // namespace
} // namespace volcomp
