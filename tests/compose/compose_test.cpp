// SPDX-License-Identifier: Apache-2.0
#include "volcomp/compose/compose.h"

#include <cmath>
#include <map>
#include <sstream>

#include <gtest/gtest.h>

#include "tests/support/boxes.h"
#include "tests/support/each_target.h"
#include "volcomp/base/principal_direction.h"
#include "volcomp/base/error.h"
#include "volcomp/base/parallel.h"

namespace volcomp {
namespace {

using openvdb::Coord;

double massOf(const VolumePart& part)
{
    double sum = 0;
    for (auto it = part.density->cbeginValueOn(); it; ++it) sum += *it;
    return sum * std::pow(part.density->voxelSize()[0], 3);
}

TEST(Compose, AnAlignedBoxIsCopiedExactly)
{
    const Box box = strands(16, 24, 12, 0.01, 1);
    const Volume v = composed({box}, {turned({0, 1, 0}, 0, {0.05, -0.11, 0.33})}, voxel(0.01));
    ASSERT_EQ(v.parts.size(), 1u);
    EXPECT_EQ(v.parts[0].density->activeVoxelCount(),
              box.volume.parts[0].density->activeVoxelCount());
    const auto& from = box.volume.parts[0];
    for (auto it = from.density->cbeginValueOn(); it; ++it) {
        const Coord c = it.getCoord().offsetBy(5, -11, 33);
        EXPECT_FLOAT_EQ(v.parts[0].density->tree().getValue(c), *it);
        const auto d = v.parts[0].direction->tree().getValue(c),
                   e = from.direction->tree().getValue(it.getCoord());
        EXPECT_GT(std::abs(d.dot(e)), 0.999f);
        EXPECT_LT(
            (v.parts[0].colour->tree().getValue(c) - from.colour->tree().getValue(it.getCoord()))
                .length(),
            1e-3f); // half floats
    }
}

TEST(Compose, AQuarterTurnAboutAnAxisIsExact)
{
    const Box box = strands(16, 24, 12, 0.01, 2);
    const auto& from = box.volume.parts[0];
    for (const Vec3d axis : {Vec3d(1, 0, 0), Vec3d(0, 1, 0), Vec3d(0, 0, 1)})
        for (int quarters = 1; quarters < 4; ++quarters) {
            const Placement p = turned(axis, quarters * kPi / 2, {1.23, 0, -4.56});
            const Volume v = composed({box}, {p}, voxel(0.01));
            ASSERT_EQ(v.parts[0].density->activeVoxelCount(), from.density->activeVoxelCount());
            for (auto it = from.density->cbeginValueOn(); it; ++it) {
                const Coord c = it.getCoord();
                const Vec3f q =
                    p.x_axis * float(c[0]) + p.y_axis * float(c[1]) + p.z_axis * float(c[2]);
                const Coord to(int(std::lround(q[0])) + 123, int(std::lround(q[1])),
                               int(std::lround(q[2])) - 456);
                EXPECT_FLOAT_EQ(v.parts[0].density->tree().getValue(to), *it);
                const auto e = from.direction->tree().getValue(c);
                const Vec3f expected = p.x_axis * e[0] + p.y_axis * e[1] + p.z_axis * e[2];
                EXPECT_GT(std::abs(v.parts[0].direction->tree().getValue(to).dot(expected)),
                          0.999f);
            }
        }
}

TEST(Compose, TheIntegralOfDensityIsKeptAtAnyVoxelSize)
{
    const Box box = strands(20, 30, 30, 0.01, 3);
    const double before = massOf(box.volume.parts[0]);
    for (const double ratio : {0.25, 0.4, 0.7, 1.0, 1.3, 2.0, 4.0, 50.0})
        for (int k = 0; k < 4; ++k) {
            Placement p = randomPlacement(hashKey(7, k), 1.0);
            const Volume v = composed({box}, {p}, voxel(0.01 * ratio));
            // Density is 1 / length: scaled by s, a box holds s^2 of its integral.
            const double expected = before * p.scale * p.scale;
            EXPECT_NEAR(massOf(v.parts[0]) / expected, 1, 2e-5)
                << "voxel " << ratio << " of the box's";
        }
}

TEST(Compose, EqualsABruteForceCompositeInDouble)
{
    // The reference computes each cube's overlap with every voxel in double, and the largest
    // eigenvector by Jacobi rotations.
    const double h = 0.013;
    std::vector<Box> boxes{strands(10, 14, 8, 0.01, 4), strands(8, 20, 6, 0.02, 5)};
    std::vector<Placement> placements;
    for (int k = 0; k < 12; ++k) {
        placements.push_back(randomPlacement(hashKey(11, k), 0.12));
        placements.back().box = k % 2;
    }
    struct Sum {
        double density = 0, weight = 0;
        SymmetricTensor tensor;
        Vec3d colour{0.0};
    };
    std::map<Coord, Sum> reference;
    for (const Placement& p : placements) {
        const VolumePart& part = boxes[p.box].volume.parts[0];
        const double source = part.density->voxelSize()[0], step = source * p.scale / h;
        const int n = step <= 1.5 ? 1 : int(std::ceil(step));
        const double width = step / n;
        for (auto it = part.density->cbeginValueOn(); it; ++it)
            for (int sub = 0; sub < n * n * n; ++sub) {
                const int index[3] = {sub / (n * n), sub / n % n, sub % n};
                Vec3d local;
                for (int i = 0; i < 3; ++i)
                    local[i] = it.getCoord()[i] + (index[i] + 0.5) / n - 0.5;
                const Vec3d world = p.position / h
                    + (Vec3d(p.x_axis) * local[0] + Vec3d(p.y_axis) * local[1]
                       + Vec3d(p.z_axis) * local[2])
                        * step;
                const auto d = Vec3d(part.direction->tree().getValue(it.getCoord()));
                const Vec3d t =
                    Vec3d(p.x_axis) * d[0] + Vec3d(p.y_axis) * d[1] + Vec3d(p.z_axis) * d[2];
                const auto c = Vec3d(part.colour->tree().getValue(it.getCoord()));
                for (int x = int(std::floor(world[0])) - 2; x <= world[0] + 2; ++x)
                    for (int y = int(std::floor(world[1])) - 2; y <= world[1] + 2; ++y)
                        for (int z = int(std::floor(world[2])) - 2; z <= world[2] + 2; ++z) {
                            double overlap = 1;
                            const int cell[3] = {x, y, z};
                            for (int i = 0; i < 3; ++i)
                                overlap *=
                                    std::max(0.0,
                                             std::min(cell[i] + 0.5, world[i] + width / 2)
                                                 - std::max(cell[i] - 0.5, world[i] - width / 2));
                            if (overlap <= 0) continue;
                            Sum& s = reference[Coord(x, y, z)];
                            const double rho = *it / double(p.scale) * overlap;
                            s.density += rho;
                            s.tensor.add(rho, t);
                            s.colour +=
                                Vec3d(c[0] * p.tint[0], c[1] * p.tint[1], c[2] * p.tint[2]) * rho;
                        }
            }
    }
    const Volume v = composed(boxes, placements, voxel(h));
    double total = 0, difference = 0, colours = 0, angles = 0;
    for (const auto& [c, s] : reference) {
        const double rho = v.parts[0].density->tree().getValue(c);
        total += s.density;
        difference += std::abs(rho - s.density);
        colours += s.density
            * (Vec3d(v.parts[0].colour->tree().getValue(c)) - s.colour / s.density).length();
        // A cube that hardly reaches a voxel may miss it where its position is rounded.
        if (rho == 0 && s.density < 1e-3) continue;
        const Principal expected = principalDirection(s.tensor);
        const Vec3d d(v.parts[0].direction->tree().getValue(c));
        EXPECT_NEAR(d.length(), 1 - expected.spread, 0.01) << c;
        // Where the two largest eigenvalues are close, a small difference turns the direction:
        // weigh by how clear it is.
        angles += s.density * (1 - expected.spread)
            * std::acos(std::min(1.0,
                                 std::abs(d.dot(expected.direction)) / std::max(1e-9, d.length())));
    }
    EXPECT_LT(difference / total, 1e-3); // positions are rounded to 1/4096 voxel
    EXPECT_LT(colours / total, 1e-3);
    EXPECT_LT(angles / total, 1e-3);
    double elsewhere = 0;
    for (auto it = v.parts[0].density->cbeginValueOn(); it; ++it)
        if (!reference.count(it.getCoord())) elsewhere += *it;
    EXPECT_LT(elsewhere / total, 1e-4);
}

TEST(Compose, TransmittanceThroughAScaledBoxIsTheOriginals)
{
    // A cube of constant density: optical depth across it is density * size, whatever the scale.
    Box box{"cube", 0, {}};
    box.volume.parts.push_back(fullPart(0.01));
    for (int x = 0; x < 20; ++x)
        for (int y = 0; y < 20; ++y)
            for (int z = 0; z < 20; ++z)
                set(box.volume.parts[0], Coord(x, y, z), 7, {0, 1, 0}, Vec3f(1.0f));
    for (const float scale : {0.5f, 1.0f, 1.7f, 3.0f}) {
        const Volume v = composed({box}, {turned({0, 1, 0}, 0, Vec3d(0.0), scale)}, voxel(0.01));
        const int middle = int(10 * scale);
        double depth = 0;
        for (int z = -5; z < 80; ++z)
            depth += v.parts[0].density->tree().getValue(Coord(middle, middle, z)) * 0.01;
        EXPECT_NEAR(depth, 7 * 0.2, 2e-3) << scale;
    }
}

std::string bytesOf(const Volume& v)
{
    std::stringstream s;
    for (const VolumePart& p : v.parts) {
        p.density->writeTopology(s);
        p.density->writeBuffers(s);
        if (p.direction) p.direction->writeBuffers(s);
        if (p.colour) p.colour->writeBuffers(s);
    }
    return s.str();
}

TEST(Compose, TheBytesAreTheSameForAnyNumberOfThreads)
{
    const std::vector<Box> boxes{strands(16, 30, 20, 0.01, 6)};
    std::vector<Placement> placements;
    placements.reserve(60);
    for (int k = 0; k < 60; ++k) placements.push_back(randomPlacement(hashKey(13, k), 0.5));
    std::string one, many;
    {
        const ThreadLimit limit(1);
        one = bytesOf(composed(boxes, placements, voxel(0.01)));
    }
    {
        const ThreadLimit limit(4);
        many = bytesOf(composed(boxes, placements, voxel(0.01)));
    }
    EXPECT_TRUE(one == many);
    EXPECT_GT(one.size(), 100000u);
}

TEST(Compose, TheBytesAreTheSameWithEveryInstructionSet)
{
    const std::vector<Box> boxes{strands(16, 30, 20, 0.01, 6)};
    std::vector<Placement> placements;
    for (int k = 0; k < 30; ++k) placements.push_back(randomPlacement(hashKey(15, k), 0.2));
    for (const double ratio : {0.4, 0.8, 1.0, 1.7, 3.0}) {
        std::string first;
        onEachTarget([&] {
            const std::string bytes = bytesOf(composed(boxes, placements, voxel(0.01 * ratio)));
            if (first.empty()) first = bytes;
            EXPECT_TRUE(bytes == first) << ratio;
        });
        EXPECT_GT(first.size(), 10000u);
    }
}

TEST(Compose, BlocksAreInTheOrderOfAnOpenvdbTree)
{
    // On both sides of the borders of the tree's nodes of 128^3 and 4096^3 voxels.
    const std::vector<Box> boxes{strands(16, 30, 20, 0.01, 6)};
    std::vector<Placement> placements;
    for (int k = 0; k < 54; ++k) {
        placements.push_back(randomPlacement(hashKey(17, k), 0.1));
        const int at[3] = {k % 3 - 1, k / 3 % 3 - 1, k / 9 % 3 - 1};
        for (int i = 0; i < 3; ++i)
            placements.back().position[i] += at[i] * (k < 27 ? 1.28 : 40.96);
    }
    const PackedVolume v = compose(boxes, placements, voxel(0.01));
    const std::vector<PackedBlock>& blocks = v.parts.at(0).blocks;
    EXPECT_GT(blocks.size(), 1000u);
    for (std::size_t i = 1; i < blocks.size(); ++i)
        ASSERT_TRUE(inTreeOrder(blocks[i - 1].origin, blocks[i].origin))
            << blocks[i - 1].origin << " " << blocks[i].origin;
}

TEST(Compose, FarFromTheOriginIsAsGoodAsAtIt)
{
    // A million voxels away a float holds no part of a voxel.
    const Box box = strands(16, 20, 10, 0.01, 9);
    Placement p = randomPlacement(5, 0.1), far = p;
    far.position += Vec3d(1e6, -1e6, 1e6) * 0.01;
    const Volume near_volume = composed({box}, {p}, voxel(0.01)),
                 far_volume = composed({box}, {far}, voxel(0.01));
    double difference = 0, total = 0;
    for (auto it = near_volume.parts[0].density->cbeginValueOn(); it; ++it) {
        total += *it;
        difference += std::abs(*it
                               - far_volume.parts[0].density->tree().getValue(
                                   it.getCoord().offsetBy(1000000, -1000000, 1000000)));
    }
    EXPECT_LT(difference / total, 1e-3);
}

TEST(Compose, ActiveTilesOfABoxCountAsVoxels)
{
    Box box{"tile", 0, {}};
    box.volume.parts.push_back(fullPart(0.1));
    box.volume.parts[0].density->tree().addTile(1, Coord(0, 0, 0), 2.0f, true);
    const Volume v = composed({box}, {Placement{}}, voxel(0.1));
    EXPECT_EQ(v.parts[0].density->activeVoxelCount(), 512u);
    EXPECT_FLOAT_EQ(v.parts[0].density->tree().getValue(Coord(7, 7, 7)), 2);
}

TEST(Compose, EmptyInputsGiveOneEmptyPart)
{
    const Volume v = composed({}, {}, voxel(0.1));
    ASSERT_EQ(v.parts.size(), 1u);
    EXPECT_TRUE(v.parts[0].density->empty());
    EXPECT_DOUBLE_EQ(v.voxelSize(), 0.1);
    Box hollow{"hollow", 0, {}};
    hollow.volume.parts.push_back(fullPart(0.1));
    EXPECT_TRUE(composed({hollow}, {Placement{}}, voxel(0.1)).parts[0].density->empty());
}

TEST(Compose, WrongInputIsRefused)
{
    const Box box = strands(8, 8, 3, 0.1, 1);
    Placement p;
    p.box = 1;
    EXPECT_THROW(composed({box}, {p}, voxel(0.1)), Error);
    p = {};
    p.scale = 0;
    EXPECT_THROW(composed({box}, {p}, voxel(0.1)), Error);
    p = {};
    p.position[1] = NAN;
    EXPECT_THROW(composed({box}, {p}, voxel(0.1)), Error);
    p.position[1] = 1e12;
    EXPECT_THROW(composed({box}, {p}, voxel(0.1)), Error);
    EXPECT_THROW(composed({box}, {Placement{}}, voxel(0)), Error);
    Box bad = strands(8, 8, 3, 0.1, 1);
    bad.volume.parts[0].density->tree().setValue(Coord(1, 1, 1), -1.0f);
    EXPECT_THROW(composed({bad}, {Placement{}}, voxel(0.1)), Error);
    bad.volume.parts[0].density->tree().setValue(Coord(1, 1, 1), NAN);
    EXPECT_THROW(composed({bad}, {Placement{}}, voxel(0.1)), Error);
}

TEST(Compose, ABoxSmallerThanAVoxelIsNotLost)
{
    const Box box = strands(16, 20, 10, 0.001, 10);
    const Volume v = composed({box}, {randomPlacement(17, 1.0)}, voxel(0.5));
    EXPECT_GE(v.parts[0].density->activeVoxelCount(), 1u);
    EXPECT_LE(v.parts[0].density->activeVoxelCount(), 27u);
    // Summed by eights again and again, it still stands where it stood, to a part of a voxel.
    const Placement p = randomPlacement(17, 1.0);
    const auto centroid = [&](double size) {
        const Volume w = composed({box}, {p}, voxel(size));
        Vec3d sum(0.0);
        double mass = 0;
        for (auto it = w.parts[0].density->cbeginValueOn(); it; ++it) {
            sum += it.getCoord().asVec3d() * (*it * size);
            mass += *it;
        }
        return sum / mass;
    };
    EXPECT_LT((centroid(0.5) - centroid(0.0005)).length(), 0.15);
}

} // namespace
} // namespace volcomp
