// SPDX-License-Identifier: Apache-2.0
// Damaged files: each is an Error or a volume, and nothing else.
#include "volcomp/volume/vdb_check.h"

#include <cstring>
#include <fstream>
#include <iterator>
#include <random>

#include <gtest/gtest.h>
#include <openvdb/io/Stream.h>

#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"
#include "volcomp/base/error.h"
#include "volcomp/render/tree/voxel_tree_io.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;
using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3SGrid;

class VdbCheckTest : public testing::Test {
protected:
    static void SetUpTestSuite() { openvdb::initialize(); }

    fs::path path(const std::string& name) const { return m_folder / name; }

    static std::string bytesOf(const fs::path& file)
    {
        std::ifstream in(file, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    static void write(const fs::path& file, const std::string& bytes)
    {
        std::ofstream(file, std::ios::binary) << bytes;
    }

    /// What another program may write: leaves, a tile and normals.
    openvdb::GridPtrVec foreignGrids() const
    {
        auto density = FloatGrid::create(0.0f);
        density->setName("density");
        auto normal = Vec3SGrid::create(openvdb::Vec3s(0));
        normal->setName("N");
        std::mt19937 rng(5);
        for (int i = 0; i < 40; ++i) {
            const Coord at(i % 5, i / 5 % 4, i / 20);
            density->tree().setValue(at, 1 + float(rng() % 1000) / 100);
            normal->tree().setValue(at, openvdb::Vec3s(1, float(i), 0));
        }
        density->fill(openvdb::CoordBBox(Coord(16), Coord(31)), 2.0f);
        return {density, normal};
    }
    fs::path foreignFile(const std::string& name, std::uint32_t compression) const
    {
        openvdb::io::File out(path(name).string());
        out.setCompression(compression);
        out.write(foreignGrids());
        out.close();
        return path(name);
    }
    fs::path ownFile(const std::string& name) const
    {
        Volume volume;
        for (const MaterialKind kind : {MaterialKind::fibre, MaterialKind::surface}) {
            VolumePart& part = volume.parts.emplace_back();
            part.material = kind == MaterialKind::fibre ? "fur" : "bark";
            part.kind = kind;
            const openvdb::GridPtrVec grids = foreignGrids();
            part.density = openvdb::gridPtrCast<FloatGrid>(grids[0]);
            part.direction = openvdb::gridPtrCast<Vec3SGrid>(grids[1]);
        }
        writeVolume(path(name), volume);
        return path(name);
    }

    /// Reads a file in all ways. Returns the first message.
    static std::string outcome(const fs::path& file)
    {
        std::string message;
        const auto attempt = [&](auto&& f) {
            try {
                f();
            } catch (const Error& e) {
                if (message.empty()) message = e.what();
            }
        };
        attempt([&] { pack(readVolume(file)); });
        attempt([&] { readVoxelTree(file); });
        return message;
    }

    /// The message about a file with `value` in place of the bytes at `at`.
    template <class T>
    std::string messageWith(const std::string& bytes, std::size_t at, T value) const
    {
        std::string damaged = bytes;
        std::memcpy(&damaged[at], &value, sizeof(T));
        write(path("damaged.vdb"), damaged);
        const std::string message = outcome(path("damaged.vdb"));
        EXPECT_NE(message.find("damaged.vdb"), std::string::npos) << message;
        return message;
    }

private:
    TemporaryFolder m_folder;
};

TEST_F(VdbCheckTest, GoodFilesPassInEveryForm)
{
    using namespace openvdb::io;
    std::vector<fs::path> files{ownFile("own.vdb")};
    for (const int compression :
         {int(COMPRESS_NONE), int(COMPRESS_ZIP), int(COMPRESS_ZIP | COMPRESS_ACTIVE_MASK),
          int(COMPRESS_ACTIVE_MASK), int(COMPRESS_BLOSC),
          int(COMPRESS_BLOSC | COMPRESS_ACTIVE_MASK)})
        files.push_back(
            foreignFile(std::to_string(compression) + ".vdb", std::uint32_t(compression)));
    { // without positions of grids
        std::ofstream out(path("stream.vdb"), std::ios::binary);
        openvdb::io::Stream(out).write(foreignGrids());
        files.push_back(path("stream.vdb"));
    }
    { // two grids that share a tree
        openvdb::GridPtrVec grids = foreignGrids();
        grids.push_back(grids[0]->copyGrid());
        grids.back()->setName("twin");
        openvdb::io::File out(path("instance.vdb").string());
        out.write(grids);
        files.push_back(path("instance.vdb"));
    }
    for (const fs::path& file : files) {
        const VdbCheck check(file);
        EXPECT_GE(check.grids().size(), 2u);
        for (const VdbGrid& grid : check.grids()) EXPECT_NO_THROW(check.checkGrid(grid.name));
        EXPECT_EQ(outcome(file), "");
    }
    EXPECT_EQ(readVolume(path("instance.vdb"), false, "twin").parts[0].density->activeVoxelCount(),
              40u + 16 * 16 * 16);
}

// Inactive values of two kinds, which OpenVDB stores with a mask of their own.
TEST_F(VdbCheckTest, InactiveValuesOfEveryKindPass)
{
    for (const bool half : {false, true})
        for (int kinds = 0; kinds < 5; ++kinds) {
            auto density = FloatGrid::create(0.0f);
            density->setName("density");
            density->setSaveFloatAsHalf(half);
            density->tree().setValue(Coord(0), 1.0f);
            for (int k = 0; k < kinds; ++k) density->tree().setValueOff(Coord(1, k, 0), float(k));
            if (kinds == 4) density->tree().setValueOff(Coord(1, 0, 0), -1.0f);
            openvdb::io::File out(path("kinds.vdb").string());
            out.write({density});
            out.close();
            EXPECT_EQ(outcome(path("kinds.vdb")), "") << kinds;
        }
}

// A length of 4 GB in metadata, in a file of 40 KB, must not be asked for.
TEST_F(VdbCheckTest, LengthsBeyondTheFileAreErrors)
{
    const std::string bytes = bytesOf(ownFile("own.vdb"));
    const std::size_t type = bytes.find("fog volume", bytes.find("density_fur"));
    ASSERT_NE(type, std::string::npos);
    EXPECT_NE(messageWith(bytes, type - 4, std::uint32_t(0xfffffff0)).find("4294967280"),
              std::string::npos);
    EXPECT_NE(messageWith(bytes, 57, std::uint32_t(0xffffffff)),
              ""); // count of the file's metadata
    const std::size_t name = bytes.find("Tree_float");
    EXPECT_NE(messageWith(bytes, name - 4, std::uint32_t(0x7fffffff)), "");
}

TEST_F(VdbCheckTest, MetadataOfAnotherSizeIsAnError)
{
    const std::string bytes = bytesOf(ownFile("own.vdb"));
    const std::size_t key = bytes.find("is_saved_as_half_float", bytes.find("density_fur"));
    const std::size_t length = bytes.find("bool", key) + 4;
    EXPECT_NE(messageWith(bytes, length, std::uint32_t(0)).find("bool"), std::string::npos);
    // Whether floats are half ones is said twice.
    EXPECT_NE(messageWith(bytes, length + 4, char(0)).find("half"), std::string::npos);
}

// OpenVDB 10.0 reads a chunk that is not compressed by its own length, into a buffer of another.
TEST_F(VdbCheckTest, ChunksOfAnotherLengthAreErrors)
{
    const fs::path file =
        foreignFile("zip.vdb", openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK);
    const std::string bytes = bytesOf(file);
    // The chunk of the last leaf of the last grid: 40 normals, of 12 bytes each.
    const std::size_t chunk = bytes.rfind("x\x9c") - 8;
    for (const std::int64_t length :
         {std::int64_t(-4096), std::int64_t(-1), std::int64_t(0), std::int64_t(1) << 40,
          std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()})
        EXPECT_NE(messageWith(bytes, chunk, length), "") << length;
    // What zlib itself finds; then the leaf is not freed as a place in the file.
    EXPECT_NE(messageWith(bytes, chunk + 12, std::int64_t(0x5555555555555555)), "");
}

// Blosc trusts the lengths in the head of its chunks.
TEST_F(VdbCheckTest, HeadsOfBloscAreChecked)
{
    if (!openvdb::io::Archive::hasBloscCompression()) GTEST_SKIP();
    const std::string bytes = bytesOf(foreignFile("blosc.vdb", openvdb::io::COMPRESS_BLOSC));
    // The last chunk: the 512 normals of a leaf.
    const std::uint32_t values = 512 * 12;
    const std::size_t head =
        bytes.rfind(std::string(reinterpret_cast<const char*>(&values), 4)) - 4 - 4;
    const std::size_t at = bytes.compare(head + 4, 4, bytes, head + 8, 4) == 0 ? head : head + 4;
    for (const int field : {4, 8, 12})
        for (const std::uint32_t value : {0u, 1u << 20, 0x7fffffffu, 0xffffffffu})
            EXPECT_NE(messageWith(bytes, at + field, value), "") << field << " " << value;
}

TEST_F(VdbCheckTest, GridsThatLieBeforeTheirNamesAreErrors)
{
    const std::string bytes = bytesOf(ownFile("own.vdb"));
    const std::size_t positions = bytes.find("Tree_float_5_4_3_HalfFloat") + 26 + 4;
    for (const int field : {0, 16})
        for (const std::int64_t to :
             {std::int64_t(-1), std::int64_t(0), std::int64_t(8), std::int64_t(1) << 40})
            EXPECT_NE(messageWith(bytes, positions + field, to), "") << field << " " << to;
}

// One to eight wrong bits, wrong words and cuts, anywhere: 11 of 512 such files made 0.1.0 crash.
TEST_F(VdbCheckTest, RandomDamageNeverCrashes)
{
    std::vector<std::string> files{bytesOf(ownFile("own.vdb"))};
    for (const auto compression : {openvdb::io::COMPRESS_ZIP | openvdb::io::COMPRESS_ACTIVE_MASK,
                                   openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK,
                                   openvdb::io::COMPRESS_ACTIVE_MASK + 0})
        files.push_back(bytesOf(foreignFile("foreign.vdb", std::uint32_t(compression))));
    std::mt19937 rng(1);
    int errors = 0;
    for (int k = 0; k < 400; ++k) {
        std::string bytes = files[k % files.size()];
        // Half of the places are in the head, which is a hundredth of the file.
        const std::size_t at = rng() % (rng() % 2 ? bytes.size() : 1500);
        const std::uint32_t words[] = {0,          1,          0x7fffffff,
                                       0x80000000, 0xffffffff, std::uint32_t(rng())};
        if (k % 3 == 0) bytes[at] = char(bytes[at] ^ 1 << rng() % 8);
        else if (k % 3 == 1)
            std::memcpy(&bytes[at], &words[rng() % 6], std::min<std::size_t>(4, bytes.size() - at));
        else bytes.resize(at);
        write(path("damaged.vdb"), bytes);
        const std::string message = outcome(path("damaged.vdb"));
        errors += !message.empty();
        if (!message.empty()) {
            EXPECT_NE(message.find("damaged.vdb"), std::string::npos) << message;
        }
    }
    EXPECT_GT(errors, 200);
}

// A tile of 4096^3 voxels is 13 bytes of a file.
TEST_F(VdbCheckTest, SolidVolumesBeyondReasonAreErrors)
{
    auto density = FloatGrid::create(0.0f);
    density->setName("density");
    density->tree().addTile(3, Coord(0), 1.0f, true);
    {
        openvdb::io::File one(path("one.vdb").string());
        one.write({density});
    }
    EXPECT_EQ(readVoxelTree(path("one.vdb")).voxelCount(), std::uint64_t(1) << 36);
    for (int i = 0; i < 2000; ++i) density->tree().addTile(3, Coord(4096 * i, 0, 0), 1.0f, true);
    openvdb::io::File out(path("solid.vdb").string());
    out.write({density});
    out.close();
    EXPECT_NE(messageOf([&] { readVoxelTree(path("solid.vdb")); }).find("solid cubes"),
              std::string::npos);
    EXPECT_NE(messageOf([&] { pack(readVolume(path("solid.vdb"))); }).find("2^27"),
              std::string::npos);
}

} // namespace
} // namespace volcomp
