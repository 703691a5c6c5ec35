// SPDX-License-Identifier: Apache-2.0
// The scene file of a program, and --set.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/shared/tool.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// The scene file that is a program's first argument, and the settings that count beside it.
class SceneOption {
public:
    /// Adds SCENE and --set; this object must outlive the parsing.
    explicit SceneOption(CLI::App& app)
    {
        app.add_option("scene", m_file, "Scene file (TOML)")->required()->type_name("SCENE");
        app.add_option("--set", m_settings,
                       "Give a key of the scene another value, as in light.rim.strength=2 or "
                       "box.fur.level.1.length=0.03; may be given more than once")
            ->type_name("KEY=VALUE")
            ->allow_extra_args(false);
    }

    /// Reads the scene with the settings, and prints its warnings. Throws Error as readScene().
    Scene read(const Tool& tool) const
    {
        Scene scene = readScene(m_file, m_settings);
        for (const std::string& warning : scene.warnings) tool.warn(warning);
        return scene;
    }

    const std::filesystem::path& file() const { return m_file; }

private:
    std::filesystem::path m_file;
    std::vector<std::string> m_settings;
};

} // namespace volcomp
