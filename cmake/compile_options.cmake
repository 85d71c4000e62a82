# SPDX-License-Identifier: GPL-2.0-or-later
# KERF_COMPILE_OPTIONS: flags of all targets.
include(CheckCXXCompilerFlag)

# deal.II empties CMake's own Release flags, and its flags ask for debug information, which makes compiling slow.
set(KERF_COMPILE_OPTIONS -Wall -Wextra -fno-math-errno)
if(KERF_ASSERTIONS)
  list(APPEND KERF_COMPILE_OPTIONS -O2 -g1 -UNDEBUG -D_GLIBCXX_ASSERTIONS)
else()
  list(APPEND KERF_COMPILE_OPTIONS $<$<CONFIG:Release>:-O3> $<$<CONFIG:Release>:-g0> $<$<CONFIG:Release>:-DNDEBUG>)
endif()
# deal.II asks for no optimisation in a Debug build; sanitizers are too slow so.
list(APPEND KERF_COMPILE_OPTIONS $<$<CONFIG:Debug>:-O1>)

# Eigen's alignment depends on the instruction set, so the whole program is compiled for it, not only its kernels.
if(KERF_NATIVE)
  check_cxx_compiler_flag(-march=native KERF_HAS_MARCH_NATIVE)
  if(KERF_HAS_MARCH_NATIVE)
    list(APPEND KERF_COMPILE_OPTIONS -march=native)
  endif()
elseif(KERF_PORTABLE_LEVEL)
  check_cxx_compiler_flag(-march=${KERF_PORTABLE_LEVEL} KERF_HAS_PORTABLE_LEVEL)
  if(KERF_HAS_PORTABLE_LEVEL)
    list(APPEND KERF_COMPILE_OPTIONS -march=${KERF_PORTABLE_LEVEL})
  else()
    set(KERF_PORTABLE_LEVEL "")
  endif()
endif()
if(NOT KERF_NATIVE)
  set(level ${KERF_PORTABLE_LEVEL})
  if(NOT level)
    set(level "the compiler's default processor")
  endif()
  message(STATUS "kerf: compiled for ${level} (KERF_NATIVE=OFF): runs on other machines, "
                 "slower than a build for this machine's processor")
endif()

# Nothing that is compiled in may name the directory of the sources.
list(APPEND KERF_COMPILE_OPTIONS -ffile-prefix-map=${CMAKE_SOURCE_DIR}/=)

if(KERF_WARNINGS_ARE_ERRORS)
  list(APPEND KERF_COMPILE_OPTIONS -Werror)
endif()
if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
  # deal.II hands on the flags of the compiler that it was built with.
  list(APPEND KERF_COMPILE_OPTIONS -Wno-unknown-warning-option -Wno-unused-command-line-argument -Wno-ignored-optimization-argument)
endif()
