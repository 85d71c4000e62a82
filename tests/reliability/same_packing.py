#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Adaptive runs against full DEM on the same packing, up to failure: peak load, and where rock is converted before it breaks.

usage: same_packing.py KERF CASES TEST_CASES [--quick] [--keep DIR] [--write docs/results/same_packing.md]

--quick: the notched plate on one packing. --keep: results stay in DIR, and those that are there are not run again. --write: runs the
variations that show the causes, too, and writes the tables between the marks of the page.
"""
import argparse
import csv
import os
import sys
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

import h5py
import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "studies"))
import kerf_runner  # noqa: E402
from compare_modes import put_section  # noqa: E402

SEEDS = (1, 2, 3, 4)
PEAK, SHARE = 0.02, 0.95  # largest difference of the peak load, least share of cells that are converted before they break
RAMP, TRACTION = 6e-3, 6e6  # of cases/notched_beam


@dataclass
class Scene:
    name: str
    case: str  # directory
    title: str
    broken: int  # bonds that have failed when the body has
    average: float  # the load is a running mean over this time [s]
    settings: dict = field(default_factory=dict)
    couples: bool = False  # tractions load it, the tool does not
    pushed: float = 0.  # speed of a boundary that pushes [m/s]
    seeds: tuple = SEEDS

    def load(self, history):
        """Force of the tool [N/m], or bending moment [N]."""
        time = history["time"]
        if self.couples:
            return TRACTION * 0.016**2 * 0.5 * (1. - np.cos(np.pi * np.minimum(time / RAMP, 1.)))
        if self.pushed:
            impulse = history["work_boundary"] / self.pushed
        else:
            force = history["tool_force_y"]  # of platens that pull it is negative, but when torn parts swing back
            impulse = np.sign(force[np.abs(force).argmax()]) * np.append(0., np.cumsum(np.diff(time) * force[1:]))
        return (impulse - np.interp(time - self.average, time, impulse)) / self.average

    def failure(self, history):
        """Rows of the peak load and of failure: the load has fallen by 30 %. Couples do not fall; there it is when the crack
        has left the notch."""
        load, broken = self.load(history), history["broken_bonds"]
        failed = broken >= self.broken
        if not self.couples:
            failed &= load < 0.7 * np.maximum.accumulate(load)
        if not failed.any():
            raise SystemExit(f"same_packing: {self.name}: nothing fails")
        end = int(failed.argmax())
        return end if self.couples else int(load[:end].argmax()), end


def scenes(cases, test_cases):
    return [Scene("direct tension", f"{cases}/direct_tension_2d", "bar of 40 x 80 mm, pulled by platens", 5, 1e-5,
                  {"Tool/Stiffness ratio": 5, "Time/Stop below": 0, "Time/End time": 1.6e-3}),
            Scene("notched plate", f"{test_cases}/notched_plate", "48 x 68 mm, edge notch of 12 mm, pulled by platens", 5, 2e-5),
            Scene("first chip", f"{test_cases}/first_chip", "disc of R = 6 mm, 12 mm beside a free side", 20, 2e-5),
            Scene("notched beam", f"{test_cases}/notched_beam", "76 x 32 mm, notch of 12 mm, bent by couples", 10, 1e-5, couples=True,
                  seeds=SEEDS[:2])]  # of half the diameter, minutes each


class Result:
    """A finished run, read back."""

    def __init__(self, directory):
        self.directory = Path(directory)
        self.history = {name: np.array(values) for name, values in kerf_runner.history(directory).items()}
        self.snapshots = sorted((self.directory / "fields").glob("snapshot_*.h5"))

    def boxes(self):
        with h5py.File(self.directory / "fields" / "mesh.h5") as file:
            corners = file["nodes"][()][file["cells"][()].astype(int)]
        return corners.min(axis=1), corners.max(axis=1)

    def breaks(self):
        """Times and places of the broken bonds. The list of places is in the order of failure on one rank; the n-th failed before
        the first row with n broken bonds."""
        with h5py.File(self.snapshots[-1]) as file:
            places = file["bond_broken_position"][()].reshape(-1, 3)
        rows = np.searchsorted(self.history["broken_bonds"], np.arange(len(places)) + 1)
        return self.history["time"][rows], places

    def first_breaks(self, until):
        """Time of the first break of each cell in which bonds break."""
        lower, upper = self.boxes()
        first = {}
        for time, place in zip(*self.breaks()):
            if time > until:
                break
            # At the surface a bond may be just outside.
            outside = np.maximum(np.maximum(lower - place, place - upper), 0.)
            first.setdefault(int(np.linalg.norm(outside, axis=1).argmin()), time)
        return first

    def conversion_times(self):
        """Time at which each cell was converted, infinite if never. Between two snapshots it is that of the last event."""
        with open(self.directory / "activations.csv", encoding="utf-8") as file:
            events = np.array([float(row["time"]) for row in csv.DictReader(line for line in file if not line.startswith("#"))])
        times, before = None, -1.
        for name in self.snapshots:
            with h5py.File(name) as file:
                converted, now = file["cell_alpha"][()] < 1e-9, float(file.attrs["time"])
            if times is None:
                times = np.full(len(converted), np.inf)
            between = events[(events > before) & (events <= now + 1e-12)]
            times[converted & np.isinf(times)] = between.max() if len(between) else now
            before = now
        return times

    def conversion_energy(self, row):
        """Energy that conversions have brought in, as a share of the work done on the body so far."""
        return self.history["energy_conversion"][row] / (self.history["work_tool"][row] + self.history["work_boundary"][row])


class Runner:
    def __init__(self, kerf, work):
        self.kerf, self.work = kerf, Path(work)

    def __call__(self, scene, name, mode, seed, settings=()):
        """Result of a run. Only the places of converted cells need snapshots over time."""
        case = self.work / scene.name.replace(" ", "_")
        if not case.is_dir():
            kerf_runner.copy_case(scene.case, case)
        output = self.work / f"{case.name}_{name}_{seed}"
        if not (output / "figures").is_dir():
            values = {"Packing/Seed": seed, "Output/History interval": 10, "Output/Snapshots": 100 if mode == "adaptive" else 1,
                      **scene.settings, **dict(settings)}
            words = [word for key, value in values.items() for word in ("--set", f"{key}={value}")]
            result = kerf_runner.run(self.kerf, ["run", case, "--mode", mode, "--output", output, "--overwrite", *words])
            if result.returncode != 0:
                raise SystemExit(f"same_packing: {output.name}: {result.stderr.strip()[-400:]}")
        return Result(output)


@dataclass
class Comparison:
    seed: int
    peaks: tuple  # full DEM, adaptive
    cells: int  # in which bonds break in full DEM until failure
    late: list  # of them: (cell, first break, conversion)
    energy: float  # of conversions, share of the work
    converted: int  # cells, at failure

    @property
    def ratio(self):
        return self.peaks[1] / self.peaks[0]


def compare(scene, run, seed):
    full, adaptive = run(scene, "dem", "dem", seed), run(scene, "adaptive", "adaptive", seed)
    (peak, end), (peak_adaptive, end_adaptive) = scene.failure(full.history), scene.failure(adaptive.history)
    first = full.first_breaks(full.history["time"][end])
    conversions = adaptive.conversion_times()
    late = [(cell, time, conversions[cell]) for cell, time in first.items() if not conversions[cell] <= time]
    return Comparison(seed, (scene.load(full.history)[peak], scene.load(adaptive.history)[peak_adaptive]), len(first), late,
                      adaptive.conversion_energy(end_adaptive), int(adaptive.history["converted_cells"][end_adaptive]))


def table(results):
    """results: by scene, a list of comparisons."""
    lines = ["| scene | packing | peak, full DEM | peak, adaptive | ratio | cells with breaks | converted before | converted cells | conversions / work |",
             "|---|---:|---:|---:|---:|---:|---:|---:|---:|"]
    for scene, found in results:
        unit = "kNm/m" if scene.couples else "kN/m"
        for one in found:
            lines.append(f"| {scene.name} | {one.seed} | {one.peaks[0] / 1e3:.4g} {unit} | {one.peaks[1] / 1e3:.4g} {unit} | {one.ratio:.4f} | "
                         f"{one.cells} | {one.cells - len(one.late)} | {one.converted} | {one.energy:+.2%} |")
    lines += ["", "| scene | | peak, adaptive / full DEM, mean +- standard deviation | cells converted before the first break |", "|---|---|---:|---:|"]
    for scene, found in results:
        ratios = [one.ratio for one in found]
        cells, late = sum(one.cells for one in found), sum(len(one.late) for one in found)
        spread = f" +- {np.std(ratios, ddof=1):.4f}" if len(ratios) > 1 else ""
        lines.append(f"| {scene.name} | {scene.title} | {np.mean(ratios):.4f}{spread} | {cells - late} of {cells}: {1. - late / cells:.1%} |")
    return lines


def variations(cases, test_cases):
    """Scene and packing, which full DEM shares, and with them what is changed, mode and settings. One thing at a time."""
    by_name = {scene.name: scene for scene in scenes(cases, test_cases)}
    plate, fine, chip = by_name["notched plate"], by_name["notched beam"], by_name["first chip"]
    beam = replace(fine, name="beam of 1 mm", settings={"Packing/Mean diameter": 1e-3, "Coupling/Overlap width": 8})
    bent = Scene("beam on supports", f"{test_cases}/supported_beam", "", 5, 1e-4, pushed=0.0125)
    middle = replace(chip, name="middle of a block", settings={
        "Mesh/Upper corner": "0.096, 0.048", "Boundary/Conditions": "left: roller; right: roller; bottom: fixed",
        "Tool/Path": "0 0.048 0.05402;  3e-3 0.048 0.0532", "Time/End time": 1.5e-3, "Tool/Stiffness ratio": 0})
    other_step = ("full DEM, time step 1.4 % smaller", "dem", {"Time/Safety": 0.69})
    low = ("sigma* fraction 0.25", "adaptive", {"Adaptivity/Sigma star fraction": 0.25})
    third = "0.02 0 0.056 0.032"
    half = {"Adaptivity/Sigma star fraction": 0.5}
    return [(plate, 4, [("sigma* fraction 0.35", "adaptive", {}), ("sigma* fraction 0.5", "adaptive", half), low,
                        ("0.5, cells of 2 mm", "adaptive", {**half, "Mesh/Refine": "0 0 0.048 0.068 1"}),
                        ("0.5, overlap of 16 d", "adaptive", {**half, "Coupling/Overlap width": 16}),
                        ("0.5, 200 relaxation steps", "adaptive", {**half, "Adaptivity/Relaxation steps": 200})]),
            (fine, 1, [("d = 0.5 mm", "adaptive", {})]),
            (beam, 1, [("d = 1 mm", "adaptive", {}), low, ("overlap of 16 d", "adaptive", {"Coupling/Overlap width": 16}),
                    ("cells of 2 mm", "adaptive", {"Mesh/Refine": "0 0 0.076 0.032 1"}),
                    ("fixed: middle third without 8 mm below its upper side", "fixed", {"Fixed/Region": "0.02 0 0.056 0.024"}),
                    ("fixed: middle third up to its upper side", "fixed", {"Fixed/Region": third}),
                    ("sigma* fraction 0.35", "adaptive", {"Adaptivity/Sigma star fraction": 0.35})]),
            (bent, 1, [("three-point bending on supports of one cell", "adaptive", {}), low,
                       ("sigma* fraction 0.1", "adaptive", {"Adaptivity/Sigma star fraction": 0.1}),
                       ("cells of 2 mm", "adaptive", {"Mesh/Refine": "0 0 0.108 0.032 1"}),
                       ("fixed: middle third up to its upper side", "fixed", {"Fixed/Region": "0.036 0 0.072 0.032"}),
                       ("fixed: the same and around the supports", "fixed",
                        {"Fixed/Region": "0 0 0.016 0.016; 0.092 0 0.108 0.016; 0.036 0 0.072 0.032"})]),
            (chip, 1, [("as it is", "adaptive", {}), low, other_step]),
            (middle, 1, [("block of 96 mm, disc in the middle", "adaptive", {}), low, other_step])]


def causes(groups, run):
    lines = ["| scene, packing | change | first break / full DEM | peak / full DEM |", "|---|---|---:|---:|"]
    for scene, seed, changes in groups:
        full = run(scene, "dem", "dem", seed)
        for number, (text, mode, settings) in enumerate(changes):
            varied = run(scene, "adaptive" if mode == "adaptive" and not settings else f"change{number}", mode, seed, settings)
            first, peak = ([scene.load(result.history)[row(result.history)] for result in (varied, full)] for row in
                           (lambda history: int((history["broken_bonds"] > 0).argmax()), lambda history: scene.failure(history)[0]))
            lines.append(f"| {scene.name}, {seed} | {text} | {first[0] / first[1]:.4f} | {peak[0] / peak[1]:.4f} |")
            print(lines[-1], flush=True)
    return lines


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("kerf", "cases", "test_cases"):
        parser.add_argument(name, type=os.path.abspath)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--keep", metavar="DIR")
    parser.add_argument("--write", metavar="PAGE")
    options = parser.parse_args()
    failed = 0

    def check(name, condition, text):
        nonlocal failed
        failed += not condition
        print(f"{'ok      ' if condition else 'FAILED  '}{name}: {text}", flush=True)

    with tempfile.TemporaryDirectory() as temporary:
        os.makedirs(options.keep or temporary, exist_ok=True)
        run = Runner(options.kerf, os.path.abspath(options.keep or temporary))
        results = []
        for scene in scenes(options.cases, options.test_cases):
            if options.quick and scene.name != "notched plate":
                continue
            found = [compare(scene, run, seed) for seed in (SEEDS[:1] if options.quick else scene.seeds)]
            results.append((scene, found))
            for one in found:
                check(f"{scene.name}, packing {one.seed}: peak load", abs(one.ratio - 1.) <= PEAK, f"{one.ratio:.4f} of full DEM")
                for cell, broken, converted in one.late:
                    print(f"        cell {cell} breaks at {broken * 1e3:.4f} ms, is converted at {converted * 1e3:.4f} ms")
            cells, late = sum(one.cells for one in found), sum(len(one.late) for one in found)
            check(f"{scene.name}: cells that are converted before they break", late <= (1. - SHARE) * cells, f"{cells - late} of {cells}")
        if options.write:
            page = Path(options.write)
            put_section(page, "\n".join(table(results)) + "\n", "<!-- same packing:begin -->", "<!-- same packing:end -->")
            put_section(page, "\n".join(causes(variations(options.cases, options.test_cases), run)) + "\n", "<!-- causes:begin -->", "<!-- causes:end -->")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
