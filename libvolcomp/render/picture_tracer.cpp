// SPDX-License-Identifier: Apache-2.0
#include "volcomp/render/picture_tracer.h"

#include "volcomp/base/error.h"

namespace volcomp {
namespace {

Material materialOf(const VoxelTree::Part& part, const std::vector<Material>& materials)
{
    for (const Material& m : materials)
        if (part.material.empty() ? m.kind == part.kind : m.name == part.material) {
            if (m.kind != part.kind)
                throw Error(
                    "material '" + m.name
                    + "' and the volume's part of that name differ in kind: one has tangents, the other normals");
            return m;
        }
    if (!part.material.empty())
        throw Error("the volume has voxels of material '" + part.material
                    + "', which the scene does not define; add [material." + part.material + "]");
    Material fallback;
    fallback.kind = part.kind;
    return fallback;
}

std::vector<Material> materialsOf(const VoxelTree& tree, const std::vector<Material>& materials)
{
    std::vector<Material> result;
    for (const VoxelTree::Part& part : tree.parts()) result.push_back(materialOf(part, materials));
    return result;
}

/// The same settings, if everything that a picture is made of is in range.
const RenderParams& validated(const RenderParams& params, const Camera& camera,
                              const std::vector<Light>& lights)
{
    camera.validate();
    params.validate();
    for (const Light& light : lights) light.validate();
    if (params.dome.kind == DomeKind::image && !params.dome.image)
        throw Error("render: expected a dome whose image is loaded; loadDome() does it");
    return params;
}

} // namespace

Crop pixelsOf(const RenderParams& params)
{
    return params.crop.width > 0 ? params.crop : Crop{0, 0, params.width, params.height};
}

PictureTracer::PictureTracer(const std::vector<VoxelLevel>& levels,
                             const std::vector<Material>& materials, const Camera& camera,
                             const std::vector<Light>& lights, const RenderParams& params,
                             const SkinTracer* skins)
    : m_params(validated(params, camera, lights)), m_crop(pixelsOf(params)),
      m_rays(camera, params.width, params.height),
      m_tracer(levels, materialsOf(*levels.at(0).tree, materials), lights, params, m_rays, skins)
{
}

} // namespace volcomp
