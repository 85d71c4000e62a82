// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/bond_network/bond_network.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

using namespace kerf::dem;

namespace
{
/// Stable step of the central difference method in units of sqrt(m / k_n).
double stable_step(const Packing &packing, double ratio)
{
  const double k_n = 2e10, density = 2700.;
  const double omega = largest_frequency(packing, k_n, ratio * k_n, density);
  return 2. / omega * std::sqrt(k_n / (density * packing.volume(0)));
}

/// omega_max of a small packing from the dense matrix, written independently with central differences of the bond energy.
double dense_frequency(const Packing &packing, double k_n, double k_t, double density)
{
  const int n = 3 * packing.size();
  const auto energy_of_bond = [&](int i, int j, const Eigen::Matrix<double, 6, 1> &q)
  {
    const Eigen::Vector2d branch = (packing.positions.col(j) - packing.positions.col(i)).head<2>();
    const double length = branch.norm(), r_i = packing.radii[i], r_j = packing.radii[j];
    const Eigen::Vector2d n_ij = branch / length, t_ij(-n_ij[1], n_ij[0]);
    const Eigen::Vector2d contact_i = q.head<2>() + q[2] * length * r_i / (r_i + r_j) * t_ij;
    const Eigen::Vector2d contact_j = q.segment<2>(3) - q[5] * length * r_j / (r_i + r_j) * t_ij;
    const double stretch = n_ij.dot(contact_j - contact_i), shear = t_ij.dot(contact_j - contact_i);
    return 0.5 * k_n * stretch * stretch + 0.5 * k_t * shear * shear;
  };
  Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(n, n), mass = Eigen::MatrixXd::Zero(n, n);
  for (const auto &[i, j] : packing.bonds)
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b < 6; ++b)
      {
        // The energy is quadratic: the mixed difference is exact for any step; rotations need a step of 1 / length.
        const auto unit = [&](int d)
        { return (d % 3 == 2 ? 1. / packing.mean_diameter : 1.) * Eigen::Matrix<double, 6, 1>::Unit(d); };
        const double step_a = unit(a)[a], step_b = unit(b)[b];
        const double mixed =
          energy_of_bond(i, j, unit(a) + unit(b)) - energy_of_bond(i, j, unit(a)) - energy_of_bond(i, j, unit(b));
        stiffness(3 * (a < 3 ? i : j) + a % 3, 3 * (b < 3 ? i : j) + b % 3) += mixed / (step_a * step_b);
      }
  for (int i = 0; i < packing.size(); ++i)
  {
    const double m = density * packing.volume(i);
    mass.diagonal().segment<3>(3 * i) << m, m, 0.5 * m * packing.radii[i] * packing.radii[i];
  }
  return std::sqrt(
    Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(stiffness, mass, Eigen::EigenvaluesOnly).eigenvalues()[n - 1]);
}
} // namespace

TEST(LargestFrequency, TriangularLattice)
{
  // omega^2 m / k_n = max(6 + 2 k, 4.5 (1 + k), 24 k) at the zone edge; the estimate is safe (1 %) and the free
  // lattice of 40 diameters lacks 0.1 %.
  PackingSettings settings;
  settings.kind = "triangular";
  settings.mean_diameter = 1e-3;
  settings.upper = Eigen::Vector3d(40.5, 42., 0.) * settings.mean_diameter;
  const Packing packing = generate_packing(settings);
  for (const double ratio : {0., 0.1, 0.25, 0.5, 1.})
  {
    const double exact = 2. / std::sqrt(std::max({6. + 2. * ratio, 4.5 * (1. + ratio), 24. * ratio}));
    EXPECT_LE(stable_step(packing, ratio), exact) << ratio;
    EXPECT_GE(stable_step(packing, ratio), exact * (1. - 0.015)) << ratio;
  }
}

TEST(LargestFrequency, FaceCentredCubicSpheres)
{
  // omega^2 m / k_n = max(8 (1 + k), 40 k); a free block of 12 cells a side lacks up to 1 %, about what the safety adds.
  Packing packing;
  packing.dim = 3;
  const int cells = 12;
  packing.positions.resize(3, 4 * cells * cells * cells);
  int n = 0;
  for (int x = 0; x < 2 * cells; ++x)
    for (int y = 0; y < 2 * cells; ++y)
      for (int z = 0; z < 2 * cells; ++z)
        if ((x + y + z) % 2 == 0)
          packing.positions.col(n++) << x, y, z;
  packing.radii.setConstant(n, std::sqrt(0.5));
  bond_by_gap(packing, 0.1);
  for (const double ratio : {0., 0.25, 1.})
  {
    const double exact = 2. / std::sqrt(std::max(8. * (1. + ratio), 40. * ratio));
    EXPECT_NEAR(stable_step(packing, ratio), exact, 0.015 * exact) << ratio;
  }
}

TEST(LargestFrequency, RandomPackingIsNeverBelowTheExactOne)
{
  for (const unsigned seed : {1u, 2u})
  {
    PackingSettings settings;
    settings.mean_diameter = 1e-3;
    settings.upper = Eigen::Vector3d(16., 14., 0.) * settings.mean_diameter;
    settings.gap_tolerance = 0.2;
    settings.seed = seed;
    const Packing packing = generate_packing(settings);
    ASSERT_GT(packing.size(), 150);
    for (const double ratio : {0., 0.3, 0.6})
    {
      const double exact = dense_frequency(packing, 1e10, ratio * 1e10, 3000.);
      const double estimate = largest_frequency(packing, 1e10, ratio * 1e10, 3000.);
      EXPECT_GE(estimate, exact);
      EXPECT_LE(estimate, 1.015 * exact); // safety 1 %, convergence 0.5 %
    }
  }
}
