// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/packing.h"

#include <cstdio>
#include <ctime>
#include <gtest/gtest.h>

using namespace kerf::dem;

TEST(LargePacking, TwoHundredThousandSpheresInMinutes)
{
  PackingSettings settings;
  settings.dim = 3;
  settings.mean_diameter = 1e-3;
  settings.radius_spread = 0.3;
  settings.upper.setConstant(57e-3);
  int reports = 0;
  const std::clock_t start = std::clock();
  const Packing packing = generate_packing(settings, [&](double, const std::string &) { ++reports; });
  const double minutes = double(std::clock() - start) / CLOCKS_PER_SEC / 60.;
  std::printf("%d spheres in %.1f minutes of CPU, solid fraction %.4f, in the core %.4f, coordination %.3f\n", packing.size(),
              minutes, packing.quality.solid_fraction, packing.quality.core_solid_fraction, packing.quality.core_coordination);
  EXPECT_GT(packing.size(), 200000);
  EXPECT_LE(minutes, 15.); // about four on one core; a machine half as fast that is shared may pass as well
  EXPECT_GT(reports, 15);
  EXPECT_NEAR(packing.mean_diameter, 1e-3, 1e-5);
  EXPECT_NEAR(packing.quality.core_solid_fraction, 0.645, 0.01); // random close packing, slightly denser for unequal spheres
  EXPECT_GE(packing.solid_fraction(), 0.62);
  EXPECT_LE(packing.quality.largest_overlap, 0.01);
  EXPECT_GE(packing.quality.isotropy, 0.98);
}
