// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/activation/stress_criterion.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace kerf;

TEST(StressMeasure, ClosedAnswers)
{
  using Stress = Eigen::Matrix<double, 6, 1>;
  Stress uniaxial = Stress::Zero();
  uniaxial[1] = 3e6;
  const double f_t = 5e6, f_c = 50e6;
  EXPECT_NEAR(stress_measure(Criterion::maximum_principal, uniaxial, f_t, f_c), 3e6, 1e-6);
  EXPECT_NEAR(stress_measure(Criterion::von_mises, uniaxial, f_t, f_c), 3e6, 1e-6);
  EXPECT_NEAR(stress_measure(Criterion::mohr_coulomb, uniaxial, f_t, f_c), 3e6, 1e-6);
  EXPECT_NEAR(stress_measure(Criterion::drucker_prager, uniaxial, f_t, f_c), 3e6, 1e-6);
  Stress compression = Stress::Zero();
  compression[1] = -50e6; // at failure the measure is the tensile strength
  EXPECT_NEAR(stress_measure(Criterion::mohr_coulomb, compression, f_t, f_c), f_t, 1e-3);
  EXPECT_NEAR(stress_measure(Criterion::drucker_prager, compression, f_t, f_c), f_t, 1e-3);
  EXPECT_NEAR(stress_measure(Criterion::maximum_principal, compression, f_t, f_c), 0., 1e-3);
  Stress shear = Stress::Zero();
  shear[5] = 2e6;
  EXPECT_NEAR(stress_measure(Criterion::von_mises, shear, f_t, f_c), 2e6 * std::sqrt(3.), 1e-6);
  EXPECT_NEAR(stress_measure(Criterion::maximum_principal, shear, f_t, f_c), 2e6, 1e-6);
  EXPECT_NEAR(stress_measure(Criterion::mohr_coulomb, shear, f_t, f_c), 2e6 * (1. + f_t / f_c), 1e-6);
  EXPECT_NEAR(stress_measure(Criterion::drucker_prager, shear, f_t, f_c), std::sqrt(3.) * 1e6 * (1. + f_t / f_c), 1e-6);
}

// Cells are passed over by the norm of their stress, so no criterion may measure more than it promises, whatever the strengths.
TEST(StressMeasure, IsBoundedByTheNorm)
{
  using Stress = Eigen::Matrix<double, 6, 1>;
  std::srand(1);
  double closest = 0.;
  for (int k = 0; k < 2000; ++k)
  {
    Stress sigma = Stress::Random();
    if (k % 2 == 1)
      sigma.head<3>().setConstant(sigma[0]); // nearly isotropic: the largest trace for a norm
    const double f_t = 1., f_c = k % 3 == 0 ? 0.5 : k % 3 == 1 ? 1. : 20.;
    const double norm = std::sqrt(sigma.head<3>().squaredNorm() + 2. * sigma.tail<3>().squaredNorm());
    sigma *= norm_below(7., f_t, f_c) / norm;
    for (const Criterion criterion :
         {Criterion::maximum_principal, Criterion::von_mises, Criterion::mohr_coulomb, Criterion::drucker_prager})
      closest = std::max(closest, stress_measure(criterion, sigma, f_t, f_c));
  }
  EXPECT_LE(closest, 7.);
  EXPECT_GT(closest, 4.); // and it is worth asking
}
