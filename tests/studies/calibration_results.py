#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Calibrates the rock of the compressed specimens in two and three dimensions and writes what was reached into docs/.

  calibration_results.py [CASE ...] [--kerf build/kerf] [--ranks N] [--existing]

Writes the tables between the markers <!-- calibration:begin --> and <!-- calibration:end --> of docs/results/specimens.md. The search is
made in copies of the cases; the cases themselves are not changed. With names of cases only those are searched, the results of
others are those of the last time. Minutes in two dimensions, longer in three.
"""
import argparse
import shutil
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
import compare_modes  # noqa: E402
import kerf_runner  # noqa: E402
from results_file import Unreadable  # noqa: E402  (found through compare_modes)

# Name in the table: case and what is changed in it. The last one shows strengths of 10 to 1.
CASES = {"uniaxial_compression_2d": ("uniaxial_compression_2d", []),
         "uniaxial_compression_3d": ("uniaxial_compression_3d", []),
         "stiff_rock_3d": ("uniaxial_compression_3d", ["Rock/Young modulus=40e9", "Rock/Tensile strength=9e6",
                                                       "Rock/Compressive strength=90e6", "Bond/Shear strength friction=1"])}
BEGIN, END = "<!-- calibration:begin -->", "<!-- calibration:end -->"
# Name, attributes of target, value and scatter in the store, unit for a person and its size in SI units.
QUANTITIES = (("E, static solve of the store", "target_young", "achieved_young", None, "GPa", 1e9),
              ("nu, static solve of the store", "target_poisson", "achieved_poisson", None, "", 1.),
              ("E, middle of the specimens in the press", "target_young", "specimen_young", "specimen_young_scatter", "GPa", 1e9),
              ("nu, middle of the specimens in the press", "target_poisson", "specimen_poisson", "specimen_poisson_scatter", "", 1.),
              ("uniaxial compressive strength", "target_compressive", "achieved_compressive", "scatter_compressive", "MPa", 1e6),
              ("Brazilian strength", "target_tensile", "achieved_tensile", "scatter_tensile", "MPa", 1e6))


def calibrate(kerf, case, directory, ranks):
    """Runs the search in a fresh copy of the case; keeps its output and the time it took."""
    shutil.rmtree(directory, ignore_errors=True)
    directory.parent.mkdir(parents=True, exist_ok=True)
    source, changes = CASES[case]
    kerf_runner.copy_case(str(ROOT / "cases" / source), str(directory))
    options = [word for change in changes for word in ("--set", change)]
    start = time.monotonic()
    result = kerf_runner.run(str(Path(kerf).resolve()), ["calibrate", str(directory), *options], ranks, timeout=None)
    if result.returncode:
        raise Unreadable(f"kerf calibrate {directory}: {result.stderr.strip()}")
    seconds = time.monotonic() - start
    (directory / "output.txt").write_text(f"{result.stdout}\n{ranks} ranks, {seconds:.0f} s of wall time\n")


def read(directory):
    """The numbers of the store and the lines of the output."""
    stores = list(directory.glob("packing_*.h5"))
    if len(stores) != 1 or not (directory / "output.txt").is_file():
        raise Unreadable(f"{directory}: no finished calibration")
    with h5py.File(stores[0]) as file:
        known = {name: float(value) for name, value in file.attrs.items() if np.ndim(value) == 0 and not isinstance(value, (str, bytes))}
    if known.get("strength_packings", 0.) < 1.:
        raise Unreadable(f"{stores[0]}: no strength calibration")
    return known, (directory / "output.txt").read_text().splitlines()


def rows_of_quantities(case, known):
    for name, target, value, scatter, unit, size in QUANTITIES:
        spread = f" +- {known[scatter] / size:.3g}" if scatter else ""
        off = f"{known[value] - known[target]:+.4f}" if name.startswith("nu") else f"{100. * (known[value] / known[target] - 1.):+.2f} %"
        yield f"| `{case}` | {name} | {known[target] / size:.4g} {unit} | {known[value] / size:.4g}{spread} {unit} | {off} |"


def row_of_bond(case, known, lines):
    attempts = sum(line.startswith("R_n") for line in lines)
    unit = "N/m" if known["dim"] == 2 else "N"
    return (f"| `{case}` | {known['strength_packings']:.0f} | {known['k_n']:.4g} N/m | {known['k_t']:.4g} N/m | {known['R_n']:.4g} {unit} | "
            f"{known['R_t']:.4g} {unit} | {known['friction']:.3g} | {known['shear_friction']:.3g} | {attempts} | {lines[-1]} |")


def section(calibrations):
    text = ["| case | quantity | target | reached, mean +- standard deviation over the packings | off |", "|---|---|---:|---:|---:|"]
    for case, (known, _) in zip(CASES, calibrations):
        text += rows_of_quantities(case, known)
    text += ["", "| case | packings | k_n | k_t | R_n | R_t | friction | shear strength friction | attempts | cost |",
             "|---|---:|---:|---:|---:|---:|---:|---:|---:|---|"]
    text += [row_of_bond(case, *calibration) for case, calibration in zip(CASES, calibrations)]
    return "\n".join([*text, "", "Made by `tests/studies/calibration_results.py`.", ""])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", metavar="CASE", help=" or ".join(CASES))
    parser.add_argument("--kerf", default=str(ROOT / "build" / "kerf"))
    parser.add_argument("--results", default="results/calibration")
    parser.add_argument("--docs", default=str(ROOT / "docs" / "results"))
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--existing", action="store_true", help="run nothing, read what is there")
    options = parser.parse_args()
    directories = [Path(options.results) / case for case in CASES]
    try:
        if not options.existing:
            for case, directory in zip(CASES, directories):
                if case in (options.cases or CASES):
                    calibrate(options.kerf, case, directory, options.ranks)
        text = section([read(directory) for directory in directories])
        compare_modes.put_section(Path(options.docs) / "specimens.md", text, BEGIN, END)
    except (Unreadable, OSError) as error:
        print(f"calibration_results: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
