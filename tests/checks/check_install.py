#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Installs kerf and runs a shortened copy of an installed case without the source tree.

  check_install.py BUILD_DIR SOURCE_DIR

The prefix has a space and a quote in its name. Where the system allows name spaces (unshare), the directories of the sources
and of the build are empty for the installed program. Everywhere, the program must not contain their names.
"""
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
import kerf_runner  # noqa: E402

BUILD, SOURCE = (Path(argument).resolve() for argument in sys.argv[1:3])
MODULES = ("numpy", "matplotlib", "h5py")
# Covers the directories before it runs the command.
HIDE = 'for directory in "$1" "$2"; do mount -t tmpfs none "$directory" 2> /dev/null; done; shift 2; exec "$@"'
failures = 0


def check(what, good, text=""):
    global failures
    failures += not good
    print("ok  " if good else "FAIL", what, "" if good else text, flush=True)


def hiding():
    """The words before a command that hide the source tree from it, or none where the system refuses."""
    flags = [["unshare", "--mount"], ["unshare", "--user", "--map-root-user", "--mount"]]
    for words in flags if shutil.which("unshare") else []:
        # The build directory often lies within the sources, which are covered last.
        words += ["sh", "-c", HIDE, "sh", str(BUILD), str(SOURCE)]
        probe = subprocess.run(words + ["ls", "-A", str(SOURCE)], capture_output=True, text=True, cwd="/", check=False)
        if probe.returncode == 0 and not probe.stdout:
            return words
    return []


def path_directory(path, with_python):
    """A directory for PATH without programs, or with a python3 that finds no installed modules."""
    path.mkdir()
    if with_python:
        (path / "python3").write_text(f'#!/bin/sh\nexec {sys.executable} -S "$@"\n')
        (path / "python3").chmod(0o755)
    return path


def run(hide, program, case, output, path):
    """A few output steps of the case; PATH is what the program looks for Python in."""
    command = [str(program), "run", str(case), "--set", "Time/End time=2e-5", "--set", "Output/Snapshots=2", "--output", str(output)]
    # Open MPI starts no daemon then, which it would look for in PATH.
    environment = {**os.environ, "PATH": path, "OMPI_MCA_ess_singleton_isolated": "1"}
    return subprocess.run(hide + command, cwd=case.parent, env=environment, capture_output=True, text=True, timeout=250, check=False)


def installed_files(prefix):
    wanted = ["bin/kerf", "share/kerf/plots/figures.py", "share/kerf/plots/results_file.py",
              "share/kerf/cases/disc_cutter_2d/case.prm", "share/kerf/cases/disc_cutter_2d/strengths.txt",
              "share/kerf/cases/uniaxial_compression_3d/case.prm",
              "share/doc/kerf/README.md", "share/doc/kerf/LICENSE", "share/doc/kerf/docs/user/parameters.md"]
    missing = [name for name in wanted if not (prefix / name).is_file()]
    check("program, scripts, cases and documents are installed", not missing, missing)
    caches = [str(path) for path in prefix.rglob("__pycache__")]
    check("no caches of Python are installed", not caches, caches)
    program = (prefix / "bin/kerf").read_bytes()
    names = [f"{SOURCE}/{part}" for part in ("coupler/", "dem_side/", "fem_side/", "tests/")] + [str(BUILD), "bin/python"]
    found = [name for name in names if name.encode() in program]
    check("no place of sources, build or Python is compiled in", not found, found)


def installed_run(prefix, work):
    program, hide = prefix / "bin/kerf", hiding()
    print("sources and build are hidden" if hide else "this system hides no directories: only the text of the program is checked")
    case = work / "a user's case"
    shutil.copytree(prefix / "share/kerf/cases/disc_cutter_2d", case)
    plain = path_directory(work / "plain", True)
    # The first python3 has no modules, so the next one has to be taken.
    output = work / "a user's results"
    result = run(hide, program, case, output, f"{plain}:{os.environ['PATH']}")
    check("an installed case runs", result.returncode == 0, result.stdout + result.stderr)
    check("nothing is said on standard error", result.stderr == "", result.stderr)
    if result.returncode == 0:
        check("its history has its rows", kerf_runner.history(output)["time"][-1] >= 1.9e-5)
        pictures = [path.name for path in (output / "figures").glob("*.png") if path.stat().st_size > 10000]
        check("its figures are drawn", {"final.png", "interface.png", "normal_force.png"} <= set(pictures), pictures)
    caches = list(prefix.rglob("__pycache__"))
    check("running leaves the installation as it was", not caches, caches)
    result = run([], program, case, work / "without", str(plain))
    lines = result.stderr.splitlines()
    check("without modules the run is good and one line says which are missing", result.returncode == 0 and len(lines) == 1 and
          str(plain) in lines[0] and all(name in lines[0] for name in MODULES), result.stderr)
    result = run([], program, case, work / "no python", str(path_directory(work / "none", False)))
    check("without Python one line says so", result.returncode == 0 and result.stderr.splitlines() ==
          ["figures were not drawn: there is no python3 in PATH"], result.stderr)


def main():
    with tempfile.TemporaryDirectory() as directory:
        work = Path(directory)
        prefix = work / "kerf's prefix"
        result = subprocess.run(["cmake", "--install", str(BUILD), "--prefix", str(prefix)], capture_output=True, text=True, check=False)
        check("cmake --install", result.returncode == 0, result.stdout + result.stderr)
        if result.returncode == 0:
            installed_files(prefix)
            installed_run(prefix, work)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
