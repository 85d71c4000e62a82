// SPDX-License-Identifier: GPL-2.0-or-later
// The stability limit 2 / omega_max: of a triangular lattice from its dispersion relation, omega_max^2 = max(6 + 2k, 4.5 (1 +
// k), 24 k) k_n / m with k = k_t / k_n, of other packings from the eigenvalues of their linearised network.
#include "dem_side/bond_network/bond_network.h"
#include "dem_side/errors.h"
#include "tests/support/dem_stiffness.h"
#include "tests/support/dem_test_packings.h"

#include <gtest/gtest.h>

using namespace kerf::dem;
using namespace kerf::dem::test;

namespace
{
/// Growth of the energy of tiny random motions.
/// @param fraction of the limit 2 / @p omega.
double energy_growth(const Packing &packing, double k_t, double omega, double fraction, int steps)
{
  Settings s = settings(packing);
  s.bond.k_t = k_t * s.bond.k_n;
  s.time_step = fraction * 2. / omega;
  DemSide dem(s);
  auto particles = all_particles(packing);
  const double speed = 1e-9;
  for (NewParticle &p : particles)
    for (int c = 0; c < 3; ++c)
    {
      if (c < packing.dim)
        p.velocity[c] = speed * noise(6 * p.index + c);
      if (packing.dim == 3 || c == 2)
        p.angular_velocity[c] = speed / packing.mean_diameter * noise(6 * p.index + 3 + c);
    }
  start(dem, packing, particles);
  const Energies begin = dem.energies();
  dem.advance(steps, {});
  const Energies end = dem.energies();
  return (end.kinetic + end.elastic) / (begin.kinetic + begin.elastic);
}

/// Lattice of 40 rows: the highest mode of a free block of n rows is below that of the infinite lattice by about (pi / n)^2 /
/// 4, 0.2 %.
double triangular_growth(double k_t, double fraction, int steps)
{
  const Packing packing = triangular_lattice(40, 40, 5e-4);
  const Settings s = settings(packing);
  const double square = std::max({6. + 2. * k_t, 4.5 * (1. + k_t), 24. * k_t});
  return energy_growth(packing, k_t, std::sqrt(square * s.bond.k_n / (s.density * packing.volume(0))), fraction, steps);
}

void expect_limit_of_network(const Packing &packing, double k_t)
{
  Settings s = settings(packing);
  s.bond.k_t = k_t * s.bond.k_n;
  const double omega = linear_network(packing, s.bond, s.density).largest_frequency();
  // The program's estimate is on the safe side by 1 %, and converged to 0.5 %.
  const double estimate = largest_frequency(packing, s.bond.k_n, s.bond.k_t, s.density);
  EXPECT_GE(estimate, omega);
  EXPECT_LE(estimate, 1.015 * omega);
  // Verlet's energy of modes near the limit is up to 1 / (1 - 0.99^2) = 50 times the conserved one.
  EXPECT_LT(energy_growth(packing, k_t, omega, 0.99, 3000), 50.);
  // The highest mode gains exp(2 acosh(2 1.01^2 - 1)) = e^0.56 a step in energy; it has a part of 1e-6 or more at the start.
  EXPECT_GT(energy_growth(packing, k_t, omega, 1.01, 80), 1e6);
}
} // namespace

TEST(DemTimeStep, TriangularLatticeIsBoundedBelowAndBlowsUpAboveTheLimit)
{
  for (const double k_t : {0.25, 0.5}) // translations and rotations set the limit
  {
    // Near the limit Verlet's energy of the highest modes is far from the conserved one: up to 1 / (1 - 0.99^2) = 50 times.
    EXPECT_LT(triangular_growth(k_t, 0.99, 3000), 50.);
    // Above, the highest mode gains about exp(2 acosh(2 f^2 - 1)) a step in energy, f^2 = 1.01^2 (1 - 0.2 %): e^0.5.
    EXPECT_GT(triangular_growth(k_t, 1.01, 80), 1e6);
  }
}

TEST(DemTimeStep, Lattices)
{
  for (const Packing &packing : {triangular_lattice(14, 14, 5e-4), fcc_lattice(3, 5e-4)})
    for (const double k_t : {0.1, 0.5})
    {
      SCOPED_TRACE(testing::Message() << packing.dim << " dimensions, k_t / k_n = " << k_t);
      expect_limit_of_network(packing, k_t);
    }
}

TEST(DemTimeStep, RandomPackings)
{
  for (const int dim : {2, 3})
  {
    PackingSettings box;
    box.dim = dim;
    box.mean_diameter = 1e-3;
    box.upper = box.mean_diameter * (dim == 2 ? Eigen::Vector3d(14., 14., 0.) : Eigen::Vector3d(6., 6., 6.));
    const Packing packing = generate_packing(box);
    ASSERT_GT(packing.size(), 150);
    for (const double k_t : {0.1, 0.5})
    {
      SCOPED_TRACE(testing::Message() << dim << " dimensions, k_t / k_n = " << k_t);
      expect_limit_of_network(packing, k_t);
    }
  }
}

TEST(DemTimeStep, AnUnstableRunEndsWithAnError)
{
  EXPECT_THROW(triangular_growth(0.25, 1.2, 5000), Unstable);
}
