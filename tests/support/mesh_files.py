# SPDX-License-Identifier: GPL-2.0-or-later
"""Meshes of squares as gmsh files, and boxes as STL files, for the tests of inputs."""
import struct


def squares(present, size, origin=(0., 0.)):
    """Nodes (x, y) and cells (four nodes, counted from 0, anticlockwise) of unit squares scaled by size."""
    number, nodes, cells = {}, [], []
    for i, j in present:
        cell = []
        for corner in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
            if corner not in number:
                number[corner] = len(nodes)
                nodes.append((origin[0] + size * corner[0], origin[1] + size * corner[1]))
            cell.append(number[corner])
        cells.append(cell)
    return nodes, cells


def block(n_x, n_y, without=()):
    return [(i, j) for i in range(n_x) for j in range(n_y) if (i, j) not in set(without)]


def column(present, size, layers, height):
    """Hexahedra (gmsh type 5) over squares of the plane (z, x), in layers along y."""
    flat, squares_of = squares(present, size)
    nodes = [(x, k * height, z) for k in range(layers + 1) for z, x in flat]
    cells = [[n + k * len(flat) for n in cell] + [n + (k + 1) * len(flat) for n in cell] for k in range(layers) for cell in squares_of]
    return nodes, cells


def write_msh(path, nodes, cells, lines=(), tags=2, element_type=3):
    """Version 2.2, text. lines: (node, node, physical number), counted from 0."""
    with open(path, "w") as file:
        file.write(f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{len(nodes)}\n")
        for n, node in enumerate(nodes):
            x = list(node) + [0.] * (3 - len(node))
            file.write(f"{n + 1} {x[0]:.17g} {x[1]:.17g} {x[2]:.17g}\n")
        file.write(f"$EndNodes\n$Elements\n{len(lines) + len(cells)}\n")
        for n, (a, b, physical) in enumerate(lines):
            file.write(f"{n + 1} 1 2 {physical} {physical} {a + 1} {b + 1}\n")
        for n, cell in enumerate(cells):
            file.write(f"{len(lines) + n + 1} {element_type} {tags} " + "1 " * tags + " ".join(str(k + 1) for k in cell) + "\n")
        file.write("$EndElements\n")


def box_facets(lower, upper):
    """The twelve triangles of a box, outwards."""
    def corner(k):
        return tuple(upper[c] if k >> c & 1 else lower[c] for c in range(3))
    faces = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    return [[corner(f[0]), corner(f[k]), corner(f[k + 1])] for f in faces for k in (1, 2)]


def stl_text(facets, name="rock"):
    lines = [f"solid {name}"]
    for facet in facets:
        lines += ["facet normal 0 0 0", " outer loop"] + ["  vertex {:.9g} {:.9g} {:.9g}".format(*p) for p in facet] + [" endloop", "endfacet"]
    return "\n".join(lines + [f"endsolid {name}", ""])


def stl_bytes(facets, header=b"binary"):
    data = header.ljust(80, b" ") + struct.pack("<I", len(facets))
    for facet in facets:
        data += struct.pack("<12f", 0., 0., 0., *[x for p in facet for x in p]) + b"\0\0"
    return data
