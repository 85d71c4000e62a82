// SPDX-License-Identifier: GPL-2.0-or-later
// Two particles through the particle engine.
#include "tests/support/dem_driven_pair.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

using namespace kerf::dem;
using namespace kerf::dem::test;

TEST(DemPair, ForceSlopesAreTheStiffnesses)
{
  for (const int dim : {2, 3})
  {
    const Packing packing = two_particles(0.4e-3, 0.6e-3, d0, dim);
    const Settings s = settings(packing);
    const double u = 1e-6 * d0; // linear to 1e-6, differences of positions are exact to 1e-10 u
    const int steps = 10;
    {
      Driven pull(s, moving(packing, Eigen::Vector3d::UnitX() * u / (steps * s.time_step)));
      pull.advance(steps);
      EXPECT_NEAR(pull.force(0, 0), s.bond.k_n * u, 2e-6 * s.bond.k_n * u);
      EXPECT_NEAR(pull.force(0, 1), -pull.force(0, 0), 1e-15 * s.bond.k_n * d0);
    }
    {
      Driven shear(s, moving(packing, Eigen::Vector3d::UnitY() * u / (steps * s.time_step)));
      shear.advance(steps);
      EXPECT_NEAR(shear.force(1, 0), s.bond.k_t * u, 2e-6 * s.bond.k_t * u);
      EXPECT_NEAR(shear.torque(2, 0), 0.4e-3 * s.bond.k_t * u, 2e-6 * d0 * s.bond.k_t * u);
      EXPECT_NEAR(shear.torque(2, 1), 0.6e-3 * s.bond.k_t * u, 2e-6 * d0 * s.bond.k_t * u);
    }
  }
}

TEST(DemPair, BreaksInTensionAtTheStrength)
{
  const Packing packing = two_particles(0.5e-3, 0.5e-3, d0);
  Settings s = settings(packing);
  s.bond.R_n = 1e-3 * d0 * s.bond.k_n;
  const int last = 1000; // steps to the strength; the half keeps round-off from deciding
  const double u = s.bond.R_n / s.bond.k_n / (last - 0.5);
  Driven pull(s, moving(packing, Eigen::Vector3d::UnitX() * u / s.time_step));
  pull.advance(last - 1);
  EXPECT_EQ(pull.dem.n_bonds_intact(), 1);
  EXPECT_EQ(pull.dem.n_bonds_broken(), 0);
  EXPECT_NEAR(pull.force(0, 0), s.bond.R_n, 1e-3 * s.bond.R_n);
  pull.advance(1);
  EXPECT_EQ(pull.dem.n_bonds_intact(), 0);
  EXPECT_EQ(pull.dem.n_bonds_broken(), 1);
  EXPECT_EQ(pull.force.norm(), 0.);

  // The work that the force has done by the trapezoidal rule when it is lost in the middle of a step: k/2 n (n - 1) u^2 against
  // k/2 (n - 1/2)^2 u^2.
  const double released = s.bond.R_n * s.bond.R_n / (2. * s.bond.k_n);
  const Energies energies = pull.dem.energies();
  EXPECT_NEAR(energies.released, released, 0.3 / (last * last) * released);
  EXPECT_EQ(energies.elastic, 0.);

  std::vector<BrokenBond> broken = pull.dem.broken_bonds();
  int here = static_cast<int>(broken.size()), everywhere = 0;
  MPI_Allreduce(&here, &everywhere, 1, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
  EXPECT_EQ(everywhere, 1);
  for (const BrokenBond &b : broken)
  {
    EXPECT_EQ(b.step, last);
    EXPECT_EQ(b.first, 0);
    EXPECT_EQ(b.second, 1);
    EXPECT_FALSE(b.shear);
    EXPECT_NEAR((b.position - Eigen::Vector3d(0.5 * d0, 0., 0.)).norm(), 0., 1e-3 * d0);
  }
  for (const double damage : pull.dem.damage())
    EXPECT_EQ(damage, 1.);
}

TEST(DemPair, WeightDoesNotChangeTheStrength)
{
  const Packing packing = two_particles(0.5e-3, 0.5e-3, d0);
  Settings s = settings(packing);
  s.bond.R_n = 1e-3 * d0 * s.bond.k_n;
  const double u = s.bond.R_n / s.bond.k_n / 99.5;
  Driven pull(s, moving(packing, Eigen::Vector3d::UnitX() * u / s.time_step));
  pull.dem.set_weights(Eigen::Vector2d(0.2, 0.4));
  pull.dem.setup(pull.hook());
  pull.advance(99);
  EXPECT_EQ(pull.dem.n_bonds_broken(), 0);
  EXPECT_NEAR(pull.force(0, 0), 0.3 * 99. * u * s.bond.k_n, 1e-9 * s.bond.R_n); // the contact's weight is the mean
  pull.advance(1);
  EXPECT_EQ(pull.dem.n_bonds_broken(), 1);
  // What the driven particles have put in by the trapezoidal rule, the 100th step with the force at its beginning only.
  EXPECT_NEAR(pull.dem.energies().released, 0.3 * 0.5 * s.bond.k_n * 100. * 99. * u * u, 1e-9 * s.bond.R_n * d0);
}

TEST(DemPair, BreaksInShearAtTheStrength)
{
  const Packing packing = two_particles(0.5e-3, 0.5e-3, d0);
  Settings s = settings(packing);
  s.bond.R_t = 1e-4 * d0 * s.bond.k_t;
  s.bond.friction = 0.;
  const int last = 1000;
  // The pair turns by 1e-4 on the way, which makes 1e-8 of shear: less than the half step kept free.
  const double u = s.bond.R_t / s.bond.k_t / (last - 0.5);
  Driven shear(s, moving(packing, Eigen::Vector3d::UnitY() * u / s.time_step));
  shear.advance(last - 1);
  EXPECT_EQ(shear.dem.n_bonds_broken(), 0);
  shear.advance(1);
  EXPECT_EQ(shear.dem.n_bonds_broken(), 1);
  for (const BrokenBond &b : shear.dem.broken_bonds())
    EXPECT_TRUE(b.shear);
  const double released = s.bond.R_t * s.bond.R_t / (2. * s.bond.k_t);
  EXPECT_NEAR(shear.dem.energies().released, released, 1e-6 * released); // as in tension
}

TEST(DemPair, CompressionNeverBreaks)
{
  const Packing packing = two_particles(0.5e-3, 0.5e-3, d0);
  Settings s = settings(packing);
  s.bond.R_n = s.bond.R_t = 1e-4 * d0 * s.bond.k_n;
  Driven push(s, moving(packing, -Eigen::Vector3d::UnitX() * 1e-3 * d0 / s.time_step));
  push.advance(100);
  EXPECT_EQ(push.dem.n_bonds_intact(), 1);
  EXPECT_NEAR(push.force(0, 0), -0.1 * d0 * s.bond.k_n, 1e-10 * d0 * s.bond.k_n); // 1000 times the strength
}

TEST(DemPair, CompressedBondWithInternalFrictionShearsLater)
{
  // Pressed by F_c = 10 R_t, then sheared in steps of 1/1000 of the strength R_t + mu_b F_c = 9 R_t.
  for (const int dim : {2, 3})
  {
    const Packing packing = two_particles(0.5e-3, 0.5e-3, d0, dim);
    Settings s = settings(packing);
    s.bond.R_t = 1e-6 * d0 * s.bond.k_n;
    s.bond.shear_friction = 0.8;
    const double press = 10. * s.bond.R_t / s.bond.k_n;
    const int last = 1000; // the half step in u keeps round-off and the turn of the pair (3.6e-5, squared) from deciding
    const double u = 9. * s.bond.R_t / s.bond.k_t / (last - 0.5);
    const Eigen::Matrix3Xd x = packing.positions;
    const auto path = [&](int particle, double t)
    { return Eigen::Vector3d(x.col(particle) + particle * Eigen::Vector3d(-press, u * t / s.time_step, 0.)); };
    Driven shear(s, path);
    shear.advance(last - 1);
    EXPECT_EQ(shear.dem.n_bonds_broken(), 0);
    EXPECT_NEAR(shear.force(1, 0), 9. * s.bond.R_t, 2e-3 * 9. * s.bond.R_t);
    shear.advance(1);
    EXPECT_EQ(shear.dem.n_bonds_broken(), 1);
    for (const BrokenBond &b : shear.dem.broken_bonds())
      EXPECT_TRUE(b.shear);
  }
}

TEST(DemPair, RigidRotationGivesNoLoad)
{
  for (const int dim : {2, 3})
  {
    const Packing packing = two_particles(0.3e-3, 0.7e-3, d0, dim);
    const Settings s = settings(packing);
    const Eigen::Vector3d axis = dim == 2 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d(0.6, 0.48, 0.64);
    const double angle = 0.01; // a step; 2 rad in the whole
    const Eigen::Matrix3Xd x = packing.positions;
    const auto turning = [&](int particle, double t)
    { return Eigen::Vector3d(Eigen::AngleAxisd(angle * t / s.time_step, axis) * x.col(particle)); };
    Driven turn(s, turning, axis * angle / s.time_step);
    for (int k = 0; k < 20; ++k)
    {
      turn.advance(10);
      EXPECT_LT(turn.force.norm(), 1e-10 * s.bond.k_n * d0);
      EXPECT_LT(turn.torque.norm(), 1e-10 * s.bond.k_n * d0 * d0);
    }
    const Particles p = turn.dem.particles();
    for (int i = 0; i < p.n; ++i)
      EXPECT_NEAR(p.rotation[4 * i], std::cos(1.), 1e-12); // of 2 rad
  }
}

TEST(DemPair, ContactDampingDecaysAsTheOscillator)
{
  const Packing packing = two_particles(0.5e-3, 0.5e-3, d0);
  Settings s = settings(packing);
  s.bond.damping = 0.05;
  const double mass = s.density * M_PI * 0.25e-6;
  const double omega = std::sqrt(s.bond.k_n / (0.5 * mass)), xi = s.bond.damping;
  s.time_step = 0.01 / omega;
  DemSide dem(s);
  auto particles = all_particles(packing);
  const double v = 1e-6 * d0 * omega;
  particles[0].velocity[0] = -0.5 * v;
  particles[1].velocity[0] = 0.5 * v;
  start(dem, packing, particles);
  const int steps = 1500; // 2.4 periods
  dem.advance(steps, {});
  const double t = steps * s.time_step, damped = omega * std::sqrt(1. - xi * xi);
  const double elongation = v / damped * std::exp(-xi * omega * t) * std::sin(damped * t);
  const Eigen::Matrix3Xd x = gather(dem, packing, Quantity::position);
  // Damping with the velocity of half a step before acts like a mass changed by xi omega dt, a phase of half that times omega
  // t.
  EXPECT_NEAR(x(0, 1) - x(0, 0) - d0, elongation, 0.5 * xi * omega * s.time_step * omega * t * v / omega);
  const Energies e = dem.energies();
  const double begin = 2. * 0.5 * mass * 0.25 * v * v;
  EXPECT_GT(e.damping, 0.5 * begin);
  EXPECT_NEAR(e.kinetic + e.elastic + e.damping, begin, 1e-3 * begin); // first half step of damping: xi omega dt = 5e-4
}
