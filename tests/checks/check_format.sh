#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-or-later
# All C++ files are formatted as .clang-format says.
#   check_format.sh ROOT
#   check_format.sh --self-test   a badly formatted file must be found, a good one not
set -euo pipefail

# check DIRECTORY: exit code 1 when a C++ file of the project is not formatted.
check()
{
  cd "$1"
  local files=()
  while IFS= read -r -d '' file; do
    [[ ! -f $file ]] || files+=("$file")
  done < <(git -c safe.directory='*' ls-files -z --cached --others --exclude-standard '*.h' '*.cpp')
  if ((${#files[@]} == 0)); then
    echo "no C++ files found in $1"
    return 1
  fi
  clang-format --dry-run -Werror "${files[@]}" && echo "${#files[@]} files are formatted"
}

if [[ ${1:-} == --self-test ]]; then
  style=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)/.clang-format
  tree=$(mktemp -d)
  trap 'rm -rf "$tree"' EXIT
  cp "$style" "$tree"
  git init --quiet "$tree"
  printf 'int answer();\n' > "$tree/good.h"
  cp "$tree/good.h" "$tree/spare.cpp"
  (check "$tree") || exit 1
  printf 'int   answer( );\n' > "$tree/bad.cpp"
  if (check "$tree"); then
    echo "the badly formatted file was not found"
    exit 1
  fi
  exit 0
fi
check "${1:?usage: check_format.sh ROOT}"
