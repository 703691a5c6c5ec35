// A picture of each box in one sheet, to see at a glance what was baked.
#pragma once

#include <string>
#include <vector>

#include "volcomp/view/image.h"
#include "volcomp/volume/material.h"
#include "volcomp/base/progress.h"
#include "volcomp/render/render_params.h"
#include "volcomp/volume/volume.h"

namespace volcomp {

/// One picture of a sheet, with two lines below it.
struct BoxThumbnail {
    Image picture;
    std::string title, subtitle;
};

/// The box from the front and slightly above, as large as fits into size x size pixels, lit from
/// the upper left in front of a bright background; its name, extent and number of voxels below.
/// `params` gives tau and the extinction. Throws Error as render() does.
BoxThumbnail renderBoxThumbnail(const Box& box, const std::vector<Material>& materials,
                                const RenderParams& params, int size = 256,
                                const Progress& progress = {});

/// The tiles in rows, wider than high. Throws Error where there is no tile, their sizes differ or
/// no font is installed.
Image contactSheet(const std::vector<BoxThumbnail>& tiles);

} // namespace volcomp
