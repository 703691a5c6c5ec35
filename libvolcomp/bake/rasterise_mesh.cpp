// SPDX-License-Identifier: Apache-2.0
#include "volcomp/bake/rasterise_mesh.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>

#include <fmt/format.h>

#include "volcomp/bake/leaf_filler.h"
#include "volcomp/bake/mesh_pieces.h"
#include "volcomp/bake/rasterise.h"
#include "volcomp/bake/solid_fill.h"
#include "volcomp/base/error.h"
#include "volcomp/base/portable_math.h"

namespace volcomp {
namespace {

constexpr double kVoxelsAcross = 256; ///< at most, along the longest side, if no voxel is given
constexpr double kVoxelsAcrossAtLeast = 128;
constexpr float kLeastDepth = 1e-5f; ///< as in rasterise.cpp
// Radii of bodies, in voxels, between which surface gives way to volume.
constexpr double kThinUpTo = 0.5, kThickFrom = 0.7;

double depthOf(double coverage) { return -portable::log(1 - std::min(coverage, kMaxCoverage)); }

/// What rays that graze a thick body's border meet too much, as a shift of the border in voxels;
/// the same for round strands (thickRadius() of leaf_filler.cpp).
double borderShift(double radius)
{
    return 0.1 + 0.13 * portable::log(std::clamp(radius, kThinUpTo, 3.0));
}

SymmetricTensor tensorOf(const std::array<float, 6>& t)
{
    return {t[0], t[1], t[2], t[3], t[4], t[5]};
}

/// The bodies of a part: their volume and surface in each voxel.
class Bodies {
public:
    Bodies(const MeshModelPart& part, double voxel, const std::vector<SheetInVoxel>& entries)
        : m_fill(fillOf(part, voxel)), m_area(areaOf(part, entries))
    {
    }

    const openvdb::FloatGrid& fill() const { return *m_fill; }

    /// What is around a voxel.
    struct Around {
        double fill, area; ///< of the voxel itself
        double radius;     ///< of the body, voxels; infinite deep inside
    };
    Around around(const openvdb::Coord& at)
    {
        double volume = 0, surface = 0;
        for (int x = -1; x <= 1; ++x)
            for (int y = -1; y <= 1; ++y)
                for (int z = -1; z <= 1; ++z) {
                    const openvdb::Coord c = at.offsetBy(x, y, z);
                    volume += m_fill_at.getValue(c);
                    surface += m_area_at.getValue(c);
                }
        return {m_fill_at.getValue(at), m_area_at.getValue(at),
                surface > 0 ? 2 * volume / surface : 1e9};
    }

private:
    static openvdb::FloatGrid::Ptr fillOf(const MeshModelPart& part, double voxel)
    {
        std::vector<std::array<Vec3d, 3>> triangles;
        const auto add = [&](const std::array<Vec3d, 3>& corners) {
            auto& t = triangles.emplace_back(corners);
            for (Vec3d& p : t) p = p / voxel + Vec3d(0.5);
        };
        triangles.reserve(part.triangles.size() + part.caps.size());
        for (const ModelTriangle& t : part.triangles)
            if (part.sheets[t.sheet].solid) add(t.corners);
        for (const auto& cap : part.caps) add(cap);
        return fillSolids(triangles);
    }

    static openvdb::FloatGrid::Ptr areaOf(const MeshModelPart& part,
                                          const std::vector<SheetInVoxel>& entries)
    {
        auto grid = openvdb::FloatGrid::create(0.0f);
        openvdb::FloatGrid::Accessor area = grid->getAccessor();
        for (const SheetInVoxel& e : entries) {
            if (!part.sheets[e.sheet].solid) continue;
            const openvdb::Coord at = unpackedVoxel(e.voxel);
            area.setValue(at, area.getValue(at) + e.area);
        }
        return grid;
    }

    openvdb::FloatGrid::Ptr m_fill, m_area;
    openvdb::FloatGrid::ConstAccessor m_fill_at{m_fill->getConstAccessor()},
        m_area_at{m_area->getConstAccessor()};
};

/// The voxels of a part while they are being filled.
class MeshFiller {
public:
    MeshFiller(const MeshModel& model, const MeshModelPart& part, double voxel)
        : m_part(part), m_voxel(voxel), m_entries(cutIntoVoxels(model, part, voxel)),
          m_bodies(part, voxel, m_entries)
    {
    }

    /// Calls put(coordinates, cell) for each voxel that counts.
    template <class F>
    void run(F&& put)
    {
        for (std::size_t first = 0, end = 0; first < m_entries.size(); first = end) {
            while (end < m_entries.size() && m_entries[end].voxel == m_entries[first].voxel) ++end;
            const openvdb::Coord at = unpackedVoxel(m_entries[first].voxel);
            put(at, cellOf(at, first, end));
        }
        goInside(put);
    }

private:
    /// What the sheets of one voxel add up to.
    Cell cellOf(const openvdb::Coord& at, std::size_t first, std::size_t end)
    {
        Cell cell;
        double solid_thin = 0;
        Bodies::Around around{};
        for (std::size_t i = first; i < end; ++i) {
            const SheetInVoxel& e = m_entries[i];
            const MeshSheet& sheet = m_part.sheets[e.sheet];
            const auto weight = e.area / float(sheet.solid ? 2 : sheet.sides);
            cell.weight += weight;
            for (std::size_t k = 0; k < 3; ++k) cell.colour[k] += e.colour[k] * (weight / e.area);
            for (std::size_t k = 0; k < 6; ++k) cell.tensor[k] += e.tensor[k] * (weight / e.area);
            if (!sheet.solid) {
                add(cell, depthOf(0.5 * weight * flatFactor(sheet.width / m_voxel)));
                continue;
            }
            if (around.radius == 0) around = m_bodies.around(at);
            solid_thin += depthOf(0.5 * weight * thinFactor(e, sheet, around.radius));
        }
        if (solid_thin > 0) add(cell, bodyDepth(around, solid_thin));
        if (m_bodies.fill().activeVoxelCount() > 0 && isBody(first, end)) remember(at, cell);
        return cell;
    }

    bool isBody(std::size_t first, std::size_t end) const
    {
        return std::any_of(m_entries.begin() + std::ptrdiff_t(first),
                           m_entries.begin() + std::ptrdiff_t(end),
                           [&](const SheetInVoxel& e) { return m_part.sheets[e.sheet].solid; });
    }

    static void add(Cell& cell, double depth)
    {
        cell.depth += float(depth);
        cell.squares += float(depth * depth);
    }

    double thinFactor(const SheetInVoxel& e, const MeshSheet& sheet, double radius) const
    {
        const double spread = principalDirection(tensorOf(e.tensor)).spread,
                     flat = std::max(0.0, 1 - 2 * spread * spread);
        return flat * flatFactor(sheet.width / m_voxel)
            + (1 - flat) * roundFactor(std::min(radius, kThickFrom));
    }

    static double bodyDepth(const Bodies::Around& around, double thin)
    {
        const double thick =
            std::clamp((around.radius - kThinUpTo) / (kThickFrom - kThinUpTo), 0.0, 1.0);
        const double inside = std::max(0.0, around.fill - borderShift(around.radius) * around.area);
        return thick * depthOf(inside) + (1 - thick) * thin;
    }

    /// What a voxel inside takes over from those beside it.
    struct Look {
        std::array<float, 3> colour;
        std::array<float, 6> tensor;
    };

    void remember(const openvdb::Coord& at, const Cell& cell)
    {
        Look look{};
        for (std::size_t k = 0; k < 3; ++k) look.colour[k] = cell.colour[k] / cell.weight;
        for (std::size_t k = 0; k < 6; ++k) look.tensor[k] = cell.tensor[k] / cell.weight;
        const std::uint64_t key = packedVoxel(at);
        m_looks.emplace(key, look);
        m_border.push_back(key);
    }

    /// The voxels inside bodies, layer by layer from their surfaces inwards.
    template <class F>
    void goInside(F&& put)
    {
        openvdb::FloatGrid::ConstAccessor fill = m_bodies.fill().getConstAccessor();
        std::vector<std::uint64_t> next;
        while (!m_border.empty()) {
            next.clear();
            for (const std::uint64_t key : m_border)
                forNeighbours(key, [&](std::uint64_t n, const openvdb::Coord& at) {
                    if (fill.getValue(at) > 0 && m_looks.count(n) == 0) next.push_back(n);
                });
            std::sort(next.begin(), next.end());
            next.erase(std::unique(next.begin(), next.end()), next.end());
            std::vector<Look> looks;
            looks.reserve(next.size());
            for (const std::uint64_t key : next) {
                const openvdb::Coord at = unpackedVoxel(key);
                looks.push_back(lookBeside(key));
                Cell cell;
                add(cell, bodyDepth(m_bodies.around(at), 0));
                cell.weight = 1;
                cell.colour = looks.back().colour;
                cell.tensor = looks.back().tensor;
                put(at, cell);
            }
            for (std::size_t i = 0; i < next.size(); ++i) m_looks.emplace(next[i], looks[i]);
            std::swap(m_border, next);
        }
    }

    Look lookBeside(std::uint64_t key) const
    {
        Look sum{};
        float count = 0;
        forNeighbours(key, [&](std::uint64_t n, const openvdb::Coord&) {
            const auto known = m_looks.find(n);
            if (known == m_looks.end()) return;
            ++count;
            for (std::size_t k = 0; k < 3; ++k) sum.colour[k] += known->second.colour[k];
            for (std::size_t k = 0; k < 6; ++k) sum.tensor[k] += known->second.tensor[k];
        });
        for (float& c : sum.colour) c /= count;
        for (float& t : sum.tensor) t /= count;
        return sum;
    }

    template <class F>
    static void forNeighbours(std::uint64_t key, F&& f)
    {
        const openvdb::Coord at = unpackedVoxel(key);
        for (int k = 0; k < 3; ++k)
            for (const int step : {-1, 1}) {
                openvdb::Coord n = at;
                n[k] += step;
                f(packedVoxel(n), n);
            }
    }

    const MeshModelPart& m_part;
    double m_voxel;
    std::vector<SheetInVoxel> m_entries;
    Bodies m_bodies;
    std::unordered_map<std::uint64_t, Look> m_looks; ///< of voxels of bodies
    std::vector<std::uint64_t> m_border;             ///< the layer that was done last
};

/// The colour that all triangles have, or nothing.
bool haveOneColour(const MeshModel& model, const MeshModelPart& part)
{
    const auto& looks = model.looks;
    return std::all_of(part.triangles.begin(), part.triangles.end(), [&](const ModelTriangle& t) {
        const MeshLook& look = looks[std::size_t(t.look)];
        return !look.texture
            && look.colour == looks[std::size_t(part.triangles.front().look)].colour;
    });
}

} // namespace

VolumePart rasteriseMesh(const MeshModel& model, const MeshModelPart& part, double voxel,
                         const Progress& progress)
{
    if (!(voxel >= kSmallestVoxel) || !std::isfinite(voxel))
        throw Error(fmt::format("the voxel of a box: expected a length of at least {:g} m, found "
                                "{:g} m; is the mesh's 'scale' right?",
                                kSmallestVoxel, voxel));
    VolumePart result = rasterise({}, part.material, MaterialKind::surface, voxel);
    if (part.triangles.empty()) return result;
    const bool one_colour = haveOneColour(model, part);
    if (one_colour) {
        result.uniform_colour = model.looks[std::size_t(part.triangles.front().look)].colour;
    } else {
        result.colour = openvdb::Vec3SGrid::create(Vec3f(0.0f));
        result.colour->setTransform(result.density->transform().copy());
    }
    MeshFiller filler(model, part, voxel);
    report(progress, 0.6);
    auto density = result.density->getAccessor(), own = result.own_share->getAccessor();
    auto direction = result.direction->getAccessor();
    std::optional<openvdb::Vec3SGrid::Accessor> colour;
    if (result.colour) colour.emplace(result.colour->getAccessor());
    filler.run([&](const openvdb::Coord& at, const Cell& cell) {
        if (!(cell.depth > kLeastDepth)) return;
        density.setValue(at, static_cast<float>(cell.depth / voxel));
        own.setValue(at, std::min(1.0f, cell.squares / (cell.depth * cell.depth)));
        direction.setValue(at, Vec3f(principalDirection(tensorOf(cell.tensor)).stored()));
        if (colour) colour->setValue(at, Vec3f(cell.colour.data()) / cell.weight);
    });
    report(progress, 1);
    return result;
}

double voxelFor(const MeshModel& model)
{
    Vec3d low(1e300), high(-1e300);
    std::vector<std::pair<double, double>> widths; // width, area
    double total = 0;
    for (const MeshModelPart& part : model.parts)
        for (const ModelTriangle& t : part.triangles) {
            for (const Vec3d& p : t.corners) {
                low = openvdb::math::minComponent(low, p);
                high = openvdb::math::maxComponent(high, p);
            }
            const double area =
                (t.corners[1] - t.corners[0]).cross(t.corners[2] - t.corners[0]).length();
            widths.emplace_back(part.sheets[t.sheet].width, area);
            total += area;
        }
    if (widths.empty()) return 0.01;
    std::sort(widths.begin(), widths.end());
    double below = 0, narrow = 0;
    for (const auto& [width, area] : widths) {
        narrow = width;
        if ((below += area) >= 0.25 * total) break;
    }
    const Vec3d extent = high - low;
    const double longest = std::max({extent[0], extent[1], extent[2]});
    return std::max({std::min(0.5 * narrow, longest / kVoxelsAcrossAtLeast),
                     longest / kVoxelsAcross, kSmallestVoxel});
}

} // namespace volcomp
