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

/// "1.2 m", "35 mm": three digits in the unit that reads best.
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

} // namespace

BoxThumbnail renderBoxThumbnail(const Box& box, const std::vector<Material>& materials,
                                const RenderParams& scene_params, int size,
                                const Progress& progress)
{
    openvdb::CoordBBox bounds;
    std::uint64_t voxels = 0;
    for (const VolumePart& part : box.volume.parts) {
        bounds.expand(part.density->evalActiveVoxelBoundingBox());
        voxels += part.density->activeVoxelCount();
    }
    const double h = box.volume.voxelSize();
    BoxThumbnail tile;
    tile.title = fmt::format("{} {}", box.name, box.variant + 1);

    Camera camera;
    camera.projection = Projection::orthographic;
    const bool empty = voxels == 0;
    const Vec3d low = empty ? Vec3d(0.0) : (bounds.min().asVec3d() - Vec3d(0.5)) * h,
                high = empty ? Vec3d(1.0) : (bounds.max().asVec3d() + Vec3d(0.5)) * h;
    const Vec3d extent = high - low, to_eye = Vec3d(0.3, 0.25, 1) / Vec3d(0.3, 0.25, 1).length();
    Vec3d right = Vec3d(0, 1, 0).cross(to_eye);
    right.normalize();
    const Vec3d up = to_eye.cross(right);
    double across = 0;
    for (const Vec3d& axis : {right, up})
        across = std::max(across,
                          std::abs(axis[0]) * extent[0] + std::abs(axis[1]) * extent[1]
                              + std::abs(axis[2]) * extent[2]);
    camera.target = (low + high) * 0.5;
    camera.eye = camera.target + to_eye * (2 * extent.length());
    camera.width = across;
    tile.subtitle = empty
        ? "empty"
        : fmt::format("{} high, {} wide, {} voxels", lengthText(extent[1]),
                      lengthText(std::max(extent[0], extent[2])), countText(voxels));

    RenderParams params = scene_params;
    params.width = params.height = size;
    params.crop = {};
    params.samples = 1; // a pixel is about a voxel
    params.background = kSky;
    params.ambient = Vec3d(0.5);
    const std::vector<Light> lights{directional({0.45, -0.8, -0.55}, 1.9),
                                    directional({-0.7, -0.1, -0.6}, 0.35)};
    tile.picture = render(box.volume, materials, camera, lights, params, progress);
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
        const int x0 = kGap + k % columns * (width + kGap),
                  y0 = kGap + k / columns * (cell_height + kGap);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const float* from = tile.picture.pixel(x, y);
                float* to = sheet.pixel(x0 + x, y0 + y);
                // the background shows where alpha is less than 1 and is already in the colour
                for (int c = 0; c < 3; ++c) to[c] = from[c];
            }
        for (const auto& [line, y, font_size] :
             {std::tuple(tile.title, height + 19, 17), std::tuple(tile.subtitle, height + 37, 11)})
            if (!OIIO::ImageBufAlgo::render_text(text, x0 + 4, y0 + y, line, font_size,
                                                 "DejaVuSans", kInk))
                throw Error(
                    "a sheet's labels need the font DejaVu Sans (Debian's package fonts-dejavu-core): "
                    + text.geterror());
    }
    return sheet;
}

} // namespace volcomp
