# SPDX-License-Identifier: GPL-2.0-or-later
"""Maps of a stability study, from its stability.csv."""
import csv
import math

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

COLOURS = {"stable": "#3a8a4d", "dissipative": "#e0b040", "unstable": "#c0392b", "refused": "#9aa2ab"}
MEANINGS = {"stable": "stable", "dissipative": "dissipative: the interface takes over 5 %", "unstable": "unstable",
            "refused": "refused before the run"}


def read_maps(path):
    """Rows of each map, by name, in the order of the file."""
    maps = {}
    with open(path, newline="", encoding="utf-8") as table:
        for row in csv.DictReader(table):
            maps.setdefault(row["map"], []).append(row)
    return maps


def short(value):
    """Energy at the end over energy at the start, for a small cell of a map."""
    number = float(value)
    if not math.isfinite(number) or number > 1e3:
        return ""
    return f"{number:.2f}"


def draw_map(name, rows, path):
    xs = list(dict.fromkeys(row["x"] for row in rows))
    ys = list(dict.fromkeys(row["y"] for row in rows))
    figure, axis = plt.subplots(figsize=(2.8 + 0.85 * len(xs), 1.6 + 0.42 * len(ys)), layout="constrained")
    for row in rows:
        x, y = xs.index(row["x"]), ys.index(row["y"])
        axis.add_patch(plt.Rectangle((x - 0.5, y - 0.5), 1., 1., facecolor=COLOURS[row["verdict"]], edgecolor="white"))
        axis.text(x, y, short(row["energy_ratio"]) if row["verdict"] != "refused" else "", ha="center", va="center", fontsize=8,
                  color="white")
        predicted, step = float(row["predicted_limit"]), float(row["step"])
        if 0. < predicted < step:  # the program would not run this step
            axis.add_patch(plt.Rectangle((x - 0.5, y - 0.5), 1., 1., fill=False, hatch="///", edgecolor="white", linewidth=0.))
    axis.set_xlim(-0.5, len(xs) - 0.5)
    axis.set_ylim(-0.5, len(ys) - 0.5)
    axis.set_xticks(range(len(xs)), xs)
    axis.set_yticks(range(len(ys)), ys)
    axis.set_xlabel(rows[0]["x_name"])
    axis.set_ylabel(rows[0]["y_name"])
    shown = [Patch(facecolor=COLOURS[verdict], label=MEANINGS[verdict]) for verdict in COLOURS
             if any(row["verdict"] == verdict for row in rows)]
    shown.append(Patch(facecolor="white", edgecolor="grey", hatch="///", label="step above the predicted limit"))
    shown.append(Line2D([], [], linestyle="", marker="$0.97$", markersize=22, color="grey",
                        label="energy at the end / at the start (empty: above 1000)"))
    axis.legend(handles=shown, loc="lower left", bbox_to_anchor=(0., 1.), ncol=2, frameon=False, fontsize=8)
    figure.savefig(path, bbox_inches="tight")  # the legend may be wider than the map
    plt.close(figure)


def stability_figures(table, output):
    """One picture for each map; numbers are the energy at the end over that at the start."""
    output.mkdir(parents=True, exist_ok=True)
    for name, rows in read_maps(table).items():
        draw_map(name, rows, output / f"stability_{name}.png")
