#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs the specimen cases and writes their results and pictures into docs/.

  specimen_results.py [--kerf build/kerf] [--existing]

Writes the table between the markers <!-- specimens:begin --> and <!-- specimens:end --> of docs/results/specimens.md and
docs/results/figures/specimen_*.png. The strengths are those in the cases; calibration_results.py searches them.
"""
import argparse
import subprocess
import sys
from pathlib import Path

from matplotlib import image

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
import compare_modes  # noqa: E402
from results_file import History, Unreadable  # noqa: E402  (found through compare_modes)

CASES = ("uniaxial_compression_2d", "uniaxial_compression_3d", "direct_tension_2d", "direct_tension_3d", "brazilian_2d")
PICTURES = (("uniaxial_compression_2d", "stress_strain"), ("uniaxial_compression_2d", "final"), ("direct_tension_2d", "stress_strain"),
            ("direct_tension_2d", "final"), ("brazilian_2d", "final"),
            ("uniaxial_compression_3d", "final"))
BEGIN, END = "<!-- specimens:begin -->", "<!-- specimens:end -->"


def last_line(directory, start):
    """What the log says at its end."""
    lines = [line for line in (directory / "log.txt").read_text().splitlines() if line.startswith(start)]
    if not lines:
        raise Unreadable(f"{directory}/log.txt: no line '{start} ...'")
    return lines[-1]


def row(case, directory):
    history = History(directory)
    balance = abs(history["energy_residual"][-1]) / history["work_tool"][-1]
    text = last_line(directory, {"b": "Brazilian", "d": "direct tension", "u": "uniaxial"}[case[0]])
    return (f"| `cases/{case}` | {int(history['active_particles'][-1])} | {history['wall_time'][-1]:.0f} | {text.split(': ', 1)[1]} | "
            f"{balance:.1e} |")


def section(directories):
    text = ["| case | particles | wall time [s] | result | energy residual / work |", "|---|---:|---:|---|---:|"]
    text += [row(case, directory) for case, directory in zip(CASES, directories)]
    text += ["", "Made by `tests/studies/specimen_results.py`.", ""]
    for case, name in PICTURES:
        text += [f"![{case}: {name.replace('_', ' ')}](figures/specimen_{case}_{name}.png)", ""]
    return "\n".join(text)


def half_size(source, target):
    """A copy with half as many pixels either way."""
    pixels = image.imread(source)
    pixels = pixels[:len(pixels) // 2 * 2, :pixels.shape[1] // 2 * 2]
    image.imsave(target, 0.25 * (pixels[::2, ::2] + pixels[1::2, ::2] + pixels[::2, 1::2] + pixels[1::2, 1::2]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kerf", default=str(ROOT / "build" / "kerf"))
    parser.add_argument("--results", default="results/specimens")
    parser.add_argument("--docs", default=str(ROOT / "docs" / "results"))
    parser.add_argument("--existing", action="store_true", help="run nothing, read what is there")
    options = parser.parse_args()
    directories = [Path(options.results) / case for case in CASES]
    docs = Path(options.docs)
    try:
        if not options.existing:
            for case, directory in zip(CASES, directories):
                subprocess.run([options.kerf, "run", str(ROOT / "cases" / case), "--output", str(directory), "--overwrite"],
                               check=True)
        for case, name in PICTURES:
            source = Path(options.results) / case / "figures" / f"{name}.png"
            half_size(source, docs / "figures" / f"specimen_{case}_{name}.png")
        compare_modes.put_section(docs / "specimens.md", section(directories), BEGIN, END)
    except (Unreadable, OSError, subprocess.CalledProcessError) as error:
        print(f"specimen_results: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
