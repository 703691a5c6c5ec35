// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/tree/voxel_levels.h"

#include <cmath>

#include <gtest/gtest.h>

#include "volcomp/base/random.h"
#include "volcomp/render/render.h"
#include "volcomp/render/tree/voxel_tree_io.h"
#include "volcomp/volume/vdb_io.h"
#include "tests/support/temporary_folder.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

class StoredLevels : public testing::Test {
protected:
    void SetUp() override
    {
        openvdb::initialize();
        writeVolume(m_file, strands());
    }

    // Two materials that overlap, in 40 x 40 x 400 voxels that reach from the origin along z, in a
    // grid whose origin is not the world's.
    static Volume strands()
    {
        Volume volume;
        Random random(11);
        for (const MaterialKind kind : {MaterialKind::fibre, MaterialKind::surface}) {
            VolumePart& part = volume.parts.emplace_back();
            part.material = kind == MaterialKind::fibre ? "hair" : "leaf";
            part.kind = kind;
            part.density = openvdb::FloatGrid::create(0.0f);
            part.direction = openvdb::Vec3SGrid::create(Vec3f(0.0f));
            part.colour = openvdb::Vec3SGrid::create(Vec3f(0.0f));
            const auto transform = openvdb::math::Transform::createLinearTransform(0.02);
            transform->postTranslate(Vec3d(0.013, -0.4, 0));
            for (const openvdb::GridBase::Ptr& grid :
                 {openvdb::GridBase::Ptr(part.density), openvdb::GridBase::Ptr(part.direction),
                  openvdb::GridBase::Ptr(part.colour)})
                grid->setTransform(transform);
            for (int i = 0; i < 60000; ++i) {
                const auto at = [&](int size) { return int(random.uniform() * size) - 20; };
                const openvdb::Coord voxel(at(40), at(40), at(400));
                part.density->tree().setValue(voxel, float(20 * random.uniform()));
                const auto component = [&] { return float(random.uniform() - 0.5); };
                part.direction->tree().setValue(voxel,
                                                Vec3f(component(), component(), component()));
                const auto level = [&] { return float(random.uniform()); };
                part.colour->tree().setValue(voxel, Vec3f(level(), level(), level()));
            }
        }
        return volume;
    }

    // The nearest voxels are a few pixels wide; of the farthest a few fit into a pixel.
    static Camera camera()
    {
        Camera c;
        c.eye = {0.1, 0.2, -1};
        c.target = {0, -0.4, 4};
        c.field_of_view = 0.6;
        return c;
    }

    static RenderParams params()
    {
        RenderParams p;
        p.width = 40;
        p.height = 30;
        p.lod = true;
        p.cutoff = 0;
        return p;
    }

    const TemporaryFolder m_folder;
    const fs::path m_file = m_folder / "volume.vdb";
};

} // namespace

// The levels of a file are those that are made from the volume, to the precision of half floats.
TEST_F(StoredLevels, AreThoseThatAreMade)
{
    const std::vector<VoxelLevel> made = readVoxelLevels(m_file, camera(), params());
    writeVoxelLevels(m_file, params().tau);
    ASSERT_GE(storedLevels(m_file, params().tau), 5);
    const std::vector<VoxelLevel> stored = readVoxelLevels(m_file, camera(), params());
    ASSERT_GE(made.size(), 3u);
    ASSERT_EQ(stored.size(), made.size());
    for (std::size_t i = 0; i < made.size(); ++i) {
        const VoxelTree &a = *made[i].tree, &b = *stored[i].tree;
        EXPECT_NEAR(stored[i].start, made[i].start, 1e-9 * made[i].start);
        if (i + 1 < made.size()) {
            EXPECT_NEAR(stored[i].end, made[i].end, 1e-9 * made[i].end);
        }
        EXPECT_DOUBLE_EQ(b.voxelSize(), a.voxelSize());
        EXPECT_TRUE((b.origin() - a.origin()).length() < 1e-9) << b.origin() << a.origin();
        ASSERT_EQ(b.voxelCount(), a.voxelCount());
        ASSERT_EQ(b.bounds(), a.bounds());
        a.forEachCell([&](const openvdb::Coord& o, int leaf) {
            const int other = b.leafAt(o[0], o[1], o[2]);
            for (int n = 0; n < 512; ++n) {
                const float density = a.densities(leaf)[n];
                ASSERT_NEAR(b.densities(other)[n], density, 1e-3 * density);
                if (density == 0) continue;
                for (int k = 0; k < 3; ++k)
                    ASSERT_NEAR(b.scatterRatio(other, n)[k], a.scatterRatio(leaf, n)[k], 1e-3);
                VoxelContent contents[2];
                a.contents(leaf, n, [&](const VoxelContent& c) { contents[c.part] = c; });
                b.contents(other, n, [&](const VoxelContent& c) {
                    const VoxelContent& expected = contents[c.part];
                    ASSERT_NEAR(c.density, expected.density, 1e-3 * expected.density);
                    ASSERT_EQ(c.directed, expected.directed);
                    ASSERT_NEAR(c.spread_code, expected.spread_code, 1);
                    ASSERT_NEAR(std::abs(c.direction.dot(expected.direction)), 1, 2e-6);
                    for (int k = 0; k < 3; ++k) ASSERT_NEAR(c.colour[k], expected.colour[k], 3e-3);
                });
            }
        });
    }

    std::vector<Material> materials(2);
    materials[0].name = "hair";
    materials[1].name = "leaf";
    materials[1].kind = MaterialKind::surface;
    Light light;
    light.direction = Vec3d(0.3, -1, 0.5).unit();
    const Image expected = render(made, materials, camera(), {light}, params());
    const Image image = render(stored, materials, camera(), {light}, params());
    double difference = 0, mean = 0;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        difference +=
            std::pow(image.pixels[i] - expected.pixels[i], 2) / double(image.pixels.size());
        mean += expected.pixels[i] / double(image.pixels.size());
    }
    EXPECT_GT(mean, 0.05);
    EXPECT_LT(std::sqrt(difference), 1e-3 * mean);
}

// A level is read from its file, not made again: here the file holds something else.
TEST_F(StoredLevels, AreWhatIsRead)
{
    writeVoxelLevels(m_file, params().tau);
    Camera far = camera();
    far.eye = {0, 0, -20000};
    const fs::path coarsest = levelFile(m_file, storedLevels(m_file, params().tau));
    Volume other;
    other.parts.emplace_back().density = openvdb::FloatGrid::create(0.0f);
    other.parts[0].density->setTransform(openvdb::math::Transform::createLinearTransform(5));
    for (int i = 0; i < 23; ++i) other.parts[0].density->tree().setValue({i, 0, 0}, 1.0f);
    writeVolume(coarsest, other, readVolumeMetadata(coarsest));
    const std::vector<VoxelLevel> levels = readVoxelLevels(m_file, far, params());
    ASSERT_EQ(levels.size(), 1u);
    EXPECT_EQ(levels[0].tree->voxelCount(), 23u);
    RenderParams fine = params();
    fine.lod = false;
    EXPECT_DOUBLE_EQ(readVoxelLevels(m_file, far, fine).at(0).tree->voxelSize(), 0.02);
}

// Levels of another volume or another tau are not taken, nor are incomplete ones.
TEST_F(StoredLevels, OfSomethingElseAreNotRead)
{
    EXPECT_EQ(storedLevels(m_file, 1), 0);
    writeVoxelLevels(m_file, 1);
    const int count = storedLevels(m_file, 1);
    ASSERT_GE(count, 3);
    EXPECT_EQ(storedLevels(m_file, 1.01), 0);
    fs::rename(levelFile(m_file, 2), m_folder / "away");
    EXPECT_EQ(storedLevels(m_file, 1), 0);
    EXPECT_EQ(
        readVoxelLevels(m_file, camera(), params()).size(),
        voxelLevels(std::make_shared<const VoxelTree>(readVoxelTree(m_file)), camera(), params())
            .size());
    fs::rename(m_folder / "away", levelFile(m_file, 2));
    EXPECT_EQ(storedLevels(m_file, 1), count);
    fs::remove(levelFile(m_file, count));
    EXPECT_EQ(storedLevels(m_file, 1), 0);
    writeVoxelLevels(m_file, 1);
    EXPECT_EQ(storedLevels(m_file, 1), count);
    fs::resize_file(levelFile(m_file, 2), fs::file_size(levelFile(m_file, 2)) / 2);
    EXPECT_EQ(storedLevels(m_file, 1), 0);
    writeVoxelLevels(m_file, 1);
    EXPECT_EQ(storedLevels(m_file, 1), count);
    writeVolume(m_file, strands()); // the same bytes again
    EXPECT_EQ(storedLevels(m_file, 1), count);
    Volume other = strands();
    other.parts[0].density->tree().setValue(openvdb::Coord(0, 0, 0), 0.125f);
    writeVolume(m_file, other);
    EXPECT_EQ(storedLevels(m_file, 1), 0);
}

// Files of 0.1.0 have no number of their version, and call their scatter ratios `shown`. They are
// as if they were not there, and are written anew.
TEST_F(StoredLevels, OfAnOlderVersionAreNotRead)
{
    writeVoxelLevels(m_file, 1);
    const int count = storedLevels(m_file, 1);
    ASSERT_GE(count, 3);
    const fs::path file = levelFile(m_file, 1);
    openvdb::io::File in(file.string());
    in.open(false);
    const openvdb::GridPtrVecPtr grids = in.getGrids();
    openvdb::MetaMap meta(*in.getMetadata());
    in.close();
    EXPECT_EQ(meta.metaValue<std::int32_t>("volcomp_levels_version"), 2);
    meta.removeMeta("volcomp_levels_version");
    int renamed = 0;
    for (const openvdb::GridBase::Ptr& grid : *grids)
        if (std::string name = grid->getName(); name.rfind("scatter_ratio", 0) == 0) {
            grid->setName(name.replace(0, 13, "shown"));
            ++renamed;
        }
    EXPECT_EQ(renamed, 2);
    openvdb::io::File out(file.string());
    out.write(*grids, meta);
    out.close();

    EXPECT_EQ(storedLevels(m_file, 1), 0);
    const std::vector<VoxelLevel> levels = readVoxelLevels(m_file, camera(), params());
    ASSERT_GE(levels.size(), 2u);
    const VoxelTree& tree = *levels.back().tree; // made, as if there were no files
    double greatest = 0;
    tree.forEachCell([&](const openvdb::Coord&, int leaf) {
        for (int n = 0; n < 512; ++n)
            if (tree.densities(leaf)[n] > 0)
                greatest = std::max(greatest, std::abs(tree.scatterRatio(leaf, n)[1] - 1.0));
    });
    EXPECT_GT(greatest, 0.05);
    writeVoxelLevels(m_file, 1);
    EXPECT_EQ(storedLevels(m_file, 1), count);
}

TEST_F(StoredLevels, OfAnEmptyVolumeAreNone)
{
    Volume empty;
    empty.parts.emplace_back().density = openvdb::FloatGrid::create(0.0f);
    writeVolume(m_file, empty);
    writeVoxelLevels(m_file, 1);
    EXPECT_EQ(storedLevels(m_file, 1), 0);
    EXPECT_EQ(readVoxelLevels(m_file, camera(), params()).size(), 1u);
}

} // namespace volcomp
