#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-or-later
# The reference of the source code can be made without warnings: names behind @param exist, references lead somewhere.
#   check_doxygen.sh ROOT
#   check_doxygen.sh --self-test   a wrong @param must be found, a list of parameters that is not complete is allowed
# Return code 77 without doxygen.
set -euo pipefail

# Parameters without @param speak for themselves, and Doxygen does not read the library's classes that are specialised.
remarks()
{
  awk '/(is|are) not documented:?$/ { next } /^  parameter / { next } /scope for class Eigen::/ { next } NF' "$1"
}

# check DIRECTORY: exit code 1 when Doxygen has something to say.
check()
{
  local out
  out=$(mktemp -d)
  (cd "$1" && { cat Doxyfile; echo "OUTPUT_DIRECTORY = $out"; } | doxygen - > "$out/log" 2>&1) || true
  remarks "$out/log" > "$out/remarks"
  cat "$out/remarks"
  local good=0
  [[ -f $out/html/index.html && ! -s $out/remarks ]] || good=1
  rm -rf "$out"
  ((good == 0)) && echo "no warnings"
  return "$good"
}

command -v doxygen > /dev/null || exit 77
if [[ ${1:-} == --self-test ]]; then
  tree=$(mktemp -d)
  trap 'rm -rf "$tree"' EXIT
  printf 'INPUT = a.h\nQUIET = YES\nEXTRACT_ALL = YES\nGENERATE_LATEX = NO\nWARN_IF_UNDOCUMENTED = NO\n' > "$tree/Doxyfile"
  printf '/// Sum. @param first one of them\nint sum(int first, int second);\n' > "$tree/a.h"
  check "$tree" || exit 1
  printf '/// Sum. @param third one of them\nint sum(int first, int second);\n' > "$tree/a.h"
  if check "$tree"; then
    echo "the wrong @param was not found"
    exit 1
  fi
  exit 0
fi
check "${1:?usage: check_doxygen.sh ROOT}"
