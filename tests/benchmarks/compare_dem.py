#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures the particle side beside other programs on the same block of bonded spheres and writes the table into docs/.

  compare_dem.py [--rounds N] [--bench build/bench_dem] [--existing] [--ranks 2]

Programs run one after another on one core each, in rounds, so that a change of the machine's speed meets all of them; what
counts is CPU time and the median of the rounds. Yade and ESyS-Particle are left out where they are not installed. Raw data
go to results/compare_dem/, the table between the markers <!-- dem:begin --> and <!-- dem:end --> of docs/results/performance.md.
"""
import argparse
import json
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BEGIN, END = "<!-- dem:begin -->", "<!-- dem:end -->"
BODIES = {"fcc_10976": 14, "fcc_48668": 23}  # name in bench_dem: cells a side
MPIRUN = ["mpirun", "--oversubscribe", "--allow-run-as-root", "-n"]

OURS = "rock_bond/{}/damped"
# Row of the table: rate it is read from ({}: the body), and our rate that it is compared with, under the same damping.
ROWS = (("kerf, contact damping 0.1", OURS, OURS),
        ("kerf, undamped", "rock_bond/{}/undamped", OURS),
        ("kerf, local damping 0.1", "rock_bond/{}/local_damping", OURS),
        ("plain bond loop, contact damping 0.1", "plain_loop/{}/damped", OURS),
        ("plain bond loop, undamped", "plain_loop/{}/undamped", "rock_bond/{}/undamped"),
        ("stock LIGGGHTS, `gran model hooke tangential history`", "stock_liggghts/{}", OURS),
        ("Yade, JCFPM", "yade/{}", OURS),
        ("ESyS-Particle, brittle beams", "esys/{}", OURS))


class Failed(Exception):
    """A program did not give a number."""


def run(command, timeout=600):
    """Standard output of a program."""
    try:
        result = subprocess.run(command, capture_output=True, text=True, timeout=timeout, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise Failed(f"{command[0]}: {error}") from error
    if result.returncode != 0:
        raise Failed(f"{' '.join(command)} ended with code {result.returncode}: {result.stderr.strip()[-300:]}")
    return result.stdout


def bench(binary, out, body, ranks=1):
    """Rates of everything that bench_dem measures on a body, in particle-steps/s."""
    only = body if ranks == 1 else f"rock_bond/{body}/damped"
    launcher = MPIRUN + [str(ranks)] if ranks > 1 else []
    run(launcher + [str(binary), f"--benchmark_filter={only}", f"--benchmark_out={out}", "--benchmark_out_format=json"])
    rates = {}
    for entry in json.loads(out.read_text(encoding="utf-8"))["benchmarks"]:
        if entry.get("error_occurred"):
            raise Failed(f"bench_dem, {entry['name']}: {entry['error_message']}")
        name = entry["name"].split("/iterations")[0]
        rates[name if ranks == 1 else f"{name}/{ranks}_ranks"] = entry["particle_steps_per_second"]
    return rates


def peer(command, out):
    """Rate of a script that prints 'result {JSON}'."""
    for line in run(command).splitlines():
        if line.startswith("result "):
            result = json.loads(line[len("result "):])
            out.write_text(json.dumps(result), encoding="utf-8")
            return result["particles"] * result["steps"] / result["cpu"]
    raise Failed(f"{' '.join(command)} printed no result")


def measure(options, directory):
    """Runs all rounds; the list of rates of each name."""
    yade = shutil.which("yade")
    esys = shutil.which("esysparticle")
    for name, found in (("Yade", yade), ("ESyS-Particle", esys)):
        if not found:
            print(f"compare_dem: {name} is not installed, left out")
    rates = {}
    for k in range(options.rounds):
        for body, cells in BODIES.items():
            found = bench(options.bench, directory / f"bench_{body}_{k}.json", body)
            if options.ranks > 1:
                found.update(bench(options.bench, directory / f"bench_{body}_{k}_ranks.json", body, options.ranks))
            steps = max(10, 800000 // cells**3 // 4)
            if yade:
                found[f"yade/{body}"] = peer([yade, "-n", "-x", "-j1", str(HERE / "yade_jcfpm.py"), str(cells), str(steps)],
                                             directory / f"yade_{body}_{k}.json")
            if esys:
                found[f"esys/{body}"] = peer(MPIRUN + ["2", esys, str(HERE / "esys_brittle_beam.py"), str(cells), str(steps)],
                                             directory / f"esys_{body}_{k}.json")
            for name, rate in found.items():
                rates.setdefault(name, []).append(rate)
            print(f"compare_dem: round {k + 1} of {options.rounds}, {body}: " +
                  ", ".join(f"{name.replace('/' + body, '')} {rate / 1e6:.2f}" for name, rate in found.items()), flush=True)
    return rates


def processor():
    """Name of the processor."""
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return "unknown processor"


def section(rates, rounds, ranks):
    """The text between the markers. Ratios are medians of the rounds' ratios: both numbers of one are close in time."""
    lines = ["| one core | " + " | ".join(f"{body.split('_')[1]} spheres | kerf is faster by" for body in BODIES) + " |",
             "|---|" + "---:|---:|" * len(BODIES)]
    rows = list(ROWS)
    if ranks > 1:
        rows.insert(1, (f"kerf, contact damping 0.1, {ranks} ranks (wall time)", OURS + f"/{ranks}_ranks", None))
    for title, name, ours in rows:
        cells = []
        for body in BODIES:
            of_row = rates.get(name.format(body))
            if not of_row:
                cells += ["not installed", ""]
                continue
            own = not ours or name.startswith("rock_bond")
            ratio = "" if own else f"{statistics.median(a / b for a, b in zip(rates[ours.format(body)], of_row)):.2f}"
            cells += [f"{statistics.median(of_row) / 1e6:.2f}", ratio]
        lines.append(f"| {title} | " + " | ".join(cells) + " |")
    table = "\n".join(lines)
    return f"""Million particle-steps a second of CPU time on a face-centred cubic block of spheres with 12 bonds each (fewer at its
surface), medians of {rounds} rounds on {processor()}. kerf's numbers are whole steps with LIGGGHTS' integration, lists and the
failure check. The plain bond loop is what a program without an engine does: structs in sorted arrays, incremental shear,
failure check, integration. Peers run their fast set-ups: `tests/benchmarks/`. Ratios are what carries over to another machine.
Made by `tests/benchmarks/compare_dem.py`.

{table}
"""


def put_section(document, text, begin=BEGIN, end=END):
    """Replaces what stands between the markers."""
    old = document.read_text(encoding="utf-8")
    if old.count(begin) != 1 or old.count(end) != 1 or old.index(end) < old.index(begin):
        raise Failed(f"{document}: the markers {begin} and {end} are not there once each, in this order")
    document.write_text(old[:old.index(begin) + len(begin)] + "\n" + text + old[old.index(end):], encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--bench", type=Path, default=ROOT / "build" / "bench_dem")
    parser.add_argument("--results", type=Path, default=ROOT / "results" / "compare_dem")
    parser.add_argument("--document", type=Path, default=ROOT / "docs" / "results" / "performance.md")
    parser.add_argument("--ranks", type=int, default=1, help="measure kerf on so many ranks, too")
    parser.add_argument("--existing", action="store_true", help="run nothing, write the table of the last run again")
    options = parser.parse_args()
    try:
        options.results.mkdir(parents=True, exist_ok=True)
        summary = options.results / "rates.json"
        if not options.existing:
            rates = measure(options, options.results)
            summary.write_text(json.dumps({"rounds": options.rounds, "ranks": options.ranks, "rates": rates}, indent=1),
                               encoding="utf-8")
        last = json.loads(summary.read_text(encoding="utf-8"))
        text = section(last["rates"], last["rounds"], last["ranks"])
        put_section(options.document, text)
    except (Failed, OSError) as error:
        print(f"compare_dem: {error}", file=sys.stderr)
        return 1
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
