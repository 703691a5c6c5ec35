// SPDX-License-Identifier: Apache-2.0
#include "volcomp/inspect/box_sheet.h"

#include <algorithm>
#include <cmath>

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <fmt/format.h>

#include "volcomp/base/error.h"
#include "volcomp/render/render.h"

namespace volcomp {
namespace {

constexpr int kLabelHeight = 44, kGap = 4;
constexpr float kPaper = 0.9f, kInk[] = {0.02f, 0.02f, 0.02f, 1.0f};
const Vec3d kSky(0.62, 0.72, 0.84);

/// A length in the unit that reads best, with three digits: "1.2 m", "35 mm".
std::string lengthText(double metres)
{
    if (metres >= 1) return fmt::format("{:.3g} m", metres);
    if (metres >= 0.1) return fmt::format("{:.3g} cm", 100 * metres);
    return fmt::format("{:.3g} mm", 1000 * metres);
}

std::string countText(std::uint64_t n)
{
    if (n >= 1000000) return fmt::format("{:.3g} M", 1e-6 * double(n));
    return n >= 1000 ? fmt::format("{:.0f} k", 1e-3 * double(n)) : std::to_string(n);
}

Light directional(const Vec3d& direction, double strength)
{
    Light light;
    light.kind = LightKind::directional;
    light.direction = direction / direction.length();
    light.strength = Vec3d(strength);
    return light;
}

/// The bounds of a box's voxels; a unit cube if it has none.
struct Extent {
    Vec3d low{0.0}, high{1.0};
    std::uint64_t voxels = 0;
};

Extent extentOf(const Box& box)
{
    Extent e;
    openvdb::CoordBBox bounds;
    for (const VolumePart& part : box.volume.parts) {
        bounds.expand(part.density->evalActiveVoxelBoundingBox());
        e.voxels += part.density->activeVoxelCount();
    }
    if (e.voxels == 0) return e;
    const double h = box.volume.voxelSize();
    e.low = (bounds.min().asVec3d() - Vec3d(0.5)) * h;
    e.high = (bounds.max().asVec3d() + Vec3d(0.5)) * h;
    return e;
}

/// A camera in front of the box and slightly above, in whose picture it fits.
Camera cameraFor(const Extent& e)
{
    const Vec3d extent = e.high - e.low,
                to_eye = Vec3d(0.3, 0.25, 1) / Vec3d(0.3, 0.25, 1).length();
    Camera camera;
    camera.projection = Projection::orthographic;
    camera.target = (e.low + e.high) * 0.5;
    camera.eye = camera.target + to_eye * (2 * extent.length());
    const CameraFrame frame(camera);
    camera.width = 0;
    for (const Vec3d& axis : {frame.right, frame.up})
        camera.width = std::max(camera.width,
                                std::abs(axis[0]) * extent[0] + std::abs(axis[1]) * extent[1]
                                    + std::abs(axis[2]) * extent[2]);
    return camera;
}

/// Copies a tile's picture and writes its text below.
void addTile(Image& sheet, OIIO::ImageBuf& text, const BoxThumbnail& tile, int left, int top)
{
    for (int y = 0; y < tile.picture.height; ++y)
        for (int x = 0; x < tile.picture.width; ++x)
            // The colour alone: it already has the background where alpha is less than 1.
            std::copy_n(tile.picture.pixel(x, y), 3, sheet.pixel(left + x, top + y));
    const int below = top + tile.picture.height;
    for (const auto& [line, y, font_size] :
         {std::tuple(tile.title, below + 19, 17), std::tuple(tile.subtitle, below + 37, 11)})
        if (!OIIO::ImageBufAlgo::render_text(text, left + 4, y, line, font_size, "DejaVuSans",
                                             kInk))
            throw Error(
                "a sheet's labels need the font DejaVu Sans (Debian's package fonts-dejavu-core): "
                + text.geterror());
}

} // namespace

BoxThumbnail renderBoxThumbnail(const Box& box, const std::vector<Material>& materials,
                                const RenderParams& scene_params, int size,
                                const Progress& progress)
{
    const Extent e = extentOf(box);
    const Vec3d extent = e.high - e.low;
    BoxThumbnail tile;
    tile.title = fmt::format("{} {}", box.name, box.variant + 1);
    tile.subtitle = e.voxels == 0
        ? "empty"
        : fmt::format("{} high, {} wide, {} voxels", lengthText(extent[1]),
                      lengthText(std::max(extent[0], extent[2])), countText(e.voxels));

    RenderParams params = scene_params;
    params.width = params.height = size;
    params.crop = {};
    params.samples = 1; // a pixel is about a voxel
    params.background = kSky;
    params.dome = {}; // the scene's, whose image nobody has loaded
    params.haze = {};
    params.ambient = Vec3d(0.5);
    const std::vector<Light> lights{directional({0.45, -0.8, -0.55}, 1.9),
                                    directional({-0.7, -0.1, -0.6}, 0.35)};
    tile.picture = render(box.volume, materials, cameraFor(e), lights, params, progress);
    return tile;
}

Image contactSheet(const std::vector<BoxThumbnail>& tiles)
{
    if (tiles.empty()) throw Error("a sheet: expected at least one picture, found none");
    const int width = tiles[0].picture.width, height = tiles[0].picture.height,
              cell_height = height + kLabelHeight;
    const int count = static_cast<int>(tiles.size());
    const int columns = std::min(count, static_cast<int>(std::ceil(std::sqrt(1.4 * count)))),
              rows = (count + columns - 1) / columns;
    Image sheet;
    sheet.width = columns * (width + kGap) + kGap;
    sheet.height = rows * (cell_height + kGap) + kGap;
    sheet.channels = {"R", "G", "B", "A"};
    sheet.pixels.assign(std::size_t(4) * sheet.width * sheet.height, kPaper);
    for (std::size_t i = 3; i < sheet.pixels.size(); i += 4) sheet.pixels[i] = 1;

    OIIO::ImageBuf text(OIIO::ImageSpec(sheet.width, sheet.height, 4, OIIO::TypeDesc::FLOAT),
                        sheet.pixels.data());
    for (int k = 0; k < count; ++k) {
        const BoxThumbnail& tile = tiles[static_cast<std::size_t>(k)];
        if (tile.picture.width != width || tile.picture.height != height)
            throw Error("a sheet: expected pictures of one size");
        addTile(sheet, text, tile, kGap + k % columns * (width + kGap),
                kGap + k / columns * (cell_height + kGap));
    }
    return sheet;
}

} // namespace volcomp
