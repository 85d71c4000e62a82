// SPDX-License-Identifier: GPL-2.0-or-later
// Two particles through the particle engine.
#include "tests/unit/dem_test_packings.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

using namespace kerf::dem;
using namespace kerf::dem::test;

namespace
{
constexpr double d0 = 1e-3;

/// Both particles follow given paths; the loads that the engine computed are kept.
struct Driven
{
  using Path = std::function<Eigen::Vector3d(int particle, double time)>;

  Driven(const Settings &settings, Path path, const Eigen::Vector3d &spin = Eigen::Vector3d::Zero())
    : dt(settings.time_step), path(path), spin(spin), dem(settings)
  {
    auto particles = all_particles(*settings.packing);
    for (NewParticle &p : particles)
    {
      p.displacement = path(p.index, 0.) - settings.packing->positions.col(p.index);
      p.velocity = (path(p.index, dt) - path(p.index, 0.)) / dt;
      p.angular_velocity = spin;
    }
    start(dem, *settings.packing, particles, hook());
  }
  void advance(int steps) { dem.advance(steps, hook()); }
  ForceHook hook()
  {
    return [this](Phase phase, Particles &p)
    {
      if (phase == Phase::step)
        ++n;
      force.setZero();
      torque.setZero();
      for (int i = 0; i < p.n; ++i)
      {
        force.col(p.index[i]) = p.force.col(i);
        torque.col(p.index[i]) = p.torque.col(i);
        p.force.col(i).setZero();
        p.torque.col(i).setZero();
        p.velocity.col(i) = (path(p.index[i], (n + 1) * dt) - p.position.col(i)) / dt;
        p.angular_velocity.col(i) = spin;
      }
      MPI_Allreduce(MPI_IN_PLACE, force.data(), 6, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
      MPI_Allreduce(MPI_IN_PLACE, torque.data(), 6, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    };
  }

  double dt;
  Path path;
  Eigen::Vector3d spin;
  int n = 0;
  Eigen::Matrix<double, 3, 2> force, torque; ///< by particle
  DemSide dem;
};

/// The first particle rests, the second one moves with this velocity.
Driven::Path moving(const Packing &packing, const Eigen::Vector3d &velocity)
{
  const Eigen::Matrix3Xd x = packing.positions;
  return [x, velocity](int particle, double t) { return Eigen::Vector3d(x.col(particle) + particle * t * velocity); };
}
} // namespace

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

  // One step beyond the strength: 1 / last in the displacement, twice that in the energy.
  const double released = s.bond.R_n * s.bond.R_n / (2. * s.bond.k_n);
  const Energies energies = pull.dem.energies();
  EXPECT_NEAR(energies.released, released, 2. / last * released);
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
  const double length = 100. * u; // at failure
  EXPECT_NEAR(pull.dem.energies().released, 0.3 * 0.5 * s.bond.k_n * length * length, 1e-9 * s.bond.R_n * d0);
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
  EXPECT_NEAR(shear.dem.energies().released, released, 2. / last * released);
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
