// SPDX-License-Identifier: Apache-2.0
// Boxes against exactly traced strands, and against what their rules say.
#include "volcomp/bake/bake.h"

#include <cmath>
#include <iostream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "tests/render/transmittance_study.h"
#include "tests/support/growth_rules.h"
#include "tests/support/message_of.h"

namespace volcomp {
namespace {

const std::vector<Material> kMaterials = [] {
    Material fur, leaf;
    fur.name = "fur";
    leaf.name = "leaf";
    leaf.kind = MaterialKind::surface;
    return std::vector<Material>{fur, leaf};
}();

GrowthLevel tuftLevel(double count)
{
    GrowthLevel l;
    l.name = "hair";
    l.parent = "ground";
    l.count = {count, count};
    l.spread = 0.010;
    l.length = 0.03;
    l.length_variation = 0.1;
    l.radius = 5e-5;
    l.taper = 0.8;
    l.segments = 10;
    l.angle = {0, 10 * kDegree};
    l.wander = 10 * kDegree;
    l.divergence_variation = 0.5;
    return l;
}

/// A rule in two variants of fur, and of leaves for levels that say so.
GrowthRule boxOf(std::vector<GrowthLevel> levels)
{
    GrowthRule rule = growthRule(std::move(levels), "box", "fur");
    rule.variants = 2;
    return rule;
}

/// A tree of 4 m with 3600 leaves; bark is a fibre, leaves are a surface.
GrowthRule tree()
{
    GrowthLevel trunk = tuftLevel(1), branch, leaf;
    trunk.name = "trunk";
    trunk.spread = 0;
    trunk.length = 4;
    trunk.radius = 0.12;
    branch.name = "branch";
    branch.parent = "trunk";
    branch.count = {12, 12};
    branch.start = 0.3;
    branch.angle = {50 * kDegree, 70 * kDegree};
    branch.length = 2;
    branch.length_tip = 0.4;
    branch.radius_ratio = 0.5;
    branch.depth = 3;
    branch.fork = {5, 5};
    branch.taper = 0.7;
    branch.wander = 20 * kDegree;
    branch.segments = 6;
    leaf.name = "leaf";
    leaf.parent = "branch";
    leaf.material = "leaf";
    leaf.outline = Outline::ovate;
    leaf.on_depth = {2, 3};
    leaf.count = {10, 10};
    leaf.length = 0.08;
    leaf.width_ratio = 0.6;
    leaf.angle = {30 * kDegree, 80 * kDegree};
    leaf.segments = 4;
    leaf.bend = 0.5;
    return boxOf({trunk, branch, leaf});
}

/// Returns the mean distance from a leaf's root to the nearest other root.
double leafSpacing(const std::vector<Segment>& leaves)
{
    std::vector<Vec3d> roots;
    for (std::size_t i = 0; i < leaves.size(); ++i)
        if (i == 0 || leaves[i].strand != leaves[i - 1].strand) roots.emplace_back(leaves[i].a);
    double sum = 0;
    for (std::size_t i = 0; i < roots.size(); ++i) {
        double nearest = 1e30;
        for (std::size_t k = 0; k < roots.size(); ++k)
            if (k != i) nearest = std::min(nearest, (roots[i] - roots[k]).lengthSqr());
        sum += std::sqrt(nearest);
    }
    return sum / double(roots.size());
}

std::uint64_t voxels(const Box& box)
{
    std::uint64_t sum = 0;
    for (const VolumePart& part : box.volume.parts) sum += part.density->activeVoxelCount();
    return sum;
}

std::string failureOf(const GrowthRule& rule, int variant = 0)
{
    return messageOf([&] { bake(rule, kMaterials, variant); });
}

// The mean of (baked - exact) transmittance over the picture, and the mean of its magnitude over
// blocks of a quarter of the picture's width: the table that docs/baking.md sums up. The limits
// hold for voxels of up to two spacings between strands.
TEST(BakeAccuracy, TransmittanceOfTheBoxIsThatOfTheExactStrands)
{
    GrowthLevel dense = tuftLevel(500), denser = tuftLevel(1500), combed = tuftLevel(250);
    combed.comb = 70 * kDegree;
    combed.angle = {0, 5 * kDegree};
    combed.clump = 0.3;
    combed.clumps = 6;
    const auto spacing = [](double count) { return 0.010 * std::sqrt(kPi / count); };
    struct Subject {
        const char* name;
        GrowthRule grown;
        double spacing;
        double limit; ///< of the mean over views, up to 2 spacings
    };
    GrowthRule plant = tree();
    const double leaf_spacing = leafSpacing(grow(plant, 0).at(1).segments);
    const std::vector<Subject> subjects{{"sparse tuft", boxOf({tuftLevel(60)}), spacing(60), 0.01},
                                        {"dense tuft", boxOf({dense}), spacing(500), 0.01},
                                        {"very dense tuft", boxOf({denser}), spacing(1500), 0.01},
                                        {"combed tuft", boxOf({combed}), spacing(250), 0.01},
                                        {"tree", plant, leaf_spacing, 0.015}};
    const std::vector<std::pair<const char*, Vec3d>> views{
        {"side", {1, 0, 0.05}}, {"oblique", {1, 1, 0.4}}, {"along", {0.02, -1, 0.01}}};
    std::cout << "| subject | voxel / spacing | view | exact T | fibre: mean error | in blocks | "
                 "isotropic: mean error | in blocks |\n|---|---|---|---|---|---|---|---|\n";
    for (Subject subject : subjects) {
        std::vector<Segment> all;
        for (const SkeletonPart& part : grow(subject.grown, 0))
            all.insert(all.end(), part.segments.begin(), part.segments.end());
        std::vector<StudyView> pictures;
        std::vector<std::vector<float>> exact;
        for (const auto& [name, direction] : views) {
            pictures.emplace_back(all, direction, 240);
            exact.push_back(exactTransmittance(all, pictures.back()));
        }
        for (double factor : {0.5, 1.0, 2.0, 4.0}) {
            subject.grown.voxel = factor * subject.spacing;
            const Box box = bake(subject.grown, kMaterials, 0);
            double sum = 0, blocks = 0;
            for (std::size_t v = 0; v < views.size(); ++v) {
                const double block = std::max(pictures[v].width, pictures[v].height) / 4;
                const StudyError fibre =
                    compare(exact[v], bakedTransmittance(box.volume, pictures[v], true),
                            pictures[v], block);
                const StudyError isotropic =
                    compare(exact[v], bakedTransmittance(box.volume, pictures[v], false),
                            pictures[v], block);
                std::cout << fmt::format(
                    "| {} | {:g} | {} | {:.2f} | {:+.3f} | {:.3f} | {:+.3f} | {:.3f} |\n",
                    subject.name, factor, views[v].first, fibre.exact, fibre.mean, fibre.local,
                    isotropic.mean, isotropic.local);
                sum += std::abs(fibre.mean) / double(views.size());
                blocks += fibre.local / double(views.size());
            }
            if (factor > 2) continue;
            EXPECT_LE(sum, subject.limit) << subject.name << " at " << factor << " spacings";
            EXPECT_LE(blocks, subject.limit + 0.01)
                << subject.name << " at " << factor << " spacings";
        }
    }
}

TEST(Bake, TotalCoverageIsThatOfAllStrands)
{
    GrowthRule p = boxOf({tuftLevel(60)});
    const double expected = [&] { // (pi/4) * the projected area of all cones
        double area = 0;
        for (const SkeletonPart& part : grow(p, 0))
            for (const Segment& s : part.segments)
                area += kPi / 4 * double(s.size_a + s.size_b) * (s.b - s.a).length();
        return area;
    }();
    // The hairs are up to a quarter of the last voxel in radius: they count for up to 4 % more, as
    // their voxels stand behind each other (leaf_filler.cpp). In the first, hairs that share a
    // voxel hide parts of each other.
    for (const double voxel : {0.004, 0.002, 0.001, 0.0005}) {
        p.voxel = voxel;
        const Box box = bake(p, kMaterials, 0);
        double area = 0;
        for (auto it = box.volume.parts[0].density->cbeginValueOn(); it; ++it)
            area -= std::expm1(-double(*it) * voxel) * voxel * voxel;
        EXPECT_NEAR(area / expected, 1, voxel > 0.003 ? 0.15 : 0.04) << voxel;
    }
}

TEST(BakeAccuracy, TransmittanceConvergesBelowTheRadius)
{
    GrowthLevel thick = tuftLevel(25);
    thick.radius = 0.0008;
    GrowthRule p = boxOf({thick});
    const std::vector<Segment> segments = grow(p, 0).at(0).segments;
    const StudyView view(segments, {1, 0.1, 0.3}, 300);
    const std::vector<float> exact = exactTransmittance(segments, view);
    for (const auto& [voxel, limit] : {std::pair(0.0016, 0.02),
                                       {0.0008, 0.02},
                                       {0.0004, 0.015},
                                       {0.0002, 0.01},
                                       {0.0001, 0.006}}) {
        p.voxel = voxel;
        const StudyError error =
            compare(exact, bakedTransmittance(bake(p, kMaterials, 0).volume, view, true), view,
                    view.width / 4);
        EXPECT_LT(std::abs(error.mean), limit)
            << voxel << " exact " << error.exact << " error " << error.mean;
    }
}

TEST(Bake, PartsCarryTheirMaterials)
{
    GrowthRule p = tree();
    p.voxel = 0.06;
    const Box box = bake(p, kMaterials, 1);
    ASSERT_EQ(box.volume.parts.size(), 2U);
    EXPECT_EQ(box.name, "box");
    EXPECT_EQ(box.variant, 1);
    EXPECT_EQ(box.volume.parts[0].material, "fur");
    EXPECT_EQ(box.volume.parts[1].material, "leaf");
    EXPECT_EQ(box.volume.parts[1].kind, MaterialKind::surface);
    for (const VolumePart& part : box.volume.parts) {
        EXPECT_NEAR(part.density->voxelSize()[0], 0.06, 1e-12);
        EXPECT_FALSE(part.colour) << "one colour needs no grid";
        EXPECT_EQ(part.uniform_colour, Vec3f(0.5f));
        EXPECT_EQ(part.direction->activeVoxelCount(), part.density->activeVoxelCount());
    }
    const openvdb::MetaMap meta = boxMetadata(p, 1);
    EXPECT_EQ(meta.metaValue<std::string>("volcomp_box"), "box");
    EXPECT_EQ(meta.metaValue<std::int32_t>("volcomp_variant"), 2);
}

TEST(Bake, ColoursRunFromRootToTip)
{
    GrowthLevel hair = tuftLevel(30);
    hair.colour_root = {0.1, 0.2, 0.3};
    hair.colour_tip = {0.9, 0.6, 0.5};
    hair.length_variation = hair.wander = 0;
    hair.angle = {0, 0};
    GrowthRule p = boxOf({hair});
    p.voxel = 0.001;
    const Box box = bake(p, kMaterials, 0);
    ASSERT_TRUE(box.volume.parts[0].colour);
    for (auto it = box.volume.parts[0].colour->cbeginValueOn(); it; ++it) {
        const double s = it.getCoord()[1] * 0.001 / 0.03;
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR((*it)[c],
                        hair.colour_root[c] + (hair.colour_tip[c] - hair.colour_root[c]) * s, 0.03);
    }
}

TEST(Bake, HairThinnerThanAVoxelLeavesNoHoles)
{
    GrowthLevel hair = tuftLevel(1);
    hair.spread = 0;
    hair.radius = 1e-6;
    hair.angle = {0.3, 0.3};
    GrowthRule p = boxOf({hair});
    p.voxel = 0.0005;
    const Box box = bake(p, kMaterials, 0);
    const auto density = box.volume.parts[0].density->getConstAccessor();
    std::vector<Segment> segments = grow(p, 0).at(0).segments;
    for (const Segment& s : segments)
        for (int k = 0; k <= 50; ++k) { // every voxel that holds more than a corner of it
            const Vec3d at = (Vec3d(s.a) + Vec3d(s.b - s.a) * (k / 50.0)) / p.voxel;
            const openvdb::Coord ijk = openvdb::Coord::round(at);
            const double corner = std::max(
                {std::abs(at[0] - ijk[0]), std::abs(at[1] - ijk[1]), std::abs(at[2] - ijk[2])});
            if (corner < 0.45) {
                EXPECT_GT(density.getValue(ijk), 0) << ijk;
            }
        }
}

TEST(Bake, OddShapesAreRight)
{
    const auto voxelsOf = [](auto change, double voxel) {
        GrowthLevel level = tuftLevel(5);
        change(level);
        GrowthRule p = boxOf({level});
        p.voxel = voxel;
        const Box box = bake(p, kMaterials, 0);
        for (const VolumePart& part : box.volume.parts)
            for (auto it = part.density->cbeginValueOn(); it; ++it)
                EXPECT_TRUE(std::isfinite(*it) && *it > 0);
        return voxels(box);
    };
    EXPECT_EQ(voxelsOf([](GrowthLevel& l) { l.count = {0, 0}; }, 0.01), 0U);
    EXPECT_EQ(voxelsOf([](GrowthLevel& l) { l.length = l.length_ratio = 0; }, 0), 0U);
    EXPECT_GT(voxelsOf([](GrowthLevel& l) { l.radius = 0.3; }, 0.02), 5000U)
        << "a radius larger than the length is a round body";
    EXPECT_GT(voxelsOf(
                  [](GrowthLevel& l) {
                      l.radius = 1e-8;
                      l.length = 1;
                  },
                  2e-5),
              0U)
        << "thin, but more than 1e-5 of a voxel";
    EXPECT_EQ(voxelsOf([](GrowthLevel& l) { l.radius = 1e-12; }, 0.001), 0U)
        << "less than can be seen";
    EXPECT_GT(voxelsOf(
                  [](GrowthLevel& l) {
                      l.curl_radius = 0.05;
                      l.curl_turns = 200;
                      l.bend = 50;
                  },
                  0.002),
              0U);
    EXPECT_GT(voxelsOf(
                  [](GrowthLevel& l) {
                      l.angle = {3, 3};
                  },
                  0.002),
              0U)
        << "the box grows below the ground as well";
    EXPECT_GT(voxelsOf([](GrowthLevel&) {}, 0.1), 0U) << "a voxel larger than the box";
}

TEST(Bake, NothingIsCutOff)
{
    GrowthLevel level = tuftLevel(3);
    level.angle = {kPi / 2, kPi / 2};
    level.length = 5;
    level.wander = 0;
    GrowthRule p = boxOf({level});
    p.voxel = 0.05;
    const Box box = bake(p, kMaterials, 0);
    Vec3d low(1e30), high(-1e30);
    const Skeleton skeleton = grow(p, 0);
    for (const Segment& s : skeleton.at(0).segments)
        for (const Vec3f& q : {s.a, s.b}) {
            low = openvdb::math::minComponent(low, Vec3d(q));
            high = openvdb::math::maxComponent(high, Vec3d(q));
        }
    const openvdb::CoordBBox bounds = box.volume.parts[0].density->evalActiveVoxelBoundingBox();
    for (int k = 0; k < 3; ++k) {
        EXPECT_LE(bounds.min()[k] * p.voxel, low[k] + 2 * p.voxel);
        EXPECT_GE(bounds.max()[k] * p.voxel, high[k] - 2 * p.voxel);
    }
}

TEST(Bake, WhatCannotBeBakedIsSaid)
{
    GrowthRule p = boxOf({tuftLevel(3)});
    p.material = "silk";
    EXPECT_NE(failureOf(p).find("the name of a material (fur, leaf), found 'silk'"),
              std::string::npos)
        << failureOf(p);
    p.material = "fur";
    EXPECT_NE(failureOf(p, 2).find("variant from 0 to 1"), std::string::npos) << failureOf(p, 2);
    p.voxel = 1e-9;
    EXPECT_NE(failureOf(p).find("at least 1.5e-05 m"), std::string::npos) << failureOf(p);
    p.voxel = 2e-5;
    p.levels[0].length = 1000;
    EXPECT_NE(failureOf(p).find("a larger voxel is needed"), std::string::npos) << failureOf(p);
}

TEST(Bake, SameVoxelsForAnyNumberOfThreads)
{
    GrowthRule p = tree();
    p.voxel = 0.05;
    const auto with = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        return bake(p, kMaterials, 0);
    };
    const Box one = with(1), four = with(4);
    for (std::size_t k = 0; k < 2; ++k) {
        ASSERT_EQ(one.volume.parts[k].density->activeVoxelCount(),
                  four.volume.parts[k].density->activeVoxelCount());
        for (auto it = one.volume.parts[k].density->cbeginValueOn(); it; ++it) {
            ASSERT_EQ(four.volume.parts[k].density->tree().getValue(it.getCoord()), *it);
            ASSERT_EQ(four.volume.parts[k].direction->tree().getValue(it.getCoord()),
                      one.volume.parts[k].direction->tree().getValue(it.getCoord()));
        }
    }
}

} // namespace
} // namespace volcomp
