// SPDX-License-Identifier: Apache-2.0
#include "tools/chart/vdb_render.h"

#include <algorithm>

#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "tools/shared/process.h"

namespace volcomp {

Measured vdbRender(const Scene& scene, const RenderParams& params,
                   const std::filesystem::path& volume, double voxel, double step,
                   const std::filesystem::path& scratch)
{
    const auto vector = [](const Vec3d& v) {
        return fmt::format("{:.9g},{:.9g},{:.9g}", v[0], v[1], v[2]);
    };
    const Camera& camera = scene.camera;
    const auto run = [&](int width, int height) {
        std::vector<std::string> command{"vdb_render",
                                         volume.string(),
                                         scratch.string(),
                                         "-name",
                                         "density",
                                         "-cpus",
                                         "1",
                                         "-res",
                                         fmt::format("{}x{}", width, height),
                                         "-translate",
                                         vector(camera.eye),
                                         "-lookat",
                                         vector(camera.target),
                                         "-up",
                                         vector(camera.up),
                                         "-gain",
                                         "0",
                                         "-absorb",
                                         vector(Vec3d(params.tau * voxel)),
                                         "-scatter",
                                         "0,0,0",
                                         "-step",
                                         fmt::format("{:g}", step),
                                         "-shadowstep",
                                         "1000000",
                                         "-cutoff",
                                         "1e-6",
                                         "-compression",
                                         "none"};
        if (camera.projection == Projection::perspective)
            command.insert(command.end(),
                           {"-fov", fmt::format("{:.9g}", camera.field_of_view * 180 / kPi)});
        else
            command.insert(command.end(),
                           {"-camera", "ortho", "-frame", fmt::format("{:.9g}", camera.width)});
        const ProcessResult result = runProcess(command);
        if (result.status != 0 || !std::filesystem::exists(scratch))
            throw Error("vdb_render failed:\n" + result.output);
        return result.cpu_seconds;
    };
    Measured measured;
    const double load = run(1, 1), all = run(params.width, params.height);
    measured.cpu_seconds = std::max(1e-3, all - load);
    measured.image = readImage(scratch);
    std::filesystem::remove(scratch);
    return measured;
}

} // namespace volcomp
