// Writes a volume with the installed library and reads it back.
#include <cstdio>

#include <volcomp/volume/vdb_io.h>

int main(int, char** argv)
{
    openvdb::initialize();
    volcomp::VolumePart part;
    part.density = openvdb::FloatGrid::create(0.0f);
    part.density->tree().setValue(openvdb::Coord(1, 2, 3), 4.0f);
    volcomp::writeVolume(argv[1], {{part}});
    const volcomp::Volume back = volcomp::readVolume(argv[1]);
    return back.parts.size() == 1
            && back.parts[0].density->tree().getValue(openvdb::Coord(1, 2, 3)) == 4.0f
        ? 0
        : 1;
}
