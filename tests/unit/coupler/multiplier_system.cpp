// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/multiplier_system.h"
#include "tests/support/dummy_fem_side.h"
#include "tests/support/scattered_points.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

using namespace kerf;

// The equations of all components at once against dense matrices, with masses that differ from one component to the next.
TEST(MultiplierSystem, AreThoseOfDenseMatrices)
{
  const int n = 150;
  const double h = 0.1;
  const Eigen::Matrix3Xd points = test::scattered_points(n, h);
  test::DummyFemSide fem(4, 3, h, 2.);
  const int n_nodes = fem.mesh().n_nodes();
  const std::vector<fem::Interpolation> found = fem.locate(points);
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(n, n_nodes), c = Eigen::MatrixXd::Zero(n, n);
  std::vector<MultiplierSystem::Row> rows(n);
  for (int i = 0; i < n; ++i)
  {
    rows[i] = {1. + 0.01 * i, {}, found[i].n, found[i].nodes.data(), found[i].N.data()};
    for (int axis = 0; axis < 3; ++axis)
      rows[i].inverse_mass[axis] = (i + axis) % 7 ? 1. + (13 * i + 5 * axis) % 11 : 0.; // some cannot move
    c(i, i) = rows[i].c;
    for (int a = 0; a < found[i].n; ++a)
      N(i, found[i].nodes[a]) = found[i].N[a];
  }
  Eigen::Matrix3Xd inverse_mass = 2. * Eigen::Matrix3Xd::Ones(3, n_nodes) + Eigen::Matrix3Xd::Random(3, n_nodes);
  inverse_mass(0, 3) = inverse_mass(1, 5) = 0.; // held
  const Eigen::MatrixXd B = N.transpose() * c * N;
  for (const int dim : {2, 3})
  {
    const MultiplierSystem equations(dim, rows, inverse_mass);
    const Eigen::MatrixXd right = Eigen::MatrixXd::Random(dim, n_nodes);
    Eigen::MatrixXd solution = right, product;
    equations.solve(solution);
    equations.multiply(right, product);
    EXPECT_LT((product - right * B).norm(), 1e-13 * product.norm());
    for (int axis = 0; axis < dim; ++axis)
    {
      Eigen::VectorXd of_particles(n);
      for (int i = 0; i < n; ++i)
        of_particles[i] = c(i, i) * c(i, i) * rows[i].inverse_mass[axis];
      const Eigen::VectorXd of_nodes = inverse_mass.row(axis);
      const Eigen::MatrixXd A = N.transpose() * of_particles.asDiagonal() * N + B * of_nodes.asDiagonal() * B;
      const Eigen::VectorXd x = solution.row(axis), b = right.row(axis);
      EXPECT_LT((A * x - b).norm(), 1e-8 * b.norm());
    }
  }
}
