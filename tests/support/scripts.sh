# SPDX-License-Identifier: GPL-2.0-or-later
# shellcheck shell=bash disable=SC2034,SC2154
# Shared by ./run, ./test and .ci/run: Debian packages, configuration, build. Sourced with $root set to the repository.

# One package a line and what it is for.
readonly build_packages='
build-essential      C++ compiler
cmake                build configuration
ninja-build          build
mold                 fast linker
libdeal.ii-dev       finite elements
libliggghts-dev      particles
libeigen3-dev        linear algebra
libmuparser-dev      expressions in case files
libhdf5-openmpi-dev  storage of packings and results
libopenmpi-dev       MPI
openmpi-bin          mpirun
libcli11-dev         command line
python3              figures
python3-numpy        figures
python3-matplotlib   figures
python3-h5py         figures'
readonly test_packages='
libgtest-dev         tests
liggghts             comparison with the stock program
git                  checks of the source tree
clang-format         check of the code style
python3-vtk9         ParaView files in the reader that users have'
readonly ci_packages='
clang                build with a second compiler
codespell            check of the spelling
doxygen              check of the comments of public functions'

fail()
{
  echo "kerf: $*" >&2
  exit 1
}

# install_packages TABLE: installs the packages of the table that are missing, says which and why.
install_packages()
{
  command -v dpkg-query > /dev/null && command -v apt-get > /dev/null ||
    fail "this script installs Debian packages, but dpkg-query and apt-get are not here; see docs/user/installing.md for a manual build"

  local name purpose missing=()
  while read -r name purpose; do
    [[ -n $name ]] || continue
    if [[ $(dpkg-query -W -f='${db:Status-Status}' "$name" 2> /dev/null) != installed ]]; then
      ((${#missing[@]})) || echo "kerf: installing missing Debian packages:"
      printf '  %-20s for %s\n' "$name" "$purpose"
      missing+=("$name")
    fi
  done <<< "$1"
  ((${#missing[@]})) || return 0

  local as_root=()
  if ((EUID != 0)); then
    command -v sudo > /dev/null || fail "not root and no sudo; have these packages installed: ${missing[*]}"
    as_root=(sudo)
  fi
  # Another apt run, usual right after a machine has started, is waited for.
  local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=300)
  { "${apt[@]}" update && "${apt[@]}" install --yes --no-install-recommends "${missing[@]}"; } < /dev/null ||
    fail "could not install: ${missing[*]}"
}

# One compiler needs up to 1.5 GB for a file that includes deal.II, so memory may allow fewer jobs than cores.
build_jobs()
{
  local cores by_memory
  cores=$(nproc)
  by_memory=$(awk '/^MemAvailable/ {print int($2 / 1.5e6)}' /proc/meminfo)
  ((by_memory >= 1)) || by_memory=1
  echo $((cores < by_memory ? cores : by_memory))
}

# configure [CMAKE OPTIONS]: a Release build in build/.
configure()
{
  local build=$root/build fresh=()
  mkdir -p "$build" 2> /dev/null && [[ -w $build ]] ||
    fail "$build is not writable for $(id -un), perhaps from an earlier run as root; remove it or change its owner"
  # A copied or moved tree brings a cache that belongs to another place.
  if [[ -f $build/CMakeCache.txt ]] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$build/CMakeCache.txt"; then
    fresh=(--fresh)
  fi
  echo "kerf: configuring build/"
  cmake "${fresh[@]}" -S "$root" -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release "$@" > "$build/configure.log" 2>&1 ||
    {
      cat "$build/configure.log" >&2
      fail "configuration failed (also in build/configure.log)"
    }
}

# build [TARGET]: everything, or one target.
build()
{
  local jobs
  jobs=$(build_jobs)
  echo "kerf: building ${1:-everything} with $jobs jobs"
  cmake --build "$root/build" --parallel "$jobs" ${1:+--target "$1"} || fail "build failed"
}
