// How a picture is computed: every approximation has its switch here.
#pragma once

#include "vec.h"

namespace volcomp {

class TableReader;

enum class Integration { exact, riemann };
enum class Filter { box, trilinear };
enum class Extinction { isotropic, fibre };
enum class Undirected { isotropic, gradient };  ///< how a voxel without direction is shaded (MODEL section 4)

struct RenderParams {
    int width = 640, height = 480;              ///< pixels
    int samples = 1;                            ///< per pixel
    double tau = 1;                             ///< extinction per density, >= 0
    Integration integration = Integration::exact;
    double step = 1;                            ///< riemann: voxels
    Filter filter = Filter::box;
    Extinction extinction = Extinction::fibre;
    Undirected undirected = Undirected::isotropic;
    Vec3d background{0};                        ///< radiance behind everything, linear RGB
    Vec3d ambient{0};                           ///< radiance from all around, linear RGB

    void validate() const;
};

/// Reads the [render] table.
RenderParams readRender(TableReader& table);

} // namespace volcomp
