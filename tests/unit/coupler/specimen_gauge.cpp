// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/specimen_gauge.h"

#include <gtest/gtest.h>

using namespace kerf;

namespace
{
/// Linear loading up to the peak at strain 1e-3, then a linear fall to a fifth; bonds break from 80 % of the peak on.
SpecimenRecord record_of(double modulus, double lateral)
{
  SpecimenRecord record;
  for (int k = 0; k <= 150; ++k)
  {
    SpecimenState state;
    const double strain = 1e-5 * k;
    state.axial_strain = strain;
    state.lateral_strain = lateral * strain;
    state.stress = k <= 100 ? modulus * strain : modulus * 1e-3 * (1. - 0.016 * (k - 100));
    state.middle_stress = 1.1 * state.stress;
    state.broken_bonds = k < 80 ? 0 : k - 80;
    record.add(state);
  }
  return record;
}
} // namespace

TEST(SpecimenRecord, ModuliAndStrength)
{
  const double E = 20e9, nu = 0.25;
  const SpecimenResult solid = record_of(E, nu).result(3);
  EXPECT_NEAR(solid.young, 1.1 * E, 1e-9 * E);
  EXPECT_NEAR(solid.nominal_young, E, 1e-9 * E); // a straight line is fitted to round-off
  EXPECT_NEAR(solid.poisson, nu, 1e-9);
  EXPECT_NEAR(solid.strength, 20e6, 1.);
  EXPECT_NEAR(solid.peak_strain, 1e-3, 1e-12);
  EXPECT_EQ(solid.linear_broken, 0.);
  EXPECT_TRUE(solid.peak_passed);

  // In plane strain the press shows E/(1 - nu^2) and nu/(1 - nu).
  const SpecimenResult flat = record_of(E / (1. - nu * nu), nu / (1. - nu)).result(2);
  EXPECT_NEAR(flat.nominal_young, E, 1e-9 * E);
  EXPECT_NEAR(flat.poisson, nu, 1e-9);
}

TEST(SpecimenRecord, EndOfTheTest)
{
  SpecimenRecord record;
  SpecimenState state;
  state.stress = 10.;
  record.add(state);
  state.stress = 1.;
  record.add(state);
  EXPECT_FALSE(record.fell_below(0.5)); // the stress swings, but nothing has broken
  EXPECT_FALSE(record.result(2).young > 0.);
  state.broken_bonds = 1;
  record.add(state);
  EXPECT_TRUE(record.fell_below(0.5));
  EXPECT_FALSE(record.fell_below(0.05));
  state.stress = -1.; // torn halves swing back
  record.add(state);
  EXPECT_TRUE(record.fell_below(0.05));
  EXPECT_FALSE(record.fell_below(0.)); // never
}
