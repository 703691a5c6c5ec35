// SPDX-License-Identifier: Apache-2.0
// The option --leave-out of the programs that compose.
#pragma once

#include <string>
#include <vector>

#include "volcomp/base/error.h"
#include "volcomp/base/text.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// Takes the named surfaces and the layers on them out of the scene. Throws Error if the scene has
/// no surface of a name.
inline void leaveOut(Scene& scene, const std::vector<std::string>& surfaces)
{
    for (const std::string& surface : surfaces) {
        if (removeSurface(scene, surface)) continue;
        throw fileError(scene.file, "--leave-out",
                        "the name of a surface (" + joined(namesOf(scene.surfaces)) + ")",
                        "'" + surface + "'");
    }
}

} // namespace volcomp
