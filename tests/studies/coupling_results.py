#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures the coupling methods on strips and writes the tables of docs/results/coupling.md.

  coupling_results.py [--study build/tests/coupling_study] [--existing] [--stability DIR] [--cost] [--only-cost]

Runs coupling_study (build target of the same name), keeps its output in results/coupling/, and writes the tables between the
markers <!-- patch:begin --> ... of docs/results/coupling.md. --existing: from what is kept. --stability: also takes the maps of a
`kerf study stability` from DIR. --cost: also cuts with every method, one run after the other, for what the exchange takes; nothing
else should run then. Minutes each.
"""
import argparse
import csv
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
import compare_modes  # noqa: E402
import kerf_runner  # noqa: E402
from results_file import Unreadable  # noqa: E402  (found through compare_modes)

KEPT = ROOT / "results" / "coupling"
PAGE = ROOT / "docs" / "results" / "coupling.md"


def measure(study, what, existing):
    """Rows of a study, run or kept."""
    path = KEPT / f"{what}.csv"
    if not existing:
        KEPT.mkdir(parents=True, exist_ok=True)
        result = subprocess.run([study, what], stdout=subprocess.PIPE, text=True, check=True)
        path.write_text(result.stdout)
    with open(path, newline="", encoding="utf-8") as table:
        return list(csv.DictReader(table))


def mean(values):
    return sum(values) / len(values)


def percent(values, digits=2):
    """Mean and, of several values, the largest deviation from it, in per cent."""
    middle = 100. * mean(values)
    spread = max(abs(100. * value - middle) for value in values)
    return f"{middle:+.{digits}f}" + (f" ± {spread:.{digits}f}" if len(values) > 1 else "")


def grouped(rows, keys):
    """Rows by the values of some columns, in the order of the file."""
    groups = defaultdict(list)
    for row in rows:
        groups[tuple(row[key] for key in keys)].append(row)
    return groups


def column(rows, name):
    return [float(row[name]) for row in rows]


def table(header, lines):
    return "\n".join(["| " + " | ".join(header) + " |", "|---|" + "---:|" * (len(header) - 1)] +
                     ["| " + " | ".join(line) + " |" for line in lines])


def patch_table(rows):
    groups = grouped(rows, ("method", "overlap", "direction"))
    overlaps, directions = list(dict.fromkeys(row["overlap"] for row in rows)), ("tension", "shear")
    header = ["method"] + [f"{what}, {direction}, L_o = {overlap} d" for overlap in overlaps for direction in directions
                           for what in ("strain %", "energy %")]
    lines = []
    for method in dict.fromkeys(row["method"] for row in rows):
        line = [f"`{method}`"]
        for overlap in overlaps:
            for direction in directions:
                group = groups[(method, overlap, direction)]
                line += [percent(column(group, "strain")), percent(column(group, "energy"))]
        lines.append(line)
    return table(header, lines)


def front_table(rows):
    groups = grouped(rows, ("method", "cells"))
    steps = list(dict.fromkeys(row["cells"] for row in rows))
    header = ["method"] + [f"{what}, {step} of 4 cells" for step in steps
                           for what in ("came in %", "moves %", "into particles %")] + ["bonds broken"]
    lines = []
    for method in dict.fromkeys(row["method"] for row in rows):
        line = [f"`{method}`"]
        for step in steps:
            group = groups[(method, step)]
            line += [f"{100. * mean(column(group, name)):.2f}" for name in ("conversion", "kinetic", "noise")]
        line.append(str(sum(int(row["broken"]) for row in rows if row["method"] == method)))
        lines.append(line)
    return table(header, lines)


def waves_table(rows):
    groups = grouped(rows, ("method", "from", "wave", "length"))
    kinds = list(dict.fromkeys((row["from"], row["wave"], row["length"]) for row in rows))
    kinds.sort(key=lambda kind: (kind[0] != "particles", kind[1], -float(kind[2])))
    header = ["method"] + [f"{wave} {length} d from {side}" for side, wave, length in kinds]
    lines = []
    for method in dict.fromkeys(row["method"] for row in rows):
        line = [f"`{method}`"]
        for kind in kinds:
            row = groups[(method, *kind)][0]
            line.append(f"{float(row['returned']):.1e}; {100. * float(row['lost']):.2f} %")
        lines.append(line)
    return table(header, lines)


def random_waves_table(rows):
    groups = grouped(rows, ("method", "wave", "length"))
    kinds = list(dict.fromkeys((row["wave"], row["length"]) for row in rows))
    lines = []
    for method in dict.fromkeys(row["method"] for row in rows):
        lines.append([f"`{method}`"] + [percent(column(groups[(method, *kind)], "returned")) for kind in kinds])
    first = rows[0]["method"]
    lines.append(["*the packing itself*"] + [percent(column(groups[(first, *kind)], "scattered"), 0) for kind in kinds])
    return table(["sent back %"] + [f"{wave} {length} d" for wave, length in kinds], lines)


def stability_text(directory):
    """Pictures of the maps, copied into docs/results/figures, and their CSV."""
    figures = sorted((Path(directory) / "figures").glob("stability_*.png"))
    if not figures:
        raise OSError(f"{directory}/figures: no maps, run kerf study stability first")
    target = ROOT / "docs" / "results" / "figures"
    for figure in figures:
        shutil.copy(figure, target / figure.name)
    shutil.copy(Path(directory) / "stability.csv", ROOT / "docs" / "results" / "stability.csv")
    with open(Path(directory) / "stability.csv", newline="", encoding="utf-8") as file:
        order = list(dict.fromkeys(row["map"] for row in csv.DictReader(file)))
    return "\n\n".join(f"![{name.replace('_', ' ')}](figures/stability_{name}.png)" for name in order)


METHODS = [("`penalty`, 0.5 k_n", {"Method": "penalty", "Penalty ratio": "0.5"}),
           ("`penalty_mass_scaled`, 0.5", {"Method": "penalty_mass_scaled", "Penalty ratio": "0.5"}),
           ("`penalty_mass_scaled`, 0.5, corrector", {"Method": "penalty_mass_scaled", "Penalty ratio": "0.5", "Corrector": "weak"}),
           ("`lumped_multipliers`, 0.02", {"Method": "lumped_multipliers", "Penalty ratio": "0.02"}),
           ("`multipliers`, relaxation 0.05", {"Method": "weak_multipliers", "Fluctuation relaxation": "0.05"})]
CUTS = [("disc_cutter_2d", {}), ("disc_cutter_3d", {"Time/End time": "0.7e-3"})]


def cost_table(kerf, existing):
    """What the exchange takes of a step, from the timer tables of adaptive cuts."""
    lines = []
    for number, (name, coupling) in enumerate(METHODS):
        cells = [name]
        for case, values in CUTS:
            directory = KEPT / f"cost_{case}_{number}"
            values = {**values, **{f"Coupling/{key}": value for key, value in coupling.items()}, "Output/Snapshots": "1"}
            settings = [word for key, value in values.items() for word in ("--set", f"{key}={value}")]
            if not existing:
                subprocess.run([kerf, "run", str(ROOT / "cases" / case), "--mode", "adaptive", "--output", str(directory), "--overwrite",
                                *settings], check=True)
            parts = kerf_runner.timer_table(directory)
            cells += [f"{parts['exchange'][1]:.0f}", f"{100. * kerf_runner.exchange_share(parts):.1f} %"]
        lines.append(cells)
    return table(["`Coupling/Method`"] + [text for case, _ in CUTS for text in (f"`{case}`, us a step", "share of the step")], lines)


def put(name, text):
    compare_modes.put_section(PAGE, text + "\n", f"<!-- {name}:begin -->", f"<!-- {name}:end -->")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--study", default=str(ROOT / "build" / "tests" / "coupling_study"))
    parser.add_argument("--existing", action="store_true")
    parser.add_argument("--stability", metavar="DIR")
    parser.add_argument("--cost", action="store_true")
    parser.add_argument("--only-cost", action="store_true")
    parser.add_argument("--kerf", default=str(ROOT / "build" / "kerf"))
    options = parser.parse_args()
    try:
        if options.cost or options.only_cost:
            put("cost", cost_table(options.kerf, options.existing))
        if options.only_cost:
            return 0
        for name, make in (("patch", patch_table), ("front", front_table), ("waves", waves_table),
                           ("random_waves", random_waves_table)):
            put(name, make(measure(options.study, name, options.existing)))
        if options.stability:
            put("stability", stability_text(options.stability))
    except (Unreadable, OSError, KeyError, ValueError, subprocess.CalledProcessError) as error:
        print(f"coupling_results: {' '.join(str(error).split())}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
