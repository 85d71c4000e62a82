#!/bin/bash
# SPDX-License-Identifier: GPL-2.0-or-later
# ./run, ./test and .ci/run in a copy of the tree, with stand-ins for apt, cmake, ctest, mpirun and kerf that write down
# how they are called. Nothing is installed or built.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
tree="$work/a tree"
calls=$work/calls
mkdir -p "$tree/tests/support" "$tree/.ci" "$tree/cases/disc_cutter_2d" "$tree/cases/other" "$work/bin"
touch "$tree/cases/other/case.prm"
cp "$root/run" "$root/test" "$tree"
cp "$root/.ci/run" "$tree/.ci"
cp "$root/tests/support/scripts.sh" "$tree/tests/support"

# stand_in NAME: takes its exit code from $work/NAME.code; arguments are written one by one in <>.
stand_in()
{
  cat > "$work/bin/$1" << END
#!/bin/bash
{ printf '%s' $1; printf ' <%s>' "\$@"; printf '\n'; } >> "$calls"
[[ ! -f "$work/$1.out" ]] || cat "$work/$1.out"
exit "\$(cat "$work/$1.code" 2> /dev/null || echo 0)"
END
  chmod +x "$work/bin/$1"
}
for name in cmake ctest mpirun apt-get kerf codespell; do stand_in "$name"; done
# dpkg-query knows all packages but those in $work/missing.
cat > "$work/bin/dpkg-query" << END
#!/bin/bash
grep -qxF "\${@: -1}" "$work/missing" 2> /dev/null && exit 1
printf installed
END
# sudo runs the command and shows that it was asked.
cat > "$work/bin/sudo" << END
#!/bin/bash
echo "sudo \$*" >> "$calls"
exec "\$@"
END
chmod +x "$work/bin/dpkg-query" "$work/bin/sudo"
mkdir -p "$tree/build"
cp "$work/bin/kerf" "$tree/build/kerf"
export PATH=$work/bin:$PATH

failures=0
# expect TEXT WHERE: the file WHERE holds a line with TEXT; refuse: it does not.
expect() { grep -qF -- "$1" "$2" || { echo "FAIL: no '$1' in:"; cat "$2"; failures=$((failures + 1)); }; }
refuse() { ! grep -qF -- "$1" "$2" || { echo "FAIL: '$1' in:"; cat "$2"; failures=$((failures + 1)); }; }
# call CODE COMMAND...: runs the command, output in $work/out; its exit code must be CODE.
call()
{
  local code=$1 got=0
  shift
  : > "$calls"
  "$@" > "$work/out" 2>&1 || got=$?
  echo "$ ${*##*/} -> $got"
  [[ $got == "$code" ]] || { echo "FAIL: exit code $got instead of $code"; cat "$work/out"; failures=$((failures + 1)); }
}
cd "$work"

call 0 "$tree/run" --help
expect "usage: ./run" "$work/out"
[[ ! -s $calls ]] || { echo "FAIL: --help does something"; failures=$((failures + 1)); }

# Cases and options.
call 0 "$tree/run"
expect "kerf <run> <$tree/cases/disc_cutter_2d>" "$calls"
expect "cmake <-S> <$tree> <-B> <$tree/build> <-G> <Ninja> <-DCMAKE_BUILD_TYPE=Release>" "$calls"
expect "<--target> <kerf>" "$calls"
refuse apt-get "$calls"
refuse mpirun "$calls"
call 0 "$tree/run" --mode dem --set 'A/b=two words' ''
expect "kerf <run> <$tree/cases/disc_cutter_2d> <--mode> <dem> <--set> <A/b=two words> <>" "$calls"
call 0 "$tree/run" cases/other --output 'x y'
expect "kerf <run> <$tree/cases/other> <--output> <x y>" "$calls"
mkdir -p "$work/cases/other"
call 0 "$tree/run" cases/other
expect "kerf <run> <cases/other>" "$calls"
call 0 "$tree/run" missing/case
expect "kerf <run> <missing/case>" "$calls"
call 0 "$tree/run" check cases/other
expect "kerf <check> <cases/other>" "$calls"
call 0 "$tree/run" --version
expect "kerf <--version>" "$calls"
echo "standard output of cmake" > "$work/cmake.out"
echo "standard output of kerf" > "$work/kerf.out"
"$tree/run" params > "$work/stdout" 2> "$work/stderr"
expect "standard output of kerf" "$work/stdout"
refuse "cmake" "$work/stdout"
expect "standard output of cmake" "$work/stderr"
rm "$work/cmake.out" "$work/kerf.out"
ln -s "$tree/run" "$work/bin/kerf-run"
call 0 kerf-run params
expect "kerf <params>" "$calls"

# MPI.
KERF_RANKS=1 call 0 "$tree/run"
expect "mpirun <-n> <1>" "$calls"
refuse "--oversubscribe" "$calls"
KERF_RANKS=4000 call 0 "$tree/run"
expect "<--oversubscribe> <$tree/build/kerf> <run>" "$calls"
if ((EUID == 0)); then expect "<--allow-run-as-root>" "$calls"; else refuse "<--allow-run-as-root>" "$calls"; fi
KERF_RANKS=two call 1 "$tree/run"
expect "KERF_RANKS=two is not a number of ranks" "$work/out"

# Exit codes.
echo 3 > "$work/kerf.code"
call 3 "$tree/run"
rm "$work/kerf.code"
echo 1 > "$work/cmake.code"
echo "the reason of cmake" > "$work/cmake.out"
call 1 "$tree/run"
expect "the reason of cmake" "$work/out"
expect "configuration failed" "$work/out"
refuse "kerf <run>" "$calls"
rm "$work/cmake.code" "$work/cmake.out"
echo 8 > "$work/ctest.code"
echo "50% tests passed, 1 tests failed out of 2" > "$work/ctest.out"
call 8 "$tree/test"
call 8 "$tree/.ci/run"
sed -n '/=== summary/,$p' "$work/out" > "$work/summary"
expect "=== summary, exit code 8 ===" "$work/summary"
expect "unit_tests_with_sanitizers: exit code 8" "$work/summary"
expect "spelling: exit code 0" "$work/summary"
[[ $(grep -c "50% tests passed" "$work/summary") == 3 && $(tail -n 1 "$work/out") == 50%* ]] ||
  { echo "FAIL: the summary does not end with what ctest says of three parts"; cat "$work/summary"; failures=$((failures + 1)); }
# All parts ran.
expect "<-LE> <.*-long>" "$calls"
for preset in debug audit; do
  expect "cmake <--preset> <$preset>" "$calls"
  expect "cmake <--build> <--preset> <$preset>" "$calls"
  expect "ctest <--preset> <$preset>" "$calls"
done
expect "<--target> <unit_tests>" "$calls"
expect "<-L> <^unit$>" "$calls"
expect "cmake <--build> <--preset> <clang>" "$calls"
expect "codespell" "$calls"
rm "$work/ctest.code"
# A part after the tests fails.
echo 65 > "$work/codespell.code"
echo "100% tests passed, 0 tests failed out of 2" > "$work/ctest.out"
call 65 "$tree/.ci/run"
expect "tests: exit code 0" "$work/out"
expect "spelling: exit code 65" "$work/out"
[[ $(tail -n 1 "$work/out") == 100%* ]] || { echo "FAIL: no summary of ctest at the end"; failures=$((failures + 1)); }
rm "$work/codespell.code" "$work/ctest.out"
# No build, no tests.
echo 1 > "$work/cmake.code"
echo "the reason of cmake" > "$work/cmake.out"
call 1 "$tree/.ci/run"
expect "the reason of cmake" "$work/out"
expect "clang: exit code 1" "$work/out"
expect "spelling: exit code 0" "$work/out"
refuse "ctest" "$calls"
rm "$work/cmake.code" "$work/cmake.out"

# Selection of tests.
call 0 "$tree/test" -R 'some name'
expect "<-DKERF_TESTS=ON>" "$calls"
expect "<-LE> <.*-long> <-R> <some name>" "$calls"
call 0 "$tree/test" --long
refuse "<-LE>" "$calls"
refuse "<--long>" "$calls"
call 0 "$tree/.ci/run" -R 'some name'
expect "=== summary, exit code 0 ===" "$work/out"
expect "<-LE> <.*-long> <-R> <some name>" "$calls"

# Packages.
printf '%s\n' libdeal.ii-dev libgtest-dev clang > "$work/missing"
if ((EUID == 0)); then
  call 0 "$tree/run"
  expect "libdeal.ii-dev       for finite elements" "$work/out"
  expect "<update>" "$calls"
  expect "<install> <--yes> <--no-install-recommends> <libdeal.ii-dev>" "$calls"
  refuse "libgtest-dev" "$calls"
  refuse "sudo" "$calls"
  call 0 "$tree/test"
  expect "<libdeal.ii-dev> <libgtest-dev>" "$calls"
  refuse "<clang>" "$calls"
  call 0 "$tree/.ci/run"
  expect "<libdeal.ii-dev> <libgtest-dev> <clang>" "$calls"
  echo 100 > "$work/apt-get.code"
  call 1 "$tree/run"
  expect "could not install: libdeal.ii-dev" "$work/out"
  rm "$work/apt-get.code"
fi

# As another user, when that can be had: with sudo, without it, and with a build directory that belongs to root.
user=()
((EUID != 0)) || user=(setpriv --reuid=65534 --regid=65534 --clear-groups)
if "${user[@]}" true 2> /dev/null; then
  ((EUID != 0)) || chmod -R go+rwX "$work" # the stand-ins and the tree, but see below
  call 0 "${user[@]}" "$tree/run"
  expect "sudo env DEBIAN_FRONTEND=noninteractive apt-get" "$calls"
  expect "kerf <run>" "$calls"
  mv "$work/bin/sudo" "$work/sudo"
  # Only the tools that the script needs, so that a real sudo is not found.
  mkdir "$work/few"
  for name in bash dirname readlink cat grep nproc awk mkdir id env lscpu sort wc; do ln -s "$(command -v "$name")" "$work/few"; done
  PATH=$work/bin:$work/few:/nowhere call 1 "$(command -v env)" "${user[@]/#setpriv/$(command -v setpriv)}" "$tree/run"
  expect "not root and no sudo; have these packages installed: libdeal.ii-dev" "$work/out"
  [[ $(wc -l < "$work/out") == 3 ]] || { echo "FAIL: more lines than the list and the message"; failures=$((failures + 1)); }
  refuse "apt-get" "$calls"
  mv "$work/sudo" "$work/bin/sudo"
  rm "$work/missing"
  if ((EUID == 0)); then
    chmod go-w "$tree/build"
    call 1 "${user[@]}" "$tree/run"
    expect "is not writable" "$work/out"
  fi
fi

((failures == 0)) || { echo "$failures expectations failed"; exit 1; }
echo "all as expected"
