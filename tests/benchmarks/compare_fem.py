#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Measures the internal forces of the continuum beside deal.II's own evaluation and a plain loop, and writes the table into docs/.

  compare_fem.py [--rounds N] [--bench build/bench_fem] [--existing] [--ranks 2]

Everything runs on one core, one after another, in rounds, so that a change of the machine's speed meets all of it; ratios are
medians of the rounds' ratios, speeds those of the fastest round. With --ranks whole steps are measured on ranks, too, in wall
time, the fastest round against the fastest of one rank: other load on the machine stops all ranks. Raw data
go to results/compare_fem/, the table between the markers <!-- fem:begin --> and <!-- fem:end --> of docs/results/performance.md.
"""
import argparse
import json
import statistics
import sys
from pathlib import Path

from compare_dem import MPIRUN, Failed, processor, put_section, run

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
BEGIN, END = "<!-- fem:begin -->", "<!-- fem:end -->"
MESHES = {"3d_boxes": "hexahedra, boxes", "3d_distorted": "hexahedra, distorted", "2d_boxes": "quadrilaterals, boxes",
          "2d_distorted": "quadrilaterals, distorted"}
FULL = "forces/{}/small/full"
# Row of the table, what it is and what it is compared with ({}: the mesh).
ROWS = (("full, small strain", FULL, None),
        ("selective, small strain", "forces/{}/small/selective", FULL),
        ("one point, small strain", "forces/{}/small/one_point", FULL),
        ("full, finite strain", "forces/{}/finite/full", FULL),
        ("selective, finite strain", "forces/{}/finite/selective", FULL),
        ("one point, finite strain", "forces/{}/finite/one_point", FULL),
        ("full, small strain, weights that vary in every cell", "forces/{}/small/full/uneven", FULL),
        ("full, small strain, half of the cells off", "forces/{}/small/full/half", FULL),
        ("plain hand-batched loop, full, small strain", "plain_loop/{}", FULL),
        ("deal.II MatrixFree and FEEvaluation, full, small strain", "stock_deal_ii/{}", FULL))


def bench(binary, out, pattern, ranks=1, steps=False):
    """Rates of everything that matches, in cells/s of CPU time, whole steps in wall time."""
    launcher = MPIRUN + [str(ranks)] if ranks > 1 else []
    command = launcher + [str(binary), f"--benchmark_filter={pattern}", f"--benchmark_out={out}", "--benchmark_out_format=json"]
    run(command, timeout=1200)
    rates = {}
    for entry in json.loads(out.read_text(encoding="utf-8"))["benchmarks"]:
        name = entry["name"].split("/iterations")[0]
        # 4 applications an iteration; times are in ms.
        rates[name] = 4. * entry["cells"] / (1e-3 * entry["real_time"]) if steps else entry["cells_per_second"]
    return rates


def measure(options):
    """Runs all rounds; the list of rates of each name."""
    rates = {}
    for k in range(options.rounds):
        found = bench(options.bench, options.results / f"bench_{k}.json", "^(forces|plain_loop|stock_deal_ii)/")
        if options.ranks > 1:
            found.update(bench(options.bench, options.results / f"bench_{k}_steps.json", "^step/", steps=True))
            together = bench(options.bench, options.results / f"bench_{k}_ranks.json", "^step/", options.ranks, steps=True)
            found.update({f"{name}/ranks": rate for name, rate in together.items()})
        for name, rate in found.items():
            rates.setdefault(name, []).append(rate)
        print(f"compare_fem: round {k + 1} of {options.rounds}", flush=True)
    return rates


def ratio(rates, name, reference):
    """Median of the rounds' ratios: both numbers of one are close in time."""
    return statistics.median(a / b for a, b in zip(rates[name], rates[reference]))


def section(rates, rounds, ranks):
    """The text between the markers."""
    lines = ["| one core, 100 000 cells | " + " | ".join(f"{title} | time" for title in MESHES.values()) + " |",
             "|---|" + "---:|---:|" * len(MESHES)]
    for title, name, reference in ROWS:
        cells = []
        for mesh in MESHES:
            own = name.format(mesh)
            time = f"{ratio(rates, reference.format(mesh), own):.2f}" if reference else "1"
            cells += [f"{max(rates[own]) / 1e6:.1f}", time]
        lines.append(f"| {title} | " + " | ".join(cells) + " |")
    together = ""
    steps = sorted(name for name in rates if name.startswith("step/") and not name.endswith("/ranks"))
    if ranks > 1 and steps:
        speedups = ", ".join(f"{name.split('/', 1)[1].replace('_boxes', '').replace('/', ' ')} "
                             f"{max(rates[name + '/ranks']) / max(rates[name]):.2f}" for name in steps)
        together = f"\nWhole steps on {ranks} ranks, wall time, are faster than on one by: {speedups}.\n"
    table = "\n".join(lines)
    over_plain, over_full = (
        ", ".join(f"{title} {ratio(rates, f'forces/{mesh}/small/one_point', other.format(mesh)):.1f}"
                  for mesh, title in MESHES.items()) for other in ("plain_loop/{}", FULL))
    return f"""Million cells a second of the internal forces on one core, best of {rounds} rounds on {processor()}, and the time over that of
full integration with small strain on the same mesh, median of the rounds. Boxes have their edges along the axes: there full
integration of small strains sums over the monomials of the strain, which is exact and has few operations. Distorted cells have
every node moved by up to 0.15 of the cell size. Cells with one point and one weight are worked on in patches of the cells
around a node, which read and add nodal values once a patch; all others go cell by cell. The plain loop is what one writes by
hand for the host's lanes; deal.II is the installed library, compiled with the same flags, with its own number of lanes. Made by
`tests/benchmarks/compare_fem.py`.

{table}

One point, small strain, is faster than the plain loop with full integration by: {over_plain};
than kerf's own full integration by: {over_full}.
{together}"""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--bench", type=Path, default=ROOT / "build" / "bench_fem")
    parser.add_argument("--results", type=Path, default=ROOT / "results" / "compare_fem")
    parser.add_argument("--document", type=Path, default=ROOT / "docs" / "results" / "performance.md")
    parser.add_argument("--ranks", type=int, default=1, help="measure whole steps on so many ranks, too")
    parser.add_argument("--existing", action="store_true", help="run nothing, write the table of the last run again")
    options = parser.parse_args()
    try:
        options.results.mkdir(parents=True, exist_ok=True)
        summary = options.results / "rates.json"
        if not options.existing:
            rates = measure(options)
            summary.write_text(json.dumps({"rounds": options.rounds, "ranks": options.ranks, "rates": rates}, indent=1),
                               encoding="utf-8")
        last = json.loads(summary.read_text(encoding="utf-8"))
        text = section(last["rates"], last["rounds"], last["ranks"])
        put_section(options.document, text, BEGIN, END)
    except (Failed, OSError) as error:
        print(f"compare_fem: {error}", file=sys.stderr)
        return 1
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
