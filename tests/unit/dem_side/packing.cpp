// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/packing.h"
#include "tests/support/packing_checks.h"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>

using namespace kerf::dem;
using namespace kerf::dem::test;

TEST(Packing, VolumesAndSolidFraction)
{
  Packing packing = from_points({{0.5, 0.5, 0.5}}, 0.5);
  packing.lower = Eigen::Vector3d::Zero();
  packing.upper = {2., 1., 0.};
  EXPECT_DOUBLE_EQ(packing.volume(0), std::acos(-1.) / 4.);
  EXPECT_DOUBLE_EQ(packing.solid_fraction(), std::acos(-1.) / 8.);
  packing.dim = 3;
  packing.upper[2] = 4.;
  EXPECT_DOUBLE_EQ(packing.volume(0), std::acos(-1.) / 6.);
  EXPECT_DOUBLE_EQ(packing.solid_fraction(), std::acos(-1.) / 48.);
}

TEST(PackingSettings, WrongOnesAreNamed)
{
  PackingSettings good = triangular(10., 10.), bad = good;
  EXPECT_EQ(error_of(good), "no error");
  bad.kind = "cubic";
  EXPECT_EQ(error_of(bad), "packing: kind 'cubic' is unknown, use random, triangular, fcc or hcp");
  bad = good;
  bad.dim = 3;
  EXPECT_EQ(error_of(bad), "packing: kind 'triangular' is a lattice in 2 dimensions, not 3");
  bad = good;
  bad.mean_diameter = 0.;
  EXPECT_EQ(error_of(bad), "packing: the mean diameter must be positive, not 0");
  bad = good;
  bad.radius_spread = 1.;
  EXPECT_EQ(error_of(bad), "packing: the radius spread must be in [0, 0.8], not 1");
  bad = good;
  bad.gap_tolerance = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(error_of(bad), "packing: the gap tolerance must be in [0, 2] mean radii, not nan");
  bad = good;
  bad.upper[1] = bad.lower[1];
  EXPECT_EQ(error_of(bad), "packing: side y of the box is 0 mean diameters long, it must be 4 to 100000");
}
