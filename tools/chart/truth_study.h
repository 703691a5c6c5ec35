// SPDX-License-Identifier: Apache-2.0
// What pictures of a scene cost, and how far they are from its geometry: curves traced directly,
// and volumes with several settings and voxel sizes.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/chart/equal_error.h"
#include "tools/chart/matrix.h"
#include "tools/chart/other_light.h"
#include "tools/shared/picture_error.h"
#include "tools/shared/tool.h"
#include "volcomp/scene/scene.h"
#include "volcomp/view/image.h"

namespace volcomp {

/// Seconds of all threads together, and by the clock.
struct Cost {
    double cpu = 0, wall = 0;
};

/// All that a user waits for until there is a picture.
struct Costs {
    Cost bake;    ///< of the boxes; none for curves
    Cost build;   ///< composing; for curves growing, placing and Embree's tree
    Cost load;    ///< starting, reading the volume, writing the picture
    Cost picture; ///< tracing, and sweeping the light through the volume
    Cost sum() const
    {
        return {bake.cpu + build.cpu + load.cpu + picture.cpu,
                bake.wall + build.wall + load.wall + picture.wall};
    }
};

/// One picture that was compared with the exact one.
struct TruthResult {
    bool curves = false; ///< traced directly: of `row` only the samples count
    TruthRow row;
    double voxel = 0; ///< metres; 0 for curves
    Costs costs;
    PictureError error;
    std::filesystem::path picture;
    EqualError at_pixels, at_blocks; ///< curves of the same error; for a volume
};

/// What is measured.
struct TruthSetup {
    std::filesystem::path directory; ///< where the files are kept
    int width = 160, height = 120;   ///< pixels
    int samples = 256;               ///< of the exact picture
    double voxel = 0;                ///< the scene's at this width, metres
    std::vector<double> factors{0.5, 1, 2, 4};
    bool all_methods = false;
    std::vector<std::string> leave_out;
    std::vector<OtherLight> other_lights; ///< measured beside the scene's own
};

/// What was measured under one light. All errors are against `exact`, which has this light.
struct TruthOfLight {
    OtherLight light;
    std::filesystem::path exact;      ///< the exact picture
    std::vector<TruthResult> results; ///< the curves first
};

/// The scene's pictures by our programs, which lie beside the one that runs. Everything measured is
/// kept: it is used again as long as the scene, the files that it names, the programs and the
/// settings are the same.
class TruthStudy {
public:
    /// The references must outlive this. `scene` is without the surfaces to leave out.
    TruthStudy(Tool& tool, const Scene& scene, TruthSetup setup);

    /// Returns what was measured under the scene's own light, then under the others: of these the
    /// box filter and swept light alone, at the voxel size that is nearest to the scene's. Throws
    /// Error if a program fails.
    std::vector<TruthOfLight> measure();

    const TruthSetup& setup() const { return m_setup; }

private:
    using Command = std::vector<std::string>;

    void traceExact(TruthOfLight& light);
    TruthResult curves(const OtherLight& light, int samples);
    TruthResult volume(const OtherLight& light, const TruthRow& row);
    std::filesystem::path boxes();
    std::filesystem::path composed(double factor);
    nlohmann::json composeKey(double factor) const;
    nlohmann::json composeFigures(double factor);
    nlohmann::json bakeFigures();
    /// The figures of the picture that `command` makes, which lacks only -o and its name.
    nlohmann::json pictured(const std::string& name, const nlohmann::json& key,
                            const std::filesystem::path& file, int repeats,
                            const std::function<Command()>& command);
    nlohmann::json timed(const std::string& name, const Command& command, int repeats);
    nlohmann::json key(std::initializer_list<const char*> programs, nlohmann::json what) const;
    Command withLeftOut(Command command) const;
    static Command withLight(Command command, const OtherLight& light);
    std::string size() const;
    void warnOf(const std::string& output);

    Tool& m_tool;
    const Scene& m_scene;
    TruthSetup m_setup;
    std::string m_scene_hash;
    nlohmann::json m_programs; ///< hashes by name
    std::set<std::string> m_warned;
};

} // namespace volcomp
