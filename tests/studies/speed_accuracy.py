#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Charts the error of the cutting force against full DEM over the cost, for many settings of the coupling.

  speed_accuracy.py [CASE] [--kerf build/kerf] [--seeds 1 2 3 ... 16] [--few 4] [--jobs 2] [--from T] [--existing]

Runs the case with every setting and packing into results/speed_accuracy/, some of them at the same time; what has finished with the
same options is kept. Full DEM and adaptive runs are made on all packings, other settings on the first few. Writes docs/results/figures/speed_accuracy.png,
docs/results/figures/packings_normal_force.png and the tables between the markers <!-- chart:begin --> and <!-- chart:end --> of
docs/results/cutting.md. About half an hour on two cores.
"""
import argparse
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))
import compare_modes  # noqa: E402
import figures  # noqa: E402  (found through compare_modes)
import kerf_runner  # noqa: E402
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from results_file import History, Unreadable, time_mean  # noqa: E402

BEGIN, END = "<!-- chart:begin -->", "<!-- chart:end -->"
MASS_SCALED = {"Coupling/Method": "penalty_mass_scaled", "Coupling/Penalty ratio": "0.5"}
# Name, mode, what is set; the first one is what errors are measured against.
SETTINGS = [("full DEM", "dem", {}),
            ("adaptive", "adaptive", {}),
            ("fixed", "fixed", {}),
            ("fixed, small region", "fixed", {"Fixed/Region": "0.044 0.072 0.104 0.088"}),
            ("without return", "adaptive", {"Adaptivity/Return fraction": "0"}),
            ("penalty", "adaptive", MASS_SCALED),
            ("sigma* 0.3 f_t", "adaptive", {"Adaptivity/Sigma star fraction": "0.3"}),
            ("sigma* 0.8 f_t", "adaptive", {"Adaptivity/Sigma star fraction": "0.8"}),
            ("overlap 4 d", "adaptive", {"Coupling/Overlap width": "4"}),
            ("overlap 16 d", "adaptive", {"Coupling/Overlap width": "16"}),
            ("cells of 2 d", "adaptive", {"Mesh/Cell size": "2e-3"})]
MAIN = 2  # of them; the others run on fewer packings


def identifier(name):
    return "".join(letter if letter.isalnum() else "_" for letter in name)


def seeds_of(number, options):
    return options.seeds if number < MAIN else options.seeds[:options.few]


def run_all(options, case, results):
    """Exit codes by (setting, seed). The first setting makes the packings, each of its runs another one."""
    jobs = [(setting, seed) for number, setting in enumerate(SETTINGS) for seed in seeds_of(number, options)]

    def run_one(job):
        (name, mode, values), seed = job
        directory = results / f"{identifier(name)}_{seed}"
        command = [options.kerf, "run", str(case), "--mode", mode, "--output", str(directory), "--set", f"Packing/Seed={seed}",
                   "--set", "Output/Snapshots=1"]
        for key, value in values.items():
            command += ["--set", f"{key}={value}"]
        if options.existing:
            return 0 if (directory / compare_modes.FINISHED).is_file() else 3
        # An unstable run is a result, too; its directory stays and is replaced the next time.
        finished = (directory / compare_modes.FINISHED).is_file()
        return compare_modes.run_mode(command, directory, directory.is_dir() and not finished)

    with ThreadPoolExecutor(options.jobs) as pool:
        codes = list(pool.map(run_one, jobs))
    return {(setting[0], seed): code for (setting, seed), code in zip(jobs, codes)}


def measure(name, seeds, codes, results, start):
    """Means of the force and costs of one setting, over the packings that ran to the end."""
    good = [seed for seed in seeds if codes[name, seed] == 0]
    row = {"name": name, "failed": len(seeds) - len(good), "mean": np.full(len(seeds), np.nan),
           "whole": np.full(len(seeds), np.nan), "peak": np.nan, "broken": np.nan, "wall": np.nan, "walls": [np.nan],
           "active": np.nan}
    if not good:
        return row
    histories = {seed: History(results / f"{identifier(name)}_{seed}") for seed in good}
    for k, seed in enumerate(seeds):
        if seed in histories:
            history = histories[seed]
            for key, begin in (("mean", start), ("whole", 0.)):
                row[key][k] = time_mean(history["time"], history["tool_force_y"], begin, history["time"][-1])
    row["peak"] = np.mean([history["tool_force_y"][history["time"] > start].max() for history in histories.values()])
    row["broken"] = np.mean([history["broken_bonds"][-1] for history in histories.values()])
    row["walls"] = [history["cpu_time"][-1] for history in histories.values()]
    row["wall"] = np.mean(row["walls"])
    row["active"] = np.mean([time_mean(history["time"], history["active_particles"], 0., history["time"][-1])
                             for history in histories.values()])
    return row


def mark_broken_up(codes, results):
    """A run that crumbles rock where full DEM does not has failed, if quietly: over four times its broken bonds."""
    broken = {key: History(results / f"{identifier(key[0])}_{key[1]}")["broken_bonds"][-1]
              for key, code in codes.items() if code == 0}
    for name, seed in broken:
        reference = broken.get((SETTINGS[0][0], seed))
        if reference and broken[name, seed] > 4. * reference:
            codes[name, seed] = 3


def settled(seeds, results, start, unit):
    """Whether full DEM has settled: its mean force in both halves of the time window, over the packings."""
    halves = []
    for seed in seeds:
        history = History(results / f"{identifier(SETTINGS[0][0])}_{seed}")
        end = history["time"][-1]
        middle = 0.5 * (start + end)
        halves.append([time_mean(history["time"], history["tool_force_y"], *window) / 1e3
                       for window in ((start, middle), (middle, end))])
    first, second = np.mean(halves, axis=0)
    error = np.std(np.diff(halves, axis=1), ddof=1) / np.sqrt(len(seeds))
    return (f"In the two halves of that time full DEM has mean forces of {first:.1f} and {second:.1f} {unit}, a change of "
            f"{second - first:+.1f} +- {error:.1f} (standard error over the packings).")


def changes_of_models(directories):
    """What the timer tables of runs say of their activations."""
    shares = [100. * kerf_runner.share_of_run(kerf_runner.timer_table(directory), "activation") for directory in directories]
    return f"Changes of models take {np.mean(shares):.1f} % of the time of the adaptive runs, {max(shares):.1f} % at most."


def errors(rows):
    """Relative errors of the mean force with their standard errors from the differences on each packing, and costs, of means
    over the packings on which a setting ran to the end."""
    for row in rows:
        finished = np.isfinite(row["mean"])
        for key, name in (("mean", "error"), ("whole", "whole_error")):
            reference = rows[0][key][:len(row[key])][finished]
            difference = (row[key][finished] - reference) / np.mean(reference)
            row[name] = np.mean(difference) if len(difference) > 1 else np.nan
            row["of_" + name] = np.std(difference, ddof=1) / np.sqrt(len(difference)) if len(difference) > 1 else np.nan
        reference = np.mean(rows[0]["mean"][:len(row["mean"])][finished])
        row["scatter"] = np.std(row["mean"][finished], ddof=1) / reference if finished.sum() > 1 else np.nan
        row["cost"] = np.mean(row["walls"]) / np.mean(rows[0]["walls"][:len(row["mean"])])


def pareto(rows):
    """Settings that none beats in both cost and error."""
    able = [row for row in rows[1:] if np.isfinite(row["error"])]
    return [row for row in able if not any(other["cost"] < row["cost"] and abs(other["error"]) < abs(row["error"])
                                           for other in able)]


def chart(rows, best, path):
    figure, axis = plt.subplots(figsize=(10., 6.), layout="constrained")
    few = min(len(row["mean"]) for row in rows)
    scatter = 100. * rows[0]["scatter"] / np.sqrt(few)
    axis.axhspan(0., scatter, color="#e3e6ea", label=f"standard error of full DEM over {few} packings")
    able = [row for row in rows[1:] if np.isfinite(row["error"])]
    for row in able:
        chosen = row in best
        axis.errorbar(row["cost"], 100. * abs(row["error"]), 100. * row["of_error"], marker="o", markersize=8, capsize=4,
                      color=figures.LINE_COLOURS[1 if chosen else 0])
        axis.annotate(row["name"], (row["cost"], 100. * abs(row["error"])), xytext=(6, 4), textcoords="offset points", fontsize=8)
    front = sorted(best, key=lambda row: row["cost"])
    axis.step([row["cost"] for row in front], [100. * abs(row["error"]) for row in front], where="post", linewidth=1.,
              color=figures.LINE_COLOURS[1], label="Pareto front")
    failed = [row for row in rows if row["failed"]]
    for k, row in enumerate(failed):
        axis.text(0.02, 0.97 - 0.05 * k, f"failed: {row['name']} ({row['failed']} of {len(row['mean'])} packings)",
                  transform=axis.transAxes, ha="left", va="top", color="#c0392b", fontsize=9)
    axis.set_xlabel("CPU time / CPU time of full DEM")
    axis.set_ylabel("|error of the mean normal force| [%]")
    axis.set_xlim(0., 1.15 * max(row["cost"] for row in able))
    axis.set_ylim(bottom=0.)
    axis.grid(True, color="#e3e6ea", linewidth=0.7)
    axis.set_axisbelow(True)
    axis.legend(frameon=False, loc="lower left", bbox_to_anchor=(0., 1.), ncol=2, borderaxespad=0.2)
    figure.savefig(path)
    plt.close(figure)


def force_figure(directories, path):
    """Running means of the force over time: mean of each mode over its packings, with a band of one standard deviation."""
    figure, axis = plt.subplots(figsize=(10., 5.), layout="constrained")
    for (name, runs), colour in zip(directories.items(), figures.LINE_COLOURS):
        histories = [History(directory) for directory in runs]
        time = histories[0]["time"]
        forces = []
        for history in histories:
            force, unit = figures.scaled("tool_force_y", history)
            forces.append(np.interp(time, history["time"], figures.running_mean(force, max(len(force) // 20, 1))))
        mean, scatter = np.mean(forces, axis=0), np.std(forces, axis=0, ddof=1)
        axis.fill_between(time * figures.MILLI, mean - scatter, mean + scatter, color=colour, alpha=0.15, linewidth=0.)
        axis.plot(time * figures.MILLI, mean, color=colour, linewidth=2., label=f"{name}, mean of {len(runs)} packings")
    axis.set_ylabel(f"normal force, running mean [{unit}]")
    axis.legend(loc="lower right", bbox_to_anchor=(1., 1.), ncol=len(directories), frameon=False, borderaxespad=0.2)
    figures.finish(figure, [axis], path)


def table(rows, best, unit):
    lines = [f"| setting | CPU time [s] | of full DEM | mean normal force [{unit}] | to full DEM | the same of the whole cut | "
             f"scatter over packings | peak [{unit}] | active particles | broken bonds | |",
             "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---|"]
    for row in rows:
        if row["failed"] == len(row["mean"]):
            lines.append(f"| {row['name']} | - | - | - | - | - | - | - | - | - | failed |")
            continue
        note = f"stopped on {row['failed']} packings" if row["failed"] else "Pareto" if row in best else ""
        change, whole = ("" if row is rows[0] else f"{100. * row[name]:+.1f} +- {100. * row['of_' + name]:.1f} %"
                         for name in ("error", "whole_error"))
        scatter = f"{100. * row['scatter']:.1f} %"
        lines.append(f"| {row['name']} | {row['wall']:.1f} | {100. * row['cost']:.0f} % | {np.nanmean(row['mean']) / 1e3:.1f} | "
                     f"{change} | {whole} | {scatter} | {row['peak'] / 1e3:.0f} | {row['active']:.0f} | {row['broken']:.0f} | {note} |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", nargs="?", default="cases/disc_cutter_2d")
    parser.add_argument("--kerf", default=str(ROOT / "build" / "kerf"))
    parser.add_argument("--seeds", nargs="+", type=int, default=list(range(1, 17)))
    parser.add_argument("--settings", nargs="+", metavar="NAME", help="other settings to run, by default all")
    parser.add_argument("--few", type=int, default=4, help="packings of the other settings")
    parser.add_argument("--jobs", type=int, default=2, help="runs at the same time")
    parser.add_argument("--results", default="results/speed_accuracy")
    parser.add_argument("--docs", default=str(ROOT / "docs" / "results"))
    parser.add_argument("--from", dest="start", type=float, default=0., metavar="T", help="start of the time window of the forces [s]")
    parser.add_argument("--existing", action="store_true", help="run nothing, read what is there")
    options = parser.parse_args()
    if options.settings is not None:
        SETTINGS[:] = SETTINGS[:MAIN] + [setting for setting in SETTINGS[MAIN:] if setting[0] in options.settings]
    case = Path(options.case) if Path(options.case).is_dir() else ROOT / options.case
    results, docs = Path(options.results), Path(options.docs)
    codes = run_all(options, case, results)
    try:
        mark_broken_up(codes, results)
        rows = [measure(name, seeds_of(number, options), codes, results, options.start)
                for number, (name, _, _) in enumerate(SETTINGS)]
        if rows[0]["failed"]:
            raise Unreadable("full DEM did not run to the end")
        errors(rows)
        best = pareto(rows)
        unit = "k" + (History(results / f"{identifier(SETTINGS[0][0])}_{options.seeds[0]}").units["tool_force_y"] or "N")
        figures.use_style()
        chart(rows, best, docs / "figures" / "speed_accuracy.png")
        force_figure({name: [results / f"{identifier(name)}_{seed}" for seed in options.seeds if codes[name, seed] == 0]
                      for name, _, _ in SETTINGS[:MAIN]}, docs / "figures" / "packings_normal_force.png")
        seeds = ", ".join(map(str, options.seeds))
        compare_modes.put_section(docs / "cutting.md", f"""Case `{options.case}`, packings {seeds}; the other settings: the first {options.few}. One rank, {options.jobs} runs at the same
time. Forces and peaks are those after {options.start * 1e3:.3g} ms, costs those of the whole run; errors are those of the mean force
against full DEM on the same packings, +- standard errors from the differences on each packing. Failed: stopped, or broke over four times the bonds of full DEM. Made by `tests/studies/speed_accuracy.py`.

{settled(options.seeds, results, options.start, unit)}

{changes_of_models([results / f"adaptive_{seed}" for seed in options.seeds if codes["adaptive", seed] == 0])}

{table(rows, best, unit)}

![Error over cost](figures/speed_accuracy.png)

![Normal force, mean and standard deviation over packings](figures/packings_normal_force.png)
""", BEGIN, END)
    except (Unreadable, OSError) as error:
        print(f"speed_accuracy: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
