#include "settings.h"

namespace volcomp {

nlohmann::json settingsOf(const RenderParams& p)
{
    static constexpr const char* kIntegration[] = {"exact", "riemann"};
    static constexpr const char* kFilter[] = {"box", "trilinear"};
    static constexpr const char* kExtinction[] = {"isotropic", "fibre"};
    static constexpr const char* kShadows[] = {"exact", "sweep", "none"};
    static constexpr const char* kUndirected[] = {"isotropic", "gradient"};
    static constexpr const char* kPixelFilter[] = {"box", "gaussian", "blackman-harris"};
    const auto colour = [](const Vec3d& c) { return nlohmann::json{c[0], c[1], c[2]}; };
    return {{"width", p.width},
            {"height", p.height},
            {"crop", {p.crop.x, p.crop.y, p.crop.width, p.crop.height}},
            {"samples", p.samples},
            {"pixel_filter", kPixelFilter[int(p.pixel_filter)]},
            {"pixel_radius", p.pixel_radius},
            {"tau", p.tau},
            {"step", p.step},
            {"cutoff", p.cutoff},
            {"lod", p.lod},
            {"integration", kIntegration[int(p.integration)]},
            {"filter", kFilter[int(p.filter)]},
            {"extinction", kExtinction[int(p.extinction)]},
            {"shadows", kShadows[int(p.shadows)]},
            {"undirected", kUndirected[int(p.undirected)]},
            {"aovs", p.aovs},
            {"background", colour(p.background)},
            {"ambient", colour(p.ambient)}};
}

} // namespace volcomp
