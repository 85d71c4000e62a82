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
/// Velocities and angular velocities of all particles: tiny noise.
Eigen::VectorXd noisy_velocities(const Packing &packing)
{
  const int dim = packing.dim, dofs = dim == 2 ? 3 : 6;
  const double speed = 1e-9;
  Eigen::VectorXd velocities(dofs * packing.size());
  for (int i = 0; i < packing.size(); ++i)
    for (int d = 0; d < dofs; ++d)
      velocities[dofs * i + d] =
        d < dim ? speed * noise(6 * i + d) : speed / packing.mean_diameter * noise(6 * i + (dim == 2 ? 5 : d));
  return velocities;
}

/// Growth of the energy of a motion that starts with the given velocities; infinite when bonds are far beyond their length.
double energy_growth(const Packing &packing, const Settings &s, int steps, const Eigen::VectorXd &velocities)
{
  DemSide dem(s);
  auto particles = all_particles(packing);
  const int dim = packing.dim, dofs = dim == 2 ? 3 : 6;
  for (NewParticle &p : particles)
  {
    p.velocity.head(dim) = velocities.segment(dofs * p.index, dim);
    p.angular_velocity.tail(dofs - dim) = velocities.segment(dofs * p.index + dim, dofs - dim);
  }
  start(dem, packing, particles);
  const Energies begin = dem.energies();
  dem.advance(steps, {});
  const Energies end = dem.energies();
  return (end.kinetic + end.elastic) / (begin.kinetic + begin.elastic);
}

/// @param fraction of the limit 2 / @p omega.
double energy_growth(const Packing &packing, double k_t, double omega, double fraction, int steps)
{
  Settings s = settings(packing);
  s.bond.k_t = k_t * s.bond.k_n;
  s.time_step = fraction * 2. / omega;
  return energy_growth(packing, s, steps, noisy_velocities(packing));
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

namespace
{
/// Whether the motion has more than 50 times its energy at the end: below the limit Verlet's energy of modes near it is up to 1
/// / (1 - 0.99^2) times the conserved one.
bool grows(const Packing &packing, const Settings &s, const Eigen::VectorXd &velocities)
{
  try
  {
    return !(energy_growth(packing, s, 3000, velocities) < 50.);
  }
  catch (const Unstable &)
  {
    return true;
  }
}

/// The limit with dashpots and local damping against the dense matrices, and against runs on both sides of it.
void expect_limit_with_damping(const Packing &packing, double fraction, double local)
{
  SCOPED_TRACE(testing::Message() << packing.dim << " dimensions, damping ratio " << fraction << ", local damping " << local);
  Settings s = settings(packing);
  s.bond.damping = fraction;
  s.local_damping = local;
  const double limit = 4. / (1. + local);
  const NetworkOperator::Material bonds{s.bond.k_n, s.bond.k_t, s.density, fraction};
  s.time_step = largest_step(packing, bonds, {}, [limit](double) { return limit; });
  const Network network = linear_network(packing, s.bond, s.density);
  const HighestMode highest = network.highest_mode(s.time_step);
  EXPECT_LE(highest.value, limit);
  EXPECT_GE(highest.value, 0.965 * limit); // safety 2 % of the eigenvalue, convergence 1 %
  const double speed = 1e-9;
  EXPECT_FALSE(grows(packing, s, noisy_velocities(packing)));
  EXPECT_FALSE(grows(packing, s, speed * highest.motion));

  // Local damping follows the resultant of all modes. So only a motion that the highest mode rules grows from the limit on, and
  // it must do so before the other modes take over: well above the limit, but below that of the dashpots alone.
  if (local > 0. && local < 0.5)
    return;
  s.time_step *= (local > 0. ? 1.25 : 1.05) * limit / highest.value;
  if (local > 0.)
  {
    EXPECT_LT(network.highest_mode(s.time_step).value, 0.95 * 4.);
  }
  EXPECT_TRUE(grows(packing, s, local > 0. ? speed * highest.motion : noisy_velocities(packing)));
}
} // namespace

TEST(DemTimeStep, Damping)
{
  PackingSettings box;
  box.mean_diameter = 1e-3;
  box.upper = Eigen::Vector3d(14., 14., 0.) * box.mean_diameter;
  const Packing random = generate_packing(box);
  for (const double fraction : {0.1, 0.4, 1.})
    for (const double local : {0., 0.2, 0.8})
      expect_limit_with_damping(random, fraction, local);
  expect_limit_with_damping(triangular_lattice(14, 14, 5e-4), 1., 0.);
  expect_limit_with_damping(fcc_lattice(3, 5e-4), 0.3, 0.);
}

TEST(DemTimeStep, AnUnstableRunEndsWithAnError)
{
  EXPECT_THROW(triangular_growth(0.25, 1.2, 5000), Unstable);
}
