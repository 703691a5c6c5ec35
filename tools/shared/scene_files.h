// SPDX-License-Identifier: Apache-2.0
// The files that a scene reads.
#pragma once

#include <vector>

#include "volcomp/base/distinct_files.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// The scene, the scenes that it includes, its meshes, height maps and images.
std::vector<NamedFile> filesOf(const Scene& scene);

} // namespace volcomp
