// SPDX-License-Identifier: Apache-2.0
// Uses the installed library: argv[1] is a scene file with a surface, argv[2] a volume to write.
#include <error.h> // glibc's: a header of the same name must not come before it

#include <cstdio>

#include <volcomp/base/error.h>
#include <volcomp/scene/scene.h>
#include <volcomp/surface/surface.h>
#include <volcomp/volume/vdb_io.h>

namespace {

// The nearest point of the scene's surface comes from CGAL, and so from gmp and mpfr when the
// library is static.
bool readsScenes(const char* file)
{
    const volcomp::Scene scene = volcomp::readScene(file);
    const volcomp::Surface surface = volcomp::loadSurface(scene.surfaces.at(0));
    const volcomp::Vec3d above(0.5, 0.5, -0.1); // the ground lies at y = 0.2
    return (surface.nearest(above).position - volcomp::Vec3d(0.5, 0.2, -0.1)).length() < 1e-6;
}

bool writesAndReadsVolumes(const char* file)
{
    volcomp::VolumePart part;
    part.density = openvdb::FloatGrid::create(0.0f);
    part.density->tree().setValue(openvdb::Coord(1, 2, 3), 4.0f);
    volcomp::writeVolume(file, {{part}});
    const volcomp::Volume back = volcomp::readVolume(file);
    return back.parts.size() == 1
        && back.parts[0].density->tree().getValue(openvdb::Coord(1, 2, 3)) == 4.0f;
}

} // namespace

int main(int, char** argv)
{
    openvdb::initialize();
    if (!readsScenes(argv[1])) error(1, 0, "the scene was read wrongly");
    if (!writesAndReadsVolumes(argv[2])) error(1, 0, "the volume was read wrongly");
    return 0;
}
