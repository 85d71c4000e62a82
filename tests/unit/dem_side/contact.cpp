// SPDX-License-Identifier: GPL-2.0-or-later
// Two particles without a bond through the particle engine.
#include "tests/support/dem_driven_pair.h"

#include <gtest/gtest.h>

using namespace kerf::dem;
using namespace kerf::dem::test;

TEST(DemPair, BrokenPairIsUnilateral)
{
  // Stored overlap 2 %: the broken pair touches at the stored distance, not at the sum of the radii.
  const Packing packing = two_particles(0.51e-3, 0.51e-3, d0);
  Settings s = settings(packing);
  s.bond.R_n = 1e-3 * d0 * s.bond.k_n;
  const double v = 1e-4 * d0 / s.time_step;
  const Eigen::Matrix3Xd x = packing.positions;
  const double turn_back = 100 * s.time_step; // out to 1 %, then in
  const auto path = [=](int particle, double t) {
    return Eigen::Vector3d(x.col(particle) + particle * v * (turn_back - std::abs(t - turn_back)) * Eigen::Vector3d::UnitX());
  };
  Driven pair(s, path);
  pair.advance(100);
  EXPECT_EQ(pair.dem.n_bonds_broken(), 1);
  EXPECT_EQ(pair.force.norm(), 0.); // overlapping surfaces, but less than as stored
  pair.advance(99);
  EXPECT_EQ(pair.force.norm(), 0.);
  pair.advance(11); // 10 steps beyond the stored distance
  EXPECT_NEAR(pair.force(0, 0), -s.bond.k_n * 1e-3 * d0, 1e-9 * s.bond.k_n * d0);
  EXPECT_NEAR(pair.dem.energies().elastic, 0.5 * s.bond.k_n * 1e-6 * d0 * d0, 1e-9 * s.bond.k_n * d0 * d0);
}

TEST(DemPair, NeverBondedPairPushesOnly)
{
  Packing packing = two_particles(0.5e-3, 0.5e-3, d0);
  packing.bonds.clear();
  const Settings s = settings(packing);
  const double v = 1e-4 * d0 / s.time_step;
  const Eigen::Matrix3Xd x = packing.positions;
  const auto path = [=](int particle, double t) { // starts 0.5 % apart
    return Eigen::Vector3d(x.col(particle) + particle * (5e-3 * d0 - v * t) * Eigen::Vector3d::UnitX());
  };
  Driven pair(s, path);
  EXPECT_EQ(pair.dem.n_bonds_intact(), 0);
  pair.advance(49);
  EXPECT_EQ(pair.force.norm(), 0.);
  pair.advance(51);
  EXPECT_NEAR(pair.force(0, 0), -s.bond.k_n * 5e-3 * d0, 1e-9 * s.bond.k_n * d0);
}

TEST(DemPair, FarPairIsMetInTheStepInWhichItTouches)
{
  // Starts 20 % of d apart: farther than pairs that are looked at in every step. Slow, and several per cent a step.
  for (const double speed : {1e-3, 3e-2})
  {
    Packing packing = two_particles(0.5e-3, 0.5e-3, d0);
    packing.bonds.clear();
    const Settings s = settings(packing);
    const double v = speed * d0 / s.time_step, gap = 0.2 * d0;
    const Eigen::Matrix3Xd x = packing.positions;
    const auto path = [=](int particle, double t)
    { return Eigen::Vector3d(x.col(particle) + particle * (gap - v * t) * Eigen::Vector3d::UnitX()); };
    Driven pair(s, path);
    const int touching = static_cast<int>(std::floor(gap / (speed * d0))) + 1; // a thousandth of a step is between the two
    pair.advance(touching - 2);
    EXPECT_EQ(pair.force.norm(), 0.);
    pair.advance(2);
    const double overlap = touching * speed * d0 - gap;
    ASSERT_GT(overlap, 0.);
    EXPECT_NEAR(pair.force(0, 0), -s.bond.k_n * overlap, 1e-9 * s.bond.k_n * d0);
  }
}

TEST(DemPair, PairOpensAndClosesAgain)
{
  // In and out three times, 10 % apart in between: nothing is left of the contact while it is open.
  Packing packing = two_particles(0.5e-3, 0.5e-3, d0);
  packing.bonds.clear();
  const Settings s = settings(packing);
  const double period = 200 * s.time_step;
  const Eigen::Matrix3Xd x = packing.positions;
  const auto gap = [=](double t) { return d0 * (0.04 + 0.06 * std::cos(2. * M_PI * t / period)); }; // 10 % to -2 %
  const auto path = [=](int particle, double t)
  { return Eigen::Vector3d(x.col(particle) + particle * gap(t) * Eigen::Vector3d::UnitX()); };
  Driven pair(s, path);
  for (int step = 1; step <= 600; ++step)
  {
    pair.advance(1);
    const double overlap = std::max(0., -gap(step * s.time_step));
    EXPECT_NEAR(pair.force(0, 0), -s.bond.k_n * overlap, 1e-9 * s.bond.k_n * d0);
    EXPECT_NEAR(pair.dem.energies().elastic, 0.5 * s.bond.k_n * overlap * overlap, 1e-9 * s.bond.k_n * d0 * d0);
  }
  EXPECT_EQ(pair.dem.energies().friction, 0.);
}

TEST(DemPair, FrictionObeysCoulomb)
{
  // Pressed by 1 %, then dragged along y beyond the sticking range (mu k_n 1 % / k_t = 2 % of d).
  Packing packing = two_particles(0.5e-3, 0.5e-3, d0);
  packing.bonds.clear();
  Settings s = settings(packing);
  s.bond.friction = 0.5;
  const double press = 1e-2 * d0, v = 1e-4 * d0 / s.time_step;
  const Eigen::Matrix3Xd x = packing.positions;
  const auto path = [=](int particle, double t)
  { return Eigen::Vector3d(x.col(particle) + particle * Eigen::Vector3d(-press, v * t, 0.)); };
  Driven pair(s, path);
  const double limit = s.bond.friction * s.bond.k_n * press;

  pair.advance(20); // 0.2 % of d, a tenth of the sticking range
  const auto tangential = [&](double y)
  {
    const Eigen::Vector2d t = Eigen::Vector2d(-y, d0 - press).normalized();
    return pair.force.col(0).head<2>().dot(t);
  };
  // The normal turns by 0.2 %: relative errors of that order.
  EXPECT_NEAR(tangential(20e-4 * d0), s.bond.k_t * 20e-4 * d0, 3e-3 * s.bond.k_t * 20e-4 * d0);
  EXPECT_EQ(pair.dem.energies().friction, 0.);

  const double before = pair.dem.energies().friction;
  for (int k = 0; k < 48; ++k)
  {
    pair.advance(10);
    const double y = pair.n * 1e-4 * d0;
    const Eigen::Vector2d between(d0 - press, y);
    const double push = s.bond.k_n * (d0 - between.norm());
    EXPECT_LE(tangential(y), std::max(0., s.bond.friction * push) * (1. + 1e-12));
    if (pair.n > 250 && push > 0.)
    {
      EXPECT_NEAR(tangential(y), s.bond.friction * push, 1e-9 * limit);
    }
  }
  EXPECT_GT(pair.dem.energies().friction, before);
}

TEST(DemPair, FrictionWorkIsLimitTimesSlip)
{
  // The second disc spins in place against the first: the contact slips by its radius times the angle, nothing else moves.
  Packing packing = two_particles(0.5e-3, 0.5e-3, d0);
  packing.bonds.clear();
  Settings s = settings(packing);
  const double press = 1e-3 * d0, angle = 1e-4; // angle a step
  DemSide dem(s);
  auto particles = all_particles(packing);
  particles[1].displacement = Eigen::Vector3d(-press, 0., 0.);
  const Eigen::Vector3d spin(0., 0., angle / s.time_step);
  const ForceHook hold = [&](Phase, Particles &p)
  {
    for (int i = 0; i < p.n; ++i)
    {
      p.velocity.col(i).setZero();
      p.force.col(i).setZero();
      p.torque.col(i).setZero();
      p.angular_velocity.col(i) = p.index[i] * spin;
    }
  };
  particles[1].angular_velocity = spin;
  start(dem, packing, particles, hold);
  const int steps = 1000;
  dem.advance(steps, hold);
  const double limit = s.bond.friction * s.bond.k_n * press;
  const double stick = limit / s.bond.k_t;
  const double branch = 0.5 * (d0 - press);
  // The step in which it begins to slide: half the stiffness times the step squared.
  const double one_step = 0.5 * s.bond.k_t * angle * angle * branch * branch;
  EXPECT_NEAR(dem.energies().friction, limit * (steps * angle * branch - stick), one_step);
  EXPECT_NEAR(dem.energies().elastic, 0.5 * (s.bond.k_n * press * press + limit * stick), 1e-9 * limit * d0);
}

TEST(DemPair, DampingDoesNotPullAnOpenContact)
{
  Packing packing = two_particles(0.5e-3, 0.5e-3, d0);
  packing.bonds.clear();
  Settings s = settings(packing);
  s.bond.damping = 1.;
  const double v = 1e-5 * d0 / s.time_step;
  const Eigen::Matrix3Xd x = packing.positions;
  const auto path = [=](int particle, double t) { // starts pressed by 0.1 %, opens
    return Eigen::Vector3d(x.col(particle) + particle * (v * t - 1e-3 * d0) * Eigen::Vector3d::UnitX());
  };
  Driven pair(s, path);
  for (int k = 0; k < 100; ++k)
  {
    pair.advance(1);
    EXPECT_LE(pair.force(0, 0), 0.); // never towards the other one
  }
}
