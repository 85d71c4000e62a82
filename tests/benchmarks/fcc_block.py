# SPDX-License-Identifier: GPL-2.0-or-later
"""The block of tests/benchmarks/fcc_block.h for the scripts of other programs. Plain Python: it runs inside of them."""

CORNERS = ((0, 0, 0), (1, 1, 0), (1, 0, 1), (0, 1, 1))
FORWARD = ((1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1))  # half of the twelve nearest neighbours


def lattice_points(cells):
    """Points of even sum on the grid of half a cell side, cells^3 cubes of four, cube by cube."""
    side = range(cells)
    return [tuple(2 * cell + corner for cell, corner in zip((x, y, z), at))
            for x in side for y in side for z in side for at in CORNERS]


def fcc_block(cells, radius):
    """Centres [m] of touching spheres."""
    return [tuple(2**0.5 * radius * coordinate for coordinate in point) for point in lattice_points(cells)]


def fcc_bonds(cells):
    """Pairs (first, second) of touching spheres."""
    points = lattice_points(cells)
    number = {point: i for i, point in enumerate(points)}
    bonds = []
    for i, point in enumerate(points):
        for step in FORWARD:
            other = number.get(tuple(a + b for a, b in zip(point, step)))
            if other is not None:
                bonds.append((min(i, other), max(i, other)))
    return sorted(bonds)
