// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_fixture.h"

#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

// A stressed body with hanging nodes, pushed by a platen, a traction and gravity, with a dashpot side: what is in it and what
// the dashpots took equals what it had and what was put in. The scheme's own energy and the trapezoidal work differ by
// (omega dt)^2/4 of the oscillating part, which smooth starts keep small: 1e-4 of the input over 10 000 steps.
TEST(FemEnergy, BalanceOverTenThousandSteps)
{
  Settings settings = box({0.6, 0.3, 0.}, 0.05);
  settings.mesh.refined = {{{0.2, 0.15, 0.}, {0.4, 0.3, 0.}, 1}};
  settings.initial_stress.diagonal() << -2e6, -4e6, 0.;
  settings.gravity = {0., -9.81, 0.};
  settings.gravity_ramp = 2e-3;
  BoundaryCondition push = condition(0, BoundaryKind::velocity), press;
  push.velocity = {0.02, -0.01, 0.};
  push.ramp = 2e-3;
  press.kind = BoundaryKind::traction;
  press.where = "y > 0.3 - 1e-6 && x > 0.2 && x < 0.4";
  press.traction = {1e6, -2e6, 0.};
  press.ramp = 1e-3;
  settings.boundary_conditions = {push, press, condition(1, BoundaryKind::absorbing), condition(2, BoundaryKind::roller),
                                  condition(3, BoundaryKind::in_situ)};
  const auto side = make_fem_side(settings);
  const double initial = total(side->energies()), dt = 0.4 * side->stable_step();
  double worst = 0., input = 0.;
  for (int n = 1; n <= 10000; ++n)
  {
    step(*side, dt, n * dt);
    if (n % 20 == 0)
    {
      const Energies now = side->energies();
      input = std::max(input, std::abs(now.boundary) + initial);
      worst = std::max(worst, std::abs(total(now) + now.absorbed - initial - now.boundary));
    }
  }
  EXPECT_LT(worst, 1e-4 * input);
  const Energies end = side->energies();
  EXPECT_GT(std::abs(end.boundary), initial);
  EXPECT_GT(end.absorbed, 1e-3 * initial);
}

// A pressure pulse of 40 coarse cells meets cells of half the size behind hanging nodes, in a bar that can only move along x
// but whose refined part covers half of its height, so that coarse and fine cells also run side by side. Its energy passes;
// what the change of cells throws back is below 1e-4 (dispersion differs by (k h)^2/24).
TEST(FemEnergy, PulsePassesIntoRefinedCells)
{
  const double h = 0.005;
  Settings settings = box({1., 4. * h, 0.}, h);
  settings.boundary_conditions = {condition(2, BoundaryKind::roller), condition(3, BoundaryKind::roller)};
  settings.mesh.refined = {{{0.5, 0., 0.}, {1., 2. * h, 0.}, 1}};
  const auto side = make_fem_side(settings);
  const double c = settings.material.speed_p(), half = 0.1, height = 1e-5;
  const Eigen::Matrix3Xd &X = side->mesh().nodes;
  Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, X.cols()), v = u;
  for (int i = 0; i < X.cols(); ++i)
  {
    const double s = (X(0, i) - 0.3) / half;
    if (std::abs(s) < 1.)
    {
      u(0, i) = height * std::pow(std::cos(0.5 * M_PI * s), 2);
      v(0, i) = c * height * M_PI / half * std::cos(0.5 * M_PI * s) * std::sin(0.5 * M_PI * s);
    }
  }
  side->set_state(u, v);
  const double initial = total(side->energies()), dt = 0.8 * side->stable_step();
  const int n_steps = static_cast<int>(0.4 / (c * dt));
  for (int n = 1; n <= n_steps; ++n)
    step(*side, dt, n * dt);
  EXPECT_NEAR(total(side->energies()), initial, 4e-3 * initial);
  // Kinetic energy left of the interface, half of what has been thrown back; the pulse is at 0.6 to 0.8 now.
  const Eigen::Matrix3Xd mass = side->gather(NodalField::mass), velocity = side->gather(NodalField::velocity);
  double back = 0., forward = 0.;
  for (int i = 0; i < X.cols(); ++i)
    (X(0, i) < 0.5 ? back : forward) += 0.5 * mass(0, i) * velocity.col(i).squaredNorm();
  EXPECT_LT(back, 1e-4 * initial);
  EXPECT_NEAR(forward, 0.5 * initial, 0.01 * initial);
}
