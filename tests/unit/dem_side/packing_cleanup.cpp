// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/generation/packing_generator.h"
#include "tests/support/packing_checks.h"

#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

using namespace kerf::dem;
using namespace kerf::dem::test;

TEST(LooseParticles, ChainsAndIslandsGo)
{
  // A rhombus of four, a chain of two hanging on it, and an island of three far away.
  const double h = std::sqrt(0.75);
  Packing packing = from_points({{-1., 0., 0.}, // end of the chain
                                 {0., 0., 0.},  // chain
                                 {10., 0., 0.},
                                 {11., 0., 0.},
                                 {10.5, h, 0.}, // island
                                 {1., 0., 0.},
                                 {2., 0., 0.},
                                 {1.5, h, 0.},
                                 {2.5, h, 0.}},
                                0.5);
  bond_by_gap(packing, 0.01);
  ASSERT_EQ(packing.bonds.size(), 2u + 3u + 5u);
  EXPECT_DOUBLE_EQ(remove_unconnected_particles(packing), 5. / 9.);
  ASSERT_EQ(packing.size(), 4);
  EXPECT_EQ(packing.positions.cols(), 4);
  EXPECT_EQ(packing.positions(0, 0), 1.);
  EXPECT_EQ(packing.positions(0, 3), 2.5);
  EXPECT_EQ(packing.bonds, (std::vector<std::array<int, 2>>{{0, 1}, {0, 2}, {1, 2}, {1, 3}, {2, 3}}));
}
