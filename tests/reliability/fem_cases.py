#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Meshes, boundary conditions and loads as a case file gives them, by the small case with other settings.

usage: fem_cases.py KERF SMALL_CASE
"""
import os
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import kerf_runner  # noqa: E402

KERF, SMALL_CASE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
passed = failed = 0

WIDTH, HEIGHT, CELL = 0.048, 0.032, 4e-3  # of the small case
CONFINED = ["--set", "Loads/Initial stress=-2e6 -3e6 0.5e6",
            "--set", "Boundary/Conditions=left: absorbing; right: in_situ; bottom: fixed; y > 0.032 - 1e-6: in_situ"]
REFINED = ["--set", "Mesh/Refine=0.016 0.02 0.032 0.032 1"]


def check(name, condition, text=""):
    global passed, failed
    passed, failed = passed + bool(condition), failed + (not condition)
    print(("ok      " if condition else "FAILED  ") + name + (": " + str(text) if text != "" else ""))


def write_msh(path):
    """The structured mesh of the small case as a gmsh file (format 2.2)."""
    nx, ny = round(WIDTH / CELL), round(HEIGHT / CELL)
    node = lambda i, j: j * (nx + 1) + i + 1  # noqa: E731
    lines = [(0, node(0, j), node(0, j + 1)) for j in range(ny)] + [(1, node(nx, j), node(nx, j + 1)) for j in range(ny)]
    lines += [(2, node(i, 0), node(i + 1, 0)) for i in range(nx)] + [(3, node(i, ny), node(i + 1, ny)) for i in range(nx)]
    with open(path, "w") as file:
        print("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes", (nx + 1) * (ny + 1), sep="\n", file=file)
        for j in range(ny + 1):
            for i in range(nx + 1):
                print(node(i, j), WIDTH * i / nx, HEIGHT * j / ny, 0, file=file)
        print("$EndNodes\n$Elements", len(lines) + nx * ny, sep="\n", file=file)
        for number, (side, a, b) in enumerate(lines, 1):
            print(number, 1, 2, side, side, a, b, file=file)
        for j in range(ny):
            for i in range(nx):
                print(len(lines) + j * nx + i + 1, 3, 2, 9, 9, node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1),
                      file=file)
        print("$EndElements", file=file)


with tempfile.TemporaryDirectory() as work:
    case = kerf_runner.copy_case(SMALL_CASE, os.path.join(work, "case"))
    assert kerf_runner.run(KERF, ["pack", case]).returncode == 0
    write_msh(os.path.join(case, "rock.msh"))

    def run(name, mode, *more, ranks=1):
        output = os.path.join(work, f"{name}_{mode}_{ranks}")
        result = kerf_runner.run(KERF, ["run", case, "--mode", mode, "--output", output, "--set", "Output/History interval=10",
                                        "--set", "Output/Snapshots=1", "--set", "Time/End time=2e-4", *more],
                                 ranks=ranks, cwd=work)
        check(f"{name} in mode {mode} on {ranks} rank(s) ends well", result.returncode == 0,
              f"exit code {result.returncode} {result.stderr.strip()[-300:]}")
        return kerf_runner.history(output)

    # The same mesh from a file: the same run, but for the last digits of its coordinates.
    # Its sides have numbers, no names.
    own, file = run("own_mesh", "fem"), run("file_mesh", "fem", "--set", "Mesh/File=rock.msh", "--set",
                                            "Boundary/Conditions=0: roller; 1: roller; 2: fixed")
    largest = max(own["tool_force_y"])
    check("a mesh from gmsh gives the run of the same own mesh",
          largest > 0. and max(abs(a - b) for a, b in zip(own["tool_force_y"], file["tool_force_y"])) < 1e-9 * largest)

    # Refined below the tool and confined: two ranks equal one until the first bond breaks, in all modes.
    for mode in ("fem", "adaptive", "dem"):
        one, two = (run("confined", mode, *CONFINED, *REFINED, ranks=ranks) for ranks in (1, 2))
        first_break = next((row for row, broken in enumerate(one["broken_bonds"]) if broken > 0), len(one["step"]))
        rows = min(first_break, len(two["step"]))
        difference = max(abs(one["tool_force_y"][row] - two["tool_force_y"][row]) for row in range(rows))
        largest = max(abs(force) for force in one["tool_force_y"][:rows])
        check(f"confined {mode}: two ranks equal one", rows > 10 and 0. < largest and difference < 1e-8 * largest,
              f"{difference:.2e} N of {largest:.3g} N over {rows} rows")

    # Before the tool arrives nothing moves: the confined rock is in equilibrium.
    still = run("confined_alone", "fem", *CONFINED, *REFINED, "--set", "Tool/Kind=none")
    check("confined rock stays at rest", max(still["energy_kinetic"]) < 1e-12 * still["energy_elastic"][0],
          f"{max(still['energy_kinetic']):.2e} J of {still['energy_elastic'][0]:.3g} J")

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
