# The programs, the library, its headers and a config with which find_package(volcomp) works.
include(CMakePackageConfigHelpers)
install(TARGETS volcomp EXPORT volcompTargets FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/volcomp)
set(VOLCOMP_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/volcomp)
install(EXPORT volcompTargets NAMESPACE volcomp:: DESTINATION ${VOLCOMP_CMAKE_DIR})
configure_package_config_file(cmake/volcompConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/volcompConfig.cmake
  INSTALL_DESTINATION ${VOLCOMP_CMAKE_DIR})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/volcompConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/volcompConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/volcompConfigVersion.cmake
  DESTINATION ${VOLCOMP_CMAKE_DIR})
