#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Calibrates the rock of the compressed specimens in two and three dimensions and writes what was reached into docs/.

  calibration_results.py [CASE ...] [--kerf build/kerf] [--ranks N] [--results DIR] [--existing]

Writes the tables between the markers <!-- calibration:begin --> and <!-- calibration:end --> of docs/results/specimens.md, from
the strengths.txt of each calibration. The search is made in copies of the cases; the cases themselves are not changed. With names
of cases only those are searched, the results of others are those of the last time. Minutes in two dimensions, longer in three.
`--results cases --existing` runs nothing and takes the strengths.txt of the cases.
"""
import argparse
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
import compare_modes  # noqa: E402
import kerf_runner  # noqa: E402
from results_file import Unreadable  # noqa: E402  (found through compare_modes)

CASES = ("uniaxial_compression_2d", "uniaxial_compression_3d")
BEGIN, END = "<!-- calibration:begin -->", "<!-- calibration:end -->"
# Names of target and value in strengths.txt, unit for a person and its size in SI units. The Brazilian strength has no target.
QUANTITIES = (("Rock/Young modulus", "specimen Young modulus", "GPa", 1e9),
              ("Rock/Poisson ratio", "specimen Poisson ratio", "", 1.),
              ("Rock/Compressive strength", "uniaxial compressive strength", "MPa", 1e6),
              ("Rock/Tensile strength", "direct tensile strength", "MPa", 1e6),
              (None, "Brazilian strength", "MPa", 1e6))


def calibrate(kerf, case, directory, ranks):
    """Runs the search in a fresh copy of the case."""
    shutil.rmtree(directory, ignore_errors=True)
    directory.parent.mkdir(parents=True, exist_ok=True)
    kerf_runner.copy_case(str(ROOT / "cases" / case), str(directory))
    (directory / "strengths.txt").unlink(missing_ok=True)
    result = kerf_runner.run(str(Path(kerf).resolve()), ["calibrate", str(directory)], ranks, timeout=None)
    if result.returncode:
        raise Unreadable(f"kerf calibrate {directory}: {result.stderr.strip()}")


def rows_of_quantities(case, known):
    for target, name, unit, size in QUANTITIES:
        value, wanted = known[name], known[target] if target else None
        text = f"{wanted / size:.4g} {unit}".strip() if target else "-"
        off = "-" if not target else f"{value - wanted:+.4f}" if not unit else f"{100. * (value / wanted - 1.):+.2f} %"
        reached = f"{value / size:.4g} +- {known[f'{name} scatter'] / size:.3g} {unit}".strip()
        yield f"| `{case}` | {name} | {text} | {reached} | {off} |"


def row_of_bond(case, known):
    unit = "N/m" if case.endswith("_2d") else "N"
    return (f"| `{case}` | {known['packings']:.0f} | {1e3 * known['mean diameter']:.3g} mm | {known['R_n']:.4g} {unit} | "
            f"{known['R_t']:.4g} {unit} | {known['Bond/Friction']:.3g} | {known['Bond/Shear strength friction']:.3g} | "
            f"{known['uniaxial compressive strength'] / known['direct tensile strength']:.3g} | "
            f"{known['uniaxial compressive strength'] / known['Brazilian strength']:.3g} |")


def section(calibrations):
    text = ["| case | quantity of the specimens | target | reached, mean +- standard deviation over the packings | off |",
            "|---|---|---:|---:|---:|"]
    for case, known in calibrations.items():
        text += rows_of_quantities(case, known)
    text += ["", "| case | packings | diameter | R_n | R_t | friction | shear strength friction | compressive to direct tensile "
             "strength | compressive to Brazilian strength |", "|---|---:|---:|---:|---:|---:|---:|---:|---:|"]
    text += [row_of_bond(case, known) for case, known in calibrations.items()]
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
    directories = {case: Path(options.results) / case for case in CASES}
    try:
        if not options.existing:
            for case, directory in directories.items():
                if case in (options.cases or CASES):
                    calibrate(options.kerf, case, directory, options.ranks)
        text = section({case: kerf_runner.strengths(directory) for case, directory in directories.items()})
        compare_modes.put_section(Path(options.docs) / "specimens.md", text, BEGIN, END)
    except (Unreadable, OSError) as error:
        print(f"calibration_results: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
