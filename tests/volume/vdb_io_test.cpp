// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/vdb_io.h"

#include <cstdio>
#include <fstream>
#include <iterator>
#include <random>
#include <sstream>

#include <gtest/gtest.h>

#include "volcomp/base/error.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3SGrid;

class VdbIo : public testing::Test {
protected:
    static void SetUpTestSuite() { openvdb::initialize(); }

    fs::path path(const std::string& name) const { return m_folder / name; }

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

    void writeGrids(const fs::path& file, const openvdb::GridPtrVec& grids)
    {
        openvdb::io::File out(file.string());
        out.write(grids);
        out.close();
    }

private:
    TemporaryFolder m_folder;
};

TEST_F(VdbIo, OneMaterialHasThePlainNames)
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

/// The bytes that OpenVDB writes of a grid.
std::string bytesOf(const openvdb::GridBase& grid)
{
    std::ostringstream out;
    openvdb::io::setDataCompression(
        out, openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK);
    grid.writeTopology(out);
    grid.writeBuffers(out);
    return out.str();
}

TEST_F(VdbIo, PackedVoxelsAreTheBytesThatOpenVdbWrites)
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

TEST_F(VdbIo, PackedAndUnpackedIsTheSame)
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

TEST_F(VdbIo, SeveralMaterialsKeepTheirGridsAndSumForOthers)
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

TEST_F(VdbIo, OneValueEverywhereIsNoGrid)
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

TEST_F(VdbIo, DensityBeyondHalfFloatsIsKept)
{
    VolumePart p = part("fur", MaterialKind::fibre, 5);
    p.density->tree().setValue(Coord(0), 1e6f);
    writeVolume(path("a.vdb"), {{p}});
    EXPECT_FLOAT_EQ(readVolume(path("a.vdb")).parts[0].density->tree().getValue(Coord(0)), 1e6f);
}

TEST_F(VdbIo, ForeignFileWithALoneDensity)
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

TEST_F(VdbIo, ForeignNormalsAreNormalised)
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

TEST_F(VdbIo, EveryTruncationIsAnError)
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
    }
}

TEST_F(VdbIo, BadFilesAreNamed)
{
    EXPECT_NE(messageOf([&] { readVolume(path("none.vdb")); }).find("no file"), std::string::npos);
    std::ofstream(path("empty.vdb")).flush();
    EXPECT_NE(messageOf([&] { readVolume(path("empty.vdb")); }).find("empty"), std::string::npos);
    std::ofstream(path("text.vdb")) << "this is not a VDB file, however long it may be";
    EXPECT_NE(messageOf([&] { readVolume(path("text.vdb")); }).find("text.vdb"), std::string::npos);
    EXPECT_NE(messageOf([&] { readVolume(path("")); }).find("directory"), std::string::npos);
}

TEST_F(VdbIo, BadGridsAreNamed)
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
    }
}

TEST_F(VdbIo, NamesTheColourAsBlenderDoes)
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

// A level's file, read and written again, keeps the scatter ratios: as a grid, and as one value.
TEST_F(VdbIo, ScatterRatiosAreKept)
{
    Volume volume{{part("fur", MaterialKind::fibre, 1), part("leaf", MaterialKind::surface, 2)}};
    for (VolumePart& p : volume.parts) {
        p.scatter_ratio = p.colour->deepCopy();
        for (auto v = p.scatter_ratio->beginValueOn(); v; ++v)
            v.setValue(p.material == "fur" ? *v + openvdb::Vec3s(1) : openvdb::Vec3s(0.5f, 1, 2));
    }
    writeVolume(path("level.vdb"), volume);
    writeVolume(path("again.vdb"), readVolume(path("level.vdb")));
    for (const bool delayed : {false, true}) {
        const Volume back = readVolume(path("again.vdb"), delayed);
        for (std::size_t i = 0; i < 2; ++i) {
            ASSERT_TRUE(back.parts[i].scatter_ratio);
            for (auto v = volume.parts[i].scatter_ratio->cbeginValueOn(); v; ++v)
                ASSERT_LT(
                    (back.parts[i].scatter_ratio->tree().getValue(v.getCoord()) - *v).length(),
                    2e-3f);
        }
    }
}

// So are own shares. A file that says nonsense of one says 0 or 1.
TEST_F(VdbIo, OwnSharesAreKept)
{
    Volume volume{{part("fur", MaterialKind::fibre, 1), part("leaf", MaterialKind::surface, 2)}};
    for (VolumePart& p : volume.parts) {
        p.own_share = p.density->deepCopy();
        for (auto v = p.own_share->beginValueOn(); v; ++v)
            v.setValue(p.material == "fur" ? *v / 10 : 0.25f);
    }
    writeVolume(path("own.vdb"), volume);
    for (const bool delayed : {false, true}) {
        const Volume back = readVolume(path("own.vdb"), delayed);
        for (std::size_t i = 0; i < 2; ++i) {
            ASSERT_TRUE(back.parts[i].own_share);
            for (auto v = volume.parts[i].own_share->cbeginValueOn(); v; ++v)
                ASSERT_NEAR(back.parts[i].own_share->tree().getValue(v.getCoord()), *v, *v / 2048);
        }
    }
    auto wrong = volume.parts[0].own_share->beginValueOn();
    wrong.setValue(std::numeric_limits<float>::quiet_NaN());
    const Coord nan = wrong.getCoord();
    (++wrong).setValue(7);
    const Coord seven = wrong.getCoord();
    writeVolume(path("wrong.vdb"), volume);
    const Volume back = readVolume(path("wrong.vdb"));
    EXPECT_EQ(back.parts[0].own_share->tree().getValue(nan), 0);
    EXPECT_EQ(back.parts[0].own_share->tree().getValue(seven), 1);
}

// What 0.1.0 wrote under another name must not be taken for voxels without a scatter ratio.
TEST_F(VdbIo, ScatterRatiosOfAnOlderVersionAreAnError)
{
    VolumePart p = part("fur", MaterialKind::fibre, 1);
    p.scatter_ratio = p.colour->deepCopy();
    writeVolume(path("new.vdb"), {{p}});
    openvdb::io::File file(path("new.vdb").string());
    file.open();
    const openvdb::GridPtrVecPtr grids = file.getGrids();
    for (const openvdb::GridBase::Ptr& grid : *grids)
        if (grid->getName() == "scatter_ratio") grid->setName("shown");
    writeGrids(path("old.vdb"), *grids);
    const std::string message = messageOf([&] { readVolume(path("old.vdb")); });
    EXPECT_NE(message.find("what volcomp 0.1.0 had"), std::string::npos) << message;
}

// The file's UUID is no chance; it follows from the content.
TEST_F(VdbIo, AVolumeWrittenAgainHasTheSameBytes)
{
    const auto bytes = [&](const char* name) {
        std::ifstream in(path(name), std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(in), {});
    };
    const VolumePart p = part("fur", MaterialKind::fibre, 1);
    for (const char* name : {"a.vdb", "b.vdb"}) writeVolume(path(name), {{p}});
    EXPECT_EQ(bytes("a.vdb"), bytes("b.vdb"));
    EXPECT_EQ(volumeIdentifier(path("a.vdb")), volumeIdentifier(path("b.vdb")));
    // One value, or the metadata, is enough for another one.
    VolumePart other = p;
    other.density = p.density->deepCopy();
    auto first = other.density->beginValueOn();
    first.setValue(*first * 1.01f);
    writeVolume(path("c.vdb"), {{other}});
    openvdb::MetaMap meta;
    meta.insertMeta("note", openvdb::StringMetadata("x"));
    writeVolume(path("d.vdb"), {{p}}, meta);
    EXPECT_NE(volumeIdentifier(path("a.vdb")), volumeIdentifier(path("c.vdb")));
    EXPECT_NE(volumeIdentifier(path("a.vdb")), volumeIdentifier(path("d.vdb")));
    openvdb::io::File file(path("a.vdb").string());
    file.open();
    EXPECT_EQ(file.getUniqueTag().size(), 36u);
}

TEST_F(VdbIo, NothingIsLeftBehindByAFailure)
{
    EXPECT_THROW(writeVolume(path("a.vdb"), Volume{}), Error);
    EXPECT_TRUE(fs::is_empty(path("")));
}

} // namespace
} // namespace volcomp
