// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/stability.h"

#include <algorithm>
#include <cmath>

#include "volcomp/render/march/integrator.h"

namespace volcomp {
namespace {

/// Returns what a lit slab shows if it is summed in floats: each of 32 voxels of optical depth x
/// lets exp(-x) through and shows 1 - exp(-x) of what is left.
double slabInFloats(float x)
{
    float light_left = 1, sum = 0;
    for (int i = 0; i < 32; ++i) {
        sum += light_left * (1 - std::exp(-x));
        light_left *= std::exp(-x);
    }
    return 0.25 * double(sum);
}

} // namespace

ChartPanel stabilityPanel()
{
    ChartPanel panel;
    panel.title = "Stability: a lit slab of 32 voxels";
    panel.x_label = "optical depth of a step (one voxel)";
    panel.y_label = "relative error";
    panel.series = {{"", true, false, {}},
                    {"riemann", true, false, {}},
                    {"1 - exp(-x) in float", true, false, {}}};
    panel.series[0].name = "exact";
    Material material;
    material.alpha = 1;
    Light light;
    light.direction = {0, 0, -1};
    RenderParams params;
    params.shadows = Shadows::none;
    params.cutoff = 0;
    for (double exponent = -8; exponent <= 3.001; exponent += 0.25) {
        const float x = float(std::pow(10, exponent));
        Volume volume;
        volume.parts.emplace_back();
        volume.parts[0].density = openvdb::FloatGrid::create(0.0f);
        volume.parts[0].density->fill(openvdb::CoordBBox({0, 0, 0}, {7, 7, 31}), x, true);
        const VoxelTree tree(volume);
        const double truth = 0.25 * -std::expm1(-32.0 * double(x));
        for (const Integration integration : {Integration::exact, Integration::riemann}) {
            params.integration = integration;
            const std::vector<Light> lights{light};
            const Integrator integrator(tree, {material}, lights, params);
            Integrator::Scratch scratch;
            const double found =
                integrator.trace({3.1, 3.2, 40.003}, {0, 0, -1}, scratch).radiance[0];
            panel.series[integration == Integration::riemann].points.push_back(
                {"", x, std::max(1e-16, std::abs(found / truth - 1))});
        }
        panel.series[2].points.push_back(
            {"", x, std::max(1e-16, std::abs(slabInFloats(x) / truth - 1))});
    }
    return panel;
}

} // namespace volcomp
