// SPDX-License-Identifier: Apache-2.0
#include "volcomp/bake/mesh_model.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/surface/mesh.h"
#include "volcomp/surface/mesh_topology.h"

namespace volcomp {
namespace {

namespace fs = std::filesystem;

/// Holes may have this part of a body's area.
constexpr double kMostHoles = 0.25;

double areaOf(const std::array<Vec3d, 3>& t)
{
    return 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).length();
}

/// What a part of a file's mesh may be called: its name, the names in it that '/' separates, and
/// its material's.
bool isMeant(const MeshMatch& match, const Mesh& mesh, const MeshPart& part)
{
    if (matches(match.name, part.name)) return true;
    if (part.material >= 0 && matches(match.name, mesh.materials[std::size_t(part.material)].name))
        return true;
    const std::string& name = part.name;
    for (std::size_t from = 0, to = 0; to != name.npos; from = to + 1) {
        to = name.find('/', from);
        if (matches(match.name, std::string_view(name).substr(from, to - from))) return true;
    }
    return false;
}

/// What the names of a mesh are, for a message.
std::string namesIn(const Mesh& mesh)
{
    std::string names;
    std::size_t count = 0;
    const auto add = [&](const std::string& name) {
        if (name.empty() || ++count > 12) return;
        names += (names.empty() ? "'" : ", '") + name + "'";
    };
    for (const MeshMaterial& m : mesh.materials) add(m.name);
    for (const MeshPart& p : mesh.parts) add(p.name);
    return names.empty() ? "no names at all" : names + (count > 12 ? ", ..." : "");
}

/// Reads each picture once.
class Pictures {
public:
    std::shared_ptr<const Texture> read(const fs::path& file, const std::string* embedded,
                                        bool colour)
    {
        std::shared_ptr<const Texture>& known = m_known[{file, colour}];
        if (!known)
            known = std::make_shared<const Texture>(embedded ? readTexture(file, *embedded, colour)
                                                             : readTexture(file, colour));
        return known;
    }

private:
    std::map<std::pair<fs::path, bool>, std::shared_ptr<const Texture>> m_known;
};

/// The channel that cuts things out: alpha, or of a picture without it the first.
int cuttingChannel(const Texture& t)
{
    return t.channels == 2 || t.channels == 4 ? t.channels - 1 : 0;
}

/// How a part of the file looks, by the file and by what the scene says of it.
MeshLook lookOf(const MeshMatch& match, const MeshMaterial& material, Pictures& pictures)
{
    MeshLook look;
    look.colour = Vec3f(match.colour);
    bool cut = material.cut;
    if (!match.texture.empty()) {
        look.texture = pictures.read(match.texture, nullptr, true);
        cut = look.texture->channels == 2 || look.texture->channels == 4;
    } else {
        look.colour *= material.colour;
        if (!material.texture.empty())
            look.texture = pictures.read(material.texture, material.embedded.get(), true);
    }
    look.cutoff = match.cutoff >= 0 ? match.cutoff : material.cutoff;
    if (!match.alpha.empty()) look.alpha = pictures.read(match.alpha, nullptr, false);
    else if (cut && match.texture.empty() && !material.alpha.empty())
        look.alpha = pictures.read(material.alpha, nullptr, false);
    else if (cut) look.alpha = look.texture;
    if (look.cutoff <= 0) look.alpha = nullptr;
    if (look.alpha) look.alpha_channel = cuttingChannel(*look.alpha);
    const bool same = look.alpha && look.alpha == look.texture;
    if (look.texture)
        look.picture = std::make_shared<const PicturePyramid>(
            *look.texture, same ? look.alpha_channel : -1, look.cutoff);
    if (look.alpha && !same)
        look.cut =
            std::make_shared<const PicturePyramid>(*look.alpha, look.alpha_channel, look.cutoff);
    return look;
}

/// Finds the sheets of the triangles of one part, and orders the triangles by them.
class SheetFinder {
public:
    SheetFinder(const std::vector<MeshLook>& looks, MeshModelPart& part)
        : m_looks(looks), m_part(part)
    {
    }

    /// `solidity` is that of each triangle.
    void run(std::vector<Solidity> solidity)
    {
        joinTriangles();
        sortBySheet(solidity);
        m_part.sheets.resize(m_sheets);
        findBorders();
        measure(solidity);
    }

private:
    std::int32_t root(std::int32_t t)
    {
        while (m_root[t] != t) t = m_root[t] = m_root[m_root[t]];
        return t;
    }

    void joinTriangles()
    {
        std::vector<Vec3d> points;
        points.reserve(m_part.triangles.size() * 3);
        m_mesh.triangles.reserve(m_part.triangles.size());
        for (const ModelTriangle& t : m_part.triangles) {
            const auto first = static_cast<std::int32_t>(points.size());
            m_mesh.triangles.push_back({first, first + 1, first + 2});
            points.insert(points.end(), t.corners.begin(), t.corners.end());
        }
        const std::vector<std::int32_t> welded = weld(points);
        m_root.resize(m_part.triangles.size());
        std::iota(m_root.begin(), m_root.end(), 0);
        m_edges = edgeUses(m_mesh, welded);
        forEachEdge(m_edges, [&](auto first, auto last) {
            for (auto use = first; use != last; ++use)
                m_root[root(use->triangle)] = root(first->triangle);
        });
    }

    /// Sheets are counted in the order of their first triangles.
    void sortBySheet(std::vector<Solidity>& solidity)
    {
        const std::size_t count = m_part.triangles.size();
        std::vector<std::int32_t> sheet_of(count, -1);
        for (std::size_t t = 0; t < count; ++t) {
            std::int32_t& sheet = sheet_of[root(std::int32_t(t))];
            if (sheet < 0) sheet = static_cast<std::int32_t>(m_sheets++);
            m_part.triangles[t].sheet = static_cast<std::uint32_t>(sheet);
        }
        std::vector<std::int32_t> order(count);
        std::iota(order.begin(), order.end(), 0);
        std::stable_sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
            return m_part.triangles[a].sheet < m_part.triangles[b].sheet;
        });
        m_place.resize(count);
        std::vector<ModelTriangle> triangles;
        std::vector<Solidity> sorted;
        triangles.reserve(count), sorted.reserve(count);
        for (const std::int32_t t : order) {
            m_place[t] = static_cast<std::int32_t>(triangles.size());
            triangles.push_back(m_part.triangles[t]);
            sorted.push_back(solidity[t]);
        }
        m_part.triangles = std::move(triangles);
        solidity = std::move(sorted);
    }

    /// One side of a triangle that no other triangle of the sheet goes back along.
    struct Side {
        Vec3d from, to;
    };

    void findBorders()
    {
        m_borders.resize(m_sheets);
        forEachEdge(m_edges, [&](auto first, auto last) {
            std::int64_t balance = 0;
            for (auto use = first; use != last; ++use) balance += use->forward ? 1 : -1;
            if (balance == 0) return;
            for (auto use = first; use != last && balance != 0; ++use) {
                if (use->forward != (balance > 0)) continue;
                const ModelTriangle& t = m_part.triangles[m_place[use->triangle]];
                m_borders[t.sheet].push_back(
                    {t.corners[use->corner], t.corners[(use->corner + 1) % 3]});
                balance -= use->forward ? 1 : -1;
            }
        });
    }

    /// The triangles that close the holes of a sheet: around the mean of each border.
    static std::vector<std::array<Vec3d, 3>> capsOf(const std::vector<Side>& border)
    {
        std::map<std::array<double, 3>, std::size_t> index;
        std::vector<std::size_t> up;
        const auto pointOf = [&](const Vec3d& p) {
            const auto [at, is_new] = index.emplace(std::array{p[0], p[1], p[2]}, up.size());
            if (is_new) up.push_back(up.size());
            return at->second;
        };
        const auto top = [&](std::size_t i) {
            while (up[i] != i) i = up[i] = up[up[i]];
            return i;
        };
        std::vector<std::size_t> hole;
        hole.reserve(border.size());
        for (const Side& s : border) {
            const std::size_t a = top(pointOf(s.from)), b = top(pointOf(s.to));
            up[a] = b;
            hole.push_back(b);
        }
        std::vector<Vec3d> sum(up.size(), Vec3d(0.0));
        std::vector<double> count(up.size(), 0);
        for (std::size_t i = 0; i < border.size(); ++i) {
            sum[top(hole[i])] += border[i].from + border[i].to;
            count[top(hole[i])] += 2;
        }
        std::vector<std::array<Vec3d, 3>> caps;
        caps.reserve(border.size());
        for (std::size_t i = 0; i < border.size(); ++i)
            caps.push_back({border[i].to, border[i].from, sum[top(hole[i])] / count[top(hole[i])]});
        return caps;
    }

    void measure(const std::vector<Solidity>& solidity)
    {
        for (std::size_t first = 0, end = 0; first < m_part.triangles.size(); first = end) {
            const std::uint32_t sheet = m_part.triangles[first].sheet;
            double area = 0, pictured = 0, uv_area = 0;
            bool cut = false;
            for (end = first; end < m_part.triangles.size() && m_part.triangles[end].sheet == sheet;
                 ++end) {
                const ModelTriangle& t = m_part.triangles[end];
                area += areaOf(t.corners);
                if (!m_looks[std::size_t(t.look)].alpha) continue;
                cut = true;
                pictured += areaOf(t.corners);
                const Vec2f a = t.uv[1] - t.uv[0], b = t.uv[2] - t.uv[0];
                uv_area += 0.5 * std::abs(double(a[0]) * b[1] - double(a[1]) * b[0]);
            }
            const auto caps = capsOf(m_borders[sheet]);
            double holes = 0;
            for (const auto& cap : caps) holes += areaOf(cap);
            MeshSheet& s = m_part.sheets[sheet];
            s.solid = solidity[first] == Solidity::automatic ? !cut && holes < kMostHoles * area
                                                             : solidity[first] == Solidity::solid;
            if (s.solid) {
                s.width = 0.5 * std::sqrt(area);
                m_part.caps.insert(m_part.caps.end(), caps.begin(), caps.end());
                continue;
            }
            s.sides = m_borders[sheet].empty() ? 2 : 1;
            area /= s.sides;
            double border = 0;
            for (const Side& side : m_borders[sheet]) border += (side.to - side.from).length();
            s.width = widthOf(area, border);
            if (cut && uv_area > 0)
                s.width = std::min(s.width, leftWidth(first, pictured / uv_area));
        }
    }

    /// The width of what a picture leaves, given the square metres in a unit square of (u,v).
    double leftWidth(std::size_t triangle, double scale) const
    {
        const MeshLook& look = m_looks[std::size_t(m_part.triangles[triangle].look)];
        const PicturePyramid* picture = look.cut ? look.cut.get() : look.picture.get();
        if (!picture || !(picture->width() > 0)) return 1e30;
        const Vec2d size = picture->size();
        return picture->width() * std::sqrt(scale / (size[0] * size[1]));
    }

    const std::vector<MeshLook>& m_looks;
    MeshModelPart& m_part;
    Mesh m_mesh; ///< the triangles alone
    std::vector<EdgeUse> m_edges;
    std::vector<std::int32_t> m_root;
    std::vector<std::int32_t> m_place; ///< of each triangle, after they were ordered
    std::size_t m_sheets = 0;
    std::vector<std::vector<Side>> m_borders; ///< of each sheet
};

/// Reads and prepares the mesh: metres, Y up, neighbours wound alike.
Mesh readBoxMesh(const MeshBox& box)
{
    Mesh mesh = readMesh(box.file);
    const UpAxis up = box.axes.up.value_or(UpAxis::y);
    for (Vec3d& p : mesh.points) p = turnedUp(up, p);
    for (Vec3f& n : mesh.normals) n = Vec3f(turnedUp(up, Vec3d(n)));
    prepareMesh(mesh, box.axes.scale > 0 ? box.axes.scale : 1, box.move, Orientation::outward);
    return mesh;
}

} // namespace

Vec3f MeshLook::colourAt(const Vec2d& uv) const
{
    return texture ? colour * texture->colour(uv[0], uv[1], Wrap::repeat) : colour;
}

bool MeshLook::isThere(const Vec2d& uv) const
{
    return !alpha || alpha->sample(uv[0], uv[1], alpha_channel, Wrap::repeat) >= cutoff;
}

PicturePyramid::Mean MeshLook::mean(const Vec2d& uv, double uv_area) const
{
    const auto look = [&](const PicturePyramid& p) {
        return p.at(uv, std::sqrt(uv_area * p.size()[0] * p.size()[1]));
    };
    PicturePyramid::Mean mean = picture ? look(*picture) : PicturePyramid::Mean{1, Vec3f(1.0f)};
    if (cut) mean.share *= look(*cut).share;
    mean.colour *= colour;
    return mean;
}

std::size_t MeshModel::triangleCount() const
{
    std::size_t count = 0;
    for (const MeshModelPart& part : parts) count += part.triangles.size();
    return count;
}

MeshModel loadMeshModel(const GrowthRule& rule, const std::vector<Material>& materials)
{
    const Mesh mesh = readBoxMesh(rule.mesh);
    MeshModel model;
    model.warnings = mesh.report.warnings;
    std::vector<MeshMatch> matches = rule.mesh.materials;
    matches.emplace_back().material = rule.material; // what none matches
    std::vector<bool> used(matches.size(), false);
    std::map<std::pair<std::size_t, std::int32_t>, std::int32_t> looks;
    std::map<std::string, std::pair<MeshModelPart, std::vector<Solidity>>> parts;
    Pictures pictures;
    std::size_t without_uv = 0;
    for (const MeshPart& part : mesh.parts) {
        std::size_t m = 0;
        while (m + 1 < matches.size() && !isMeant(matches[m], mesh, part)) ++m;
        used[m] = true;
        const auto [known, is_new] =
            looks.emplace(std::pair(m, part.material), std::int32_t(model.looks.size()));
        if (is_new)
            model.looks.push_back(lookOf(
                matches[m],
                part.material < 0 ? MeshMaterial() : mesh.materials[std::size_t(part.material)],
                pictures));
        if (mesh.uv.empty() && model.looks[std::size_t(known->second)].hasPicture())
            without_uv += part.end - part.first;
        auto& [to, solidity] = parts[matches[m].material];
        for (std::size_t t = part.first; t < part.end; ++t) {
            const auto& c = mesh.triangles[t];
            const std::array<Vec3d, 3> corners{mesh.points[c[0]], mesh.points[c[1]],
                                               mesh.points[c[2]]};
            if (!(areaOf(corners) > 0)) continue;
            const Vec2f corner(0.0f, 0.0f);
            to.triangles.push_back(
                {corners,
                 mesh.uv.empty() ? std::array<Vec2f, 3>{corner, corner, corner} : mesh.uv[t],
                 known->second, 0});
            solidity.push_back(matches[m].solidity);
        }
    }
    for (std::size_t m = 0; m + 1 < matches.size(); ++m)
        if (!used[m])
            throw fileError(
                rule.mesh.file, fmt::format("box {}: mesh_material {}", rule.name, m + 1),
                fmt::format("a part that '{}' matches and none above it", matches[m].name),
                namesIn(mesh));
    if (without_uv > 0)
        model.warnings.push_back(fmt::format(
            "{}: {} triangles have a texture but no texture coordinates; they show its corner.",
            rule.mesh.file.string(), without_uv));
    for (const Material& material : materials) {
        const auto part = parts.find(material.name);
        if (part == parts.end() || part->second.first.triangles.empty()) continue;
        part->second.first.material = material.name;
        SheetFinder(model.looks, part->second.first).run(std::move(part->second.second));
        model.parts.push_back(std::move(part->second.first));
    }
    return model;
}

} // namespace volcomp
