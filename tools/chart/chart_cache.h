// SPDX-License-Identifier: Apache-2.0
// What volcomp-chart has measured so far, kept in files: an interrupted run goes on from there, and
// a second run only draws.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "volcomp/view/image.h"
#include "volcomp/render/render_params.h"
#include "volcomp/scene/scene.h"
#include "volcomp/scene/scene_skins.h"
#include "tools/shared/tool.h"
#include "volcomp/render/tree/voxel_levels.h"

namespace volcomp {

struct Measured {
    Image image;
    double cpu_seconds = 0; ///< user and system, all threads
};

/// Renders the volumes of one scene and remembers the pictures and times. A result is used again as
/// long as everything that it depends on is the same: the scene file and the files that it names,
/// the programs, and the settings. One volume is in memory at a time.
class ChartCache {
public:
    /// Keeps its files in `directory`; `leave_out` names the surfaces that are not in `scene` any
    /// more. The references must outlive this.
    ChartCache(Tool& tool, const Scene& scene, std::vector<std::string> leave_out,
               std::filesystem::path directory);

    /// Renders the scene's volume with voxels of `voxel` metres and its skins, or, if `lights` is
    /// false, the volume alone without any light. The time includes the sweep and the trees that
    /// the method needs, but not the loading of the volume and the making of its coarser levels.
    Measured render(const std::string& name, double voxel, const RenderParams& params,
                    bool lights = true);

    /// Returns the CPU seconds that composing the volume took.
    double composeSeconds(double voxel);

    /// Returns the file of the volume, which is composed if it does not exist.
    std::filesystem::path volume(double voxel);

    /// Returns the remembered result, or calls measure(). `key` holds all that the result depends
    /// on beside the scene and our programs.
    Measured remember(const std::string& name, const nlohmann::json& key,
                      const std::function<Measured()>& measure);

    /// Removes the files of a volume and its levels.
    void forget(double voxel);

private:
    nlohmann::json composed(double voxel);
    std::filesystem::path boxes();
    std::filesystem::path place(const std::string& kind, const nlohmann::json& key,
                                const char* ending) const;
    std::vector<VoxelLevel> levels(double voxel, const RenderParams& params);
    const SkinTracer* skins();

    Tool& m_tool;
    const Scene& m_scene;
    std::vector<std::string> m_leave_out;
    std::filesystem::path m_directory;
    nlohmann::json m_scene_key, m_program_key;
    std::shared_ptr<const VoxelTree> m_tree;
    double m_tree_voxel = 0;
    std::unique_ptr<const SkinTracer> m_skins; ///< once they are asked for
};

} // namespace volcomp
