#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs the small case in every mode, on one and two ranks, and interrupts one run.

usage: modes.py KERF SMALL_CASE
"""
import os
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import kerf_runner  # noqa: E402

KERF, SMALL_CASE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
passed = failed = 0

COLUMNS = ("step,time,tool_force_x,tool_force_y,tool_force_z,active_particles,overlap_particles,converted_cells,intact_bonds,"
           "broken_bonds,energy_kinetic,energy_elastic,energy_coupling,work_tool,wall_time").split(",")


def check(name, condition, text=""):
    global passed, failed
    passed, failed = passed + bool(condition), failed + (not condition)
    print(("ok      " if condition else "FAILED  ") + name + (": " + str(text) if text != "" else ""))


def run(mode, output, ranks=1, *more):
    result = kerf_runner.run(KERF, ["run", case, "--mode", mode, "--output", output, "--set", "Output/History interval=10", *more], ranks=ranks, cwd=work)
    check(f"{mode} on {ranks} rank(s) ends well", result.returncode == 0, result.stderr.strip()[-300:])
    return kerf_runner.history(output)


with tempfile.TemporaryDirectory() as work:
    case = kerf_runner.copy_case(SMALL_CASE, os.path.join(work, "case"))
    assert kerf_runner.run(KERF, ["pack", case]).returncode == 0
    peak = {}
    for mode in ("adaptive", "fixed", "dem", "fem"):
        one = run(mode, os.path.join(work, mode + "_1"))
        two = run(mode, os.path.join(work, mode + "_2"), 2)
        peak[mode] = max(one["tool_force_y"])
        check(f"{mode} writes the columns", all(column in one for column in COLUMNS))
        produced = os.listdir(os.path.join(work, mode + "_1"))
        check(f"{mode} writes all files",
              all(name in produced for name in ("fem.pvd", "particles.pvd", "bonds.pvd", "tool.pvd", "history.csv",
                                                "history.h5", "log.txt", "case.prm", "figures")), sorted(produced))
        check(f"{mode} feels the tool", peak[mode] > 0., f"{peak[mode]:.4g} N")
        # The same sums in another order: round-off, amplified little by an elastic body. One part in 1e8 of the peak force is
        # far above round-off (1e-16 a step) and far below any error of the exchange.
        first_break = next((row for row, broken in enumerate(one["broken_bonds"]) if broken > 0), len(one["step"]))
        rows = min(first_break, len(two["step"]))
        difference = max(abs(one[column][row] - two[column][row])
                         for row in range(rows) for column in ("tool_force_x", "tool_force_y"))
        largest = max(abs(force) for force in one["tool_force_y"][:rows])
        check(f"{mode}: two ranks equal one until the first bond breaks", rows > 10 and difference < 1e-8 * largest,
              f"{difference:.2e} N of {largest:.3g} N over {rows} rows")
        if mode == "adaptive":
            # The disc starts less than a particle above the rock.
            check("adaptive starts with particles where the disc comes down", 0 < one["converted_cells"][0] < 10,
                  one["converted_cells"][0])
            check("adaptive converts cells", one["converted_cells"][-1] > 0, one["converted_cells"][-1])
            check("adaptive breaks bonds", one["broken_bonds"][-1] > 0, one["broken_bonds"][-1])
            check("adaptive has an overlap", one["overlap_particles"][-1] > 0)
            # Cells below a moving tool are converted: the balance closes.
            missing = max(abs(value) for value in one["energy_residual"])
            check("activation below the tool keeps the balance", missing < 0.005 * one["work_tool"][-1],
                  f"{missing:.3g} of {one['work_tool'][-1]:.3g} J")
            # Springs that know no masses need a step for the lightest particle of overlaps to come.
            stiff = run(mode, os.path.join(work, "stiff"), 1, "--set", "Coupling/Method=penalty", "--set", "Coupling/Penalty ratio=1")
            missing = max(abs(value) for value in stiff["energy_residual"])
            check("a constant penalty keeps the balance", missing < 0.005 * stiff["work_tool"][-1],
                  f"{missing:.3g} of {stiff['work_tool'][-1]:.3g} J")
        if mode == "fem":
            check("fem has no particles", max(one["active_particles"]) == 0)
        if mode == "dem":
            check("dem has all particles", one["overlap_particles"][0] == 0 and one["active_particles"][0] > 1000)

    # Cells below the tool become particles while it presses: from then on, until ten bonds have broken, the force is that of
    # particles alone. The surface of particles is rough, the tool meets one after the other: a tenth.
    adaptive, particles = (run(mode, os.path.join(work, "fine_" + mode), 1, "--set", "Output/Snapshots=1", "--set",
                               "Output/History interval=10", "--set", "Time/End time=4e-5") for mode in ("adaptive", "dem"))
    rows = [row for row in range(1, len(adaptive["step"]))
            if adaptive["converted_cells"][row - 1] > 0 and adaptive["broken_bonds"][row] < 10]

    def force_at(history, time):
        last = next(row for row, t in enumerate(history["time"]) if t >= time)
        share = (history["time"][last] - time) / (history["time"][last] - history["time"][last - 1])
        return (1. - share) * history["tool_force_y"][last] + share * history["tool_force_y"][last - 1]

    pairs = [(adaptive["tool_force_y"][row], force_at(particles, adaptive["time"][row])) for row in rows]
    off = sum(abs(one - other) for one, other in pairs) / max(1., sum(other for _, other in pairs))
    check("the force goes on below converted cells", len(rows) > 5 and off < 0.1, f"{off:.3f} over {len(rows)} rows")

    # Outputs must not change the state: other snapshot and history intervals, same forces where rows coincide.
    sparse = run("adaptive", os.path.join(work, "sparse"), 1, "--set", "Output/Snapshots=1", "--set", "Output/History interval=100")  # the last one counts
    dense = kerf_runner.history(os.path.join(work, "adaptive_1"))
    energies = dict(zip(dense["step"], dense["energy_elastic"]))
    common = [row for row, step in enumerate(sparse["step"]) if step in energies]
    check("outputs do not change the state",
          len(common) > 10 and all(sparse["energy_elastic"][row] == energies[sparse["step"][row]] for row in common))

    # An interrupted run keeps what it has.
    output = os.path.join(work, "interrupted")
    process = subprocess.Popen(kerf_runner.command(KERF, ["run", case, "--mode", "dem", "--output", output, "--set",
                                                          "Time/End time=1"]), cwd=work, stdout=subprocess.DEVNULL)
    while not os.path.exists(os.path.join(output, "history.csv")) or len(open(os.path.join(output, "history.csv")).readlines()) < 6:
        time.sleep(0.2)
        assert process.poll() is None, "the run ended before it could be interrupted"
    process.send_signal(signal.SIGINT)
    code = process.wait(timeout=120)
    rows = len(kerf_runner.history(output)["step"])
    check("an interrupted run ends with 130 and its output", code == 130 and rows >= 4 and
          os.path.exists(os.path.join(output, "history.h5")) and os.path.exists(os.path.join(output, "particles.pvd")),
          f"code {code}, {rows} rows")

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
