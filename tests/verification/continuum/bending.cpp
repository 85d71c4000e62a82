// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_cell_mesh.h"

#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
/// Cantilever along x, depth along y; @p n cells deep, square in the xy plane; in space @p n/2 cells wide.
template <int dim>
struct Cantilever
{
  static constexpr double depth = 0.1, length = 1.; // [m]
  static constexpr double load = 1e3;               // [N], in the plane [N/m]

  explicit Cantilever(const int n, const double poisson)
    : mesh(Eigen::Vector3i(10 * n, n, n / 2).head<dim>(), q1::Point<dim>::Constant(depth / n)), material(rock())
  {
    material.poisson = poisson;
    const Eigen::Index size = mesh.X.size();
    fixed.assign(size, false);
    loads = Eigen::VectorXd::Zero(size);
    for (int i = 0; i < mesh.X.cols(); ++i)
    {
      const auto x = mesh.X.col(i);
      const bool root = x[0]<1e-9, tip = x[0]> length - 1e-9, axis = std::abs(x[1] - 0.5 * depth) < 1e-9;
      // The root section stays plane and upright, and is free to grow wider or deeper.
      if (root)
        fixed[dim * i] = true;
      if (root && axis)
        fixed[dim * i + 1] = true;
      if (dim == 3 && root && axis && x[dim - 1] < 1e-9)
        fixed[dim * i + dim - 1] = true;
      // Parabolic shear of the beam on both ends, so that the support takes next to nothing.
      if (root || tip)
        loads[dim * i + 1] = (tip ? -1. : 1.) * shear_share(x[1], n) * width_share(x, n);
    }
  }

  /// Load of a node: parabola 6 y (depth - y)/depth^3 times the hat function of the node.
  static double shear_share(const double y, const int n)
  {
    const double h = depth / n;
    double sum = 0.;
    for (const double side : {-1., 1.})
      for (const double point : {0.5 - 0.5 * q1::gauss, 0.5 + 0.5 * q1::gauss})
      {
        const double z = y + side * point * h;
        if (z > 0. && z < depth)
          sum += 0.5 * h * (1. - point) * 6. * z * (depth - z) / (depth * depth * depth);
      }
    return load * sum;
  }
  template <typename Point>
  static double width_share(const Point &x, const int n)
  {
    if (dim == 2)
      return 1.;
    const int cells = n / 2;
    const double z = x[dim - 1], width = 0.5 * depth;
    return (z < 1e-9 || z > width - 1e-9 ? 0.5 : 1.) / cells;
  }

  /// Stiffness and lumped mass without the fixed components.
  void assemble(const Integration integration)
  {
    const Eigen::MatrixXd all = mesh.stiffness(mesh.kernel(Strain::small, integration, material));
    free.clear();
    for (Eigen::Index i = 0; i < all.rows(); ++i)
      if (!fixed[i])
        free.push_back(static_cast<int>(i));
    const auto size = static_cast<Eigen::Index>(free.size());
    Eigen::MatrixXd K(size, size);
    for (Eigen::Index j = 0; j < size; ++j)
      for (Eigen::Index i = 0; i < size; ++i)
        K(i, j) = all(free[i], free[j]);
    factor.compute(K);
    Eigen::VectorXd nodal = Eigen::VectorXd::Zero(mesh.X.cols());
    for (const auto &nodes : mesh.cells)
      for (const int node : nodes)
        nodal[node] += material.density * std::pow(mesh.X(1, nodes[2]) - mesh.X(1, nodes[0]), dim) / CellMesh<dim>::n;
    mass.resize(size);
    for (Eigen::Index i = 0; i < size; ++i)
      mass[i] = nodal[free[i] / dim];
  }
  double deflection() const
  {
    Eigen::VectorXd f(factor.rows());
    for (Eigen::Index i = 0; i < f.size(); ++i)
      f[i] = loads[free[i]];
    const Eigen::VectorXd u = factor.solve(f);
    // Work of the loads: the mean over the end sections.
    return f.dot(u) / load;
  }
  /// First bending frequency [1/s] by inverse iteration.
  double frequency() const
  {
    Eigen::VectorXd x(factor.rows());
    for (Eigen::Index i = 0; i < x.size(); ++i)
      x[i] = free[i] % dim == 1 ? std::pow(mesh.X(0, free[i] / dim), 2) : 0.;
    double value = 0.;
    for (int i = 0; i < 30; ++i)
    {
      const Eigen::VectorXd y = factor.solve(mass.cwiseProduct(x));
      value = x.dot(mass.cwiseProduct(x)) / x.dot(mass.cwiseProduct(y));
      x = y.normalized();
    }
    return std::sqrt(value) / (2. * M_PI);
  }

  /// Timoshenko: P L^3/(3 E I) + P L/(kappa G A), kappa = 5/6; in plane strain E/(1 - nu^2).
  double beam_deflection() const
  {
    const double width = dim == 2 ? 1. : 0.5 * depth;
    const double young = dim == 2 ? material.young / (1. - material.poisson * material.poisson) : material.young;
    const double inertia = width * std::pow(depth, 3) / 12., area = width * depth;
    return load * std::pow(length, 3) / (3. * young * inertia) + load * length / (5. / 6. * material.lame_mu() * area);
  }
  /// Euler-Bernoulli: 1.8751^2 sqrt(E I/(rho A L^4))/(2 pi).
  double beam_frequency() const
  {
    const double young = dim == 2 ? material.young / (1. - material.poisson * material.poisson) : material.young;
    return 1.8751 * 1.8751 * std::sqrt(young * depth * depth / 12. / (material.density * std::pow(length, 4))) / (2. * M_PI);
  }

  CellMesh<dim> mesh;
  Material material;
  std::vector<bool> fixed;
  std::vector<int> free;
  Eigen::VectorXd loads, mass;
  Eigen::LLT<Eigen::MatrixXd> factor;
};

template <int dim>
double deflection_ratio(const Integration integration, const int n, const double poisson)
{
  Cantilever<dim> beam(n, poisson);
  beam.assemble(integration);
  return beam.deflection() / beam.beam_deflection();
}
} // namespace

// Nearly incompressible rock, 4 cells deep. One point bends exactly, what differs is the beam theory (depth/length)^2.
// Selective integration keeps the shear of bilinear cells in bending, (1/4)^2 of it for 4 cells. Full integration locks.
TEST(FemBending, OnlyFullIntegrationLocks)
{
  EXPECT_NEAR(deflection_ratio<2>(Integration::one_point, 4, 0.49), 1., 0.01);
  EXPECT_NEAR(deflection_ratio<2>(Integration::selective, 4, 0.49), 1., 0.05);
  EXPECT_LT(deflection_ratio<2>(Integration::full, 4, 0.49), 0.6);
  EXPECT_NEAR(deflection_ratio<3>(Integration::one_point, 4, 0.49), 1., 0.01);
  EXPECT_NEAR(deflection_ratio<3>(Integration::selective, 4, 0.49), 1., 0.05);
  EXPECT_LT(deflection_ratio<3>(Integration::full, 4, 0.49), 0.9); // a beam in space can escape sideways
  // One cell over the depth is enough for one point.
  EXPECT_NEAR(deflection_ratio<2>(Integration::one_point, 2, 0.49), 1., 0.02);
}

// Halving the cells divides the change of the answer by 4: order 2. One point is within 0.2 % with two cells over the depth, so
// that higher powers of the cell size still count. Beam theory holds up to shear and rotary inertia, (depth/length)^2.
TEST(FemBending, DeflectionAndFrequencyConvergeWithOrderTwo)
{
  for (const Integration integration : {Integration::full, Integration::selective, Integration::one_point})
  {
    double deflection[3], frequency[3];
    for (int level = 0; level < 3; ++level)
    {
      Cantilever<2> beam(2 << level, 0.2);
      beam.assemble(integration);
      deflection[level] = beam.deflection() / beam.beam_deflection();
      frequency[level] = beam.frequency() / beam.beam_frequency();
    }
    const auto order = [](const double(&v)[3]) { return std::log2(std::abs((v[1] - v[0]) / (v[2] - v[1]))); };
    EXPECT_GT(order(deflection), 1.75) << static_cast<int>(integration);
    EXPECT_GT(order(frequency), 1.75) << static_cast<int>(integration);
    if (integration != Integration::one_point)
    {
      EXPECT_LT(order(deflection), 2.2) << static_cast<int>(integration);
      EXPECT_LT(order(frequency), 2.2) << static_cast<int>(integration);
    }
    else
    {
      EXPECT_NEAR(deflection[0], 1., 2e-3);
    }
    EXPECT_NEAR(deflection[2], 1., 0.01);
    EXPECT_NEAR(frequency[2], 1., 0.01);
  }
}
