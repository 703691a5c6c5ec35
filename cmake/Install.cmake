# SPDX-License-Identifier: Apache-2.0
# What is installed. The component `programs` is what the Debian package holds: the programs, their
# manual pages and shell completion, scenes, documents and licences. The component `development` is
# the library, its public headers and a config with which find_package(volcomp) works.
include(CMakePackageConfigHelpers)
set(VOLCOMP_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/volcomp)
install(TARGETS volcomp EXPORT volcompTargets
  ARCHIVE COMPONENT development
  LIBRARY COMPONENT programs NAMELINK_COMPONENT development) # the programs need a shared library
foreach(header ${VOLCOMP_PUBLIC_HEADERS} ${VOLCOMP_INCLUDED_HEADERS})
  get_filename_component(room ${header} DIRECTORY)
  install(FILES libvolcomp/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/volcomp/${room}
    COMPONENT development)
endforeach()
install(EXPORT volcompTargets NAMESPACE volcomp:: DESTINATION ${VOLCOMP_CMAKE_DIR}
  COMPONENT development)
configure_package_config_file(cmake/volcompConfig.cmake.in
  ${CMAKE_CURRENT_BINARY_DIR}/volcompConfig.cmake INSTALL_DESTINATION ${VOLCOMP_CMAKE_DIR})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/volcompConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/volcompConfig.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/volcompConfigVersion.cmake
  DESTINATION ${VOLCOMP_CMAKE_DIR} COMPONENT development)

# A manual page is the program's own --help with the sections of cmake/manual.h2m. Completion is
# bash-completion's reading of --help.
find_program(HELP2MAN help2man)
get_property(programs GLOBAL PROPERTY VOLCOMP_PROGRAMS)
foreach(target ${programs})
  get_target_property(program ${target} OUTPUT_NAME)
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/completions/${program} "complete -F _longopt ${program}\n")
  if(HELP2MAN)
    set(page ${CMAKE_CURRENT_BINARY_DIR}/man/${program}.1.gz)
    set(make_page "\"$0\" --no-info --name \"$($1 --help | head -1)\" --include \"$2\" \"$1\"")
    add_custom_command(OUTPUT ${page} VERBATIM
      DEPENDS ${target} ${CMAKE_CURRENT_SOURCE_DIR}/cmake/manual.h2m
      COMMAND sh -c "${make_page} | gzip -9n > \"$3\"" ${HELP2MAN}
              $<TARGET_FILE:${target}> ${CMAKE_CURRENT_SOURCE_DIR}/cmake/manual.h2m ${page})
    list(APPEND pages ${page})
  endif()
endforeach()
set(script ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}/volcomp-import)
file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/completions/volcomp-import
  "complete -F _longopt volcomp-import\n")
if(HELP2MAN)
  set(page ${CMAKE_CURRENT_BINARY_DIR}/man/volcomp-import.1.gz)
  set(make_page "\"$0\" --no-info --name \"makes strands of Alembic and USD curves\" \"$1\"")
  add_custom_command(OUTPUT ${page} VERBATIM DEPENDS ${script}
    COMMAND sh -c "${make_page} | gzip -9n > \"$2\"" ${HELP2MAN} ${script} ${page})
  list(APPEND pages ${page})
endif()
install(DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/completions/
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT programs)
if(HELP2MAN)
  add_custom_target(man ALL DEPENDS ${pages})
  install(FILES ${pages} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT programs)
endif()
install(DIRECTORY scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/volcomp COMPONENT programs
  USE_SOURCE_PERMISSIONS PATTERN update_keys.sh EXCLUDE PATTERN __pycache__ EXCLUDE)
install(FILES README.md CHANGELOG.md CONTRIBUTING.md SECURITY.md LICENSE NOTICE packages.txt
  cmake/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT programs)
install(DIRECTORY LICENSES docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT programs)
# The pages in scenes/ show pictures of ../docs.
file(RELATIVE_PATH docs_from_scenes ${CMAKE_INSTALL_FULL_DATADIR}/volcomp
  ${CMAKE_INSTALL_FULL_DOCDIR}/docs)
file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/installed)
file(CREATE_LINK ${docs_from_scenes} ${CMAKE_CURRENT_BINARY_DIR}/installed/docs SYMBOLIC)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/installed/docs
  DESTINATION ${CMAKE_INSTALL_DATADIR}/volcomp COMPONENT programs)

# cmake --workflow --preset package makes build/package/volcomp_VERSION_ARCH.deb.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the volcomp developers <volcomp@localhost>")
set(CPACK_COMPONENTS_ALL programs)
set(CPACK_COMPONENTS_GROUPING ALL_COMPONENTS_IN_ONE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_PACKAGE_DESCRIPTION "\
volcomp-bake grows fur and plants from recursive functions and bakes them into
boxes of voxels, volcomp-compose stands thousands of them on a surface and adds
them into one sparse OpenVDB grid, volcomp-render shades it. volcomp-chart
measures methods and settings.")
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION ${CPACK_PACKAGE_DESCRIPTION})
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# The scenes' surfaces and maps are made by Python, and volcomp-import has an environment of it; the font is for the labels on sheets.
set(CPACK_DEBIAN_PACKAGE_DEPENDS "python3, python3-numpy, python3-venv, fonts-dejavu-core")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "gnuplot-nox, bash-completion")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "libopenvdb-tools") # volcomp-chart compares with vdb_render
include(CPack)
