#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The finite elements alone (kerf run --mode fem) against CalculiX on the same mesh, motion and time: a bar with a wave and a
cantilever. Exit code 77, skipped, where there is no program ccx (Debian package calculix-ccx).

usage: calculix.py KERF
"""
import base64
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zlib

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "support"))
import kerf_runner  # noqa: E402

SKIPPED = 77
YOUNG, POISSON, DENSITY = 40e9, 0.2, 2650.
failed = 0


def check(name, condition, text):
    global failed
    failed += not condition
    print(("ok      " if condition else "FAILED  ") + name + ": " + text)


class Body:
    """A block of cells from the origin, left side driven by a velocity with a half-cosine start, right side fixed."""

    def __init__(self, cells, h, velocity, ramp, end_time):
        self.cells, self.h, self.velocity, self.ramp, self.end_time = cells, h, velocity, ramp, end_time

    def pushed(self, t):
        """Distance of the driven side over its velocity: the time integral of the start."""
        if t >= self.ramp:
            return t - 0.5 * self.ramp
        return 0.5 * (t - self.ramp / math.pi * math.sin(math.pi * t / self.ramp))

    def nodes(self):
        i, j, k = np.meshgrid(*[np.arange(n + 1) for n in self.cells], indexing="ij")
        return self.h * np.stack([i.ravel(), j.ravel(), k.ravel()], axis=1)

    def number(self, i, j, k):
        return (i * (self.cells[1] + 1) + j) * (self.cells[2] + 1) + k + 1

    # ---- kerf ----

    def run_kerf(self, kerf, directory, integration):
        os.makedirs(directory)
        upper = ", ".join(repr(n * self.h) for n in self.cells)
        velocity = " ".join(repr(v) for v in self.velocity)
        with open(os.path.join(directory, "case.prm"), "w") as file:
            file.write(f"""subsection Rock
  set Density = {DENSITY}
  set Young modulus = {YOUNG}
  set Poisson ratio = {POISSON}
end
subsection Mesh
  set Dimension = 3
  set Lower corner = 0, 0, 0
  set Upper corner = {upper}
  set Cell size = {self.h}
end
subsection Finite elements
  set Integration = {integration}
end
subsection Boundary
  set Conditions = left: velocity {velocity} ramp {self.ramp!r}; right: fixed
end
subsection Tool
  set Kind = none
end
subsection Time
  set End time = {self.end_time!r}
  set Safety = 0.5
end
subsection Output
  set Snapshots = 1
end
""")
        output = os.path.join(directory, "results")
        result = kerf_runner.run(kerf, ["run", directory, "--mode", "fem", "--output", output])
        assert result.returncode == 0, result.stderr + result.stdout
        stores = [name for name in os.listdir(directory) if name.endswith(".h5")]
        check("mode fem needs no packing", not stores, f"{len(stores)} stores beside the case")
        fields = os.path.join(output, "fields")
        last = sorted(name for name in os.listdir(fields) if name.startswith("fem_"))[-1]
        # Steps are equal: the last one ends at the end time or up to a step behind it.
        time = kerf_runner.history(output)["time"][-1]
        return self.by_node(*read_vtu(os.path.join(fields, last))), time

    def by_node(self, points, values):
        """Values of the mesh's nodes from those of the cells' corners."""
        index = np.rint(points / self.h).astype(int)
        order = (index[:, 0] * (self.cells[1] + 1) + index[:, 1]) * (self.cells[2] + 1) + index[:, 2]
        result = np.full((np.prod(np.array(self.cells) + 1), 3), np.nan)
        result[order] = values
        assert not np.isnan(result).any()
        return result

    # ---- CalculiX ----

    def run_calculix(self, ccx, directory, time):
        """Displacements of the nodes by explicit dynamics with fully integrated cells."""
        os.makedirs(directory)
        lines = ["*NODE,NSET=ALL"]
        lines += [f"{n + 1},{x[0]:.12e},{x[1]:.12e},{x[2]:.12e}" for n, x in enumerate(self.nodes().tolist())]
        lines.append("*ELEMENT,TYPE=C3D8,ELSET=ROCK")
        cell = 0
        for i in range(self.cells[0]):
            for j in range(self.cells[1]):
                for k in range(self.cells[2]):
                    cell += 1
                    corners = [self.number(i + a, j + b, k + c) for c in (0, 1) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
                    lines.append(",".join(str(n) for n in [cell, *corners]))
        sides = {"LEFT": 0, "RIGHT": self.cells[0]}
        for name, i in sides.items():
            lines.append(f"*NSET,NSET={name}")
            lines += [f"{self.number(i, j, k)}," for j in range(self.cells[1] + 1) for k in range(self.cells[2] + 1)]
        lines += ["*MATERIAL,NAME=ROCK", "*ELASTIC", f"{YOUNG!r},{POISSON!r}", "*DENSITY", repr(DENSITY),
                  "*SOLID SECTION,ELSET=ROCK,MATERIAL=ROCK", "*AMPLITUDE,NAME=PUSH,TIME=TOTAL TIME"]
        lines += [f"{t:.12e},{self.pushed(t):.12e}" for t in np.linspace(0., time, 201).tolist()]
        lines += ["*BOUNDARY", "RIGHT,1,3,0.", "*STEP,INC=1000000", "*DYNAMIC,EXPLICIT",
                  f"{1e-3 * time:.12e},{time:.12e}", "*BOUNDARY,AMPLITUDE=PUSH"]
        lines += [f"LEFT,{c + 1},{c + 1},{v:.12e}" for c, v in enumerate(self.velocity)]
        lines += ["*NODE PRINT,NSET=ALL,FREQUENCY=1000000", "U", "*END STEP", ""]
        with open(os.path.join(directory, "body.inp"), "w") as file:
            file.write("\n".join(lines))
        result = subprocess.run([ccx, "body"], cwd=directory, capture_output=True, text=True, timeout=500,
                                env={**os.environ, "OMP_NUM_THREADS": "1"})
        with open(os.path.join(directory, "body.dat")) as file:
            blocks = re.split(r"displacements.*?time\s+(\S+)\s*\n", file.read())
        assert len(blocks) > 2, result.stdout[-2000:]
        reached, rows = float(blocks[-2]), np.array([line.split() for line in blocks[-1].strip().splitlines()], dtype=float)
        assert abs(reached - time) < 1e-6 * time, result.stdout[-2000:]
        return rows[np.argsort(rows[:, 0]), 1:4]


def read_vtu(path):
    """Points and displacements of a VTU file with compressed binary arrays."""
    with open(path) as file:
        text = file.read()

    def arrays(pattern):
        for kind, data in re.findall(r'<DataArray type="(\w+)"' + pattern + r'[^>]*format="binary">\s*(\S+)\s*</DataArray>', text):
            assert kind == "Float32", kind
            # Number of blocks, their size, that of the last, and the compressed sizes; then the blocks.
            n_blocks = np.frombuffer(base64.b64decode(data[:8])[:4], np.uint32)[0]
            header_length = 4 * math.ceil(4 * (3 + n_blocks) / 3)
            sizes = np.frombuffer(base64.b64decode(data[:header_length]), np.uint32, 3 + n_blocks)[3:]
            packed, raw, start = base64.b64decode(data[header_length:]), b"", 0
            for size in sizes:
                raw += zlib.decompress(packed[start:start + size])
                start += size
            yield np.frombuffer(raw, np.float32).reshape(-1, 3).astype(float)

    points = next(arrays(' NumberOfComponents="3" '))
    displacement = next(arrays(' Name="displacement"'))
    assert points.shape == displacement.shape
    return points, displacement


def difference(a, b):
    """Root mean square of the difference over that of b."""
    return np.sqrt(((a - b)**2).sum() / (b**2).sum())


def compare(name, body, kerf, ccx, top, limit):
    directory = os.path.join(top, name.replace(" ", "_"))
    theirs = None
    for integration in ("full", "selective", "one_point"):
        ours, time = body.run_kerf(kerf, f"{directory}_{integration}", integration)
        if theirs is None:
            theirs = body.run_calculix(ccx, directory + "_ccx", time)
        check(f"{name}, {integration}", difference(ours, theirs) < limit,
              f"{100. * difference(ours, theirs):.3f} % of displacements up to {abs(theirs).max():.2e} m")


def main(kerf, ccx):
    c = math.sqrt(YOUNG / DENSITY)
    with tempfile.TemporaryDirectory() as top:
        # The same cells and lumped masses on both sides. What differs are the time steps and, for the last two, the integration;
        # an error in either program's waves or bending would show as tens of per cent.
        # A bar of 60 cells; the front has passed 2/3 of it. Its width stays behind the wave length, 1 % is left to dispersion.
        h = 0.005
        bar = Body((60, 2, 2), h, (1., 0., 0.), 10. * h / c, 40. * h / c)
        compare("wave in a bar", bar, kerf, ccx, top, 0.01)
        # A cantilever of 20 x 4 x 2 cells, its end moved sideways within a period of its first mode and held in motion.
        length, depth = 20 * h, 4 * h
        period = 2. * math.pi / (1.8751**2 * math.sqrt(YOUNG * depth**2 / 12. / (DENSITY * length**4)))
        compare("bent cantilever", Body((20, 4, 2), h, (0., 1e-3 * length / period, 0.), 0.5 * period, period), kerf, ccx, top, 0.01)
    return failed > 0


if __name__ == "__main__":
    program = shutil.which("ccx")
    if program is None:
        print("skipped: there is no program ccx (Debian package calculix-ccx)")
        sys.exit(SKIPPED)
    sys.exit(main(os.path.abspath(sys.argv[1]), program))
