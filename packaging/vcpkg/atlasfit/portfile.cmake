# An overlay port: `vcpkg install atlasfit --overlay-ports=packaging/vcpkg` in a clone. Needs cargo (Rust 1.95
# or newer) in PATH. ATLASFIT_SOURCE names the sources where this port does not lie in a clone.
if(DEFINED ENV{ATLASFIT_SOURCE})
  set(SOURCE_PATH "$ENV{ATLASFIT_SOURCE}")
else()
  get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
endif()
if(NOT EXISTS "${SOURCE_PATH}/cpp/CMakeLists.txt")
  message(FATAL_ERROR "atlasfit's sources are not at ${SOURCE_PATH}: set ATLASFIT_SOURCE to a clone")
endif()

vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}/cpp")
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(PACKAGE_NAME atlasfit CONFIG_PATH lib/cmake/atlasfit)
vcpkg_fixup_pkgconfig()

# One kind of library in each tree; the CMake package offers what is there.
if(VCPKG_LIBRARY_LINKAGE STREQUAL "static")
  set(unwanted libatlasfit.so*)
else()
  set(unwanted libatlasfit.a)
endif()
file(GLOB unwanted
  "${CURRENT_PACKAGES_DIR}/lib/${unwanted}" "${CURRENT_PACKAGES_DIR}/debug/lib/${unwanted}")
file(REMOVE ${unwanted})
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE-MIT" "${SOURCE_PATH}/LICENSE-APACHE")
file(INSTALL "${CMAKE_CURRENT_LIST_DIR}/usage" DESTINATION "${CURRENT_PACKAGES_DIR}/share/${PORT}")
