// SPDX-License-Identifier: Apache-2.0
// The dome of a scene file, ready for render().
#pragma once

#include <string>
#include <vector>

#include "volcomp/scene/scene.h"

namespace volcomp {

/// Loads the image of the scene's dome, if it has one, and adds its suns (loadDome()) to the
/// scene's lights: "sun", "sun2" and so on, passing over names that other lights have. Returns a
/// sentence for each sun, for people. Throws Error as loadDome() does.
std::vector<std::string> loadSceneDome(Scene& scene);

} // namespace volcomp
