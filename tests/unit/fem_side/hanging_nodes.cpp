// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_fixture.h"

#include <Eigen/Dense>
#include <algorithm>
#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
constexpr double h = 0.1;

/// A box whose middle is halved twice, so that cells of three sizes meet.
Settings refined_box(const int dim)
{
  Settings settings = box({8 * h, 6 * h, dim == 3 ? 6 * h : 0.}, h);
  settings.mesh.refined = {{{0.3, 0.25, 0.25}, {0.45, 0.6, 0.45}, 2}, {{0., 0., 0.}, {0.1, 0.1, 0.1}, 1}};
  return settings;
}

class FemHanging : public ::testing::TestWithParam<int>
{
protected:
  FemHanging() : side(make_fem_side(refined_box(GetParam()))) {}

  const Mesh &mesh() const { return side->mesh(); }
  Eigen::Matrix3Xd zero() const { return Eigen::Matrix3Xd::Zero(3, mesh().n_nodes()); }
  /// Noise on the free nodes, slaves in between.
  Eigen::Matrix3Xd admissible(const double size, const int seed) const
  {
    Eigen::Matrix3Xd u = noise_field(mesh().n_nodes(), size, seed, GetParam());
    for (const SlaveNode &slave : mesh().slaves)
    {
      u.col(slave.node).setZero();
      for (std::size_t k = 0; k < slave.masters.size(); ++k)
        u.col(slave.node) += slave.weights[k] * u.col(slave.masters[k]);
    }
    return u;
  }
  Eigen::Matrix3Xd forces_of(const Eigen::Matrix3Xd &u)
  {
    side->set_state(u, zero());
    side->compute_forces();
    return side->gather(NodalField::force);
  }
  static double force_scale() { return rock().young * (GetParam() == 3 ? h * h : h); }

  std::unique_ptr<FemSide> side;
};
} // namespace

INSTANTIATE_TEST_SUITE_P(Dimensions, FemHanging, ::testing::Values(2, 3));

TEST_P(FemHanging, SlavesLieBetweenTheirMasters)
{
  ASSERT_GT(mesh().slaves.size(), 10u);
  std::vector<char> slave(mesh().n_nodes(), 0);
  for (const SlaveNode &s : mesh().slaves)
    slave[s.node] = 1;
  for (const SlaveNode &s : mesh().slaves)
  {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < s.masters.size(); ++k)
    {
      EXPECT_FALSE(slave[s.masters[k]]);
      mean += s.weights[k] * mesh().nodes.col(s.masters[k]);
    }
    EXPECT_LT((mean - mesh().nodes.col(s.node)).norm(), 1e-15);
  }
  // Inside of the box the cells are a quarter of the size, and they fill it: no cell is missing or there twice.
  double volume = 0., smallest = 1.;
  for (int cell = 0; cell < mesh().n_cells(); ++cell)
  {
    const Eigen::Vector3d extent =
      mesh().nodes.col(mesh().cells(mesh().cells.rows() - 1, cell)) - mesh().nodes.col(mesh().cells(0, cell));
    volume += extent.head(GetParam()).prod();
    smallest = std::min(smallest, extent.head(GetParam()).maxCoeff());
  }
  EXPECT_NEAR(smallest, 0.25 * h, 1e-15);
  EXPECT_NEAR(volume, 48. * std::pow(h, 2) * (GetParam() == 3 ? 6. * h : 1.), 1e-13);
}

// The element passes the patch test across halved neighbours: linear fields give uniform stress and no inner force.
TEST_P(FemHanging, UniformStrainIsExact)
{
  Eigen::Matrix3d H;
  H << 0.9, -0.6, 0.2, 0.4, -0.7, -0.3, 0.1, 0.5, 0.8;
  if (GetParam() == 2)
    H.row(2) = Eigen::RowVector3d::Zero(), H.col(2).setZero();
  H *= 1e-2;
  const Eigen::Matrix3Xd f = forces_of(H * mesh().nodes);
  const CellStress stress = side->cell_stress();
  for (int i = 0; i < stress.sigma.cols(); ++i)
    EXPECT_LT((stress.sigma.col(i) - stress.sigma.col(0)).norm(), 1e-12 * rock().young);
  const std::vector<bool> outer = boundary_nodes(mesh());
  for (int i = 0; i < mesh().n_nodes(); ++i)
  {
    if (!outer[i])
    {
      EXPECT_LT(f.col(i).norm(), 1e-12 * force_scale()) << i;
    }
  }
  EXPECT_GT(f.norm(), 1e-3 * force_scale());
}

TEST_P(FemHanging, ForcesAreConservativeAndBalanced)
{
  const Eigen::Matrix3Xd u = admissible(0.01 * h, 1), direction = admissible(h, 2);
  const Eigen::Matrix3Xd f = forces_of(u);
  for (const SlaveNode &slave : mesh().slaves)
    EXPECT_EQ(f.col(slave.node).norm(), 0.);
  EXPECT_LT(f.rowwise().sum().norm(), 1e-12 * f.norm());
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (int i = 0; i < mesh().n_nodes(); ++i)
    moment += Eigen::Vector3d(mesh().nodes.col(i) + u.col(i)).cross(Eigen::Vector3d(f.col(i)));
  EXPECT_LT(moment.norm(), 1e-12 * f.norm());

  // f = -dW/du; central differences of a quartic energy.
  const double step = 1e-5;
  side->set_state(u + step * direction, zero());
  const double above = side->energies().elastic;
  side->set_state(u - step * direction, zero());
  const double below = side->energies().elastic;
  EXPECT_NEAR(f.cwiseProduct(direction).sum(), -(above - below) / (2. * step), 1e-6 * f.norm() * direction.norm());
}

TEST_P(FemHanging, MastersCarryTheMass)
{
  const Eigen::Matrix3Xd mass = side->gather(NodalField::mass);
  const double volume = 48. * h * h * (GetParam() == 3 ? 6. * h : 1.);
  EXPECT_NEAR(mass.row(0).sum(), rock().density * volume, 1e-12 * rock().density * volume);
  std::vector<char> slave(mesh().n_nodes(), 0);
  for (const SlaveNode &s : mesh().slaves)
    slave[s.node] = 1;
  for (int i = 0; i < mesh().n_nodes(); ++i)
    EXPECT_EQ(mass(0, i) > 0., !slave[i]);
  // First moments: the lumped masses have the centre of the body.
  EXPECT_NEAR(mass.row(0).dot(mesh().nodes.row(0)), rock().density * volume * 4. * h, 1e-12 * rock().density * volume);
}

// Slaves follow their masters through steps, also where the caller gave them other values.
TEST_P(FemHanging, SlavesMoveWithTheirMasters)
{
  const Eigen::Matrix3Xd noise = noise_field(mesh().n_nodes(), 1., 3, GetParam());
  side->set_state(1e-4 * h * noise, noise);
  const double dt = 0.7 * side->stable_step();
  for (int n = 1; n <= 5; ++n)
    step(*side, dt, n * dt);
  const Eigen::Matrix3Xd u = side->gather(NodalField::displacement), v = side->gather(NodalField::velocity);
  for (const SlaveNode &slave : mesh().slaves)
  {
    Eigen::Vector3d mean_u = Eigen::Vector3d::Zero(), mean_v = mean_u;
    for (std::size_t k = 0; k < slave.masters.size(); ++k)
    {
      mean_u += slave.weights[k] * u.col(slave.masters[k]);
      mean_v += slave.weights[k] * v.col(slave.masters[k]);
    }
    EXPECT_LT((u.col(slave.node) - mean_u).norm(), 1e-15);
    EXPECT_LT((v.col(slave.node) - mean_v).norm(), 1e-12);
  }
}

TEST_P(FemHanging, LocateNamesMastersOnly)
{
  Eigen::Matrix3Xd points = noise_field(3000, 0.5, 5, GetParam());
  points.topRows(GetParam()).array() += 0.5;
  points.row(0) *= 8 * h;
  points.row(1) *= 6 * h;
  points.row(2) *= 6 * h;
  std::vector<char> slave(mesh().n_nodes(), 0);
  for (const SlaveNode &s : mesh().slaves)
    slave[s.node] = 1;
  int with_masters = 0;
  const std::vector<Interpolation> found = side->locate(points);
  for (std::size_t i = 0; i < found.size(); ++i)
  {
    const Interpolation &at = found[i];
    ASSERT_GE(at.cell, 0);
    Eigen::Vector3d x = Eigen::Vector3d::Zero();
    Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero(); // of the position itself: the identity
    for (int a = 0; a < at.n; ++a)
    {
      EXPECT_FALSE(slave[at.nodes[a]]);
      x += at.N[a] * mesh().nodes.col(at.nodes[a]);
      gradient += mesh().nodes.col(at.nodes[a]) * at.dN.col(a).transpose();
    }
    const int dim = GetParam();
    EXPECT_LT((x - points.col(static_cast<int>(i))).norm(), 1e-13);
    EXPECT_LT((gradient.topLeftCorner(dim, dim) - Eigen::MatrixXd::Identity(dim, dim)).norm(), 1e-11);
    for (int a = 0; a < mesh().cells.rows(); ++a)
      with_masters += slave[mesh().cells(a, at.cell)];
  }
  EXPECT_GT(with_masters, 100);
}

// Neighbours are mutual, and their common faces together with the outer ones are all faces.
TEST_P(FemHanging, NeighboursShareFaces)
{
  const int dim = GetParam();
  const auto lower = [&](const int cell) { return Eigen::Vector3d(mesh().nodes.col(mesh().cells(0, cell))); };
  const auto upper = [&](const int cell)
  { return Eigen::Vector3d(mesh().nodes.col(mesh().cells(mesh().cells.rows() - 1, cell))); };
  double shared = 0., surface = 0.;
  for (int cell = 0; cell < mesh().n_cells(); ++cell)
  {
    const Eigen::Vector3d extent = upper(cell) - lower(cell);
    for (int d = 0; d < dim; ++d)
      surface += 2. * extent.head(dim).prod() / extent[d];
    for (const int other : mesh().neighbours[cell])
    {
      EXPECT_TRUE(std::count(mesh().neighbours[other].begin(), mesh().neighbours[other].end(), cell) == 1);
      const Eigen::VectorXd common = (upper(cell).cwiseMin(upper(other)) - lower(cell).cwiseMax(lower(other))).head(dim);
      EXPECT_EQ((common.array().abs() < 1e-9).count(), 1); // they touch along one axis
      double area = 1.;
      for (int d = 0; d < dim; ++d)
        area *= common[d] > 1e-9 ? common[d] : 1.;
      shared += area;
    }
  }
  const double outer = dim == 2 ? 2. * (8 + 6) * h : 2. * (8 * 6 + 8 * 6 + 6 * 6) * h * h;
  EXPECT_NEAR(surface, shared + outer, 1e-10);
}

TEST(FemHangingMesh, UnusableBoxGivesOneLine)
{
  Settings settings = refined_box(2);
  settings.mesh.refined[0].upper.y() = -1.;
  EXPECT_NE(error_of(settings).find("refined box"), std::string::npos);
}
