// SPDX-License-Identifier: Apache-2.0
// The files that a scene names, with the keys that name them: the one list of them.
//
// A key that is new and takes a path is added here.
#pragma once

#include <vector>

#include "volcomp/base/distinct_files.h"
#include "volcomp/scene/scene.h"

namespace volcomp {

/// The files of one table, each under its key, such as "mesh"; a key may stand more than once.
std::vector<NamedFile> inputsOf(const SurfaceSpec& surface);
std::vector<NamedFile> inputsOf(const Layer& layer);
std::vector<NamedFile> inputsOf(const GrowthRule& box);

/// All files that the scene reads, each under its table and key or as "the scene" and "an included
/// scene". They need not exist.
std::vector<NamedFile> inputsOf(const Scene& scene);

} // namespace volcomp
