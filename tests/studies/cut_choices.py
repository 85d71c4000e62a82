#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures how numerical choices rule the force of the cut: damping, tool speed, particle size, boundaries, contact stiffness, step.

  cut_choices.py [--kerf build/kerf] [--seeds 1 2 3 4] [--jobs 2] [--groups damping speed ...] [--existing]

Runs cases/disc_cutter_2d adaptively with each choice on the same packings. What has finished with the same options is kept. Writes
the table between the markers <!-- choices:begin --> and <!-- choices:end --> of docs/results/cutting.md. The slow cuts take most of
the time, that of 0.25 m/s sixteen times that of the case.
"""
import argparse
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
sys.path.insert(0, str(ROOT / "tests" / "studies"))
import compare_modes  # noqa: E402
import numpy as np  # noqa: E402
from speed_accuracy import identifier  # noqa: E402
from results_file import History, Unreadable, time_mean  # noqa: E402

BEGIN, END = "<!-- choices:begin -->", "<!-- choices:end -->"
CASE = "cases/disc_cutter_2d"
AT_DEPTH, DURATION = 2e-3, 12e-3  # the disc reaches its depth, the run ends [s]


def at_speed(factor):
    """The same way of the disc, faster by a factor."""
    return {"Tool/Path": f"0 0.05 0.09405; {AT_DEPTH / factor:.9g} 0.058 0.093; {DURATION / factor:.9g} 0.098 0.093",
            "Tool/Smoothing time": f"{2e-4 / factor:.9g}", "Time/End time": f"{DURATION / factor:.9g}"}


def of_size(diameter):
    return {"Packing/Mean diameter": f"{diameter:g}", "Mesh/Cell size": f"{4. * diameter:g}"}


ROLLERS = {"Boundary/Conditions": "left: roller; right: roller; bottom: fixed"}
# Group, name, speed relative to the case, what is set.
CHOICES = [("the case", "", 1., {})]
CHOICES += [("local damping", f"{value:g}", 1., {"Bond/Local damping": f"{value:g}"}) for value in (0.2, 0.5)]
CHOICES += [("contact damping", f"{value:g}", 1., {"Bond/Damping ratio": f"{value:g}"}) for value in (0.02, 0.4)]
CHOICES += [("tool speed", f"{4. * factor:g} m/s", factor, at_speed(factor)) for factor in (2., 0.5, 0.25, 0.125, 0.0625)]
CHOICES += [("particle size", f"{1e3 * diameter:g} mm", 1., of_size(diameter)) for diameter in (2e-3,)]
CHOICES += [("sides", "rollers", 1., ROLLERS)]


def directory_of(options, choice, seed):
    group, name, _, _ = choice
    return Path(options.results) / f"{identifier(group)}_{identifier(name)}_{seed}"


def run_all(options, choices):
    case = ROOT / CASE

    def run_one(job):
        choice, seed = job
        directory = directory_of(options, choice, seed)
        if options.existing:
            return
        command = [options.kerf, "run", str(case), "--mode", "adaptive", "--output", str(directory), "--set", f"Packing/Seed={seed}",
                   "--set", "Output/Snapshots=1"]
        for key, value in choice[3].items():
            command += ["--set", f"{key}={value}"]
        if any(key.startswith("Mesh/") for key in choice[3]): # a packing of its own
            command += ["--set", f"Packing/File={directory.resolve()}.store.h5"]
        finished = (directory / compare_modes.FINISHED).is_file()
        compare_modes.run_mode(command, directory, directory.is_dir() and not finished)

    jobs = [(choice, seed) for choice in choices for seed in options.seeds]
    with ThreadPoolExecutor(options.jobs) as pool:
        list(pool.map(run_one, jobs))


def measure(options, choice):
    """One column for each packing: mean force while the disc is at its depth [N/m], share of the bonds that break in this time,
    shares of the work of the tool that contact damping and local damping, friction and breaking take. NaN: did not finish."""
    columns = []
    for seed in options.seeds:
        directory = directory_of(options, choice, seed)
        if not (directory / compare_modes.FINISHED).is_file():
            columns.append([np.nan] * 5)
            continue
        history = History(directory)
        time, broken = history["time"], history["broken_bonds"]
        start = AT_DEPTH / choice[2]
        before = broken[time <= start][-1]
        work = history["work_tool"][-1]
        columns.append([time_mean(time, history["tool_force_y"], start, time[-1]), (broken[-1] - before) / max(broken[-1], 1.),
                        history["energy_damping"][-1] / work, history["energy_friction"][-1] / work,
                        history["energy_released"][-1] / work])
    return np.array(columns).T


def with_error(values):
    values = values[np.isfinite(values)]
    return f"{np.mean(values):.1f} +- {np.std(values, ddof=1) / np.sqrt(len(values)):.1f}" if len(values) > 1 else "-"


def table(options, choices):
    lines = ["| choice | value | mean normal force [kN/m] | to the first row, same packings | bonds that break at depth | damping | friction | "
             "breaking | finished |",
             "|---|---|---:|---:|---:|---:|---:|---:|---:|"]
    reference = measure(options, CHOICES[0])
    for choice in choices:
        values = measure(options, choice)
        good = np.isfinite(values[0])
        percent = ["-"] * 4 if not good.any() else [f"{100. * np.nanmean(row):.0f} %" for row in values[1:]]
        change = 100. * (values[0] - reference[0]) / np.nanmean(reference[0])
        lines.append(f"| {choice[0]} | {choice[1]} | {with_error(1e-3 * values[0])} | "
                     f"{'' if choice is CHOICES[0] else with_error(change) + ' %'} | {' | '.join(percent)} | "
                     f"{good.sum()} of {len(good)} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kerf", default=str(ROOT / "build" / "kerf"))
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3, 4])
    parser.add_argument("--jobs", type=int, default=2, help="runs at the same time")
    parser.add_argument("--groups", nargs="+", help="groups of choices to run; the table has all that ran")
    parser.add_argument("--results", default="results/cut_choices")
    parser.add_argument("--docs", default=str(ROOT / "docs" / "results"))
    parser.add_argument("--existing", action="store_true", help="run nothing, read what is there")
    options = parser.parse_args()
    run_all(options, [choice for choice in CHOICES if not options.groups or choice[0] in options.groups])
    ran = [choice for choice in CHOICES
           if any((directory_of(options, choice, seed) / compare_modes.FINISHED).is_file() for seed in options.seeds)]
    try:
        seeds = ", ".join(map(str, options.seeds))
        compare_modes.put_section(Path(options.docs) / "cutting.md", f"""Adaptive runs of `{CASE}` on the packings {seeds}. The force is that at the full depth, the
shares are those of the work of the tool; +- standard errors over the packings. Made by `tests/studies/cut_choices.py`.

{table(options, ran)}
""", BEGIN, END)
    except (Unreadable, OSError) as error:
        print(f"cut_choices: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
