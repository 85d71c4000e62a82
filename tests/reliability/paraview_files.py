#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Opens every file for ParaView with VTK's own readers and compares it with the HDF5 file of the same time: all modes, two and
three dimensions, disc and platens, the start and later, one rank and two.

  paraview_files.py KERF SMALL_CASE

Needs VTK for Python (Debian: python3-vtk9); without it the test is skipped (exit code 77).
"""
import os
import re
import sys
import tempfile
import xml.etree.ElementTree

import h5py
import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import kerf_runner  # noqa: E402

try:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
except ImportError:
    print("VTK for Python is not installed (Debian: python3-vtk9): skipped")
    sys.exit(77)

KERF, SMALL_CASE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
VERTEX, LINE, QUAD, HEXAHEDRON = 1, 3, 9, 12
passed = failed = 0


def check(name, good, detail=""):
    global passed, failed
    passed, failed = passed + bool(good), failed + (not good)
    if not good:
        print(f"FAILED  {name} {detail}")


# Units by a part of the name; forces are per metre of thickness in the plane.
UNITS = {"displacement": "m", "radius": "m", "direction": "1", "velocity": "m/s", "stress": "Pa", "alpha": "1", "damage": "1",
         "weight": "1", "index": "1", "broken": "1", "force": "N/m"}


def read(path):
    """Points, types of the cells, points of each cell in a row, arrays of the points and cells."""
    with open(path, "rb") as file:
        text = file.read()
    check(path + " has an element of points", b"<Points>" in text)  # VTK reads on without one
    units = {name.decode(): unit.decode() for name, unit in re.findall(rb'<DataArray [^>]*Name="([^"]*)"[^>]*units="([^"]*)"', text)}
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    check(path + " is read without an error", reader.GetErrorCode() == 0 and grid.GetPoints() is not None)
    points = vtk_to_numpy(grid.GetPoints().GetData()) if grid.GetPoints() is not None else np.zeros((0, 3))
    types = [grid.GetCellType(k) for k in range(grid.GetNumberOfCells())]
    cells = [[grid.GetCell(k).GetPointId(i) for i in range(grid.GetCell(k).GetNumberOfPoints())] for k in range(len(types))]
    arrays = {}
    for data in (grid.GetPointData(), grid.GetCellData()):
        for k in range(data.GetNumberOfArrays()):
            name = data.GetArrayName(k)
            arrays[name] = vtk_to_numpy(data.GetArray(k))
            unit = units.get(name)
            expected = next((value for key, value in UNITS.items() if key in name), None)
            check(f"{path} has the unit of {name}", unit is not None and unit == expected, (unit, expected))
    return points, types, cells, arrays


def check_time(directory, stamp, dim, tool):
    """The files of one time; single precision is what the files hold."""
    UNITS["force"] = "N/m" if dim == 2 else "N"
    name = lambda kind: os.path.join(directory, "fields", f"{kind}_{stamp}.vtu")  # noqa: E731
    with h5py.File(os.path.join(directory, "fields", f"snapshot_{stamp}.h5")) as file:
        model = {key: file[key][:] for key in file}
    n = len(model["particle_index"])
    points, types, cells, arrays = read(name("particles"))
    check(f"{name('particles')} has a vertex for each particle", len(points) == n and types == [VERTEX] * n, (len(points), n))
    if n > 0 and len(points) == n:
        order = np.argsort(arrays["index"]), np.argsort(model["particle_index"])
        for array, key in (("radius", "particle_radius"), ("weight", "particle_weight"), ("damage", "particle_damage"),
                           ("velocity", "particle_velocity")):
            there, here = arrays[array][order[0]], model[key][order[1]]
            check(f"{name('particles')} {array}", there.shape == here.shape and
                  np.allclose(there, here, rtol=1e-6, atol=1e-6 * np.abs(here).max()), there.shape)
        check(f"{name('particles')} positions",
              np.allclose(points[order[0]], model["particle_position"][order[1]], rtol=0., atol=1e-8))
    check(f"{name('particles')} names its arrays", {"radius", "damage", "weight", "velocity", "index"} <= set(arrays), set(arrays))

    points, types, cells, arrays = read(name("bonds"))
    check(f"{name('bonds')} has lines only", set(types) <= {LINE} and all(len(cell) == 2 for cell in cells))
    check(f"{name('bonds')} has bonds where there are particles", (len(types) > 0) == (n > 1), (len(types), n))
    check(f"{name('bonds')} names its arrays", set(arrays) == {"broken", "normal_force", "shear_force"}, set(arrays))
    if types:
        ends = points[[cell[0] for cell in cells]], points[[cell[1] for cell in cells]]
        distance = np.linalg.norm(ends[0] - ends[1], axis=1)
        check(f"{name('bonds')} joins neighbours", distance.max() < 6.1 * model["particle_radius"].max(), distance.max())
        lonely = [end for end in ends[0][:50] if np.abs(model["particle_position"] - end).max(axis=1).min() > 1e-7]
        check(f"{name('bonds')} ends at particles", not lonely, lonely[:1])

    points, types, cells, arrays = read(name("fem"))
    n_cells = int((model["cell_alpha"] > 0.).sum())
    check(f"{name('fem')} has the cells with weight", types == [QUAD if dim == 2 else HEXAHEDRON] * n_cells, (len(types), n_cells))
    if n_cells:
        check(f"{name('fem')} has vectors", arrays["displacement"].shape[1:] == (3,) and arrays["velocity"].shape[1:] == (3,))

    points, types, cells, arrays = read(name("tool"))
    check(f"{name('tool')} has lines", len(types) > 0 and set(types) == {LINE}, len(types))
    if tool == "disc":
        check(f"{name('tool')} has the radius", np.allclose(arrays["radius"], 0.012 if dim == 2 else 0.006))
        check(f"{name('tool')} is as large as the disc", abs(np.ptp(points[:, 0]) / (2. * arrays["radius"][0]) - 1.) < 1e-3)


def check_run(directory, dim, tool):
    for kind in ("fem", "particles", "bonds", "tool"):
        collection = xml.etree.ElementTree.parse(os.path.join(directory, kind + ".pvd")).getroot()
        files = [entry.get("file") for entry in collection.iter("DataSet")]
        check(f"{directory}/{kind}.pvd lists files", len(files) >= 2 and
              all(os.path.exists(os.path.join(directory, file)) for file in files), files)
    stamps = sorted(name[9:-3] for name in os.listdir(os.path.join(directory, "fields")) if name.startswith("snapshot_"))
    check(f"{directory} has the start and a later time", len(stamps) >= 2)
    for stamp in (stamps[0], stamps[-1]):
        check_time(directory, stamp, dim, tool)


with tempfile.TemporaryDirectory() as work:
    case = kerf_runner.copy_case(SMALL_CASE, os.path.join(work, "case"))
    space = ["--set", "Mesh/Dimension=3", "--set", "Mesh/Upper corner=0.016, 0.016, 0.016", "--set", "Packing/Kind=fcc", "--set",
             "Tool/Radius=0.006", "--set", "Tool/Width=0.004", "--set", "Tool/Middle=0.008", "--set",
             "Tool/Path=0 0.008 0.0224; 1e-4 0.008 0.0208", "--set", "Coupling/Overlap width=4", "--set", "Coupling/Method=penalty",
             "--set", "Fixed/Region=0.004 0.008 0 0.012 0.016 0.016", "--set", "Time/End time=6e-6"]
    press = ["--set", "Tool/Kind=platens", "--set", "Boundary/Conditions=", "--set", "Time/End time=2e-5"]
    runs = [(mode, 2, "disc", ["--set", "Time/End time=2.5e-4"] if mode == "adaptive" else ["--set", "Time/End time=2e-5"], 1)
            for mode in ("adaptive", "fixed", "dem", "fem")]
    runs += [(mode, 3, "disc", space, 1) for mode in ("fixed", "fem")]
    runs += [("adaptive", 2, "disc", ["--set", "Time/End time=2.5e-4"], 2), ("dem", 2, "platens", press, 1)]
    for number, (mode, dim, tool, options, ranks) in enumerate(runs):
        results = os.path.join(work, f"{number}_{mode}_{dim}d_{tool}_{ranks}")
        run = kerf_runner.run(KERF, ["run", case, "--mode", mode, "--output", results, "--set", "Output/Snapshots=2", *options],
                              ranks, cwd=work)
        check(f"{results} ends well", run.returncode == 0, run.stderr)
        if run.returncode == 0:
            check_run(results, dim, tool)

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
