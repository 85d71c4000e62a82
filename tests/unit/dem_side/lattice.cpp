// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/packing_checks.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

using namespace kerf::dem;
using namespace kerf::dem::test;

TEST(TriangularPacking, FillsTheBoxWithCentredRows)
{
  // 10.2 x 9 diameters: rows of 10 and 9 discs; 1 + 9 sqrt(3)/2 = 8.79 diameters hold 10 rows.
  const Packing packing = generate_packing(triangular(10.2, 9.));
  ASSERT_EQ(packing.size(), 5 * 10 + 5 * 9);
  const double d = packing.mean_diameter;
  const Eigen::Vector3d low = packing.positions.rowwise().minCoeff(), high = packing.positions.rowwise().maxCoeff();
  // Exact numbers up to round-off of the positions.
  EXPECT_NEAR(low[0] - packing.lower[0], 0.6 * d, 1e-12 * d);
  EXPECT_NEAR(packing.upper[0] - high[0], 0.6 * d, 1e-12 * d);
  EXPECT_NEAR(low[1] - packing.lower[1], packing.upper[1] - high[1], 1e-12 * d);
  EXPECT_NEAR(high[1] - low[1], 9. * std::sqrt(3.) / 2. * d, 1e-12 * d);

  // 10 in each row when the shifted row fits as well: 10.5 diameters, made with round-off against us.
  EXPECT_EQ(generate_packing(triangular(10.5, 9.)).size(), 100);
}

TEST(TriangularPacking, BondsNearestNeighboursOnlyAtAnyTolerance)
{
  for (const double tolerance : {0., 0.1, 2.}) // second neighbours are 1.46 radii apart
  {
    PackingSettings settings = triangular(20.5, 20.);
    settings.gap_tolerance = tolerance;
    const Packing packing = generate_packing(settings);
    std::vector<int> partners(packing.size(), 0);
    for (const auto &[i, j] : packing.bonds)
    {
      EXPECT_NEAR((packing.positions.col(i) - packing.positions.col(j)).norm(), packing.mean_diameter, 1e-10);
      ++partners[i];
      ++partners[j];
    }
    for (int i = 0; i < packing.size(); ++i)
    {
      const Eigen::Vector3d x = packing.positions.col(i);
      const double inside =
        std::min((x - packing.lower).head<2>().minCoeff(), (packing.upper - x).head<2>().minCoeff()) / packing.mean_diameter;
      EXPECT_GE(partners[i], 2);
      if (inside > 1.5)
      {
        EXPECT_EQ(partners[i], 6);
      }
    }
  }
}
