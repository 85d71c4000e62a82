// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/element/elastic_law.h"
#include "tests/support/fem_fixture.h"

#include <gtest/gtest.h>

using namespace kerf::fem;

namespace
{
const StVenantKirchhoff law{3., 2.};
}

// P is the derivative of the stored energy; central differences with step 1e-6 are good to 1e-9 at strains of order one.
TEST(FemLaw, FirstPiolaStressIsDerivativeOfStoredEnergy)
{
  double H[3][3] = {{0.3, -0.2, 0.1}, {0.4, -0.1, 0.25}, {-0.15, 0.05, 0.2}};
  double P[3][3];
  law.first_piola<3>(H, P);
  const double step = 1e-6;
  for (auto i : {0, 1, 2})
    for (auto j : {0, 1, 2})
    {
      const double h = H[i][j];
      H[i][j] = h + step;
      const double above = law.energy_density<3>(H);
      H[i][j] = h - step;
      const double below = law.energy_density<3>(H);
      H[i][j] = h;
      EXPECT_NEAR(P[i][j], (above - below) / (2. * step), 1e-8) << i << j;
    }
}

// Plane strain is three-dimensional strain without out-of-plane part; the same sums, so only round-off differs.
TEST(FemLaw, PlaneStrainIsThreeDimensionalLawWithoutOutOfPlaneStrain)
{
  const double plane[2][2] = {{0.3, -0.2}, {0.4, -0.1}};
  const double solid[3][3] = {{0.3, -0.2, 0.}, {0.4, -0.1, 0.}, {0., 0., 0.}};
  double P2[2][2], P3[3][3], E[2][2], S[2][2];
  law.first_piola<2>(plane, P2);
  law.first_piola<3>(solid, P3);
  for (auto i : {0, 1})
    for (auto j : {0, 1})
      EXPECT_NEAR(P2[i][j], P3[i][j], 1e-14);
  StVenantKirchhoff::strain<2>(plane, E);
  EXPECT_NEAR(law.second_piola<2>(E, S), P3[2][2], 1e-14);
  EXPECT_NEAR(law.energy_density<2>(plane), law.energy_density<3>(solid), 1e-14);
}

// The rest of the expansion is quadratic in H: about 10 (lambda + mu) |H|^2 here.
TEST(FemLaw, LinearisedLawIsTheLimitOfSmallStrain)
{
  const double size = 1e-7;
  const double H[2][2] = {{0.3 * size, -0.2 * size}, {0.4 * size, -0.1 * size}};
  double P[2][2], linear[2][2];
  law.first_piola<2>(H, P);
  LinearisedLaw{law.lambda, law.mu}.first_piola<2>(H, linear);
  for (auto i : {0, 1})
    for (auto j : {0, 1})
      EXPECT_NEAR(P[i][j], linear[i][j], 50. * size * size);
}

// Speeds by hand for E = 40 GPa, nu = 0.2, rho = 2650: the literature example of a granite-like rock, 4 digits.
TEST(FemLaw, WaveSpeeds)
{
  const Material material = test::rock();
  EXPECT_NEAR(material.speed_p(), 4095., 1.);
  EXPECT_NEAR(material.speed_s(), 2508., 1.);
}

TEST(FemLaw, VelocityRampIsHalfCosine)
{
  BoundaryCondition condition = test::condition(0, BoundaryKind::velocity);
  condition.velocity = {2., -1., 0.};
  condition.ramp = 4.;
  EXPECT_EQ(condition.velocity_at(-1.).norm(), 0.);
  EXPECT_NEAR(condition.velocity_at(1.).x(), 1. - std::sqrt(0.5), 1e-14);
  EXPECT_NEAR(condition.velocity_at(2.).y(), -0.5, 1e-14);
  EXPECT_EQ(condition.velocity_at(4.), condition.velocity);
  condition.ramp = 0.;
  EXPECT_EQ(condition.velocity_at(0.), condition.velocity);
}
