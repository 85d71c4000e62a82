#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Writes a results directory as `kerf run` does, from made-up curves: input for the tests of the figures, not physics.

  synthetic_results.py DIRECTORY [--mode adaptive|fixed|dem|fem] [--snapshots N] [--rows N]
"""
import argparse
from pathlib import Path

import h5py
import numpy as np

WIDTH, HEIGHT, CELL, DIAMETER = 0.2, 0.08, 0.004, 0.0012  # rock, cell, mean particle [m]
TOOL_RADIUS, DEPTH, SPEED, DURATION = 0.1, 0.004, 10., 0.008  # [m], [m], [m/s], [s]
UNITS = {"step": "1", "time": "s", "tool_force_x": "N", "tool_force_y": "N", "tool_force_z": "N", "wall_time": "s", "cpu_time": "s",
         "energy_kinetic": "J", "energy_elastic": "J", "energy_coupling": "J", "work_tool": "J", "work_boundary": "J"}
COUNTS = ("active_particles", "overlap_particles", "converted_cells", "intact_bonds", "broken_bonds")
SPREAD = {"adaptive": 0.16, "fixed": 0.2, "dem": 0.25, "fem": 0.}
WALL_TIME = {"adaptive": 60., "fixed": 100., "dem": 150., "fem": 20.}


def write_history(path, mode, rows):
    """Force: zero until a tenth of the time, then a rise to 100 kN/m normal and 40 kN/m tangential with scatter."""
    rng = np.random.default_rng(list(SPREAD).index(mode))
    s = np.linspace(0., 1., rows)
    load = np.clip((s - 0.1) / 0.1, 0., 1.)
    particles = {"adaptive": 9000. * np.clip(s - 0.12, 0., 1.), "fixed": 0. * s + 8000., "dem": 0. * s + 14000.,
                 "fem": 0. * s}[mode]
    columns = {
        "step": np.arange(rows) * 50, "time": s * DURATION,
        "tool_force_x": load * -4e4 * (1. + SPREAD[mode] * rng.standard_normal(rows)),
        "tool_force_y": load * 1e5 * (1. + SPREAD[mode] * rng.standard_normal(rows)), "tool_force_z": 0. * s,
        "active_particles": particles.round(), "overlap_particles": (0.35 * particles).round(),
        "converted_cells": (particles / 8.).round(), "intact_bonds": (2.2 * particles).round(),
        "broken_bonds": (1500. * np.clip(s - 0.15, 0., 1.) * (mode != "fem")).round(),
        "energy_kinetic": 40. * load, "energy_elastic": 160. * load * s, "energy_coupling": 2. * load,
        "work_tool": 320. * np.clip(s - 0.1, 0., 1.), "work_boundary": 0. * s, "wall_time": WALL_TIME[mode] * s, "cpu_time": WALL_TIME[mode] * s,
    }
    with h5py.File(path, "w") as file:
        for name, values in columns.items():
            file[name] = values
            file.attrs[f"unit_{name}"] = "1" if name in COUNTS else UNITS[name]


def rock_mesh():
    """Nodes and cells of a uniform box, corners in lexicographic order."""
    nx, ny = round(WIDTH / CELL), round(HEIGHT / CELL)
    x, y = np.meshgrid(np.linspace(0., WIDTH, nx + 1), np.linspace(0., HEIGHT, ny + 1))
    nodes = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    first = (np.arange(ny)[:, None] * (nx + 1) + np.arange(nx)).ravel()
    return nodes, np.column_stack([first, first + 1, first + nx + 1, first + nx + 2])


def rock_particles():
    """Centres and radii of a disturbed triangular lattice."""
    rng = np.random.default_rng(3)
    rows, columns = int(HEIGHT / (DIAMETER * 0.866)), int(WIDTH / DIAMETER)
    i, j = np.meshgrid(np.arange(columns), np.arange(rows))
    x, y = (i + 0.5 * (j % 2) + 0.5) * DIAMETER, (j + 0.5) * DIAMETER * 0.866
    position = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    position[:, :2] += 0.06 * DIAMETER * rng.standard_normal((len(position), 2))
    return position, 0.5 * DIAMETER * rng.uniform(0.8, 1.05, len(position))


def converted_distance(points, mode, s):
    """Distance [m] into the particle region; negative outside."""
    if mode == "fem":
        return np.full(len(points), -1.)
    if mode == "dem":
        return np.full(len(points), 1.)
    if mode == "fixed":
        return np.minimum(0.09 - np.abs(points[:, 0] - 0.1), points[:, 1] - 0.04)
    tip = 0.04 + SPEED * DURATION * s
    along = np.abs(points[:, 0] - np.clip(points[:, 0], 0.04, tip))
    return 0.025 * min(1., 4. * max(s - 0.05, 0.)) - np.hypot(along, HEIGHT - points[:, 1])


def write_snapshots(fields, mode, count):
    fields.mkdir(exist_ok=True)
    for old in fields.glob("*.h5"):
        old.unlink()
    nodes, cells = rock_mesh()
    position, radius = rock_particles()
    centres = nodes[cells].mean(axis=1)
    rng = np.random.default_rng(5)
    with h5py.File(fields / "mesh.h5", "w") as file:
        file["nodes"], file["cells"] = nodes, cells
    for number, s in enumerate(np.linspace(0., 1., count)):
        tip = np.array([0.04 + SPEED * DURATION * s, HEIGHT - DEPTH * min(1., 8. * s), 0.])
        inside = converted_distance(centres, mode, s)
        depth = converted_distance(position, mode, s)
        near = np.hypot(position[:, 0] - np.clip(position[:, 0], 0.04, tip[0]), HEIGHT - position[:, 1])
        active = (depth > 0.) & (np.hypot(*(position - tip - [0., TOOL_RADIUS, 0.])[:, :2].T) > TOOL_RADIUS)
        damage = np.clip(1.2 - near / 0.006 + 0.3 * rng.standard_normal(len(near)), 0., 1.) * (s > 0.1)
        with h5py.File(fields / f"snapshot_{number * 5000:09d}.h5", "w") as file:
            file.attrs["time"], file.attrs["step"] = s * DURATION, number * 5000
            file.attrs["tool_radius"], file.attrs["tool_center"] = TOOL_RADIUS, tip + [0., TOOL_RADIUS, 0.]
            file["cell_alpha"] = 1. - np.clip(np.floor(inside / CELL + 1.) / 4., 0., 1.)
            file["cell_stress"] = 4e7 * min(1., 8. * s) / (1. + (np.hypot(*(centres - tip)[:, :2].T) / 0.015) ** 2)
            file["fem_displacement"] = np.column_stack([0. * nodes[:, 0], -1e-5 * s * nodes[:, 1] / HEIGHT, 0. * nodes[:, 0]])
            file["particle_position"], file["particle_radius"] = position[active], radius[active]
            file["particle_weight"] = np.clip(depth[active] / (3. * CELL), 0.02, 1.)
            file["particle_damage"] = damage[active]
            file["bond_broken_position"] = position[(damage > 0.25) & (depth > 0.)] + [0.3 * DIAMETER, 0., 0.]


def write_results(directory, mode="adaptive", snapshots=9, rows=800):
    """history.h5 and, with snapshots > 0, the mesh and the snapshots in fields/."""
    directory = Path(directory)
    directory.mkdir(parents=True, exist_ok=True)
    write_history(directory / "history.h5", mode, rows)
    if snapshots:
        write_snapshots(directory / "fields", mode, snapshots)
    return directory


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("directory")
    parser.add_argument("--mode", default="adaptive", choices=sorted(SPREAD))
    parser.add_argument("--snapshots", type=int, default=9)
    parser.add_argument("--rows", type=int, default=800)
    options = parser.parse_args()
    write_results(options.directory, options.mode, options.snapshots, options.rows)
