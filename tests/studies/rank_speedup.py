#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Times the modes of the cutting cases on one rank and on several, and writes the table of docs/results/performance.md.

  rank_speedup.py [--kerf build/kerf] [--ranks 2] [--repeats 2]

Runs stop early in the cut; those on one rank and on several take turns, and the fastest of each counts. Adaptive runs part ways
when rock breaks, so their mean numbers of active particles stand beside their times. Writes between the markers
<!-- ranks:begin --> and <!-- ranks:end -->. About five minutes; leave the machine alone meanwhile.
"""
import argparse
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "coupler" / "application" / "plots"))
sys.path.insert(0, str(ROOT / "tests" / "support"))
import compare_modes  # noqa: E402  (found through the path above)
import kerf_runner  # noqa: E402
from results_file import History, time_mean  # noqa: E402

BEGIN, END = "<!-- ranks:begin -->", "<!-- ranks:end -->"
RUNS = [("cases/disc_cutter_2d", "dem", 0.8e-3), ("cases/disc_cutter_2d", "fixed", 1e-3),
        ("cases/disc_cutter_2d", "adaptive", 4e-3), ("cases/disc_cutter_3d", "fixed", 1.5e-4),
        ("cases/disc_cutter_3d", "adaptive", 9e-4)]


def timed(kerf, case, mode, end_time, ranks, directory):
    """Wall time after set-up [s] and mean number of active particles."""
    arguments = ["run", ROOT / case, "--mode", mode, "--output", directory, "--overwrite", "--set", f"Time/End time={end_time}",
                 "--set", "Output/Snapshots=1"]
    result = kerf_runner.run(kerf, arguments, ranks)
    if result.returncode != 0:
        sys.exit(f"rank_speedup: {case}, mode {mode}, {ranks} ranks: {result.stdout}{result.stderr}")
    history = History(directory)
    time = history["time"]
    return history["wall_time"][-1], time_mean(time, history["active_particles"], time[0], time[-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kerf", default=str(ROOT / "build" / "kerf"))
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=2)
    options = parser.parse_args()
    lines = [f"| case | mode | until | particles, mean on 1 rank | on {options.ranks} | wall time on 1 rank [s] | "
             f"on {options.ranks} [s] | faster by |", "|---|---|---:|---:|---:|---:|---:|---:|"]
    with tempfile.TemporaryDirectory() as directory:
        for case, mode, end_time in RUNS:
            best = {}
            for _ in range(options.repeats):
                for ranks in (1, options.ranks):
                    best[ranks] = min(best.get(ranks, (float("inf"), 0.)),
                                      timed(options.kerf, case, mode, end_time, ranks, Path(directory) / "run"))
            (alone, few), (together, many) = best[1], best[options.ranks]
            lines.append(f"| `{case}` | {mode} | {1e3 * end_time:g} ms | {few:.0f} | {many:.0f} | {alone:.1f} | {together:.1f} | "
                         f"{alone / together:.2f} |")
            print(lines[-1], flush=True)
    text = ("Best of {0} runs each, in turns. Made by `tests/studies/rank_speedup.py`.\n\n{1}\n"
            .format(options.repeats, "\n".join(lines)))
    compare_modes.put_section(ROOT / "docs" / "results" / "performance.md", text, BEGIN, END)


if __name__ == "__main__":
    main()
