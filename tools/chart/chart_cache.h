// What volcomp-chart has measured so far, in files: an interrupted run goes on, a second one only
// draws.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "volcomp/view/image.h"
#include "volcomp/render/render_params.h"
#include "volcomp/scene/scene.h"
#include "tools/shared/tool.h"
#include "volcomp/render/tree/voxel_levels.h"

namespace volcomp {

struct Measured {
    Image image;
    double cpu_seconds = 0; ///< user and system, all threads
};

/// Renders the volumes of one scene and remembers the pictures and times. A result is used again
/// while everything it depends on is the same: the scene file and the files that it names, the
/// programs, and the settings. One volume is in memory at a time.
class ChartCache {
public:
    /// Keeps its files in `directory`; `leave_out` names the surfaces that are not in `scene` any
    /// more. The references must outlive this.
    ChartCache(Tool& tool, const Scene& scene, std::vector<std::string> leave_out,
               std::filesystem::path directory);

    /// A render of the scene's volume of that voxel: sweep and trees of the method included,
    /// loading the volume and making coarser levels of it not. `lights` false: without light.
    Measured render(const std::string& name, double voxel, const RenderParams& params,
                    bool lights = true);

    /// CPU seconds that composing that volume took.
    double composeSeconds(double voxel);

    /// The volume's file, composed where it is not there.
    std::filesystem::path volume(double voxel);

    /// Any other measurement that makes a picture; `key` says all that it depends on beside the
    /// scene and our programs.
    Measured remember(const std::string& name, const nlohmann::json& key,
                      const std::function<Measured()>& measure);

    /// Frees the disk of a volume and its levels, which are needed no more.
    void forget(double voxel);

private:
    nlohmann::json composed(double voxel);
    std::filesystem::path place(const std::string& kind, const nlohmann::json& key,
                                const char* ending) const;
    std::vector<VoxelLevel> levels(double voxel, const RenderParams& params);

    Tool& m_tool;
    const Scene& m_scene;
    std::vector<std::string> m_leave_out;
    std::filesystem::path m_directory;
    nlohmann::json m_scene_key, m_program_key;
    std::shared_ptr<const VoxelTree> m_tree;
    double m_tree_voxel = 0;
};

} // namespace volcomp
