#include "volcomp/volume/vdb_io.h"

#include <cstdio>
#include <fstream>
#include <random>
#include <sstream>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"
#include "volcomp/render/tree/voxel_tree.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3SGrid;

class VdbIo : public testing::Test {
protected:
    void SetUp() override
    {
        openvdb::initialize();
        m_dir = fs::path(testing::TempDir())
            / ("vdb_io_"
               + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
        fs::remove_all(m_dir);
        fs::create_directories(m_dir);
    }
    void TearDown() override { fs::remove_all(m_dir); }

    fs::path path(const std::string& name) const { return m_dir / name; }

    static VolumePart part(const std::string& material, MaterialKind kind, std::uint32_t seed)
    {
        std::mt19937 rng(seed);
        std::uniform_real_distribution<float> uniform(0.1f, 1.0f);
        VolumePart p;
        p.material = material;
        p.kind = kind;
        p.density = FloatGrid::create(0.0f);
        p.direction = Vec3SGrid::create(openvdb::Vec3s(0));
        p.colour = Vec3SGrid::create(openvdb::Vec3s(0));
        const auto transform = openvdb::math::Transform::createLinearTransform(0.25);
        for (openvdb::GridBase* g : {static_cast<openvdb::GridBase*>(p.density.get()),
                                     static_cast<openvdb::GridBase*>(p.direction.get()),
                                     static_cast<openvdb::GridBase*>(p.colour.get())})
            g->setTransform(transform);
        for (int i = 0; i < 300; ++i) {
            const Coord at(int(rng() % 40) - 20, int(rng() % 40) - 20, int(rng() % 40) - 20);
            p.density->tree().setValue(at, 10 * uniform(rng));
            p.direction->tree().setValue(
                at, openvdb::Vec3s(uniform(rng), uniform(rng), uniform(rng)).unit() * uniform(rng));
            p.colour->tree().setValue(at, {uniform(rng), uniform(rng), uniform(rng)});
        }
        return p;
    }

    static void expectSame(const VolumePart& a, const VolumePart& b)
    {
        EXPECT_EQ(a.material, b.material);
        EXPECT_EQ(a.kind, b.kind);
        ASSERT_EQ(a.density->activeVoxelCount(), b.density->activeVoxelCount());
        for (auto v = a.density->cbeginValueOn(); v; ++v) {
            const Coord at = v.getCoord();
            EXPECT_NEAR(*v, b.density->tree().getValue(at), *v / 2048);
            EXPECT_LT(
                (a.direction->tree().getValue(at) - b.direction->tree().getValue(at)).length(),
                1e-3);
            EXPECT_LT((a.colour->tree().getValue(at) - b.colour->tree().getValue(at)).length(),
                      1e-3);
        }
    }

    static std::string messageOf(const std::function<void()>& f)
    {
        try {
            f();
        } catch (const Error& e) {
            return e.what();
        }
        return "no error";
    }

    void writeGrids(const fs::path& file, const openvdb::GridPtrVec& grids)
    {
        openvdb::io::File out(file.string());
        out.write(grids);
        out.close();
    }

private:
    fs::path m_dir;
};

TEST_F(VdbIo, oneMaterialHasThePlainNames)
{
    const Volume volume{{part("fur", MaterialKind::fibre, 1)}};
    writeVolume(path("a.vdb"), volume);
    const Volume back = readVolume(path("a.vdb"));
    ASSERT_EQ(back.parts.size(), 1u);
    expectSame(volume.parts[0], back.parts[0]);
    EXPECT_DOUBLE_EQ(back.voxelSize(), 0.25);

    openvdb::io::File file(path("a.vdb").string());
    file.open();
    const auto tangent = file.readGrid("tangentu"), colour = file.readGrid("Cd"),
               density = file.readGrid("density");
    EXPECT_EQ(density->getGridClass(), openvdb::GRID_FOG_VOLUME);
    EXPECT_EQ(tangent->getVectorType(), openvdb::VEC_CONTRAVARIANT_RELATIVE);
    EXPECT_EQ(colour->getVectorType(), openvdb::VEC_INVARIANT);
    EXPECT_TRUE(density->saveFloatAsHalf());
}

/// What OpenVDB's own grids write.
std::string bytesOf(const openvdb::GridBase& grid)
{
    std::ostringstream out;
    openvdb::io::setDataCompression(
        out, openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    grid.writeTopology(out);
    grid.writeBuffers(out);
    return out.str();
}

TEST_F(VdbIo, packedVoxelsAreTheBytesThatOpenVdbWrites)
{
    VolumePart p = part("fur", MaterialKind::fibre, 7);
    p.density->tree().setValue(Coord(5000, -9000, 130), 3.0f); // other nodes of the tree
    p.density->tree().setValue(Coord(-5000, 20, 700), 4.0f);
    p.density->tree().setValue(Coord(-4999, 20, 1), 5.0f);
    for (openvdb::Vec3SGrid* g : {p.direction.get(), p.colour.get()})
        g->tree().topologyUnion(p.density->tree());
    writeVolume(path("a.vdb"), {{p}});
    std::ifstream in(path("a.vdb"), std::ios::binary);
    const std::string file((std::istreambuf_iterator<char>(in)), {});
    for (openvdb::GridBase* g : {static_cast<openvdb::GridBase*>(p.density.get()),
                                 static_cast<openvdb::GridBase*>(p.direction.get()),
                                 static_cast<openvdb::GridBase*>(p.colour.get())}) {
        g->setSaveFloatAsHalf(true);
        EXPECT_NE(file.find(bytesOf(*g)), std::string::npos);
    }
    openvdb::io::File opened(path("a.vdb").string());
    opened.open(false);
    const auto grid = opened.readGridMetadata("tangentu");
    EXPECT_EQ(grid->metaValue<openvdb::Int64>("file_voxel_count"),
              openvdb::Int64(p.density->activeVoxelCount()));
    const openvdb::CoordBBox box = p.density->evalActiveVoxelBoundingBox();
    EXPECT_EQ(grid->metaValue<openvdb::Vec3i>("file_bbox_min"), box.min().asVec3i());
    EXPECT_EQ(grid->metaValue<openvdb::Vec3i>("file_bbox_max"), box.max().asVec3i());
}

TEST_F(VdbIo, packedAndUnpackedIsTheSame)
{
    const Volume volume{
        {part("bark", MaterialKind::surface, 8), part("leaf", MaterialKind::surface, 9)}};
    const PackedVolume packed = pack(volume);
    EXPECT_EQ(packed.voxels(),
              volume.parts[0].density->activeVoxelCount()
                  + volume.parts[1].density->activeVoxelCount());
    const Volume back = unpack(packed);
    ASSERT_EQ(back.parts.size(), 2u);
    for (int i = 0; i < 2; ++i) {
        expectSame(volume.parts[i], back.parts[i]);
        for (auto v = volume.parts[i].density->cbeginValueOn(); v; ++v)
            EXPECT_EQ(back.parts[i].density->tree().getValue(v.getCoord()), *v);
    }
    EXPECT_DOUBLE_EQ(back.voxelSize(), 0.25);
}

TEST_F(VdbIo, severalMaterialsKeepTheirGridsAndSumForOthers)
{
    const Volume volume{
        {part("bark", MaterialKind::surface, 2), part("leaf", MaterialKind::surface, 3)}};
    writeVolume(path("a.vdb"), volume);
    const Volume back = readVolume(path("a.vdb"));
    ASSERT_EQ(back.parts.size(), 2u);
    expectSame(volume.parts[0], back.parts[0]);
    expectSame(volume.parts[1], back.parts[1]);

    openvdb::io::File file(path("a.vdb").string());
    file.open();
    const auto sum = openvdb::gridPtrCast<FloatGrid>(file.readGrid("density"));
    for (auto v = sum->cbeginValueOn(); v; ++v) {
        const float wanted = volume.parts[0].density->tree().getValue(v.getCoord())
            + volume.parts[1].density->tree().getValue(v.getCoord());
        EXPECT_NEAR(*v, wanted, wanted / 2000);
    }
}

TEST_F(VdbIo, oneValueEverywhereIsNoGrid)
{
    VolumePart p = part("fur", MaterialKind::fibre, 4);
    const openvdb::Vec3s up(0, 0.75f, 0);
    for (auto v = p.colour->beginValueOn(); v; ++v) v.setValue({0.5f, 0.25f, 0.125f});
    for (auto v = p.direction->beginValueOn(); v; ++v) v.setValue(up);
    writeVolume(path("a.vdb"), {{p}});
    openvdb::io::File file(path("a.vdb").string());
    file.open();
    EXPECT_TRUE(file.hasGrid("density"));
    EXPECT_FALSE(file.hasGrid("Cd"));
    EXPECT_FALSE(file.hasGrid("tangentu"));
    const Volume back = readVolume(path("a.vdb"));
    EXPECT_FALSE(back.parts[0].colour);
    EXPECT_EQ(back.parts[0].uniform_colour, Vec3f(0.5f, 0.25f, 0.125f));
    ASSERT_TRUE(back.parts[0].direction);
    for (auto v = p.density->cbeginValueOn(); v; ++v)
        EXPECT_EQ(back.parts[0].direction->tree().getValue(v.getCoord()), up);
}

TEST_F(VdbIo, densityBeyondHalfFloatsIsKept)
{
    VolumePart p = part("fur", MaterialKind::fibre, 5);
    p.density->tree().setValue(Coord(0), 1e6f);
    writeVolume(path("a.vdb"), {{p}});
    EXPECT_FLOAT_EQ(readVolume(path("a.vdb")).parts[0].density->tree().getValue(Coord(0)), 1e6f);
}

TEST_F(VdbIo, foreignFileWithALoneDensity)
{
    auto grid = FloatGrid::create(0.0f);
    grid->setName("density");
    grid->fill(openvdb::CoordBBox(Coord(0), Coord(31)), 2.0f); // tiles
    writeGrids(path("a.vdb"), {grid});
    const Volume back = readVolume(path("a.vdb"));
    ASSERT_EQ(back.parts.size(), 1u);
    EXPECT_FALSE(back.parts[0].direction);
    EXPECT_EQ(back.parts[0].material, "");
    EXPECT_EQ(back.parts[0].density->activeVoxelCount(), 32u * 32 * 32);
}

TEST_F(VdbIo, foreignNormalsAreNormalised)
{
    auto grid = FloatGrid::create(0.0f);
    grid->setName("density");
    auto normal = Vec3SGrid::create(openvdb::Vec3s(0));
    normal->setName("N");
    for (int i = 0; i < 3; ++i) grid->tree().setValue(Coord(i, 0, 0), 1);
    normal->tree().setValue(Coord(0), {3, 0, 0});
    normal->tree().setValue(Coord(1, 0, 0), {0, NAN, 0});
    writeGrids(path("a.vdb"), {grid, normal});
    const Volume back = readVolume(path("a.vdb"));
    EXPECT_EQ(back.parts[0].kind, MaterialKind::surface);
    EXPECT_EQ(back.parts[0].direction->tree().getValue(Coord(0)), openvdb::Vec3s(1, 0, 0));
    EXPECT_EQ(back.parts[0].direction->tree().getValue(Coord(1, 0, 0)), openvdb::Vec3s(0));
}

TEST_F(VdbIo, everyTruncationIsAnError)
{
    writeVolume(path("whole.vdb"), {{part("fur", MaterialKind::fibre, 6)}});
    const auto size = fs::file_size(path("whole.vdb"));
    for (int k = 0; k < 64; ++k) {
        const auto length = size * k / 64;
        fs::copy_file(path("whole.vdb"), path("cut.vdb"), fs::copy_options::overwrite_existing);
        fs::resize_file(path("cut.vdb"), length);
        const std::string message = messageOf([&] { readVolume(path("cut.vdb")); });
        EXPECT_NE(message.find("cut.vdb"), std::string::npos)
            << "cut at " << length << " of " << size << ": " << message;
        EXPECT_NE(messageOf([&] { readVoxelTree(path("cut.vdb")); }).find("cut.vdb"),
                  std::string::npos)
            << "cut at " << length << " of " << size;
    }
}

TEST_F(VdbIo, badFilesAreNamed)
{
    EXPECT_NE(messageOf([&] { readVolume(path("none.vdb")); }).find("no file"), std::string::npos);
    std::ofstream(path("empty.vdb")).flush();
    EXPECT_NE(messageOf([&] { readVolume(path("empty.vdb")); }).find("empty"), std::string::npos);
    std::ofstream(path("text.vdb")) << "this is not a VDB file, however long it may be";
    EXPECT_NE(messageOf([&] { readVolume(path("text.vdb")); }).find("text.vdb"), std::string::npos);
    EXPECT_NE(messageOf([&] { readVolume(path("")); }).find("directory"), std::string::npos);
}

TEST_F(VdbIo, badGridsAreNamed)
{
    auto vectors = Vec3SGrid::create(openvdb::Vec3s(0));
    vectors->setName("density");
    writeGrids(path("type.vdb"), {vectors});
    EXPECT_NE(messageOf([&] { readVolume(path("type.vdb")); }).find("type Tree_float"),
              std::string::npos);

    auto grid = FloatGrid::create(0.0f);
    grid->setName("fog");
    writeGrids(path("name.vdb"), {grid});
    EXPECT_NE(messageOf([&] { readVolume(path("name.vdb")); }).find("grids fog"),
              std::string::npos);

    for (const float bad : {-1.0f, NAN, INFINITY}) {
        auto density = FloatGrid::create(0.0f);
        density->setName("density");
        density->tree().setValue(Coord(1, 2, 3), 1.0f);
        density->tree().setValue(Coord(4, 5, 6), bad);
        writeGrids(path("bad.vdb"), {density});
        EXPECT_NE(messageOf([&] { readVolume(path("bad.vdb")); }).find("voxel (4, 5, 6)"),
                  std::string::npos)
            << bad;
        const std::string message = messageOf([&] { readVoxelTree(path("bad.vdb")); });
        EXPECT_NE(message.find("bad.vdb: grid 'density', voxel (4, 5, 6)"), std::string::npos)
            << message;
    }

    auto stretched = FloatGrid::create(0.0f);
    stretched->setName("density");
    stretched->setTransform(openvdb::math::Transform::createLinearTransform(
        openvdb::Mat4d(1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1)));
    writeGrids(path("stretched.vdb"), {stretched});
    EXPECT_NE(messageOf([&] { readVolume(path("stretched.vdb")); }).find("cubic voxels"),
              std::string::npos);
}

TEST_F(VdbIo, namesTheColourAsBlenderDoes)
{
    VolumePart bark = part("bark", MaterialKind::surface, 2),
               fur = part("fur", MaterialKind::fibre, 4);
    for (const bool several : {false, true}) {
        const Volume volume = several ? Volume{{bark, fur}} : Volume{{fur}};
        writeVolume(path("blender.vdb"), volume, {}, GridNames::blender);
        openvdb::io::File file(path("blender.vdb").string());
        file.open();
        EXPECT_TRUE(file.hasGrid(several ? "color_fur" : "color"));
        EXPECT_FALSE(file.hasGrid(several ? "Cd_fur" : "Cd"));
        writeVolume(path("houdini.vdb"), volume);
        const Volume a = readVolume(path("blender.vdb")), b = readVolume(path("houdini.vdb"));
        for (std::size_t p = 0; p < a.parts.size(); ++p) {
            ASSERT_TRUE(a.parts[p].colour);
            ASSERT_GT(a.parts[p].colour->activeVoxelCount(), 0u);
            for (auto v = b.parts[p].colour->cbeginValueOn(); v; ++v)
                ASSERT_EQ(a.parts[p].colour->tree().getValue(v.getCoord()), *v);
        }
    }
}

// Leaf by leaf from the file, the tree is the one that the whole volume makes.
TEST_F(VdbIo, treesAreReadAsVolumesAre)
{
    VolumePart leaf = part("leaf", MaterialKind::surface, 3),
               up = part("up", MaterialKind::fibre, 4);
    for (auto v = up.direction->beginValueOn(); v; ++v)
        v.setValue({0, 0.75f, 0});                                        // no grid in the file
    leaf.density->fill(openvdb::CoordBBox(Coord(128), Coord(159)), 2.0f); // tiles
    writeVolume(path("a.vdb"), {{part("bark", MaterialKind::surface, 2), leaf, up}});
    const VoxelTree expected(readVolume(path("a.vdb"))), tree = readVoxelTree(path("a.vdb"));
    ASSERT_EQ(tree.parts().size(), 3u);
    EXPECT_EQ(tree.parts()[1].material, expected.parts()[1].material);
    EXPECT_EQ(tree.voxelCount(), expected.voxelCount());
    ASSERT_EQ(tree.leafCount(), expected.leafCount());
    std::size_t compared = 0;
    for (std::size_t l = 0; l < tree.leafCount(); ++l)
        for (int n = 0; n < 512; ++n) {
            ASSERT_EQ(tree.densities(l)[n], expected.densities(l)[n]);
            if (!(tree.densities(l)[n] > 0)) continue;
            std::vector<VoxelContent> a, b;
            tree.contents(l, n, [&](const VoxelContent& c) { a.push_back(c); });
            expected.contents(l, n, [&](const VoxelContent& c) { b.push_back(c); });
            ASSERT_EQ(a.size(), b.size());
            for (std::size_t i = 0; i < a.size(); ++i, ++compared) {
                EXPECT_EQ(a[i].part, b[i].part);
                EXPECT_EQ(a[i].density, b[i].density);
                EXPECT_EQ(a[i].direction, b[i].direction);
                EXPECT_EQ(a[i].colour, b[i].colour);
            }
        }
    EXPECT_GT(compared, 1000u);
}

TEST_F(VdbIo, nothingIsLeftBehindByAFailure)
{
    EXPECT_THROW(writeVolume(path("a.vdb"), Volume{}), Error);
    EXPECT_TRUE(fs::is_empty(path("")));
}

} // namespace
} // namespace volcomp
