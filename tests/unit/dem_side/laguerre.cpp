// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/laguerre.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

using namespace kerf::dem;

TEST(LaguerreCells, OfTwoSizesOnACubicLattice)
{
  // Radii a and b alternate: the plane to a nearest neighbour lies at s = (D^2 + a^2 - b^2) / (2 D) from a. Cells of the small
  // ones are cubes of edge 2 (D - s), the large ones share the rest of 2 D^3. Exact up to round-off.
  const double D = 1., a = 0.52, b = 0.4, s = (D * D + a * a - b * b) / (2. * D);
  const int n = 7;
  Packing packing;
  packing.dim = 3;
  packing.positions.resize(3, n * n * n);
  packing.radii.resize(n * n * n);
  std::vector<char> target(n * n * n, 0);
  for (int i = 0; i < n * n * n; ++i)
  {
    const int x = i % n, y = i / n % n, z = i / (n * n);
    packing.positions.col(i) << x, y, z;
    packing.radii[i] = (x + y + z) % 2 ? a : b;
    target[i] = std::min({x, y, z}) > 2 && std::max({x, y, z}) < n - 2;
  }
  const Eigen::VectorXd volumes = laguerre_volumes(packing, target);
  const double small = 8. * std::pow(D - s, 3);
  for (int i = 0; i < n * n * n; ++i)
    EXPECT_NEAR(volumes[i], !target[i] ? 0. : packing.radii[i] == b ? small : 2. * D * D * D - small, 1e-12);
}
