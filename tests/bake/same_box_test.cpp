// SPDX-License-Identifier: Apache-2.0
// MODEL section 6: the same seed gives the same box on every machine.
#include <cstring>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/growth_rules.h"
#include "tests/support/temporary_folder.h"
#include "tools/shared/process.h"
#include "volcomp/bake/bake.h"
#include "volcomp/base/hash.h"

namespace volcomp {
namespace {

template <class T>
void add(std::uint64_t& hash, const T& value)
{
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    hash = fnv1a({bytes, sizeof value}, hash);
}

template <class Grid>
void addVoxels(std::uint64_t& hash, const Grid& grid)
{
    for (auto it = grid.cbeginValueOn(); it; ++it) {
        add(hash, it.getCoord());
        add(hash, *it);
    }
}

std::uint64_t hashOf(const Skeleton& skeleton)
{
    static_assert(sizeof(Segment) == 72, "without padding");
    std::uint64_t hash = fnv1a("");
    for (const SkeletonPart& part : skeleton)
        for (const Segment& s : part.segments) add(hash, s);
    return hash;
}

std::uint64_t hashOf(const Box& box)
{
    std::uint64_t hash = fnv1a("");
    for (const VolumePart& part : box.volume.parts) {
        addVoxels(hash, *part.density);
        addVoxels(hash, *part.direction);
        if (part.colour) addVoxels(hash, *part.colour);
    }
    return hash;
}

/// Hairs with everything that bends a strand, thin and thick, and leaves of every outline on them.
GrowthRule everything()
{
    GrowthLevel hair;
    hair.name = "hair";
    hair.parent = "ground";
    hair.material = "fibre";
    hair.count = {60, 60};
    hair.spread = 0.3;
    hair.length = 1;
    hair.length_variation = hair.colour_variation = hair.bend_variation = 0.2;
    hair.radius = 0.03;
    hair.taper = 0.95;
    hair.segments = 7;
    hair.angle = {0, 0.5};
    hair.wander = hair.bend = hair.comb = hair.twist = hair.gravity = hair.light = 0.3;
    hair.curl_radius = 0.05;
    hair.frizz = 0.05;
    hair.clump = 0.5;
    hair.clumps = 5;
    hair.depth = 2;
    hair.colour_tip = {0.9, 0.4, 0.1};
    std::vector<GrowthLevel> levels{hair};
    for (const Outline outline :
         {Outline::blade, Outline::ellipse, Outline::ovate, Outline::obovate}) {
        GrowthLevel leaf;
        leaf.name = "leaf" + std::to_string(levels.size());
        leaf.parent = "hair";
        leaf.material = "leaf";
        leaf.outline = outline;
        leaf.count = {1, 3};
        leaf.length = 0.3;
        leaf.angle = {0.3, 1.2};
        leaf.facing = 0.5;
        levels.push_back(leaf);
    }
    GrowthRule rule = growthRule(levels, "everything", "fibre");
    rule.voxel = 0.02;
    return rule;
}

std::vector<Material> materials()
{
    std::vector<Material> result(2);
    result[0].name = "fibre";
    result[1].name = "leaf";
    result[1].kind = MaterialKind::surface;
    return result;
}

} // namespace

// The numbers were found on one machine and hold for all. They change with every change of growing
// or baking that changes boxes; then they are set anew, and CHANGELOG.md says so.
TEST(SameBox, HasTheBytesOfEveryOtherMachine)
{
    EXPECT_EQ(hashOf(grow(everything(), 0)), 7909218209216624644ULL);
    EXPECT_EQ(hashOf(bake(everything(), materials(), 0)), 4814503117275696240ULL);
}

// glibc chooses its sin, exp and others by the processor. GLIBC_TUNABLES makes it take those for a
// processor without FMA.
TEST(SameBox, DoesNotDependOnTheProcessor)
{
#if defined(__x86_64__)
    if (!__builtin_cpu_supports("fma")) GTEST_SKIP() << "this processor has no FMA";
#else
    GTEST_SKIP() << "only for x86-64";
#endif
    const TemporaryFolder folder;
    for (const char* name : {"hair", "clover", "dead_tree"}) {
        const std::string scene =
            std::string(VOLCOMP_SOURCE "/scenes/primitives/") + name + ".toml";
        for (const auto& [environment, directory] :
             {std::pair<std::string, std::string>{"GLIBC_TUNABLES=", "with"},
              {"GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-AVX2_Usable,-FMA_Usable", "without"}}) {
            const ProcessResult result =
                runProcess({"env", environment, VOLCOMP_BIN "/volcomp-bake", scene, "-o",
                            (folder / directory).string(), "--quiet"});
            ASSERT_EQ(result.status, 0) << result.output;
        }
        const std::string file = std::string("/") + name + "_1.vdb";
        const std::string with = folder.read("with" + file),
                          without = folder.read("without" + file);
        ASSERT_GT(with.size(), 10000U);
        // A VDB file starts with 21 bytes of header and 36 of an identifier.
        EXPECT_TRUE(with.substr(57) == without.substr(57)) << name;
    }
}

} // namespace volcomp
