# SPDX-License-Identifier: Apache-2.0
# The libraries that volcomp stands on, all from Debian 12's packages. Their headers are SYSTEM, so
# that the compiler gives no warnings about them.

# The cache gives an object of one build folder to another of the same kind: paths below the sources
# are made relative, and the folder's name counts for nothing even with debugging information. The
# sloppiness lets ccache work with a precompiled header.
find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_NOHASHDIR=1
      CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
      CCACHE_BASEDIR=${CMAKE_SOURCE_DIR} ${CCACHE})
endif()

list(APPEND CMAKE_MODULE_PATH /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
set(OpenMesh_FIND_QUIETLY ON)
find_package(OpenVDB REQUIRED COMPONENTS openvdb)
find_package(TBB REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(CLI11 REQUIRED)
find_package(OpenImageIO REQUIRED)
find_package(OpenMesh REQUIRED)
find_package(CGAL REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(hwy REQUIRED)
find_package(embree 3 REQUIRED)
if(VOLCOMP_TESTS)
  find_package(GTest REQUIRED)
endif()
if(VOLCOMP_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()

# CGAL's own target would put -frounding-math on every source, and the marcher would not be
# vectorised any more. Only the sources that include CGAL get the flag (VOLCOMP_CGAL_SOURCES).
add_library(volcomp_cgal INTERFACE)
target_include_directories(volcomp_cgal SYSTEM INTERFACE
  $<TARGET_PROPERTY:CGAL::CGAL,INTERFACE_INCLUDE_DIRECTORIES>)
