// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"

#include <algorithm>
#include <cmath>

namespace kerf::dem::benchmarks
{
/// Face-centred cubic block of touching spheres of radius @p r [m], n^3 cells of 4 spheres, cell by cell; the 12 nearest
/// neighbours of a sphere are bonded, sorted by the first sphere.
inline Packing fcc_block(int n, double r)
{
  Packing packing;
  packing.kind = "fcc";
  packing.dim = 3;
  packing.mean_diameter = 2. * r;
  packing.positions.resize(3, 4 * n * n * n);
  packing.radii.setConstant(4 * n * n * n, r);

  // Lattice points are the points of even sum on a grid of half the cell side.
  const int side = 2 * n;
  const double spacing = std::sqrt(2.) * r;
  const Eigen::Vector3i corners[] = {{0, 0, 0}, {1, 1, 0}, {1, 0, 1}, {0, 1, 1}};
  const Eigen::Vector3i forward[] = {{1, 1, 0}, {1, -1, 0}, {1, 0, 1}, {1, 0, -1}, {0, 1, 1}, {0, 1, -1}}; // half of the twelve
  const auto number = [n, &corners](const Eigen::Vector3i &p)
  {
    const Eigen::Vector3i cell = p / 2, rest = p - 2 * cell;
    int corner = 0;
    while (corners[corner] != rest)
      ++corner;
    return 4 * ((cell[0] * n + cell[1]) * n + cell[2]) + corner;
  };
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      for (int z = (x + y) % 2; z < side; z += 2)
        packing.positions.col(number({x, y, z})) = spacing * Eigen::Vector3d(x, y, z);
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      for (int z = (x + y) % 2; z < side; z += 2)
        for (const Eigen::Vector3i &step : forward)
        {
          const Eigen::Vector3i p(x, y, z), q = p + step;
          if ((q.array() >= 0).all() && (q.array() < side).all())
            packing.bonds.push_back({std::min(number(p), number(q)), std::max(number(p), number(q))});
        }
  std::sort(packing.bonds.begin(), packing.bonds.end());
  packing.lower = packing.positions.rowwise().minCoeff().array() - r;
  packing.upper = packing.positions.rowwise().maxCoeff().array() + r;
  return packing;
}
} // namespace kerf::dem::benchmarks
