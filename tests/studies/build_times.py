#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""How long a first build took, from Ninja's log of a build directory, and writes the table of docs/developer/testing.md.

  build_times.py BUILD [--jobs 2] [--write]   after ./test in a fresh clone on an idle machine, without a compiler cache

The time of a target is the sum over its files divided by the number of jobs: all jobs are busy but for the last seconds.
"""
import argparse
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BEGIN, END = "<!-- build times:begin -->", "<!-- build times:end -->"


def durations(build):
    """Seconds by file that Ninja made; of files made twice the last time counts."""
    seconds = {}
    for line in (build / ".ninja_log").read_text().splitlines():
        if not line.startswith("#"):
            start, end, _, name, _ = line.split("\t")
            seconds[name] = (int(end) - int(start)) / 1000.
    return seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    seconds = durations(options.build)
    parts = {"the program `kerf`": {n: s for n, s in seconds.items() if n == "kerf" or n.split("/")[0] in ("coupler", "dem_side", "fem_side")},
             "the tests": {n: s for n, s in seconds.items() if n.startswith("tests/")}}
    rows = ["| target | files | minutes with 2 jobs | slowest files [s] |".replace("2", str(options.jobs)), "|---|---|---|---|"]
    for name, files in parts.items():
        slowest = sorted(files.items(), key=lambda item: -item[1])[:4]
        rows.append(f"| {name} | {len(files)} | {sum(files.values()) / options.jobs / 60.:.1f} | " +
                    ", ".join(f"{Path(file).name.replace('.o', '')} {time:.0f}" for file, time in slowest) + " |")
    text = "\n".join([*rows, "", "Made by `tests/studies/build_times.py`.", ""])
    print(text)
    if options.write:
        page = ROOT / "docs" / "developer" / "testing.md"
        content = page.read_text()
        before, after = content.split(BEGIN)[0], content.split(END)[1]
        page.write_text(f"{before}{BEGIN}\n{text}{END}{after}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
