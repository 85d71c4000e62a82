#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Energy that conversions create in cuts, and the warnings at the end of a run.

usage: conversions.py KERF SMALL_CASE CASES
"""
import csv
import os
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import kerf_runner  # noqa: E402

KERF, SMALL_CASE, CASES = map(os.path.abspath, sys.argv[1:4])
passed = failed = 0


def check(name, condition, text=""):
    global passed, failed
    passed, failed = passed + bool(condition), failed + (not condition)
    print(("ok      " if condition else "FAILED  ") + name + (": " + str(text) if text != "" else ""), flush=True)


def run(case, name, *values, mode="adaptive"):
    """Exit code and output of a run without local damping, which leaves what conversions do to itself."""
    output = os.path.join(work, name)
    settings = [word for value in ("Bond/Local damping=0", "Output/Snapshots=1", *values) for word in ("--set", value)]
    result = kerf_runner.run(KERF, ["run", case, "--mode", mode, "--output", output, *settings])
    with open(os.path.join(output, "log.txt"), encoding="utf-8") as file:
        return result, output, file.read()


def warnings_of(log):
    return [line for line in log.splitlines() if line.startswith("warning:")]


def events(directory):
    """Rows of activations.csv as dictionaries of numbers."""
    with open(os.path.join(directory, "activations.csv"), encoding="utf-8") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return [{name: float(value) for name, value in row.items()} for row in rows]


def created(directory):
    """Energy created by the events [J]. Kinetic and elastic parts only, which is nearly all of it."""
    energy = [[event[f"energy_{part}_{when}"] for part in ("kinetic", "elastic")]
              for when in ("before", "after") for event in events(directory)]
    n = len(energy) // 2
    return sum(max(0., sum(after) - sum(before)) for before, after in zip(energy[:n], energy[n:]))


with tempfile.TemporaryDirectory() as work:
    small = kerf_runner.copy_case(SMALL_CASE, os.path.join(work, "small"))
    assert kerf_runner.run(KERF, ["pack", small]).returncode == 0

    # In intact rock every stored bond is created.
    result, output, log = run(small, "small_cut")
    check("small cut ends well", result.returncode == 0, result.stderr.strip()[-300:])
    history = kerf_runner.history(output)
    first_break = next((time for time, broken in zip(history["time"], history["broken_bonds"]) if broken > 0), 1.)
    intact = [event for event in events(output) if event["time"] <= first_break]
    check("no bond is born broken before one broke", intact and all(event["bonds_born_broken"] == 0 for event in intact),
          len(intact))

    # The particles of a plain projection are no equilibrium: conversions create energy, which the balance does not show.
    result, output, log = run(small, "projection", "Adaptivity/Relaxation steps=0", "Time/Energy tolerance=0.001")
    check("created energy ends a run", result.returncode == 3 and "conversions created energy before t =" in result.stderr and
          " around (" in result.stderr, result.stderr.strip()[-300:])

    # A region of a few cells below the tool: the damage reaches its border.
    result, output, log = run(small, "narrow", "Fixed/Region=0.020 0.024 0.028 0.032", mode="fixed")
    check("a narrow region is warned of", result.returncode == 0 and "the particle region is smaller than the damage" in log,
          warnings_of(log))
    result, output, log = run(small, "all", mode="dem")
    check("all particles are not", result.returncode == 0 and "broken bonds" not in log, warnings_of(log))
    result, output, log = run(small, "damped", "Bond/Local damping=0.9", mode="dem")
    check("strong damping is warned of", result.returncode == 0 and "damping rules the force" in log, warnings_of(log))

    # Nothing damps. Loose particles next to the front brought in up to 38 % of the work: their mass, their springs and their contacts
    # grew at the velocity, gap and overlap that they had. The limit is a quarter of the tolerance; 0.2 % are measured.
    undamped = [f"{part}/Damping ratio=0" for part in ("Bond", "Tool")] + ["Tool/Friction=0", "Packing/Seed=3"]
    result, output, log = run(small, "undamped", "Coupling/Method=penalty_mass_scaled", *undamped)
    work_of_tool = kerf_runner.history(output)["work_tool"][-1]
    check("conversions of an undamped cut create next to nothing",
          result.returncode == 0 and created(output) < 0.0125 * work_of_tool, f"{created(output):.3f} of {work_of_tool:.1f} J")

    # The shipped cut as far as its first chips. A bond to a particle of the overlap that had come off and spun brought in 24 J,
    # while the tool had done 70 J. Half of a per cent of the work is what all events together may create.
    cut = kerf_runner.copy_case(os.path.join(CASES, "disc_cutter_2d"), os.path.join(work, "cut"))
    result, output, log = run(cut, "chips", "Packing/Seed=4", "Time/End time=6e-4")
    check("the cut ends well", result.returncode == 0, result.stderr.strip()[-300:])
    work_in = kerf_runner.history(output)["work_tool"][-1]
    check("its conversions create no energy", created(output) < 0.005 * work_in, f"{created(output):.3g} of {work_in:.4g} J")
    check("bonds that are born broken are counted", "born broken" in log,
          sum(event["bonds_born_broken"] for event in events(output)))

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
