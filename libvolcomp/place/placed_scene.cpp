// SPDX-License-Identifier: Apache-2.0
#include "volcomp/place/placed_scene.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/place/scatter.h"
#include "volcomp/place/spacing.h"

namespace volcomp {
namespace {

PlacedSurface loadPlacedSurface(const SurfaceSpec& spec)
{
    PlacedSurface s{spec.name, loadSurface(spec), spec.skin, SecondDensity()};
    s.skin_colour = loadSkinMaps(spec, s.surface.mesh());
    return s;
}

/// Index of the element of that name. Throws Error if there is none.
template <class T>
std::int32_t indexOf(const std::vector<T>& list, const std::string& name, const Layer& layer,
                     const char* what)
{
    const auto it =
        std::find_if(list.begin(), list.end(), [&](const T& x) { return x.name == name; });
    if (it == list.end())
        throw Error(fmt::format("layer '{}': expected the name of a {}, found '{}'", layer.name,
                                what, name));
    return static_cast<std::int32_t>(it - list.begin());
}

LayerBoxes boxesOf(const std::vector<BoxKind>& kinds, const Layer& layer)
{
    const std::int32_t kind = indexOf(kinds, layer.box, layer, "box");
    LayerBoxes boxes{0, kinds[kind].variants};
    for (std::int32_t k = 0; k < kind; ++k) boxes.first += kinds[k].variants;
    return boxes;
}

PlacedLayer makeLayer(const std::vector<PlacedSurface>& surfaces, const Layer& layer)
{
    PlacedLayer placed;
    placed.layer = layer;
    placed.surface = indexOf(surfaces, layer.surface, layer, "surface");
    placed.tints_voxels = layer.tint == TintAt::voxel && !layer.colour.empty();
    if (placed.tints_voxels) placed.tint = SecondDensity(layer.colour, true);
    return placed;
}

/// The roots of the layers that others keep away from, and what they leave of a layer.
class Room {
public:
    Room(const std::vector<PlacedSurface>& surfaces, const std::vector<PlacedLayer>& layers)
        : m_surfaces(surfaces), m_layers(layers), m_roots(layers.size())
    {
    }

    /// Whether layer `i` has to stand in a list of its own before it is collected.
    bool concerns(std::size_t i) const
    {
        const Layer& layer = m_layers[i].layer;
        return layer.spacing > 0 || !layer.avoid.empty() || isAvoided(layer.name);
    }

    /// Drops those of layer `i` that are too near to something, and remembers the others.
    void thin(std::size_t i, PlacementList& list)
    {
        const Layer& layer = m_layers[i].layer;
        std::vector<char> keep(list.size(), 1);
        for (const Avoid& avoid : layer.avoid) {
            if (!avoid.surface.empty())
                keepAway(
                    list,
                    m_surfaces[std::size_t(indexOf(m_surfaces, avoid.surface, layer, "surface"))]
                        .surface,
                    avoid.distance, keep);
            for (std::size_t k = 0; k < i; ++k)
                if (m_layers[k].layer.name == avoid.layer)
                    keepAway(list, m_roots[k], avoid.distance, keep);
        }
        list.filter(keep);
        if (layer.spacing > 0) {
            std::vector<const std::vector<Root>*> others;
            for (std::size_t k = 0; k < i; ++k)
                if (m_layers[k].layer.spacing > 0) others.push_back(&m_roots[k]);
            list.filter(keepSpacing(list, layer, others));
        }
        m_roots[i] = rootsOf(list, layer.spacing);
    }

private:
    bool isAvoided(const std::string& name) const
    {
        for (const PlacedLayer& l : m_layers)
            for (const Avoid& avoid : l.layer.avoid)
                if (avoid.layer == name) return true;
        return false;
    }

    const std::vector<PlacedSurface>& m_surfaces;
    const std::vector<PlacedLayer>& m_layers;
    std::vector<std::vector<Root>> m_roots; ///< by layer
};

/// Warns of a layer without boxes, or whose density asks for less than one.
void warnOfFewBoxes(const PlacedLayer& l, const PlacedSurface& s,
                    std::vector<std::string>& warnings)
{
    const double wanted = l.layer.density * s.surface.area();
    const bool by_area = l.layer.sampling == Sampling::area;
    const bool few = !l.layer.hasPlaces() && by_area && l.layer.density > 0 && wanted < 1 - 1e-9;
    if (l.boxes > 0 && !few) return;
    const std::string found = fmt::format("layer '{}': {} boxes", l.layer.name, l.boxes);
    if (l.layer.hasPlaces())
        warnings.push_back(found + ", as its points are of other boxes, or its masks leave none.");
    else if (l.layer.density == 0) warnings.push_back(found + ", as its density is 0.");
    else if (few)
        warnings.push_back(fmt::format(
            "{}: a density of {:g} on the {:.4g} m^2 of surface '{}' asks for {:.4g}, and chance "
            "decides. For one box that is certain write sampling = \"uv\", cells = [1, 1] and "
            "density = 1, or set a higher density.",
            found, l.layer.density, s.surface.area(), s.name, wanted));
    else
        warnings.push_back(
            found + ": its 'where' or 'size_map' is about 0 wherever a sample fell"
            + (by_area ? "." : ", or its cells are larger than the surface's part of (u,v)."));
}

} // namespace

PlacedScene place(const std::vector<SurfaceSpec>& surfaces, const std::vector<Layer>& layers,
                  std::vector<BoxKind> kinds, const PlaceOptions& options, const Progress& progress)
{
    const double steps = double(surfaces.size() + layers.size());
    double done = 0;
    PlacedScene scene;
    scene.kinds = std::move(kinds);
    for (const SurfaceSpec& spec : surfaces) {
        scene.surfaces.push_back(loadPlacedSurface(spec));
        report(progress, ++done / steps);
    }
    for (const Layer& layer : layers) { // before any of them takes its time
        const std::int32_t surface = indexOf(scene.surfaces, layer.surface, layer, "surface");
        checkSamples(scene.surfaces[static_cast<std::size_t>(surface)].surface, layer);
    }
    for (const Layer& layer : layers) scene.layers.push_back(makeLayer(scene.surfaces, layer));
    // A walk over the mesh begins at the triangle under the box.
    const bool walks = std::any_of(scene.layers.begin(), scene.layers.end(),
                                   [](const PlacedLayer& l) { return l.tints_voxels; });
    const KeptPlaces kept{walks, options.keep_uvs};
    PlacementCollector collector;
    Room room(scene.surfaces, scene.layers);
    for (std::size_t i = 0; i < scene.layers.size(); ++i) {
        PlacedLayer& l = scene.layers[i];
        const std::size_t before = collector.size();
        PlacementCollector own;
        PlacementCollector& out = room.concerns(i) ? own : collector;
        scatter(scene.surfaces[l.surface].surface, l.layer, boxesOf(scene.kinds, l.layer),
                static_cast<int>(i), kept, out,
                [&](double f) { report(progress, (done + f) / steps); });
        if (room.concerns(i)) {
            PlacementList list = own.take();
            room.thin(i, list);
            collector.append(std::move(list));
        }
        l.boxes = collector.size() - before;
        warnOfFewBoxes(l, scene.surfaces[static_cast<std::size_t>(l.surface)], scene.warnings);
        ++done;
    }
    scene.boxes = collector.take();
    report(progress, 1);
    return scene;
}

PlacedScene placedBoxes(std::vector<Placement> placements)
{
    PlacedScene scene;
    scene.boxes.placements = std::move(placements);
    return scene;
}

std::vector<std::string> boxNames(const std::vector<BoxKind>& kinds)
{
    std::vector<std::string> names;
    for (const BoxKind& kind : kinds)
        for (int variant = 0; variant < kind.variants; ++variant)
            names.push_back(fmt::format("{}_{}", kind.name, variant + 1));
    return names;
}

} // namespace volcomp
