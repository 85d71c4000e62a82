# SPDX-License-Identifier: GPL-2.0-or-later
"""Reads history.h5, fields/mesh.h5 and fields/snapshot_STEP.h5 of a run; means over its time series."""
import re
from pathlib import Path

import h5py
import numpy as np


class Unreadable(Exception):
    """A results file that cannot be used; the text is one line for the user."""


def open_results(directory, name):
    """The open HDF5 file, or None when the run has not written it."""
    path = Path(directory) / name
    if not path.is_file():
        return None
    try:
        return h5py.File(path, "r")
    except OSError as error:
        reason = str(error).split("(")[0].strip()
        raise Unreadable(f"{path}: not a readable HDF5 file, perhaps of an interrupted run ({reason})")


def two_dimensional(directory):
    """True when the mesh of the run has quadrilaterals."""
    try:
        cells = Snapshots(directory).cells
        return len(cells) > 0 and cells.shape[1] == 4
    except Unreadable:
        return False  # the snapshot figures report it


class History:
    """Columns of history.h5, all of the same length; units as stored, with /m where two dimensions mean per metre."""

    def __init__(self, directory):
        file = open_results(directory, "history.h5")
        if file is None:
            raise Unreadable(f"{directory}: there is no history.h5")
        with file:
            columns = {name: item for name, item in file.items() if isinstance(item, h5py.Dataset) and item.ndim == 1}
            # A run that was stopped while it wrote a row leaves columns of two lengths.
            self.rows = min((len(item) for item in columns.values()), default=0)
            self.columns = {name: item[:self.rows].astype(float) for name, item in columns.items()}
            self.units = {name: as_text(file.attrs.get(f"unit_{name}", "")) for name in columns}
        self.read_newer_rows(Path(directory) / "history.csv")
        if two_dimensional(directory):
            self.units = {name: unit + "/m" if unit in ("N", "J") else unit for name, unit in self.units.items()}
        if "time" not in self.columns:
            raise Unreadable(f"{directory}/history.h5: the column 'time' is missing")

    def read_newer_rows(self, path):
        """history.csv has every row at once, history.h5 those up to the last fields: a run that was killed leaves it behind."""
        try:
            rows = np.genfromtxt(path, delimiter=",", names=True, skip_header=1, invalid_raise=False)
        except (OSError, ValueError):
            return
        if rows.dtype.names is None or set(rows.dtype.names) < set(self.columns) or rows.size <= self.rows:
            return
        rows = np.atleast_1d(rows)
        self.columns = {name: rows[name].astype(float) for name in self.columns}
        self.rows = len(rows)

    def __contains__(self, name):
        return name in self.columns

    def __getitem__(self, name):
        return self.columns[name]


def as_text(value):
    return value.decode() if isinstance(value, bytes) else str(value)


class Snapshot:
    """The state at one time. Missing data sets are empty."""

    def __init__(self, file, n_nodes, n_cells):
        def read(name, shape):
            return file[name][()].reshape(shape) if name in file and file[name].size else np.empty((0, *shape[1:]))

        self.time = float(file.attrs.get("time", np.nan))
        self.displacement = read("fem_displacement", (-1, 3))
        if len(self.displacement) != n_nodes:
            self.displacement = np.zeros((n_nodes, 3))
        self.alpha, self.stress = read("cell_alpha", (-1,)), read("cell_stress", (-1,))
        self.alpha = self.alpha if len(self.alpha) == n_cells else np.ones(n_cells)
        self.stress = self.stress if len(self.stress) == n_cells else np.full(n_cells, np.nan)
        self.position, self.radius = read("particle_position", (-1, 3)), read("particle_radius", (-1,))
        n = len(self.radius)
        self.weight, self.damage = read("particle_weight", (-1,)), read("particle_damage", (-1,))
        self.weight = self.weight if len(self.weight) == n else np.ones(n)
        self.damage = self.damage if len(self.damage) == n else np.zeros(n)
        self.broken = read("bond_broken_position", (-1, 3))
        self.platens = np.asarray(file.attrs.get("platens", []), float)  # y of the lower and the upper face
        self.total = n  # particles of the whole body, also of a cut
        self.tool_center = np.asarray(file.attrs.get("tool_center", []), float)
        self.tool_radius = float(file.attrs.get("tool_radius", 0.)) if len(self.tool_center) else 0.


    def cut(self, z):
        """Leaves the particles that a plane cuts, with the radii of their sections, and the broken bonds beside it."""
        distance = np.abs(self.position[:, 2] - z)
        thickness = np.median(self.radius) if len(self.radius) else 0.
        kept = distance < self.radius
        self.radius = np.sqrt(self.radius[kept]**2 - distance[kept]**2)
        self.position, self.weight, self.damage = self.position[kept], self.weight[kept], self.damage[kept]
        self.broken = self.broken[np.abs(self.broken[:, 2] - z) < thickness]


class Snapshots:
    """The mesh and the names of the snapshots, in the order of time; each is read when it is drawn."""

    def __init__(self, directory):
        self.directory = Path(directory)
        # Step numbers are padded with zeros: the order of the names is that of time.
        self.names = sorted(f"fields/{path.name}" for path in (self.directory / "fields").glob("snapshot_*.h5"))
        mesh = open_results(directory, "fields/mesh.h5")
        if mesh is None:
            self.nodes, self.cells = np.empty((0, 3)), np.empty((0, 4), int)
            return
        with mesh:
            if "nodes" not in mesh or "cells" not in mesh:
                raise Unreadable(f"{directory}/fields/mesh.h5: 'nodes' or 'cells' is missing")
            self.nodes, self.cells = mesh["nodes"][()], mesh["cells"][()].astype(int)

    @property
    def solid(self):
        """True for three dimensions."""
        return self.cells.shape[1] == 8

    @property
    def middle(self):
        """z of the plane that pictures show [m]."""
        return 0.5 * (self.nodes[:, 2].min() + self.nodes[:, 2].max())

    def read(self, name):
        """A snapshot; in three dimensions the cut through the middle of z."""
        with open_results(self.directory, name) as file:
            snapshot = Snapshot(file, len(self.nodes), len(self.cells))
        if self.solid:
            snapshot.cut(self.middle)
        return snapshot


def sigma_star(directory):
    """The threshold of conversions of an adaptive run [Pa] from its case.prm, or None."""
    path = Path(directory) / "case.prm"
    if not path.is_file():
        return None
    found = re.findall(r"^\s*set Sigma star\s*=\s*([0-9.eE+-]+)", path.read_text(errors="replace"), re.MULTILINE)
    return float(found[0]) if found and float(found[0]) > 0. else None


def running_mean(values, window):
    """Centred mean over up to @p window values. It stays centred at both ends, over fewer values: it begins and ends as they do."""
    total = np.concatenate(([0.], np.cumsum(values)))
    index = np.arange(len(values))
    half = np.minimum(max(int(window), 1) // 2, np.minimum(index, len(values) - 1 - index))
    first, last = index - half, index + half + 1
    return (total[last] - total[first]) / (last - first)


def first_contact(time, force):
    """Time at which the force passes a thousandth of its peak."""
    force = np.abs(np.nan_to_num(force))
    touched = np.nonzero(force > 1e-3 * force.max(initial=0.))[0]
    return time[touched[0]] if len(touched) else time[0]


def steady_window(time, force):
    """The second half of the time in contact: (start, end)."""
    touched = np.nonzero(np.abs(np.nan_to_num(force)) > 1e-3 * np.abs(np.nan_to_num(force)).max(initial=0.))[0]
    end = time[touched[-1]] if len(touched) else time[-1]
    return 0.5 * (first_contact(time, force) + end), end


def time_mean(time, values, start, end):
    """Mean over the time window by the trapezoidal rule, so that uneven output intervals do not matter."""
    inside = (time >= start) & (time <= end)
    t, v = time[inside], values[inside]
    if len(t) < 2:
        return float(v.mean()) if len(v) else float("nan")
    return float(np.trapz(v, t) / (t[-1] - t[0]))
