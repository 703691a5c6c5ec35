// SPDX-License-Identifier: Apache-2.0
// A drawing of a scene before anything is baked: what stands where in the picture.
#pragma once

#include <string>
#include <vector>

#include "volcomp/place/placed_scene.h"
#include "volcomp/scene/scene.h"
#include "volcomp/view/image.h"

namespace volcomp {

/// A scene's placements, or an even part of them if there are very many.
struct LayoutPlaces {
    PlacedScene placed;
    std::vector<double> parts; ///< by layer: of the boxes, how many are there, 0 to 1
};

/// Places a scene for a layout: all boxes up to about a million, of more layers as many as an even
/// part of each needs to stay below. Throws Error as place() does.
LayoutPlaces placeForLayout(const Scene& scene);

/// How many strokes a layout has at most.
inline constexpr std::size_t kLayoutStrokes = 100'000;

/// Draws the surfaces with their skins' maps, a stroke for each box from its root along its axis,
/// as long as the longest strand on the box's ground and in the colour of its layer, and the
/// lights: those at a place where they are, the others as arrows around a small globe, as the
/// camera sees them. The picture's own frame, of scene.render's size, is a rectangle; a margin
/// around it, which is darker, shows what is cut off. Labels name layers, numbers of boxes and
/// lights. Of more than kLayoutStrokes boxes every nth is drawn, and a label says so. Throws Error
/// if the font DejaVu Sans is not installed.
Image layoutPicture(const Scene& scene, const LayoutPlaces& places);

/// The margin on each side of a frame of that size, pixels.
int layoutMargin(int width, int height);

} // namespace volcomp
