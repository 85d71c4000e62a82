// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_fixture.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
/// Energy after some steps of a start with all frequencies in it, over the energy at the start.
double energy_ratio(FemSide &side, const double dt, const int n_steps)
{
  const int n = side.mesh().n_nodes();
  // Tiny, so that even an unstable run stays in the linear range.
  side.set_state(Eigen::Matrix3Xd::Zero(3, n), noise_field(n, 1e-9, 21, side.mesh().dim));
  const double start = total(side.energies());
  for (int i = 1; i <= n_steps; ++i)
    step(side, dt, i * dt);
  return total(side.energies()) / start;
}

/// Below the limit the energy v^T M v/2 + W of a mode stays within 1/(1 - (omega dt/2)^2) = 50 of its start; above it each step
/// multiplies the mode by exp(2 arcosh(1.01)) = 1.33, in 100 steps its energy by 1e24.
void expect_sharp_limit(FemSide &side, const char *what)
{
  const double limit = side.stable_step();
  EXPECT_LT(energy_ratio(side, 0.99 * limit, 2000), 60.) << what;
  EXPECT_GT(energy_ratio(side, 1.01 * limit, 100), 1e6) << what;
}
} // namespace

namespace
{
/// Largest frequency squared of a box of n cells of size h a side on rollers all around: its modes are the plane waves
/// k_d = pi m_d/n_d with u_d ~ sin(k_d x_d) prod cos(k_e x_e), and the assembled multilinear element with full integration is a
/// product of one-dimensional stiffness (2 - 2 cos k)/h, consistent mass h (2 + cos k)/3 and derivative sin k a direction.
double largest_frequency_squared(const Eigen::Vector3i &n_cells, const int dim, const double h)
{
  const Material material = rock();
  const double lambda = material.lame_lambda(), mu = material.lame_mu();
  double largest = 0.;
  const int n_z = dim == 3 ? n_cells.z() : 0;
  for (int i = 0; i <= n_cells.x(); ++i)
    for (int j = 0; j <= n_cells.y(); ++j)
      for (int k = 0; k <= n_z; ++k)
      {
        const int m[3] = {i, j, k};
        double stiffness[3], mass[3], derivative[3];
        for (int d = 0; d < dim; ++d)
        {
          const double angle = M_PI * m[d] / n_cells[d];
          stiffness[d] = (2. - 2. * std::cos(angle)) / h;
          mass[d] = h * (2. + std::cos(angle)) / 3.;
          derivative[d] = std::sin(angle);
        }
        Eigen::MatrixXd K = Eigen::MatrixXd::Zero(dim, dim);
        for (int c = 0; c < dim; ++c)
        {
          if (m[c] == 0 || m[c] == n_cells[c]) // u_c vanishes: no such mode
            continue;
          for (int d = 0; d < dim; ++d)
          {
            double term = (d == c ? lambda + 2. * mu : mu) * stiffness[d];
            for (int e = 0; e < dim; ++e)
              term *= e == d ? 1. : mass[e];
            K(c, c) += term;
            double mixed = (lambda + mu) * derivative[c] * derivative[d];
            for (int e = 0; e < dim; ++e)
              mixed *= e == c || e == d ? 1. : mass[e];
            if (d != c)
              K(c, d) = mixed;
          }
        }
        largest = std::max(largest, Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K).eigenvalues()[dim - 1]);
      }
  return largest / (material.density * std::pow(h, dim));
}

Settings on_rollers(const Eigen::Vector3d &upper, const double h)
{
  Settings settings = box(upper, h);
  for (int id = 0; id < 2 * settings.dim; ++id)
    settings.boundary_conditions.push_back(condition(id, BoundaryKind::roller));
  return settings;
}
} // namespace

// 6e-4: half the tolerance of the eigenvalue plus a margin.
TEST(FemStability, StableStepOfSquareAndCubeCells)
{
  const double h = 0.01;
  const auto plane = make_fem_side(on_rollers({0.25, 0.16, 0.}, h));
  const double exact_plane = 2. / std::sqrt(largest_frequency_squared({25, 16, 0}, 2, h));
  EXPECT_NEAR(plane->stable_step(), exact_plane, 6e-4 * exact_plane);
  // The limit does not depend on a common weight.
  set_weights(*plane, [](const Eigen::Vector3d &) { return 0.3; });
  EXPECT_NEAR(plane->stable_step(), exact_plane, 6e-4 * exact_plane);

  const auto solid = make_fem_side(on_rollers({0.1, 0.08, 0.07}, h));
  const double exact_solid = 2. / std::sqrt(largest_frequency_squared({10, 8, 7}, 3, h));
  EXPECT_NEAR(solid->stable_step(), exact_solid, 6e-4 * exact_solid);

  // Highest plane wave of an endless mesh: cells in opposite motion, omega = 2 c_p/h. Free sides raise it by less than a
  // percent; the limit of the five-point difference scheme, h/sqrt(c_p^2 + c_s^2), is on the safe side.
  const auto free = make_fem_side(box({0.25, 0.16, 0.}, h));
  const double c_p = rock().speed_p(), c_s = rock().speed_s();
  EXPECT_NEAR(free->stable_step(), h / c_p, 0.01 * h / c_p);
  EXPECT_GT(free->stable_step(), h / std::sqrt(c_p * c_p + c_s * c_s));
}

class FemStabilityOfIntegration : public ::testing::TestWithParam<Integration>
{
};
INSTANTIATE_TEST_SUITE_P(All, FemStabilityOfIntegration,
                         ::testing::Values(Integration::full, Integration::selective, Integration::one_point));

TEST_P(FemStabilityOfIntegration, LimitIsSharp)
{
  Settings settings = box({0.2, 0.15, 0.}, 0.01);
  settings.integration = GetParam();
  const auto uniform = make_fem_side(settings);
  expect_sharp_limit(*uniform, "uniform");
  set_weights(*uniform, [](const Eigen::Vector3d &X) { return std::min(1., std::max(0., (X[0] - 0.055) / 0.1)); });
  expect_sharp_limit(*uniform, "linear weight with a nearly empty edge");
  set_weights(*uniform, [](const Eigen::Vector3d &X) { return std::hypot(X[0] - 0.1, X[1] - 0.15) < 0.06 ? 0. : 1.; });
  expect_sharp_limit(*uniform, "hole");

  settings.boundary_conditions = {condition(0, BoundaryKind::fixed), condition(2, BoundaryKind::roller)};
  expect_sharp_limit(*make_fem_side(settings), "fixed and roller sides");

  settings.mesh.fine_lower = {0.08, 0.1, 0.};
  settings.mesh.fine_upper = {0.1, 0.15, 0.};
  settings.mesh.cell_size = 0.005;
  settings.mesh.growth = 1.3;
  expect_sharp_limit(*make_fem_side(settings), "graded");

  const MshFile file("stability");
  write_distorted_msh(file.path, 10, 8, 0.01);
  settings.boundary_conditions.clear();
  settings.mesh.gmsh_file = file.path;
  expect_sharp_limit(*make_fem_side(settings), "distorted");

  // In space, flat cells of growing size, at small strain.
  Settings solid = box({0.05, 0.04, 0.03}, 0.005);
  solid.integration = GetParam();
  solid.strain = Strain::small;
  solid.mesh.fine_lower = {0.01, 0.02, 0.};
  solid.mesh.fine_upper = {0.03, 0.04, 0.01};
  solid.mesh.growth = 1.3;
  const auto graded_solid = make_fem_side(solid);
  set_weights(*graded_solid, [](const Eigen::Vector3d &X) { return std::min(1., std::max(0., (X[0] - 0.012) / 0.02)); });
  expect_sharp_limit(*graded_solid, "graded in space, with weights");

  const MshFile solid_file("stability_solid");
  write_distorted_hex_msh(solid_file.path, 6, 5, 4, 0.01);
  Settings distorted_solid = box({0.06, 0.05, 0.04}, 0.01);
  distorted_solid.integration = GetParam();
  distorted_solid.mesh.gmsh_file = solid_file.path;
  expect_sharp_limit(*make_fem_side(distorted_solid), "distorted in space");

  settings.mesh = box({0.2, 0.15, 0.}, 0.01).mesh;
  settings.mesh.refined = {{{0.08, 0.1, 0.}, {0.12, 0.15, 0.}, 1}};
  expect_sharp_limit(*make_fem_side(settings), "hanging nodes");
}

// Dashpots all around do not lower the limit, because their force follows the velocity at the end of the step.
TEST(FemStability, AbsorbingBoundariesDoNotLowerTheLimit)
{
  Settings settings = box({0.1, 0.08, 0.}, 0.01);
  for (int id = 0; id < 4; ++id)
    settings.boundary_conditions.push_back(condition(id, BoundaryKind::absorbing));
  const auto side = make_fem_side(settings);
  set_weights(*side, [](const Eigen::Vector3d &X) { return X[0] < 0.05 ? 0.02 : 1.; });
  EXPECT_LT(energy_ratio(*side, 0.999 * side->stable_step(), 1000), 1.);
}

// Velocity Verlet keeps v^T M v/2 + (1 - (omega dt/2)^2) W of a mode, so v^T M v/2 + W swings by (omega dt/2)^2. Longest mode
// over 120 cells at half the limit: (1.37/120/2)^2 = 3.3e-5; the body's other low modes that the start excites are below that.
TEST(FemStability, FreeVibrationKeepsItsEnergy)
{
  const auto side = make_fem_side(box({1.2, 0.2, 0.}, 0.01));
  const Eigen::Matrix3Xd &X = side->mesh().nodes;
  Eigen::Matrix3Xd zero = Eigen::Matrix3Xd::Zero(3, X.cols()), v = zero;
  v.row(0) = (M_PI * X.row(0).array() / 1.2).cos();
  side->set_state(zero, v);
  const double dt = 0.5 * side->stable_step();
  const double start = total(side->energies());
  double largest = 0., least_kinetic = start;
  for (int n = 1; n <= 2000; ++n)
  {
    step(*side, dt, n * dt);
    const Energies now = side->energies();
    largest = std::max(largest, std::abs(total(now) - start));
    least_kinetic = std::min(least_kinetic, now.kinetic);
  }
  EXPECT_LT(largest, 1e-4 * start);
  EXPECT_LT(least_kinetic, 0.1 * start) << "it must swing";
}

// A block pulled by a smooth velocity for 10 000 steps: what the boundary puts in is what the block holds, to 1e-4 of the
// input. The step is 0.5 of the limit; the swing of the scheme, (omega dt/2)^2 of the energy in a mode, stays far below that
// because the ramp excites only low modes.
class FemEnergyBalance : public ::testing::TestWithParam<std::tuple<Strain, Integration>>
{
};
INSTANTIATE_TEST_SUITE_P(All, FemEnergyBalance,
                         ::testing::Combine(::testing::Values(Strain::finite, Strain::small),
                                            ::testing::Values(Integration::full, Integration::selective,
                                                              Integration::one_point)));

TEST_P(FemEnergyBalance, HoldsOverTenThousandSteps)
{
  Settings settings = box({0.2, 0.1, 0.}, 0.01);
  settings.strain = std::get<0>(GetParam());
  settings.integration = std::get<1>(GetParam());
  const MshFile file("balance");
  write_distorted_msh(file.path, 20, 10, 0.01);
  settings.mesh.gmsh_file = file.path;
  BoundaryCondition pull = condition(1, BoundaryKind::velocity);
  pull.velocity = {0.3, 0.2, 0.};
  pull.ramp = 1e-3;
  settings.boundary_conditions = {condition(0, BoundaryKind::fixed), pull};
  const auto side = make_fem_side(settings);
  set_weights(*side, [](const Eigen::Vector3d &X) { return X[0] < 0.1 ? 0.4 : 1.; });
  const double dt = 0.5 * side->stable_step();
  double worst = 0., input = 0.;
  for (int n = 1; n <= 10000; ++n)
  {
    step(*side, dt, n * dt);
    if (n % 100 == 0)
    {
      const Energies now = side->energies();
      input = std::max(input, std::abs(now.boundary));
      worst = std::max(worst, std::abs(total(now) - now.boundary));
    }
  }
  EXPECT_GT(input, 0.);
  EXPECT_LT(worst, 1e-4 * input);
}
