#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Shows that two programs compute the same: history.csv agrees to the last bit, but for the columns of wall times.

  same_histories.py OLD_KERF NEW_KERF [--work DIR] [--quick]

Runs tests/cases/small_cut in all modes on one rank and on two, with every coupling method and with return to the
continuum, and cases/disc_cutter_2d (not with --quick). What the old program
has computed in DIR before is kept. Exit code 1 and a line for each history that differs. For changes that are to move code only.
"""
import argparse
import csv
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
import kerf_runner  # noqa: E402

TIMES = ("wall_time", "cpu_time", "seconds")
SMALL, CUT = ROOT / "tests" / "cases" / "small_cut", ROOT / "cases" / "disc_cutter_2d"
# Case, mode, ranks, changed parameters.
RUNS = [(SMALL, mode, ranks, ()) for mode in ("adaptive", "fixed", "dem", "fem") for ranks in (1, 2)]
RUNS += [(SMALL, mode, 1, options) for mode in ("adaptive", "fixed") for options in (
    ("Coupling/Method=penalty", "Coupling/Penalty ratio=0.5", "Coupling/Interface damping=0.1"),
    ("Coupling/Method=penalty_mass_scaled", "Coupling/Penalty ratio=0.5"),
    ("Coupling/Method=penalty_mass_scaled", "Coupling/Penalty ratio=0.5", "Coupling/Corrector=weak"),
    ("Coupling/Method=multipliers_diagonal", "Coupling/Penalty ratio=0.5"))]
RUNS += [(SMALL, "adaptive", 1, ("Adaptivity/Return fraction=0.6", "Adaptivity/Return time=2e-5")), (CUT, "adaptive", 1, ())]


def run(kerf, case, mode, ranks, overrides, stores, output):
    """The text of history.csv of a run whose case has the packing of all runs."""
    copy = stores / case.name
    if not copy.exists():
        shutil.copytree(case, copy)
    changes = [word for override in overrides for word in ("--set", override)]
    shutil.rmtree(output, ignore_errors=True)
    result = kerf_runner.run(kerf, ["run", copy, "--mode", mode, "--output", output, *changes], ranks, cwd=stores, timeout=3600)
    if result.returncode != 0:
        sys.exit(f"{kerf} {case.name} {mode} {ranks}: exit code {result.returncode}\n{result.stderr}")


def columns(directory):
    """Columns of history.csv as they are written, without wall times."""
    with open(directory / "history.csv") as file:
        file.readline()
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0] if not name.startswith(TIMES)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--work", type=Path)
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    work = (options.work or Path(tempfile.mkdtemp())).resolve()
    work.mkdir(parents=True, exist_ok=True)
    different = 0
    for number, (case, mode, ranks, overrides) in enumerate(RUNS):
        if options.quick and case == CUT:
            continue
        name = f"{number:02}_{case.name}_{mode}_{ranks}"
        old, new = work / "old" / name, work / "new" / name
        if not (old / "history.csv").exists():
            run(options.old.resolve(), case, mode, ranks, overrides, work, old)
        run(options.new.resolve(), case, mode, ranks, overrides, work, new)
        before, after = columns(old), columns(new)
        changed = [column for column in before if before[column] != after.get(column)] + [c for c in after if c not in before]
        different += bool(changed)
        print(" ".join((name, *overrides)) + ": " + ("differs in " + ", ".join(changed) if changed else f"the same, {len(before['time'])} rows"), flush=True)
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
