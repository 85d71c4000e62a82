// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/packing.h"
#include "tests/support/packing_checks.h"

#include <array>
#include <gtest/gtest.h>
#include <random>
#include <vector>

using namespace kerf::dem;
using namespace kerf::dem::test;

TEST(Bonds, EqualBruteForce)
{
  std::mt19937_64 random(7);
  const auto uniform = [&] { return double(random() >> 11) * 0x1p-53; };
  for (const int dim : {2, 3})
  {
    Packing packing;
    packing.dim = dim;
    const int n = 600;
    packing.positions.setZero(3, n);
    packing.radii.resize(n);
    for (int i = 0; i < n; ++i)
    {
      for (int c = 0; c < dim; ++c)
        packing.positions(c, i) = (c + 1) * uniform() - 3.; // a box with unequal sides
      packing.radii[i] = (dim == 2 ? 0.02 : 0.09) * (0.5 + uniform());
    }
    const double tolerance = 0.3, gap = tolerance * packing.radii.mean();
    bond_by_gap(packing, tolerance);
    std::vector<std::array<int, 2>> expected;
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < n; ++j)
        if ((packing.positions.col(i) - packing.positions.col(j)).norm() - packing.radii[i] - packing.radii[j] < gap)
          expected.push_back({i, j});
    ASSERT_GT(expected.size(), 500u);
    EXPECT_EQ(packing.bonds, expected);
    EXPECT_EQ(packing.gap_tolerance, tolerance);
    EXPECT_DOUBLE_EQ(packing.coordination(), 2. * double(expected.size()) / n);
  }
}

TEST(Bonds, AFarParticleCostsNoMemory)
{
  // Cells of the size of a particle over this box would be 1e16.
  Packing packing = from_points({{0., 0., 0.}, {1e-3, 0., 0.}, {1e5, 1e5, 0.}}, 0.5e-3);
  bond_by_gap(packing, 0.1);
  EXPECT_EQ(packing.bonds, (std::vector<std::array<int, 2>>{{0, 1}}));
}
