#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Figures of a run, from history.h5 and fields/*.h5 in its results directory.

  figures.py RESULTS_DIR                                  PNG files in RESULTS_DIR/figures/
  figures.py --compare DIR1 DIR2 ... --output FILE.png    one column of several runs over each other
             [--labels L1 L2 ...] [--column tool_force_y]
"""
import argparse
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from results_file import History, Unreadable, running_mean, steady_window, time_mean
from snapshot_figures import MILLI, OVERLAP_COLOUR, snapshot_figures
from stability_figures import stability_figures

LINE_COLOURS = ["#1f5488", "#d1421f", "#3a8a4d", "#8e44ad", "#c98a12", "#4c4c4c", "#1aa0a8", "#a8325e"]
MORE_COLOURS = ["#e377c2", "#8c564b", "#bcbd22", "#7fb3e6", "#f2a07b", "#9bd3a5", "#c5a3dd", "#7a7a00", "#00501e", "#b0b0b0"]
STYLE = {"font.size": 11, "axes.titlesize": 11, "axes.labelsize": 11, "legend.fontsize": 10, "axes.grid": False,
         "axes.prop_cycle": plt.cycler(color=LINE_COLOURS), "savefig.dpi": 150, "figure.facecolor": "white"}


def use_style():
    """Fonts, line colours and resolution of all figures."""
    plt.rcParams.update(STYLE)


def scaled(name, history):
    """Values and axis unit of a column; forces in kN, energies in kJ when they are large."""
    values, unit = history[name], history.units[name]
    if unit.startswith("N"):
        return values / 1e3, "k" + unit
    if unit.startswith("J") and np.nanmax(np.abs(values), initial=0.) >= 1e4:
        return values / 1e3, "k" + unit
    return values, unit


def finish(figure, axes, path):
    for axis in axes:
        axis.margins(x=0.01)
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(True, color="#e3e6ea", linewidth=0.7)
        axis.set_axisbelow(True)
    axes[-1].set_xlabel("time [ms]")
    figure.savefig(path)
    plt.close(figure)


def draw_force(axis, history, name, label):
    """Thin raw line, thick running mean, the mean of the steady part."""
    time, (force, unit) = history["time"], scaled(name, history)
    window = max(len(force) // 20, 1)
    axis.plot(time * MILLI, force, color=LINE_COLOURS[0], linewidth=0.6, alpha=0.5, label="every output")
    axis.plot(time * MILLI, running_mean(force, window), color=LINE_COLOURS[0], linewidth=2.,
              label=f"running mean over {np.median(np.diff(time)) * window * MILLI:.2g} ms")
    start, end = steady_window(time, force)
    mean = time_mean(time, force, start, end)
    axis.plot([start * MILLI, end * MILLI], [mean, mean], color=LINE_COLOURS[1], linestyle="--", linewidth=1.4,
              label=f"mean {mean:.4g} {unit}")
    axis.set_ylabel(f"{label} [{unit}]")
    # Above the axes: a cutting force fills its axes from end to end.
    axis.legend(loc="lower right", bbox_to_anchor=(1., 1.), ncol=3, frameon=False, borderaxespad=0.2)


def force_figure(history, output):
    shown = [(name, label) for name, label in (("tool_force_y", "normal force"), ("tool_force_x", "tangential force"))
             if name in history]
    if shown:
        figure, axes = plt.subplots(len(shown), 1, sharex=True, squeeze=False, layout="constrained",
                                    figsize=(10., 3.4 * len(shown)))
        for axis, (name, label) in zip(axes.flat, shown):
            draw_force(axis, history, name, label)
        finish(figure, axes.flat, output / "normal_force.png")


def specimen_figure(history, output):
    """Nominal stress over the displacement of the platens and over the strains of the middle, up to shortly after the peak."""
    if "nominal_stress" not in history or not np.any(history["nominal_stress"]):
        return
    stress, closing = history["nominal_stress"] / 1e6, history["platen_closing"] * MILLI
    pulled = history["tool_force_y"][int(np.argmax(stress))] < 0.
    peak = int(np.argmax(stress))
    figure, axes = plt.subplots(1, 2, layout="constrained", figsize=(11., 4.6), sharey=True)
    axes[0].plot(closing, stress, linewidth=1.8)
    axes[0].set(xlabel=f"{'opening' if pulled else 'closing'} of the platens [mm]", ylabel="nominal stress [MPa]",
                title=f"largest nominal stress {stress[peak]:.4g} MPa")
    twin = axes[0].twinx()
    twin.plot(closing, history["broken_bonds"], color=LINE_COLOURS[1], linewidth=1.4)
    twin.set_ylabel("broken bonds", color=LINE_COLOURS[1])
    for name, label, sign, colour in (("axial_strain", "lengthening" if pulled else "shortening", 1., LINE_COLOURS[0]),
                                      ("lateral_strain", "narrowing" if pulled else "widening", -1., LINE_COLOURS[2])):
        axes[1].plot(sign * history[name][:peak + 1] * 1e3, stress[:peak + 1], color=colour, linewidth=1.8, label=label)
    axes[1].set(xlabel="strain of the middle of the specimen up to the peak [1e-3]")
    axes[1].axvline(0., color="#888888", linewidth=0.8)
    axes[1].legend(frameon=False)
    for axis in axes:
        axis.grid(True, color="#e3e6ea", linewidth=0.7)
        axis.set_ylim(bottom=0.)
    twin.set_ylim(bottom=0.)
    figure.savefig(output / "stress_strain.png")
    plt.close(figure)


def cost_figure(history, output):
    """Cost of the adaptivity: particles, converted cells, broken bonds, wall time."""
    shown = [(name, label, colour) for name, label, colour in
             (("active_particles", "active particles", LINE_COLOURS[0]),
              ("converted_cells", "converted cells", LINE_COLOURS[3]),
              ("broken_bonds", "broken bonds", LINE_COLOURS[1]), ("wall_time", "wall time [s]", LINE_COLOURS[5]))
             if name in history]
    if shown:
        figure, axes = plt.subplots(len(shown), 1, sharex=True, squeeze=False, layout="constrained",
                                    figsize=(10., 1.9 * len(shown) + 0.4))
        for axis, (name, label, colour) in zip(axes.flat, shown):
            axis.plot(history["time"] * MILLI, history[name], color=colour, linewidth=1.8)
            if name == "active_particles" and "overlap_particles" in history:
                axis.plot(history["time"] * MILLI, history["overlap_particles"], color=OVERLAP_COLOUR, linestyle="--",
                          linewidth=1.4, label="of them in the overlap")
                axis.legend(frameon=False)
            axis.set_ylabel(label)
            axis.set_ylim(bottom=0.)
        figure.align_ylabels()
        finish(figure, axes.flat, output / "cost.png")


def energy_figure(history, output):
    """All energies and works that are not zero throughout, works dashed; below, the error of the balance."""
    names = [name for name in sorted(history.columns) if name.startswith(("energy_", "work_")) and np.any(history[name])
             and name != "energy_residual"]
    if not names:
        return
    largest = max(names, key=lambda name: np.nanmax(np.abs(history[name]), initial=0.))
    unit = scaled(largest, history)[1]
    factor = 1e-3 if unit.startswith("k") else 1.
    figure, (axis, missing) = plt.subplots(2, 1, sharex=True, figsize=(10., 6.6), layout="constrained",
                                           gridspec_kw={"height_ratios": [3., 1.]})
    colours = iter(LINE_COLOURS + MORE_COLOURS)  # more than there are columns: no two lines look the same
    for name in names:
        kind, what = name.split("_", 1)
        style = {"linestyle": "--"} if kind == "work" else {}
        style["color"] = "black" if name == "work_tool" else next(colours)
        label = f"work of the {what}" if kind == "work" else what.replace("_", " ")
        axis.plot(history["time"] * MILLI, history[name] * factor, linewidth=1.8, label=label, **style)
    axis.set_ylabel(f"energy [{unit}]")
    axis.legend(loc="lower right", bbox_to_anchor=(1., 1.), ncol=6, frameon=False, borderaxespad=0.2)
    if "energy_residual" in history:
        share = 100. / np.nanmax(np.abs(history[largest]), initial=np.finfo(float).tiny)
        missing.plot(history["time"] * MILLI, share * history["energy_residual"], linewidth=1.4)
        kind, what = largest.split("_", 1)
        missing.set_ylabel(f"residual [% of {kind if kind == 'work' else what.replace('_', ' ')}]")
    finish(figure, [axis, missing], output / "energy.png")


def compare(directories, labels, output, column="tool_force_y"):
    """One column of several runs: thin raw lines and thick running means."""
    names = {"tool_force_y": "normal force", "tool_force_x": "tangential force"}
    figure, axis = plt.subplots(figsize=(10., 5.), layout="constrained")
    unit = ""
    for directory, label, colour in zip(directories, labels, LINE_COLOURS * len(directories)):
        history = History(directory)
        if column not in history or not history.rows:
            raise Unreadable(f"{directory}/history.h5: no values of the column '{column}'")
        time, (values, unit) = history["time"] * MILLI, scaled(column, history)
        if column.startswith("tool_force"):
            axis.plot(time, values, color=colour, linewidth=0.5, alpha=0.3)
            values = running_mean(values, max(len(values) // 20, 1))
            label += " (running mean)"
        axis.plot(time, values, color=colour, linewidth=2., label=label)
    axis.set_ylabel(names.get(column, column.replace("_", " ")) + (f" [{unit}]" if unit.strip("-1 ") else ""))
    axis.legend(loc="lower right", bbox_to_anchor=(1., 1.), ncol=3 if len(labels) > 4 else 4, frameon=False, borderaxespad=0.2)
    finish(figure, [axis], output)


def make_figures(directory):
    """All figures of one run or study, in directory/figures."""
    output = Path(directory) / "figures"
    if (Path(directory) / "stability.csv").exists():
        stability_figures(Path(directory) / "stability.csv", output)
        return
    history = History(directory)
    output.mkdir(exist_ok=True)
    notes = [snapshot_figures(directory, output)]
    if history.rows >= 2:
        force_figure(history, output)
        cost_figure(history, output)
        energy_figure(history, output)
        specimen_figure(history, output)
    else:
        notes.append(f"history.h5 has {history.rows} rows, too few for curves")
    for note in filter(None, notes):
        print(f"figures: {directory}: {note}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory", nargs="?", metavar="RESULTS_DIR")
    parser.add_argument("--compare", nargs="+", metavar="DIR")
    parser.add_argument("--output", metavar="FILE.png")
    parser.add_argument("--labels", nargs="+", metavar="LABEL")
    parser.add_argument("--column", default="tool_force_y")
    options = parser.parse_args()
    use_style()
    try:
        if options.compare:
            labels = options.labels or [Path(directory).name for directory in options.compare]
            if not options.output or len(labels) != len(options.compare):
                parser.error("--compare needs --output and one label for each directory")
            compare(options.compare, labels, options.output, options.column)
        elif options.directory:
            make_figures(options.directory)
        else:
            parser.error("RESULTS_DIR or --compare is needed")
    except (Unreadable, OSError, KeyError, ValueError) as error:
        print(f"figures: {' '.join(str(error).split())}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
