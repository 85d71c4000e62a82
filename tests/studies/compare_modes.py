#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs one case as full DEM, fixed and adaptive coupling and writes the comparison into docs/.

  compare_modes.py [CASE] [--from T] [--overwrite] [--existing] [--launcher "mpirun -n 2"] [-- kerf options]

Writes the table between the markers <!-- modes:begin --> and <!-- modes:end --> of docs/results/cutting.md, and the figures
docs/results/figures/modes_normal_force.png and docs/results/figures/modes_active_particles.png. A mode that has finished with the same
options is not run again.
"""
import argparse
import shlex
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "coupler" / "application" / "plots"))
import figures  # noqa: E402  (found through the path above)
from results_file import History, Unreadable, first_contact, time_mean  # noqa: E402

BEGIN, END = "<!-- modes:begin -->", "<!-- modes:end -->"
FINISHED = "compare_modes.txt"  # in the results of a mode: the command that finished there
NEEDED = ("time", "tool_force_y", "active_particles", "broken_bonds", "cpu_time")


def run_mode(command, directory, overwrite):
    """Runs kerf unless the same command has finished in the directory; its exit code."""
    marker = directory / FINISHED
    text = shlex.join(command)
    if not overwrite and marker.is_file() and marker.read_text() == text:
        print(f"compare_modes: {directory} is finished, kept")
        return 0
    # Without --overwrite kerf itself refuses a directory that holds another run.
    if overwrite:
        marker.unlink(missing_ok=True)
    code = subprocess.run(command + (["--overwrite"] if overwrite else []), check=False).returncode
    if code == 0:
        marker.write_text(text)
    return code


def common_window(histories, start):
    """Time window that all runs have: from start, by default the second half of the time after all are in contact."""
    end = min(history["time"][-1] for history in histories)
    if start is None:
        contact = max(first_contact(history["time"], history["tool_force_y"]) for history in histories)
        start = 0.5 * (contact + end)
    if not start < end:
        raise Unreadable(f"the time window from {start:g} s has no end: the shortest run stops at {end:g} s")
    return start, end


def summary(history, start, end):
    """The numbers of one run: forces within the window, costs over the whole run."""
    time, force, active = history["time"], history["tool_force_y"], history["active_particles"]
    inside = (time >= start) & (time <= end)
    quarters = [active[abs(time - (time[0] + part * (time[-1] - time[0]))).argmin()] for part in (0.25, 0.5, 0.75, 1.)]
    return {"cpu_time": history["cpu_time"][-1], "mean_force": time_mean(time, force, start, end),
            "peak_force": force[inside].max(), "mean_active": time_mean(time, active, time[0], time[-1]),
            "max_active": active.max(), "quarters": quarters, "broken_bonds": history["broken_bonds"][-1]}


def table(modes, rows, unit):
    """Markdown table; differences are to the first mode."""
    lines = [f"| mode | CPU time [s] | mean normal force [{unit}] | to {modes[0]} | peak normal force [{unit}] | "
             "active particles, mean | max | at 25 / 50 / 75 / 100 % of the time | broken bonds |",
             "|---|---:|---:|---:|---:|---:|---:|---:|---:|"]
    reference = rows[0]["mean_force"]
    for mode, row in zip(modes, rows):
        change = f"{100. * (row['mean_force'] / reference - 1.):+.1f} %" if reference else "-"
        quarters = " / ".join(f"{value:.0f}" for value in row["quarters"])
        lines.append(f"| {mode} | {row['cpu_time']:.1f} | {row['mean_force'] / 1e3:.1f} | {change} | "
                     f"{row['peak_force'] / 1e3:.1f} | {row['mean_active']:.0f} | {row['max_active']:.0f} | {quarters} | "
                     f"{row['broken_bonds']:.0f} |")
    return "\n".join(lines)


def section(case, options, modes, directories, start):
    """The text between the markers."""
    histories = [History(directory) for directory in directories]
    for directory, history in zip(directories, histories):
        missing = [name for name in NEEDED if name not in history]
        if missing or history.rows < 2:
            raise Unreadable(f"{directory}/history.h5: " + (f"no column {missing[0]}" if missing else "fewer than two rows"))
    start, end = common_window(histories, start)
    rows = [summary(history, start, end) for history in histories]
    unit = "k" + (histories[0].units["tool_force_y"] or "N")
    chosen = f" with `{shlex.join(options)}`" if options else ""
    return f"""Case `{case}`{chosen}. Forces are those between {start * 1e3:.3g} ms and {end * 1e3:.3g} ms, costs those of the
whole run. Made by `tests/studies/compare_modes.py`.

{table(modes, rows, unit)}

![Normal force of the modes](figures/modes_normal_force.png)

![Active particles of the modes](figures/modes_active_particles.png)
"""


def put_section(document, text, begin=BEGIN, end=END):
    """Replaces what stands between the markers; a document that does not exist is made."""
    old = document.read_text(encoding="utf-8") if document.is_file() else f"# Results\n\n## Modes\n\n{begin}\n{end}\n"
    if old.count(begin) != 1 or old.count(end) != 1 or old.index(end) < old.index(begin):
        raise Unreadable(f"{document}: the markers {begin} and {end} are not there once each, in this order")
    document.write_text(old[:old.index(begin) + len(begin)] + "\n" + text + old[old.index(end):], encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", nargs="?", default="cases/disc_cutter_2d")
    parser.add_argument("--modes", nargs="+", default=["dem", "fixed", "adaptive"], metavar="MODE")
    parser.add_argument("--kerf", default=str(ROOT / "build" / "kerf"), help="executable, by default build/kerf")
    parser.add_argument("--launcher", default="", help="command in front of kerf, for MPI")
    parser.add_argument("--results", help="directory of the runs, by default results/CASE_modes")
    parser.add_argument("--docs", default=str(ROOT / "docs" / "results"))
    parser.add_argument("--from", dest="start", type=float, metavar="T", help="start of the time window of the forces [s]")
    parser.add_argument("--overwrite", action="store_true", help="run all modes again")
    parser.add_argument("--existing", action="store_true", help="run nothing, read what is there")
    # What follows -- belongs to kerf.
    arguments = sys.argv[1:]
    cut = arguments.index("--") if "--" in arguments else len(arguments)
    options, kerf_options = parser.parse_args(arguments[:cut]), arguments[cut + 1:]

    case = Path(options.case) if Path(options.case).is_dir() else ROOT / options.case
    results = Path(options.results or f"results/{case.name}_modes")
    directories = [results / mode for mode in options.modes]
    if not options.existing:
        for mode, directory in zip(options.modes, directories):
            command = shlex.split(options.launcher) + [options.kerf, "run", str(case), "--mode", mode, "--output",
                                                       str(directory)] + kerf_options
            code = run_mode(command, directory, options.overwrite)
            if code != 0:
                print(f"compare_modes: kerf failed in mode {mode} with exit code {code}", file=sys.stderr)
                return code
    docs = Path(options.docs)
    try:
        text = section(options.case, kerf_options, options.modes, directories, options.start)
        (docs / "figures").mkdir(parents=True, exist_ok=True)
        figures.use_style()
        for column, name in (("tool_force_y", "modes_normal_force"), ("active_particles", "modes_active_particles")):
            figures.compare(directories, options.modes, docs / "figures" / f"{name}.png", column)
        put_section(docs / "cutting.md", text)
    except (Unreadable, OSError) as error:
        print(f"compare_modes: {error}", file=sys.stderr)
        return 1
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
