// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/solver/stress_recovery.h"
#include "tests/support/fem_fixture.h"

#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
/// Nodal stresses recovered from cell stresses that are @p field at the centres of the cells left of @p limit.
template <typename Field>
Eigen::MatrixXd recovered(const FemSide &side, const Field &field, const double limit = 10.)
{
  const Mesh &mesh = side.mesh();
  CellStress stress;
  std::vector<Eigen::Matrix<double, 6, 1>> values;
  for (const int cell : side.owned_cells())
  {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (int a = 0; a < mesh.cells.rows(); ++a)
      centre += mesh.nodes.col(mesh.cells(a, cell)) / mesh.cells.rows();
    if (centre.x() > limit)
      continue;
    stress.cell.push_back(cell);
    values.push_back(field(centre));
  }
  stress.sigma.resize(6, static_cast<Eigen::Index>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i)
    stress.sigma.col(static_cast<Eigen::Index>(i)) = values[i];
  return recover_stress(mesh, stress, MPI_COMM_WORLD);
}

Eigen::Matrix<double, 6, 1> linear_stress(const Eigen::Vector3d &x)
{
  Eigen::Matrix<double, 6, 1> sigma;
  for (int k = 0; k < 6; ++k)
    sigma[k] = 1. + 0.3 * k + (2. - k) * x[0] + 0.5 * k * x[1] - (1. + k) * x[2];
  return sigma;
}
} // namespace

// Stresses that vary linearly come out exactly at every node, at corners and hanging nodes, too.
TEST(FemRecovery, LinearStressIsExactUpToTheBoundary)
{
  for (const int dim : {2, 3})
  {
    Settings settings = box({0.8, 0.6, dim == 3 ? 0.6 : 0.}, 0.1);
    settings.mesh.refined = {{{0.2, 0.2, 0.2}, {0.4, 0.6, 0.4}, 1}};
    const auto side = make_fem_side(settings);
    const Eigen::MatrixXd sigma = recovered(*side, linear_stress);
    for (int i = 0; i < sigma.cols(); ++i)
    {
      const Eigen::Matrix<double, 6, 1> exact = linear_stress(side->mesh().nodes.col(i));
      EXPECT_LT((sigma.col(i) - exact).norm(), 1e-11) << side->mesh().nodes.col(i).transpose();
    }
  }
}

// Cells without weight do not count; a single row of cells has a slope along itself only, there the mean remains.
TEST(FemRecovery, OnlyWeightedCellsCount)
{
  const Settings settings = box({0.8, 0.1, 0.}, 0.1);
  const auto side = make_fem_side(settings);
  const Eigen::MatrixXd sigma = recovered(
    *side,
    [](const Eigen::Vector3d &x)
    {
      Eigen::Matrix<double, 6, 1> stress = Eigen::Matrix<double, 6, 1>::Zero();
      stress[0] = x[0];
      return stress;
    },
    0.4);
  for (int i = 0; i < sigma.cols(); ++i)
  {
    const double x = side->mesh().nodes(0, i);
    if (x > 0.45)
    {
      EXPECT_EQ(sigma(0, i), 0.);
    }
    else if (x > 0.05 && x < 0.35)
    {
      EXPECT_NEAR(sigma(0, i), x, 1e-14);
    }
    else
    {
      EXPECT_NEAR(sigma(0, i), x < 0.05 ? 0.05 : 0.35, 1e-14);
    }
  }
}
