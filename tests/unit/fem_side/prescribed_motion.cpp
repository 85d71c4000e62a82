// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_fixture.h"

#include <algorithm>
#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
Eigen::Matrix3Xd zero(const FemSide &side)
{
  return Eigen::Matrix3Xd::Zero(3, side.mesh().n_nodes());
}

/// Weight by position: 1 left of the limit, 0 right of it.
void keep_left_part(FemSide &side, const double limit)
{
  set_weights(side, [&](const Eigen::Vector3d &X) { return X[0] < limit ? 1. : 0.; });
}
} // namespace

TEST(FemBoundary, PrescribedNodesMoveAsPrescribed)
{
  Settings settings = box({0.6, 0.3, 0.}, 0.1);
  BoundaryCondition push = condition(3, BoundaryKind::velocity);
  push.velocity = {0.2, -0.5, 0.};
  settings.boundary_conditions = {condition(0, BoundaryKind::roller), push, condition(2, BoundaryKind::fixed)};
  const auto side = make_fem_side(settings);
  const double dt = 0.5 * side->stable_step();
  for (int n = 1; n <= 40; ++n)
    step(*side, dt, n * dt);
  const Eigen::Matrix3Xd u = side->gather(NodalField::displacement), v = side->gather(NodalField::velocity);
  const Mesh &mesh = side->mesh();
  for (int i = 0; i < mesh.n_nodes(); ++i)
  {
    if (mesh.nodes(1, i) == 0.3) // the platen also where it meets the roller
    {
      EXPECT_NEAR(u(0, i), 0.2 * 40 * dt, 1e-12 * dt);
      EXPECT_NEAR(u(1, i), -0.5 * 40 * dt, 1e-12 * dt);
      EXPECT_EQ(v(1, i), -0.5);
    }
    else if (mesh.nodes(1, i) == 0.)
      EXPECT_EQ(u.col(i).norm(), 0.);
    else if (mesh.nodes(0, i) == 0.)
    {
      EXPECT_EQ(u(0, i), 0.);
      EXPECT_NE(u(1, i), 0.);
    }
  }
}

// Work put in equals energy found: the trapezoidal sum and the energy of the step scheme differ by (omega dt)^2/4 of the
// oscillating part; the ramp keeps the highest frequencies out. The work on the fixed and roller sides is zero.
TEST(FemBoundary, WorkOfVelocityBoundaryEqualsEnergy)
{
  Settings settings = box({0.6, 0.3, 0.}, 0.05);
  BoundaryCondition push = condition(1, BoundaryKind::velocity);
  push.velocity = {-0.5, 0.1, 0.};
  push.ramp = 1e-4;
  settings.boundary_conditions = {condition(0, BoundaryKind::fixed), push, condition(2, BoundaryKind::roller)};
  const auto side = make_fem_side(settings);
  const double dt = 0.25 * side->stable_step();
  for (int n = 1; n <= 400; ++n)
    step(*side, dt, n * dt);
  const Energies energies = side->energies();
  EXPECT_GT(total(energies), 1.);
  EXPECT_NEAR(energies.boundary, total(energies), 2e-3 * total(energies));
}

// A free body pushed by a constant force: momentum is force times time exactly, because every step adds dt (f^n + f^(n+1))/2
// and the outer force of a step counts in both its half kicks. The very first half kick has no outer force yet.
TEST(FemBoundary, OuterForcesCountInBothHalfKicks)
{
  const auto side = make_fem_side(box({0.4, 0.2, 0.}, 0.1));
  const double dt = 0.5 * side->stable_step();
  side->set_window(this_rank() == 0 ? std::vector<int>{3} : std::vector<int>{});
  Eigen::Matrix3Xd push(3, this_rank() == 0 ? 1 : 0);
  if (this_rank() == 0)
    push.col(0) << 1000., -400., 0.;
  for (int n = 1; n <= 50; ++n)
  {
    side->begin_step(dt, n * dt);
    side->compute_forces();
    side->add_window_forces(push);
    side->end_step(dt, n * dt);
  }
  const Eigen::Vector3d momentum =
    side->gather(NodalField::mass).cwiseProduct(side->gather(NodalField::velocity)).rowwise().sum();
  EXPECT_NEAR(momentum.x(), 1000. * 49.5 * dt, 1e-10 * 1000. * 50 * dt);
  EXPECT_NEAR(momentum.y(), -400. * 49.5 * dt, 1e-10 * 1000. * 50 * dt);
}

// Switching off the right half leaves a body that moves as if the right half had never been meshed.
TEST(FemBoundary, SwitchedOffCellsLeaveTheOthersUntouched)
{
  const auto whole = make_fem_side(box({0.8, 0.3, 0.}, 0.1));
  const auto half = make_fem_side(box({0.4, 0.3, 0.}, 0.1));
  keep_left_part(*whole, 0.4);
  EXPECT_EQ(whole->n_active_cells(), 12);
  EXPECT_EQ(whole->cell_stress().sigma.cols(),
            std::count_if(whole->owned_cells().begin(), whole->owned_cells().end(),
                          [&](const int cell) { return whole->mesh().nodes(0, whole->mesh().cells(0, cell)) < 0.39; }));

  const auto start = [](FemSide &side)
  {
    Eigen::Matrix3Xd v = zero(side);
    const Eigen::Matrix3Xd &X = side.mesh().nodes;
    v.row(0) = (9. * X.row(0).array()).sin() * (7. * X.row(1).array()).cos();
    v.row(1) = (5. * X.row(0).array() * X.row(1).array()).cos();
    side.set_state(zero(side), v);
  };
  start(*whole);
  start(*half);
  const double dt = 0.5 * half->stable_step();
  EXPECT_NEAR(whole->stable_step(), half->stable_step(), 1e-3 * half->stable_step()); // tolerance of the eigenvalue
  for (int n = 1; n <= 100; ++n)
  {
    step(*whole, dt, n * dt);
    step(*half, dt, n * dt);
  }
  const Eigen::Matrix3Xd u = whole->gather(NodalField::displacement), small = half->gather(NodalField::displacement);
  const Eigen::Matrix3Xd v = whole->gather(NodalField::velocity);
  const Mesh &mesh = whole->mesh();
  int compared = 0;
  for (int i = 0; i < mesh.n_nodes(); ++i)
  {
    if (mesh.nodes(0, i) > 0.45)
    {
      EXPECT_EQ(u.col(i).norm(), 0.);
      EXPECT_EQ(v.col(i).norm(), 0.);
      continue;
    }
    for (int j = 0; j < small.cols(); ++j)
      if ((half->mesh().nodes.col(j) - mesh.nodes.col(i)).norm() < 1e-9)
      {
        // Vertex coordinates of the two meshes differ in the last digit.
        EXPECT_LT((u.col(i) - small.col(j)).norm(), 1e-11 * small.norm());
        ++compared;
      }
  }
  EXPECT_EQ(compared, small.cols());
}

// Massless prescribed nodes stay, too, and do no work.
TEST(FemBoundary, SwitchedOffPlatenStandsStill)
{
  Settings settings = box({0.8, 0.3, 0.}, 0.1);
  BoundaryCondition push = condition(1, BoundaryKind::velocity);
  push.velocity = {-1., 0., 0.};
  settings.boundary_conditions = {push};
  const auto side = make_fem_side(settings);
  keep_left_part(*side, 0.4);
  for (int n = 1; n <= 10; ++n)
    step(*side, 1e-6, n * 1e-6);
  EXPECT_EQ(side->gather(NodalField::displacement).norm(), 0.);
  EXPECT_EQ(side->energies().boundary, 0.);
}
