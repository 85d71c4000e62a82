# SPDX-License-Identifier: GPL-2.0-or-later
# Read by CPack before it packs.
if(CPACK_KERF_NATIVE)
  message(FATAL_ERROR "this build is for this machine's processor only (KERF_NATIVE=ON) and would stop with an illegal "
                      "instruction elsewhere; a package is built by: cmake --workflow --preset package")
endif()
