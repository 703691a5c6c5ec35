// SPDX-License-Identifier: Apache-2.0
#include "volcomp/volume/cubic_voxels.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <vector>

#include <fmt/format.h>
#include <openvdb/tree/ValueAccessor.h>
#include <tbb/parallel_for.h>

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

using openvdb::Coord;
using openvdb::FloatGrid;
using openvdb::Vec3d;
using openvdb::Vec3SGrid;
using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using VectorLeaf = openvdb::Vec3STree::LeafNodeType;

constexpr double kMostVoxels = 2147483648.0;
constexpr double kMostLeaves = 2 * kMostVoxels / FloatLeaf::SIZE; // that are looked into
constexpr double kLeastWeight = 1e-9;                             // of a voxel: less is rounding

/// The affine map from indices of the new voxels to those of the old ones.
struct IndexMap {
    Vec3d origin; ///< of index (0,0,0)
    Vec3d axes[3];

    Vec3d at(const Coord& c) const
    {
        return origin + axes[0] * c.x() + axes[1] * c.y() + axes[2] * c.z();
    }
};

double shortestEdge(const openvdb::math::Transform& t)
{
    const Vec3d edges = t.voxelSize();
    return std::min({edges[0], edges[1], edges[2]});
}

void checkSize(double voxels, double edge)
{
    if (!(voxels < kMostVoxels))
        throw Error(
            fmt::format("in cubes of the shortest edge of its voxels, {:g}, the volume has {:.0g} "
                        "voxels, more than 2^31; resample it in the program that made it",
                        edge, voxels));
}

/// Finds the new leaves that old voxels reach.
class LeafFinder {
public:
    LeafFinder(const openvdb::math::Transform& from, const openvdb::math::Transform& to)
        : m_from(from), m_to(to)
    {
    }

    std::vector<Coord> find(const FloatGrid& density)
    {
        for (auto leaf = density.tree().cbeginLeaf(); leaf; ++leaf)
            if (leaf->onVoxelCount() > 0) add(leaf->getNodeBoundingBox());
        auto tile = density.cbeginValueOn();
        tile.setMaxDepth(FloatGrid::ValueOnCIter::LEAF_DEPTH - 1);
        for (; tile; ++tile) {
            openvdb::CoordBBox box;
            tile.getBoundingBox(box);
            add(box);
        }
        return {m_leaves.begin(), m_leaves.end()};
    }

private:
    void add(const openvdb::CoordBBox& box)
    {
        const Vec3d around(1.0);
        const openvdb::BBoxd reach = m_to.worldToIndex(m_from.indexToWorld(
            openvdb::BBoxd(box.min().asVec3d() - around, box.max().asVec3d() + around)));
        for (const Vec3d& end : {reach.min(), reach.max()})
            for (int a = 0; a < 3; ++a)
                if (!(std::abs(end[a]) < 1e9))
                    throw Error("the volume reaches beyond 1e9 voxels from its origin");
        const Coord low = Coord::floor(reach.min()) & ~7, high = Coord::ceil(reach.max());
        const Vec3d leaves = (high - low).asVec3d() / 8 + Vec3d(1.0);
        m_visited += leaves[0] * leaves[1] * leaves[2];
        if (m_visited > kMostLeaves) checkSize(m_visited * FloatLeaf::SIZE, shortestEdge(m_to));
        for (int x = low.x(); x <= high.x(); x += 8)
            for (int y = low.y(); y <= high.y(); y += 8)
                for (int z = low.z(); z <= high.z(); z += 8) m_leaves.insert(Coord(x, y, z));
    }

    const openvdb::math::Transform &m_from, &m_to;
    std::set<Coord> m_leaves;
    double m_visited = 0;
};

/// Takes values between the voxels of a part.
class Sampler {
public:
    explicit Sampler(const VolumePart& part) : m_density(part.density->getConstAccessor())
    {
        for (const auto& grid : {part.direction, part.colour, part.scatter_ratio})
            m_vectors.push_back(
                grid ? std::make_unique<Vec3SGrid::ConstAccessor>(grid->getConstAccessor())
                     : nullptr);
    }

    struct Sample {
        float density = 0;
        openvdb::Vec3s vectors[3]; ///< direction, colour, scatter ratio
    };
    Sample at(const Vec3d& p)
    {
        Sample sample;
        const Coord low = Coord::floor(p);
        const Vec3d part = p - low.asVec3d();
        double density = 0, most = 0;
        Vec3d sums[3] = {Vec3d(0.0), Vec3d(0.0), Vec3d(0.0)};
        for (int corner = 0; corner < 8; ++corner) {
            const int d[3] = {corner >> 2, corner >> 1 & 1, corner & 1};
            double weight = 1;
            for (int a = 0; a < 3; ++a) weight *= d[a] ? part[a] : 1 - part[a];
            float value = 0;
            const Coord c = low.offsetBy(d[0], d[1], d[2]);
            if (!(weight > kLeastWeight) || !m_density.probeValue(c, value) || value == 0) continue;
            weight *= value;
            density += weight;
            for (int v = 1; v < 3; ++v)
                if (m_vectors[v]) sums[v] += Vec3d(m_vectors[v]->getValue(c)) * weight;
            if (weight > most && m_vectors[0]) sample.vectors[0] = m_vectors[0]->getValue(c);
            most = std::max(most, weight);
        }
        sample.density = static_cast<float>(density);
        for (int v = 1; v < 3; ++v)
            if (density > 0) sample.vectors[v] = openvdb::Vec3s(sums[v] / density);
        return sample;
    }

private:
    FloatGrid::ConstAccessor m_density;
    std::vector<std::unique_ptr<Vec3SGrid::ConstAccessor>> m_vectors;
};

/// The new leaves of a part's grids at one place.
struct NewLeaves {
    std::unique_ptr<FloatLeaf> density;
    std::unique_ptr<VectorLeaf> vectors[3];
};

NewLeaves leavesAt(const Coord& origin, Sampler& sampler, const IndexMap& map, const bool (&has)[3])
{
    NewLeaves leaves;
    for (openvdb::Index n = 0; n < FloatLeaf::SIZE; ++n) {
        const Coord c = origin + FloatLeaf::offsetToLocalCoord(n);
        const Sampler::Sample sample = sampler.at(map.at(c));
        if (!(sample.density > 0)) continue;
        if (!leaves.density) {
            leaves.density = std::make_unique<FloatLeaf>(origin, 0.0f);
            for (int v = 0; v < 3; ++v)
                if (has[v])
                    leaves.vectors[v] = std::make_unique<VectorLeaf>(origin, openvdb::Vec3s(0.0f));
        }
        leaves.density->setValueOn(n, sample.density);
        for (int v = 0; v < 3; ++v)
            if (has[v]) leaves.vectors[v]->setValueOn(n, sample.vectors[v]);
    }
    return leaves;
}

VolumePart cubicPart(const VolumePart& from, const openvdb::math::Transform::Ptr& to,
                     const IndexMap& map)
{
    VolumePart part = from;
    part.own_share = nullptr; // strands are told apart in the voxels that they were baked for alone
    const bool has[3] = {from.direction != nullptr, from.colour != nullptr,
                         from.scatter_ratio != nullptr};
    part.density = FloatGrid::create(0.0f);
    part.density->insertMeta(*from.density);
    part.density->setTransform(to);
    Vec3SGrid::Ptr* vectors[3] = {&part.direction, &part.colour, &part.scatter_ratio};
    for (int v = 0; v < 3; ++v)
        if (has[v]) {
            *vectors[v] = Vec3SGrid::create(openvdb::Vec3s(0.0f));
            (*vectors[v])->setTransform(to);
        }
    const std::vector<Coord> places =
        LeafFinder(from.density->transform(), *to).find(*from.density);
    std::vector<NewLeaves> leaves(places.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, places.size(), 64),
                      [&](const auto& range) {
                          Sampler sampler(from);
                          for (std::size_t i = range.begin(); i < range.end(); ++i)
                              leaves[i] = leavesAt(places[i], sampler, map, has);
                      });
    for (NewLeaves& l : leaves) {
        if (!l.density) continue;
        part.density->tree().addLeaf(l.density.release());
        for (int v = 0; v < 3; ++v)
            if (has[v]) (*vectors[v])->tree().addLeaf(l.vectors[v].release());
    }
    return part;
}

} // namespace

bool hasCubicVoxels(const openvdb::math::Transform& transform)
{
    const openvdb::Mat4d m = transform.baseMap()->getAffineMap()->getMat4();
    const double h = m(0, 0);
    double off = std::max(std::abs(m(1, 1) - h), std::abs(m(2, 2) - h));
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            if (i != j) off = std::max(off, std::abs(m(i, j)));
    return h > 0 && off <= 1e-6 * h;
}

Volume withCubicVoxels(const Volume& volume)
{
    const openvdb::math::Transform& from = volume.parts.at(0).density->transform();
    const double edge = shortestEdge(from);
    const double ratio = std::abs(from.baseMap()->determinant()) / (edge * edge * edge);
    double voxels = 0;
    for (const VolumePart& part : volume.parts)
        voxels += double(part.density->activeVoxelCount()) * ratio;
    checkSize(voxels, edge);
    // A voxel's centre stays one: voxels that are only mirrored keep their values.
    const auto to = openvdb::math::Transform::createLinearTransform(edge);
    to->postTranslate(from.indexToWorld(Vec3d(0.0)));
    IndexMap map;
    map.origin = from.worldToIndex(to->indexToWorld(Vec3d(0.0)));
    for (int a = 0; a < 3; ++a) {
        Vec3d e(0.0);
        e[a] = 1;
        map.axes[a] = from.worldToIndex(to->indexToWorld(e)) - map.origin;
    }
    Volume cubic;
    cubic.warnings = volume.warnings;
    for (const VolumePart& part : volume.parts) cubic.parts.push_back(cubicPart(part, to, map));
    return cubic;
}

} // namespace volcomp
