// SPDX-License-Identifier: Apache-2.0
// A sheet with a picture of each box, to see at a glance what was baked.
#pragma once

#include <string>
#include <vector>

#include "volcomp/view/image.h"
#include "volcomp/volume/material.h"
#include "volcomp/base/progress.h"
#include "volcomp/render/render_params.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// One picture of a sheet and the two lines of text below it.
struct BoxThumbnail {
    Image picture;
    std::string title, subtitle;
};

/// Renders a box from the front and slightly above, as large as fits into size x size pixels, lit
/// from the upper left in front of a bright background. The text is its name, its extent and its
/// number of voxels. `params` gives tau and the extinction. Throws Error as render() does.
BoxThumbnail renderBoxThumbnail(const Box& box, const std::vector<Material>& materials,
                                const RenderParams& params, int size = 256,
                                const Progress& progress = {});

/// Puts the tiles in rows, so that the sheet is wider than high. Throws Error if there is no tile,
/// if their sizes differ, or if the font DejaVu Sans is not installed.
Image contactSheet(const std::vector<BoxThumbnail>& tiles);

} // namespace volcomp
