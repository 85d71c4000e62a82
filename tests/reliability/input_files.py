#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Stores, meshes and surfaces from files: what fits is used and what does not is refused with its reason.

usage: input_files.py KERF SMALL_CASE
"""
import os
import re
import sys
import tempfile

import h5py

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import kerf_runner  # noqa: E402
from mesh_files import block, box_facets, column, squares, stl_bytes, stl_text, write_msh  # noqa: E402

KERF, SMALL_CASE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
STORE = "packing_random_1000um_seed1.h5"
HELD = "Boundary/Conditions=y < 1e-6: fixed"
passed = failed = 0


def check(name, good, text=""):
    global passed, failed
    passed, failed = passed + bool(good), failed + (not good)
    print(f"{'ok      ' if good else 'FAILED  '}{name}: {text}", flush=True)


def sets(settings):
    return [word for setting in settings for word in ("--set", setting)]


def refused(name, arguments, *words):
    result = kerf_runner.run(KERF, arguments, cwd=work)
    lines = [line for line in result.stderr.splitlines() if line.strip()]
    good = result.returncode == 2 and len(lines) == 1 and lines[0].startswith("kerf: ") and all(word in lines[0] for word in words)
    check(name, good, f"exit code {result.returncode}, {result.stderr.strip()!r}")


def accepted(name, arguments, *words):
    result = kerf_runner.run(KERF, arguments, cwd=work)
    good = result.returncode == 0 and all(word in result.stdout for word in words)
    check(name, good, f"exit code {result.returncode}, {result.stderr.strip()!r}" + ("" if good else result.stdout[-600:]))
    return result


def small(name, edit=None):
    return kerf_runner.copy_case(SMALL_CASE, os.path.join(work, name), edit)


def content(path):
    with open(path, "rb") as file:
        return file.read()


def stores():
    case = small("stores")
    store = os.path.join(case, STORE)
    assert kerf_runner.run(KERF, ["pack", case], cwd=work).returncode == 0
    made = content(store)
    for key, value, words in (("Packing/Radius spread", "0.5", ("radius spread 0.3", "asks for 0.5")),
                              ("Packing/Radius spread", "0", ("radius spread 0.3", "asks for 0")),
                              ("Packing/Mean diameter", "1.004e-3", ("mean diameter 0.001", "asks for 0.001004")),
                              ("Packing/Gap tolerance", "0.2", ("gap tolerance 0.1", "asks for 0.2")),
                              ("Packing/Seed", "2", ("seed 1", "asks for 2")),
                              ("Packing/Kind", "triangular", ("holds a random packing", "triangular")),
                              ("Mesh/Upper corner", "0.048, 0.036", ("fills 0 to 0.032", "0.036")),
                              ("Mesh/Dimension", "3", ("2 dimensions", "asks for 3"))):
        more = ["Tool/Kind=none"] + (["Fixed/Region=", "Mesh/Upper corner=0.048, 0.032, 0.016"] if key == "Mesh/Dimension" else [])
        refused(f"store with {key} = {value}", ["check", case] + sets([f"Packing/File={STORE}", f"{key}={value}"] + more), STORE,
                key if "corner" not in key else "the rock", "remove the file", *words)

    # Another rock: the stiffnesses are for this run only, the store stays. kerf pack stores them.
    other = ["Rock/Young modulus=30e9"]
    accepted("check with another modulus", ["check", case] + sets(other), "stays as it is", "E = 30 GPa")
    accepted("run with another modulus", ["run", case, "--mode", "dem", "--output", os.path.join(work, "other")] +
             sets(other + ["Time/End time=1e-6"]), "stays as it is", "E = 30 GPa")
    check("the store is not rewritten", content(store) == made)
    accepted("pack with another modulus", ["pack", case] + sets(other), "E = 30 GPa")
    with h5py.File(store) as file:
        check("pack stores the stiffnesses", file.attrs["target_young"] == 30e9, file.attrs["target_young"])

    with h5py.File(store, "r+") as file:
        del file.attrs["asked_radius_spread"]
    refused("store of an earlier version", ["check", case], STORE, "earlier version", "Packing/Radius spread", "remove the file")
    for name, spoil in (("NaN", lambda file: file.attrs.__setitem__("mean_diameter", float("nan"))),
                        ("large radii", lambda file: file["radii"].__setitem__(slice(None), 10. * file["radii"][()]))):
        with open(store, "wb") as file:
            file.write(made)
        with h5py.File(store, "r+") as file:
            spoil(file)
        refused(f"store with {name}", ["run", case], STORE)

    # A notch elsewhere: the same bounding box and volume. A finer mesh of the same body fits.
    for name, notch, size in (("left", [(3, 7)], 4e-3), ("right", [(8, 7)], 4e-3), ("fine", block(2, 2), 2e-3)):
        n = round(4e-3 / size)
        without = notch if n == 1 else [(6 + i, 14 + j) for i, j in notch]
        nodes, cells = squares(block(12 * n, 8 * n, without), size)
        write_msh(os.path.join(case, name + ".msh"), nodes, cells)
    os.remove(store)
    accepted("pack of a notched body", ["pack", case] + sets(["Mesh/File=left.msh", HELD]))
    refused("store of another notch", ["check", case] + sets(["Mesh/File=right.msh", HELD]), STORE, "another shape", "Mesh/File")
    accepted("store of the same notch in a finer mesh", ["check", case] + sets(["Mesh/File=fine.msh", "Tool/Kind=none", HELD]))

    # Small particles of wide distributions rattle; the mean diameter is still the one asked for.
    for spread in (0.55, 0.8):
        os.remove(store)
        accepted(f"spread {spread}", ["check", case, "--pack", "--mode", "dem"] + sets([f"Packing/Radius spread={spread}"]), "valid")
        with h5py.File(store) as file:
            mean = 2e3 * file["radii"][()].mean()
        check(f"mean diameter at spread {spread}", abs(mean - 1.) < 0.01, mean)


def far_from_the_origin():
    """A lattice, which does not depend on the place. At 1000 m coordinates have round-off 1e-13 m, 1e-7 of the indentation of
    some micrometres. Until 0.24 ms 65 bonds break; much later the crack paths are chaotic."""
    case = small("far")
    mean = {}
    for x in (0, 10, 1000):
        place = sets([f"Packing/File=at_{x}.h5", "Packing/Kind=triangular", f"Mesh/Lower corner={x}, {x}",
                      f"Mesh/Upper corner={x + 0.048!r}, {x + 0.032!r}", f"Tool/Path=0 {x + 0.024!r} {x + 0.04402!r}; 4e-4 {x + 0.024!r} {x + 0.0433!r}",
                      "Time/End time=2.4e-4"])
        results = os.path.join(work, f"far_{x}")
        accepted(f"run at {x} m", ["run", case, "--output", results] + place)
        history = kerf_runner.history(results)
        mean[x] = sum(history["tool_force_y"]) / len(history["time"])
        check(f"mean force at {x} m", mean[0] > 1e4 and abs(mean[x] / mean[0] - 1.) < 1e-6, mean[x])
    for name, more in (("disc", ["Mesh/Shape=disc", "Mesh/Upper corner=1000.048, 0.048", "Boundary/Conditions=x < 1000.01: fixed"]),
                       ("refined", ["Mesh/Refine=1000 0 1000.01 0.01 1"]),
                       ("periodic", ["Mesh/Periodic=y", "Mesh/Upper corner=1000.048, 0.036", "Boundary/Conditions=left: fixed"])):
        accepted(f"{name} mesh at 1000 m", ["run", case, "--output", os.path.join(work, name)] + sets(
            ["Mesh/Lower corner=1000, 0", "Mesh/Upper corner=1000.048, 0.032", "Tool/Kind=none", f"Packing/File={name}.h5",
             "Fixed/Region=1000.01 0.01 1000.03 0.04", "Time/End time=2e-6"] + more) + ["--mode", "fixed"])
    refused("too far from the origin", ["check", case, "--mode", "fem"] + sets(
        ["Mesh/Lower corner=1e6, 0", "Mesh/Upper corner=1000000.048, 0.032", "Tool/Kind=none"]), "Mesh", "origin", "allowed are", "move it")


def specimens():
    """Elastic cells between frictionless platens: force over the own cross-section of a prism gives Young's modulus. The platens are
    loaded slowly; oscillations make some percent."""
    case = small("press", lambda text: text.replace("set Radius         = 0.012", "set Kind = platens\n  set Closing speed = 0.1\n  set Friction = 0"))
    press = [HELD.split("=")[0] + "=", "Fixed/Region=", "Mesh/File=m.msh", "Rock/Young modulus=20e9", "Time/End time=1e-4"]

    def text_of(name, more, *words):
        run = ["run", case, "--mode", "fem", "--output", os.path.join(work, "press_" + name)] + sets(press + more)
        return accepted(name, run, *words).stdout

    path = os.path.join(case, "m.msh")
    write_msh(path, *column(block(4, 4, block(2, 2)), 2e-3, 8, 2e-3), element_type=5)
    found = re.search(r"E = ([\d.]+) GPa in the middle, ([\d.]+) GPa by force", text_of("column", ["Mesh/Dimension=3"], "uniaxial compression"))
    check("Young's modulus of an L column", found and abs(float(found[2]) / 20. - 1.) < 0.05, found and found[0])
    write_msh(path, *squares(block(6, 6, [(0, 0), (5, 0), (0, 5), (5, 5)]), 4e-3))
    text = text_of("body of another form", [], "no prism", "by force and cross-section at mid-height, 0.024")
    check("no name of a test", "compression" not in text.split("no prism")[1].split("energy")[0] and "Brazilian" not in text)


def cell_size_of_a_file():
    """The overlap in cells, and the warning of narrow ones, go by the cells of the file."""
    case = small("cells", lambda text: text.replace("set Overlap width = 8", "set Overlap cells = 2"))
    write_msh(os.path.join(case, "m.msh"), *squares(block(6, 4), 8e-3))
    accepted("overlap of two cells of a file", ["check", case, "--pack"] + sets(["Mesh/File=m.msh", HELD]), "overlap          0.016 m")
    accepted("narrow overlap of a file", ["check", case, "--pack"] + sets(["Mesh/File=m.msh", HELD, "Coupling/Overlap cells=0", "Coupling/Overlap width=8"]),
             "warning: Coupling/Overlap width is 1 cells")


def files_of_other_programs():
    case = small("files")
    mesh = os.path.join(case, "m.msh")
    nodes, cells = squares(block(12, 8), 4e-3)
    fem = ["check", case, "--mode", "fem"] + sets(["Mesh/File=m.msh", HELD])
    write_msh(mesh, nodes, cells)
    good = content(mesh)
    accepted("good mesh", fem)

    def changed(name, data, *words):
        with open(mesh, "wb") as file:
            file.write(data)
        refused(name, fem, "Mesh", "m.msh", *words) if words else accepted(name, fem)

    changed("mesh with byte order mark", b"\xef\xbb\xbf" + good)
    changed("binary mesh", good.replace(b"2.2 0 8", b"2.2 1 8"), "binary", "text", "Mesh.Binary = 0")
    changed("no mesh", b"solid rock\n", "$MeshFormat")
    changed("truncated mesh", good[:len(good) // 3], "cut off")
    changed("decimal comma", good.replace(b"0.0040000000000000001", b"0,004", 1), "number should stand")
    for name, data, words in (("quadrilaterals of second order", dict(element_type=10, cells=[c + c[:1] * 5 for c in cells]), ("second", "Mesh.ElementOrder = 1")),
                              ("triangles", dict(element_type=2, cells=[c[:3] for c in cells]), ("triangles", "quadrilaterals", "recombine")),
                              ("line inside", dict(lines=[(cells[20][1], cells[20][2], 7)], cells=cells), ("line inside the body", "group")),
                              ("a cell listed twice", dict(cells=cells + cells[5:6]), ("listed twice",))):
        write_msh(mesh, nodes, data.pop("cells"), **data)
        refused(name, fem, "Mesh", "m.msh", *words)
    solid = ["check", case, "--mode", "fem"] + sets(["Mesh/File=m.msh", "Mesh/Dimension=3", "Tool/Kind=none", "Fixed/Region=", "Boundary/Conditions="])
    for name, kind, corners in (("wedges", 6, 6), ("pyramids", 7, 5)):
        points, hexahedra = column(block(2, 2), 4e-3, 2, 4e-3)
        write_msh(mesh, points, [c[:corners] for c in hexahedra], element_type=kind)
        refused(name, solid, "Mesh", "m.msh", name, "hexahedra")

    # Two pieces of rock. The finite elements alone may have them.
    write_msh(mesh, *squares(block(12, 8, [(5, j) for j in range(8)]), 4e-3))
    refused("two pieces", ["pack", case] + sets(["Mesh/File=m.msh", HELD]), "Mesh", "2 pieces, one is allowed")

    with open(os.path.join(case, "case.prm"), "rb") as file:
        text = file.read()
    with open(os.path.join(case, "case.prm"), "wb") as file:
        file.write(b"\xef\xbb\xbf" + text)
    accepted("case with byte order mark", ["check", case, "--mode", "fem"])

    # A surface is read as far as its packing: ten diameters are too few for a calibration, which is the next step.
    facets = box_facets((1e-3,) * 3, (11e-3,) * 3)
    stl = sets(["Packing/Surface=s.stl", "Packing/Mean diameter=1e-3", "Mesh/Dimension=3", "Mesh/Lower corner=0, 0, 0",
                "Mesh/Upper corner=0.016, 0.016, 0.016", "Tool/Kind=none", "Fixed/Region="])
    plain, binary = stl_text(facets), stl_bytes(facets)
    other = box_facets((4e-3, 4e-3, 4e-3), (14e-3, 8e-3, 15e-3))
    beside = box_facets((12e-3,) * 3, (15e-3,) * 3)
    for name, data, words in (("text", plain.encode(), ()), ("upper case", plain.upper().encode(), ()),
                              ("byte order mark", b"\xef\xbb\xbf" + plain.encode(), ()), ("windows lines", plain.replace("\n", "\r\n").encode(), ()),
                              ("vertex in the name", plain.replace("rock", "rock vertex facet 1").encode(), ()),
                              ("binary", binary, ()), ("trailing bytes", binary + b"more", ()),
                              ("binary that begins with solid", stl_bytes(facets, b"solid") + b"\n", ()),
                              ("cut off", binary[:-50], ("cut off", "12 facets", "holds 11")), ("text cut off", plain[:700].encode(), ("s.stl",)),
                              ("cuts itself", stl_text(facets + other).encode(), ("cuts itself",)),
                              ("two pieces", stl_text(facets + beside).encode(), ("2 pieces, one is allowed",)),
                              ("a facet missing", stl_text(facets[:-1]).encode(), ("not closed",))):
        with open(os.path.join(case, "s.stl"), "wb") as file:
            file.write(data)
        store = os.path.join(case, "packing_random_1000um_seed1.h5")
        if os.path.exists(store):
            os.remove(store)
        refused("surface, " + name, ["pack", case] + stl, *(("Packing/Surface",) + words if words else ("mean diameters wide, at least 12 are needed",)))


with tempfile.TemporaryDirectory() as work:
    cell_size_of_a_file()
    files_of_other_programs()
    specimens()
    stores()
    far_from_the_origin()

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
