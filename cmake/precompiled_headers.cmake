# SPDX-License-Identifier: GPL-2.0-or-later
# Most of a file's compile time is the parsing of library headers. They are compiled once for all files with the same flags.
# Every file still includes what it uses: builds with KERF_PRECOMPILED_HEADERS=OFF and the include test show what is missing.
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
