#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures the elastic force of the tool against cell size, particle size and contact stiffness, and writes docs/results/cutting.md.

  tool_force.py [--kerf build/kerf] [--packings 8] [--work results/tool_force]

tests/cases/indentation: a disc is pressed 0.1 mm deep into a block whose bonds cannot break, and stays there. The force is the mean
while it stays. The reference is the finite-element force on the finest cells with a stiff contact. Runs that are in the working
directory are not repeated. About ten minutes; writes between the marks <!-- toolforce:begin --> and <!-- toolforce:end -->.
"""
import argparse
import math
import os
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
import kerf_runner  # noqa: E402

CASE = ROOT / "tests" / "cases" / "indentation"
PAGE = ROOT / "docs" / "results" / "cutting.md"
HOLD = (1.4e-4, 1.8e-4)  # the tool is at rest, vibrations average out
SHALLOWER = (0.08, "0 0.016 0.04101;  1.1e-4 0.016 0.04092;  2e-4 0.016 0.04092")  # depth [mm] and path, for the slope
CELLS = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4)
DIAMETERS = ((1e-3, 1.), (5e-4, 1.), (2.5e-4, 0.125))  # and the share of the packings
RATIOS = (1, 4, 10, 40)
STIFF = 40


class Study:
    def __init__(self, kerf, work):
        self.kerf, self.work = os.path.abspath(kerf), Path(work)
        self.work.mkdir(parents=True, exist_ok=True)

    def force(self, mode, cell=4e-3, d=1e-3, seed=1, ratio=0, path=None):
        """Mean force while the tool stays [kN/m]."""
        name = f"{mode}_h{cell:g}_d{d:g}_s{seed}_r{ratio:g}" + ("_shallower" if path else "")
        case, output = self.work / f"case_d{d:g}_s{seed}", self.work / name
        if not case.exists():
            kerf_runner.copy_case(CASE, case)
        if not (output / "history.csv").exists():
            settings = {"Mesh/Cell size": cell, "Packing/Mean diameter": d, "Packing/Seed": seed, "Tool/Stiffness ratio": ratio}
            if path:
                settings["Tool/Path"] = path
            words = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
            result = kerf_runner.run(self.kerf, ["run", case, "--mode", mode, "--output", output, "--overwrite", *words], timeout=3600)
            if result.returncode != 0:
                shutil.rmtree(output, ignore_errors=True)
                sys.exit(f"{name}: {result.stderr.strip()}")
        history = kerf_runner.history(output)
        forces = [force for time, force in zip(history["time"], history["tool_force_y"]) if HOLD[0] < time <= HOLD[1]]
        print(f"{name}: {1e-3 * sum(forces) / len(forces):.1f} kN/m", flush=True)
        return 1e-3 * sum(forces) / len(forces)

    def steps(self, mode, ratio):
        return kerf_runner.history(self.work / f"{mode}_h0.004_d0.001_s1_r{ratio:g}")["step"][-1]


def statistics(values):
    mean = sum(values) / len(values)
    spread = math.sqrt(sum((value - mean) ** 2 for value in values) / max(1, len(values) - 1))
    return mean, spread if len(values) > 1 else float("nan")


def percent(value, reference):
    return f"{100. * (value / reference - 1.):+.1f} %"


def tables(study, n_packings):
    # d is the scale of the contact in mode fem, too: it falls with the cells.
    cells = {h: study.force("fem", cell=h, d=min(1e-3, h), ratio=STIFF) for h in CELLS}
    reference = cells[CELLS[-1]]
    slope = (reference - study.force("fem", cell=CELLS[-1], d=CELLS[-1], ratio=STIFF, path=SHALLOWER[1])) / (0.1 - SHALLOWER[0])
    yield f"Reference: {reference:.0f} kN/m, the finite-element force on cells of {1e3 * CELLS[-1]:g} mm, stiffness ratio {STIFF}. " \
          f"Made by `tests/studies/tool_force.py`.\n"
    yield "| mode fem, cells [mm] | " + " | ".join(f"{1e3 * h:g}" for h in CELLS) + " |"
    yield "|---|" + "---:|" * len(CELLS)
    yield "| force [kN/m] | " + " | ".join(f"{cells[h]:.0f}" for h in CELLS) + " |"
    yield "| to the reference | " + " | ".join(percent(cells[h], reference) for h in CELLS) + " |\n"

    ratios = (*RATIOS, 0)
    forces = {r: study.force("dem", ratio=r) for r in (*ratios, 100)}
    yield "| full DEM, d = 1 mm, packing 1, stiffness ratio | " + " | ".join("by the step" if r == 0 else f"{r}" for r in ratios) + " |"
    yield "|---|" + "---:|" * len(ratios)
    yield "| to ratio 100 | " + " | ".join(percent(forces[r], forces[100]) for r in ratios) + " |"
    yield "| time steps | " + " | ".join(f"{study.steps('dem', r):.0f}" for r in ratios) + " |\n"

    yield "| particles d [mm] | packings | full DEM | scatter over packings | depth that is missing | fixed | adaptive |"
    yield "|---:|---:|---:|---:|---:|---:|---:|"
    for d, share in DIAMETERS:
        seeds = range(1, 1 + max(1, round(share * n_packings)))
        of_mode = {mode: [study.force(mode, d=d, seed=seed) for seed in seeds] for mode in ("dem", "fixed", "adaptive")}
        mean, spread = statistics(of_mode["dem"])
        error = spread / math.sqrt(len(seeds))
        missing = (reference - mean) / slope
        several = len(seeds) > 1
        plus_minus = f" +- {100. * error / reference:.1f} %" if several else ""
        scatter = f"{100. * spread / mean:.1f} %" if several else ""
        yield f"| {1e3 * d:g} | {len(seeds)} | {percent(mean, reference)}{plus_minus} | {scatter} | " \
              f"{missing / (1e3 * d):.3f} d | " + \
              " | ".join(percent(statistics(of_mode[mode])[0], reference) for mode in ("fixed", "adaptive")) + " |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kerf", default=ROOT / "build" / "kerf")
    parser.add_argument("--packings", type=int, default=8)
    parser.add_argument("--work", default=ROOT / "results" / "tool_force")
    arguments = parser.parse_args()
    text = "\n".join(tables(Study(arguments.kerf, arguments.work), arguments.packings))
    page = PAGE.read_text(encoding="utf-8")
    begin, end = "<!-- toolforce:begin -->\n", "<!-- toolforce:end -->"
    head, rest = page.split(begin)
    PAGE.write_text(head + begin + text + "\n" + end + rest.split(end)[1], encoding="utf-8")


if __name__ == "__main__":
    main()
