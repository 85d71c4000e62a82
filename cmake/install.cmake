# SPDX-License-Identifier: GPL-2.0-or-later
# Installation and Debian package. The program finds its scripts from its own place: PREFIX/bin/kerf uses
# PREFIX/share/kerf/plots, build/kerf uses build/share/kerf/plots.
include(GNUInstallDirs)
set(KERF_SHARE share/kerf)
set(KERF_DOC share/doc/kerf)

file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/${KERF_SHARE})
file(CREATE_LINK ${CMAKE_SOURCE_DIR}/coupler/application/plots ${CMAKE_BINARY_DIR}/${KERF_SHARE}/plots SYMBOLIC)

install(TARGETS kerf RUNTIME DESTINATION bin)
install(DIRECTORY coupler/application/plots/ DESTINATION ${KERF_SHARE}/plots FILES_MATCHING PATTERN "*.py"
        PATTERN __pycache__ EXCLUDE)
# Stores are made on first use, but for the one that belongs to the first case.
install(DIRECTORY cases DESTINATION ${KERF_SHARE} FILES_MATCHING PATTERN "case.prm" PATTERN "README.md")
install(FILES cases/disc_cutter_2d/packing_random_1000um_seed1.h5 DESTINATION ${KERF_SHARE}/cases/disc_cutter_2d)
install(DIRECTORY docs DESTINATION ${KERF_DOC})
install(FILES README.md LICENSE DESTINATION ${KERF_DOC})
install(FILES CHANGELOG.md DESTINATION ${KERF_DOC} OPTIONAL)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME kerf)
set(CPACK_PACKAGE_CONTACT "The developers of kerf <kerf@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "adaptive coupling of finite elements and bonded particles for rock cutting")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_RESOURCE_FILE_LICENSE ${CMAKE_SOURCE_DIR}/LICENSE)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "openmpi-bin, python3, python3-numpy, python3-matplotlib, python3-h5py")
# A package is for other machines, too: cmake/package_check.cmake stops where the build is not.
set(CPACK_KERF_NATIVE ${KERF_NATIVE})
set(CPACK_PROJECT_CONFIG_FILE ${CMAKE_SOURCE_DIR}/cmake/package_check.cmake)
include(CPack)
