// SPDX-License-Identifier: GPL-2.0-or-later
// What an undamped bonded body must keep: momentum, angular momentum, energy.
#include "tests/support/dem_test_packings.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

using namespace kerf::dem;
using namespace kerf::dem::test;

namespace
{
struct Momentum
{
  Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = Eigen::Vector3d::Zero();
};

/// About @p centre; a far one would only add round-off of the positions.
Momentum momentum(DemSide &dem, const Packing &packing, const Eigen::Vector3d &centre)
{
  const Particles p = dem.particles();
  Momentum sum;
  for (int i = 0; i < p.n; ++i)
  {
    const double inertia = (packing.dim == 2 ? 0.5 : 0.4) * p.mass[i] * p.radius[i] * p.radius[i];
    const Eigen::Vector3d mv = p.mass[i] * p.velocity.col(i), arm = p.position.col(i) - centre;
    sum.linear += mv;
    sum.angular += arm.cross(mv) + inertia * p.angular_velocity.col(i);
  }
  return sum;
}

/// Particles of a lattice with random radii: the bonds keep their lengths, the branches become unequal.
Packing uneven(Packing packing)
{
  for (int i = 0; i < packing.size(); ++i)
    packing.radii[i] *= 1. + 0.3 * noise(i);
  return packing;
}

std::vector<NewParticle> perturbed(const Packing &packing, double velocity)
{
  auto particles = all_particles(packing);
  for (NewParticle &p : particles)
    for (int c = 0; c < 3; ++c)
    {
      if (c < packing.dim)
        p.velocity[c] = velocity * noise(6 * p.index + c);
      if (packing.dim == 3 || c == 2)
        p.angular_velocity[c] = velocity / packing.mean_diameter * noise(6 * p.index + 3 + c);
    }
  return particles;
}

void expect_momentum_is_kept(const Packing &packing, double damping)
{
  Settings s = settings(packing);
  s.time_step *= 0.4; // the smallest particles have 0.35 of the mean mass
  s.bond.damping = damping;
  DemSide dem(s);
  start(dem, packing, perturbed(packing, 1.));
  const Eigen::Vector3d centre = 0.5 * (packing.lower + packing.upper);
  const Momentum before = momentum(dem, packing, centre);
  dem.advance(1000, {});
  const Momentum after = momentum(dem, packing, centre);
  EXPECT_EQ(dem.n_bonds_intact(), static_cast<std::int64_t>(packing.bonds.size()));
  EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * before.linear.norm());
  EXPECT_LT((after.angular - before.angular).norm(), 1e-12 * before.angular.norm());
}
} // namespace

TEST(DemConservation, MomentumAndAngularMomentum)
{
  expect_momentum_is_kept(uneven(triangular_lattice(6, 6, 5e-4)), 0.);
  expect_momentum_is_kept(uneven(fcc_lattice(2, 5e-4)), 0.);
}

TEST(DemConservation, ContactDampingKeepsMomentum)
{
  expect_momentum_is_kept(uneven(triangular_lattice(6, 6, 5e-4)), 0.2);
}

TEST(DemConservation, EnergyOfAVibratingBlock)
{
  for (const Packing &packing : {triangular_lattice(12, 12, 5e-4), fcc_lattice(3, 5e-4)})
  {
    Settings s = settings(packing);
    if (packing.dim == 3)
      s.time_step *= std::sqrt(6.5 / 10.); // FCC with free rotations: omega_max^2 = 40 k_t / m
    DemSide dem(s);
    start(dem, packing, perturbed(packing, 0.5)); // bonds are strained by 1e-3: the law is well in its nonlinear terms
    const Energies begin = dem.energies();
    const double total = begin.kinetic + begin.elastic;
    // Verlet oscillates by (omega dt)^2 / 8 of the energy of a mode around a conserved value, at 0.2 of the limit 2 % for the
    // highest one. Averages of many steps show the drift alone.
    const auto mean_total = [&]
    {
      double sum = 0.;
      for (int k = 0; k < 50; ++k)
      {
        dem.advance(2, {});
        const Energies e = dem.energies();
        sum += (e.kinetic + e.elastic) / 50.;
      }
      return sum;
    };
    dem.advance(200, {}); // equipartition first
    const double early = mean_total();
    EXPECT_NEAR(early, total, 0.02 * total);
    dem.advance(4600, {});
    const double late = mean_total();
    EXPECT_NEAR(late, early, 1e-3 * total);
    EXPECT_GT(dem.energies().elastic, 0.3 * total);
    EXPECT_EQ(dem.energies().damping, 0.);
  }
}

TEST(DemConservation, EnergyBalanceOfABreakingBlock)
{
  // Kinetic + elastic + what damping, friction and failure took out stays the same while a third of the bonds breaks.
  const Packing packing = triangular_lattice(12, 12, 5e-4);
  Settings s = settings(packing);
  s.time_step *= 0.1;
  s.bond.R_n = 2e-4 * packing.mean_diameter * s.bond.k_n;
  s.bond.R_t = 1e-4 * packing.mean_diameter * s.bond.k_n;
  s.bond.damping = 0.05;
  DemSide dem(s);
  start(dem, packing, perturbed(packing, 0.5));
  const Energies begin = dem.energies();
  dem.advance(4000, {});
  const Energies end = dem.energies();
  EXPECT_GT(dem.n_bonds_broken(), 50);
  EXPECT_GT(end.released, 0.02 * begin.kinetic);
  EXPECT_GT(end.damping, 0.02 * begin.kinetic);
  EXPECT_GT(end.friction, 0.);
  const double sum = end.kinetic + end.elastic + end.damping + end.friction + end.released;
  // First order in the step: bonds fail up to a step late, contacts open and close within one.
  EXPECT_NEAR(sum, begin.kinetic + begin.elastic, 5e-3 * begin.kinetic);
}

TEST(DemConservation, LocalDampingIsCounted)
{
  const Packing packing = triangular_lattice(12, 12, 5e-4);
  Settings s = settings(packing);
  s.time_step *= 0.1;
  s.local_damping = 0.1;
  DemSide dem(s);
  start(dem, packing, perturbed(packing, 0.5));
  const Energies begin = dem.energies();
  dem.advance(2000, {});
  const Energies end = dem.energies();
  EXPECT_GT(end.damping, 0.3 * begin.kinetic);
  EXPECT_NEAR(end.kinetic + end.elastic + end.damping, begin.kinetic, 5e-3 * begin.kinetic); // (omega dt)^2 and the first step
}
