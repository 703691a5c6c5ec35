// SPDX-License-Identifier: Apache-2.0
#include "tools/shared/version.h"

#include <vector>

#include <CGAL/version.h>
#include <OpenImageIO/oiioversion.h>
#include <OpenMesh/Core/System/config.h>
#include <fmt/format.h>
#include <openvdb/version.h>
#include <tbb/version.h>
#if __has_include(<hwy/highway.h>)
#include <hwy/highway.h>
#endif

#include "volcomp/base/instruction_set.h"
#include "volcomp/base/text.h"

namespace volcomp {

std::string versionText(const std::string& program)
{
    std::vector<std::string> libraries{
        fmt::format("OpenVDB {}", OPENVDB_LIBRARY_VERSION_STRING),
        fmt::format("OpenImageIO {}", OIIO_VERSION_STRING),
        fmt::format("OpenMesh {}.{}", OM_GET_VER, OM_GET_MAJ),
        fmt::format("CGAL {}", CGAL_VERSION_STR),
        fmt::format("TBB {}.{}", TBB_VERSION_MAJOR, TBB_VERSION_MINOR),
    };
#ifdef HWY_MAJOR
    libraries.push_back(fmt::format("Highway {}.{}.{}", HWY_MAJOR, HWY_MINOR, HWY_PATCH));
#endif
    return fmt::format(
        "{} {}\n"
        "Libraries: {}.\n"
        "Vector instructions in use: {}.\n"
        "This program as built is distributed under GPL-3.0-or-later, because of CGAL's AABB tree;\n"
        "its own sources are under Apache-2.0.",
        program, VOLCOMP_VERSION, joined(libraries), instructionSet());
}

} // namespace volcomp
