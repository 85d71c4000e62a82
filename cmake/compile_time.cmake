# SPDX-License-Identifier: GPL-2.0-or-later
# Most of a file's compile time is the parsing of library headers. Headers that many files use are compiled once for all files
# with the same flags. deal.II's take about eight seconds and, precompiled, a gigabyte: the few files that use them are compiled
# together instead. Every file still includes all it uses: a build with KERF_PRECOMPILED_HEADERS=OFF shows missing includes.
set(KERF_COMMON_HEADERS <algorithm> <array> <cmath> <filesystem> <fstream> <functional> <iomanip> <limits> <map> <memory>
    <numeric> <optional> <set> <sstream> <stdexcept> <string> <unordered_map> <utility> <vector> <Eigen/Dense> <mpi.h>)

# kerf_precompile(TARGET headers...): compiles library headers for the target.
function(kerf_precompile target)
  if(KERF_PRECOMPILED_HEADERS)
    target_precompile_headers(${target} PRIVATE ${ARGN})
  endif()
endfunction()

# kerf_reuse_precompiled(TARGET FROM): the target uses those of another one, which is compiled with the same flags.
function(kerf_reuse_precompiled target from)
  if(KERF_PRECOMPILED_HEADERS)
    target_precompile_headers(${target} REUSE_FROM ${from})
  endif()
endfunction()

# kerf_compile_together(TARGET GROUP files...): files of the target that one run of the compiler takes.
function(kerf_compile_together target group)
  if(KERF_PRECOMPILED_HEADERS)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
    set_source_files_properties(${ARGN} PROPERTIES UNITY_GROUP ${group})
  endif()
endfunction()

# kerf_compile_with(OPTIONS options... FILES files...): files with optimisation flags of their own. GCC takes these flags from a
# precompiled header and ignores those of the command, so such files use none.
function(kerf_compile_with)
  cmake_parse_arguments(ARG "" "" "OPTIONS;FILES" ${ARGN})
  set_source_files_properties(${ARG_FILES} PROPERTIES COMPILE_OPTIONS "${ARG_OPTIONS}" SKIP_PRECOMPILE_HEADERS ON)
endfunction()
