#include "volcomp/render/tree/voxel_levels.h"

#include <algorithm>
#include <cmath>

#include "volcomp/base/error.h"
#include "volcomp/volume/packed_volume.h"
#include "volcomp/volume/vdb_io.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

constexpr double kVoxelsPerPixel = 1.5;    // at the distance where a level begins
constexpr std::uint64_t kFewestVoxels = 8; // of a level that has a coarser one
constexpr const char* kOf = "volcomp_levels_of";
constexpr const char* kTau = "volcomp_tau";
constexpr const char* kLast = "volcomp_levels_last";
constexpr const char* kVoxel = "volcomp_levels_voxel";
constexpr const char* kLow = "volcomp_levels_low";
constexpr const char* kHigh = "volcomp_levels_high";

struct Range {
    int level;
    double start, end;
};

// The levels between which a pixel's width changes on its way through the box, axes and units of
// which are those of `eye`; as if there were endless levels.
std::vector<Range> rangesOf(const Vec3d& eye, const Vec3d& low, const Vec3d& high, double voxel,
                            const Camera& camera, const RenderParams& params)
{
    double nearest = 0, farthest = 0;
    for (int a = 0; a < 3; ++a) {
        const double below = low[a] - eye[a], above = high[a] - eye[a];
        const double outside = std::max({below, -above, 0.0}),
                     most = std::max(std::abs(below), std::abs(above));
        nearest += outside * outside;
        farthest += most * most;
    }
    nearest = std::sqrt(nearest);
    farthest = std::sqrt(farthest);
    const bool perspective = camera.projection == Projection::perspective;
    const double pixel = perspective ? 2 * std::tan(camera.field_of_view / 2) / params.width
                                     : camera.width / params.width;
    constexpr double kEndless = std::numeric_limits<double>::infinity();
    std::vector<Range> ranges;
    double start = 0;
    int level = 0;
    for (;; ++level) {
        const double width =
            voxel * std::ldexp(kVoxelsPerPixel, level + 1); // of a pixel, for the next level
        const double next = perspective ? width / pixel : width <= pixel ? 0 : kEndless;
        if (!(next <= farthest)) break;
        if (next <= nearest || next <= start) continue;
        ranges.push_back({level, start, next});
        start = next;
    }
    ranges.push_back({level, start, kEndless});
    return ranges;
}

// Levels one after another, each made of the one before.
class Maker {
public:
    Maker(std::shared_ptr<const VoxelTree> finest, double tau)
        : m_tree(std::move(finest)), m_tau(tau)
    {
    }

    bool hasNext() const { return !m_tree->empty() && m_tree->voxelCount() > kFewestVoxels; }
    void next()
    {
        m_tree = std::make_shared<const VoxelTree>(VoxelTree::coarser(*m_tree, m_tau));
        ++m_level;
    }
    int level() const { return m_level; }
    const std::shared_ptr<const VoxelTree>& tree() const { return m_tree; }

private:
    std::shared_ptr<const VoxelTree> m_tree;
    double m_tau;
    int m_level = 0;
};

// A tree for each range; treeAt() gives the coarsest where there is none so coarse, always the
// same.
template <class F>
std::vector<VoxelLevel> levelsFor(const std::vector<Range>& ranges, F&& treeAt)
{
    std::vector<VoxelLevel> levels;
    for (const Range& r : ranges) {
        std::shared_ptr<const VoxelTree> tree = treeAt(r.level);
        if (!levels.empty() && levels.back().tree == tree) levels.back().end = r.end;
        else levels.push_back({std::move(tree), r.start, r.end});
    }
    return levels;
}

// Corners of the leaves in world units, along the axes of the grid.
Vec3d lowCorner(const VoxelTree& tree) { return tree.bounds().min().asVec3d() * tree.voxelSize(); }
Vec3d highCorner(const VoxelTree& tree)
{
    return (tree.bounds().max().asVec3d() + Vec3d(1.0)) * tree.voxelSize();
}

// What the files of levels say of the volume that they were made from.
struct Stored {
    int count = 0; // of levels
    double voxel = 0;
    Vec3d low{0.0}, high{0.0};
};

Stored stored(const fs::path& volume, double tau)
{
    Stored s;
    std::error_code code;
    std::string of;
    for (int n = 1; fs::is_regular_file(levelFile(volume, n), code); ++n) {
        openvdb::MetaMap meta;
        try {
            meta = readVolumeMetadata(levelFile(volume, n));
        } catch (const Error&) { // damaged: as good as missing
            break;
        }
        const auto is = [&](const char* key, const auto& value) {
            const auto found =
                meta.getMetadata<openvdb::TypedMetadata<std::decay_t<decltype(value)>>>(key);
            return found && found->value() == value;
        };
        if (of.empty()) of = volumeIdentifier(volume);
        if (!is(kOf, of) || !is(kTau, tau)) break;
        if (!is(kLast, true)) continue;
        const auto voxel = meta.getMetadata<openvdb::DoubleMetadata>(kVoxel);
        const auto low = meta.getMetadata<openvdb::Vec3DMetadata>(kLow),
                   high = meta.getMetadata<openvdb::Vec3DMetadata>(kHigh);
        if (voxel && low && high) s = {n, voxel->value(), low->value(), high->value()};
        break;
    }
    return s;
}

PackedVolume packed(const VoxelTree& tree)
{
    PackedVolume volume;
    volume.transform = openvdb::math::Transform::createLinearTransform(tree.voxelSize());
    volume.transform->postTranslate(tree.origin() + Vec3d(tree.voxelSize() / 2));
    for (const VoxelTree::Part& p : tree.parts()) {
        PackedPart& part = volume.parts.emplace_back();
        part.material = p.material;
        part.kind = p.kind;
        part.has_direction = part.has_colour = part.has_scatter_ratio = true;
        part.stores.emplace_back();
    }
    struct Place {
        openvdb::Coord origin;
        int leaf;
    };
    std::vector<Place> places;
    tree.forEachCell([&](const openvdb::Coord& origin, int leaf) {
        places.push_back({origin, leaf});
    });
    std::sort(places.begin(), places.end(),
              [](const Place& a, const Place& b) { return inTreeOrder(a.origin, b.origin); });
    struct Voxel {
        int n;
        float density;
        Half3 direction, colour, scatter_ratio;
    };
    const auto halves = [](const Vec3d& v) {
        using openvdb::math::half;
        return Half3{half(float(v[0])), half(float(v[1])), half(float(v[2]))};
    };
    std::vector<std::vector<Voxel>> voxels(tree.parts().size());
    for (const Place& place : places) {
        const VoxelTree::Leaf& leaf = tree.leaf(place.leaf);
        for (int n = 0; n < 512; ++n) {
            if (!(leaf.mask[n >> 6] >> (n & 63) & 1)) continue;
            const VoxelTree::ScatterRatio s = tree.scatterRatio(place.leaf, n);
            tree.contents(place.leaf, n, [&](const VoxelContent& c) {
                const Vec3d direction = c.directed
                    ? c.direction * (1 - VoxelTree::spreadOf(c.spread_code))
                    : Vec3d(0.0);
                voxels[c.part].push_back({n, c.density, halves(direction), halves(c.colour),
                                          halves(Vec3d(s[0], s[1], s[2]))});
            });
        }
        for (std::size_t p = 0; p < voxels.size(); ++p) {
            if (voxels[p].empty()) continue;
            PackedPart& part = volume.parts[p];
            PackedBlock block{place.origin, std::uint32_t(voxels[p].size()), {}, nullptr};
            block.values =
                part.stores[0].allocate(block.count * PackedPart::voxelBytes(true, true, true));
            for (std::size_t i = 0; i < voxels[p].size(); ++i) {
                const Voxel& v = voxels[p][i];
                block.mask[v.n >> 6] |= std::uint64_t(1) << (v.n & 63);
                part.density(block)[i] = v.density;
                part.direction(block)[i] = v.direction;
                part.colour(block)[i] = v.colour;
                part.scatterRatio(block)[i] = v.scatter_ratio;
            }
            part.blocks.push_back(block);
            voxels[p].clear();
        }
    }
    return volume;
}

} // namespace

std::vector<VoxelLevel> voxelLevels(std::shared_ptr<const VoxelTree> finest, const Camera& camera,
                                    const RenderParams& params)
{
    if (!params.lod || finest->empty()) return {{std::move(finest)}};
    const Vec3d eye = finest->toCorner(camera.eye) * finest->voxelSize();
    const std::vector<Range> ranges =
        rangesOf(eye, lowCorner(*finest), highCorner(*finest), finest->voxelSize(), camera, params);
    Maker maker(std::move(finest), params.tau);
    return levelsFor(ranges, [&](int level) {
        while (maker.level() < level && maker.hasNext()) maker.next();
        return maker.tree();
    });
}

std::vector<VoxelLevel> readVoxelLevels(const fs::path& volume, const Camera& camera,
                                        const RenderParams& params, const Progress& progress)
{
    const Stored s = params.lod ? stored(volume, params.tau) : Stored();
    if (s.count == 0)
        return voxelLevels(std::make_shared<const VoxelTree>(readVoxelTree(volume, progress)),
                           camera, params);
    int last = -1;
    std::shared_ptr<const VoxelTree> tree;
    return levelsFor(rangesOf(camera.eye, s.low, s.high, s.voxel, camera, params), [&](int level) {
        level = std::min(level, s.count);
        if (level == last) return tree;
        const Progress next = last < 0 ? progress : Progress(); // the finest takes longest by far
        last = level;
        return tree = std::make_shared<const VoxelTree>(
                   readVoxelTree(level == 0 ? volume : levelFile(volume, level), next));
    });
}

int storedLevels(const fs::path& volume, double tau) { return stored(volume, tau).count; }

fs::path levelFile(const fs::path& volume, int n)
{
    fs::path file = volume;
    return file.replace_extension(".level" + std::to_string(n) + ".vdb");
}

void writeVoxelLevels(const fs::path& volume, double tau, const Progress& progress)
{
    openvdb::MetaMap meta;
    meta.insertMeta(kOf, openvdb::StringMetadata(volumeIdentifier(volume)));
    meta.insertMeta(kTau, openvdb::DoubleMetadata(tau));
    Maker maker(std::make_shared<const VoxelTree>(
                    readVoxelTree(volume, [&](double done) { report(progress, 0.4 * done); })),
                tau);
    const VoxelTree& finest = *maker.tree();
    meta.insertMeta(kVoxel, openvdb::DoubleMetadata(finest.voxelSize()));
    meta.insertMeta(kLow, openvdb::Vec3DMetadata(finest.origin() + lowCorner(finest)));
    meta.insertMeta(kHigh, openvdb::Vec3DMetadata(finest.origin() + highCorner(finest)));
    double done = 0.4;
    while (maker.hasNext()) {
        maker.next();
        if (maker.tree()->voxelCount() >> 28)
            throw fileError(volume, "", "less than 2^28 voxels in each level to write",
                            std::to_string(maker.tree()->voxelCount()),
                            "Render without files of levels.");
        meta.insertMeta(kLast, openvdb::BoolMetadata(!maker.hasNext()));
        writeVolume(levelFile(volume, maker.level()), packed(*maker.tree()), meta);
        report(progress, done += (1 - done) * 0.7);
    }
}

} // namespace volcomp
