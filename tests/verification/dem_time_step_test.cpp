// SPDX-License-Identifier: GPL-2.0-or-later
// The stability limit of a triangular lattice, from its dispersion relation: omega_max^2 = max(6 + 2k, 4.5 (1 + k), 24 k) k_n /
// m, k = k_t / k_n.
#include "tests/unit/dem_test_packings.h"

#include <gtest/gtest.h>

using namespace kerf::dem;
using namespace kerf::dem::test;

namespace
{
/// Growth of the energy of tiny random motions.
/// @param fraction of the infinite lattice's limit 2 / omega_max.
double energy_growth(double k_t, double fraction, int steps)
{
  // The highest mode of a free block of n rows is below that of the infinite lattice by about (pi / n)^2 / 4: 0.2 % at 40.
  const Packing packing = triangular_lattice(40, 40, 5e-4);
  Settings s = settings(packing);
  s.bond.k_t = k_t * s.bond.k_n;
  const double square = std::max({6. + 2. * k_t, 4.5 * (1. + k_t), 24. * k_t});
  const double mass = s.density * M_PI * 0.25e-6;
  s.time_step = fraction * 2. / std::sqrt(square * s.bond.k_n / mass);
  DemSide dem(s);
  auto particles = all_particles(packing);
  for (NewParticle &p : particles)
  {
    p.velocity = 1e-9 * Eigen::Vector3d(noise(3 * p.index), noise(3 * p.index + 1), 0.);
    p.angular_velocity[2] = 1e-9 / 1e-3 * noise(3 * p.index + 2);
  }
  start(dem, packing, particles);
  const Energies begin = dem.energies();
  dem.advance(steps, {});
  const Energies end = dem.energies();
  return (end.kinetic + end.elastic) / (begin.kinetic + begin.elastic);
}
} // namespace

TEST(DemTimeStep, TriangularLatticeIsBoundedBelowAndBlowsUpAboveTheLimit)
{
  for (const double k_t : {0.25, 0.5}) // translations and rotations set the limit
  {
    // Near the limit Verlet's energy of the highest modes is far from the conserved one: up to 1 / (1 - 0.99^2) = 50 times.
    EXPECT_LT(energy_growth(k_t, 0.99, 3000), 50.);
    // Above, the highest mode gains about exp(2 acosh(2 f^2 - 1)) a step in energy, f^2 = 1.01^2 (1 - 0.2 %): e^0.5.
    EXPECT_GT(energy_growth(k_t, 1.01, 80), 1e6);
  }
}

TEST(DemTimeStep, AnUnstableRunEndsWithAnError)
{
  EXPECT_THROW(energy_growth(0.25, 1.2, 5000), std::runtime_error);
}
