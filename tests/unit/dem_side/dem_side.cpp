// SPDX-License-Identifier: GPL-2.0-or-later
// What the interface promises beyond the law: hook, motion, energies, particles that leave, no particles at all.
#include "tests/support/dem_test_packings.h"

#include <gtest/gtest.h>
#include <set>

using namespace kerf::dem;
using namespace kerf::dem::test;

namespace
{
double sum_over_ranks(double of_rank)
{
  MPI_Allreduce(MPI_IN_PLACE, &of_rank, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  return of_rank;
}
} // namespace

TEST(DemSide, WithoutParticlesOnlyTheHookIsCalled)
{
  const Packing packing = triangular_lattice(4, 4, 5e-4);
  DemSide dem(settings(packing));
  int calls = 0, setups = 0;
  const ForceHook hook = [&](Phase phase, Particles &p)
  {
    EXPECT_EQ(p.n, 0);
    EXPECT_EQ(p.position.cols(), 0);
    (phase == Phase::step ? calls : setups) += 1;
  };
  dem.setup(hook);
  dem.advance(7, hook);
  EXPECT_EQ(setups, 1);
  EXPECT_EQ(calls, 7);
  EXPECT_EQ(dem.n_active(), 0);
  EXPECT_EQ(dem.n_bonds_intact(), 0);
  EXPECT_EQ(dem.n_bonds_broken(), 0);
  EXPECT_TRUE(dem.bonds().empty());
  EXPECT_EQ(dem.energies().kinetic, 0.);

  start(dem, packing, all_particles(packing)); // it may begin later
  dem.advance(3, {});
  EXPECT_EQ(dem.n_bonds_intact(), static_cast<std::int64_t>(packing.bonds.size()));
}

TEST(DemSide, HookIsCalledOnceAStep)
{
  const Packing packing = triangular_lattice(4, 4, 5e-4);
  DemSide dem(settings(packing));
  int steps = 0, setups = 0;
  const ForceHook hook = [&](Phase phase, Particles &p)
  {
    (phase == Phase::step ? steps : setups) += 1;
    EXPECT_EQ(sum_over_ranks(p.n), packing.size());
  };
  start(dem, packing, all_particles(packing), hook);
  dem.advance(5, hook);
  dem.advance(6, hook);
  EXPECT_EQ(setups, 1);
  EXPECT_EQ(steps, 11);
}

TEST(DemSide, OuterForcesMoveFreeDiscsAndSpheres)
{
  for (const int dim : {2, 3})
  {
    Packing packing = two_particles(0.4e-3, 0.6e-3, 3e-3, dim);
    packing.bonds.clear();
    const Settings s = settings(packing);
    DemSide dem(s);
    const double force = 3., torque = 2e-4;
    const ForceHook push = [&](Phase, Particles &p)
    {
      for (int i = 0; i < p.n; ++i)
      {
        p.force(1, i) += force;
        p.torque(2, i) += torque;
      }
    };
    start(dem, packing, all_particles(packing), push);
    const int steps = 50;
    dem.advance(steps, push);
    const double t = steps * s.time_step;
    const Eigen::Matrix3Xd x = gather(dem, packing, Quantity::position), v = gather(dem, packing, Quantity::velocity),
                           w = gather(dem, packing, Quantity::angular_velocity);
    const double density = s.density;
    for (int i = 0; i < 2; ++i)
    {
      const double r = packing.radii[i];
      const double mass = density * (dim == 2 ? M_PI * r * r : 4. / 3. * M_PI * r * r * r);
      const double inertia = (dim == 2 ? 0.5 : 0.4) * mass * r * r; // cylinder per thickness, sphere
      // Constant acceleration is exact in Verlet.
      EXPECT_NEAR(v(1, i), force / mass * t, 1e-12 * force / mass * t);
      EXPECT_NEAR(x(1, i), 0.5 * force / mass * t * t, 1e-12 * force / mass * t * t);
      EXPECT_NEAR(w(2, i), torque / inertia * t, 1e-12 * torque / inertia * t);
    }
    // The angle is exact, too: w^{n+1/2} dt summed up.
    const Particles p = dem.particles();
    for (int i = 0; i < p.n; ++i)
    {
      const double inertia = (dim == 2 ? 0.5 : 0.4) * p.mass[i] * p.radius[i] * p.radius[i];
      const double half_angle = 0.25 * torque / inertia * t * t;
      EXPECT_NEAR(p.rotation[4 * i], std::cos(half_angle), 1e-12);
      EXPECT_NEAR(p.rotation[4 * i + 3], std::sin(half_angle), 1e-12);
    }
    const Energies e = dem.energies();
    const double work = force * (x(1, 0) + x(1, 1));
    double spin_energy = 0.;
    for (int i = 0; i < 2; ++i)
      spin_energy += 0.5 * torque * w(2, i) * t; // T times angle
    EXPECT_NEAR(e.kinetic, work + spin_energy, 1e-12 * work);
  }
}

TEST(DemSide, LocalDampingStiffensWhatTurnsBackInEveryStep)
{
  // x_n = +-A: the velocity of the half step before has the sign of x_n, so F = -k (1 + a) x, and Verlet's limit is
  // omega^2 dt^2 (1 + a) = 4 although a body that moves slowly is only damped.
  Packing packing = two_particles(0.5e-3, 0.5e-3, 3e-3);
  packing.bonds.clear();
  Settings s = settings(packing);
  s.local_damping = 0.6;
  const double mass = s.density * M_PI * 0.25e-6;
  const auto amplitude = [&](double share_of_limit)
  {
    const double k = share_of_limit * share_of_limit * 4. * mass / ((1. + s.local_damping) * s.time_step * s.time_step);
    DemSide dem(s);
    const double y0 = packing.positions(1, 0), start_velocity = 1e-6;
    const ForceHook spring = [&](Phase, Particles &p) { p.force.row(1).array() -= k * (p.position.row(1).array() - y0); };
    auto particles = all_particles(packing);
    for (NewParticle &p : particles)
      p.velocity[1] = start_velocity;
    start(dem, packing, particles, spring);
    double largest = 0.;
    for (int step = 0; step < 45; ++step)
    {
      dem.advance(1, spring);
      if (step >= 40)
        largest = std::max(largest, std::abs(gather(dem, packing, Quantity::position)(1, 0) - y0));
    }
    return largest / (start_velocity * s.time_step);
  };
  EXPECT_LT(amplitude(0.98), 0.5); // decays
  EXPECT_GT(amplitude(1.02), 1e3); // q = 4 1.02^2: grows by 1.5 a step
}

TEST(DemSide, LocalDampingTakesItsShare)
{
  // A constant force on a free disc at rest: F - a |F| v/|v| = (1 - a) F as soon as it moves.
  Packing packing = two_particles(0.5e-3, 0.5e-3, 3e-3);
  packing.bonds.clear();
  Settings s = settings(packing);
  s.local_damping = 0.3;
  DemSide dem(s);
  const double force = 3.;
  const ForceHook push = [&](Phase, Particles &p) { p.force.row(1).array() += force; };
  auto particles = all_particles(packing);
  const double v0 = 1e-3;
  for (NewParticle &p : particles)
    p.velocity[1] = v0;
  start(dem, packing, particles, push);
  const int steps = 100;
  dem.advance(steps, push);
  const double mass = s.density * M_PI * 0.25e-6, t = steps * s.time_step;
  const double a = (1. - s.local_damping) * force / mass;
  const Eigen::Matrix3Xd v = gather(dem, packing, Quantity::velocity), x = gather(dem, packing, Quantity::position);
  EXPECT_NEAR(v(1, 0), v0 + a * t, 1e-12 * a * t);
  // Dissipated: a share of the work. The first half step is set up, not counted: 1/steps^2 of the work, and v0.
  const double work = 2. * force * x(1, 0);
  EXPECT_NEAR(dem.energies().damping, s.local_damping * work, 2e-2 * s.local_damping * work);
}

TEST(DemSide, ParticleThatLeavesIsCountedAndTheRestGoesOn)
{
  Packing packing = triangular_lattice(6, 6, 5e-4);
  // The last particle is alone and flies away.
  packing.bonds.erase(std::remove_if(packing.bonds.begin(), packing.bonds.end(), [](const auto &b) { return b[1] == 35; }),
                      packing.bonds.end());
  Settings s = settings(packing);
  DemSide dem(s);
  auto particles = all_particles(packing);
  const double room = s.domain_upper[0] - packing.positions(0, 35);
  particles[35].velocity[0] = room / (200. * s.time_step);
  start(dem, packing, particles);
  const auto bonds = dem.n_bonds_intact();
  EXPECT_EQ(bonds, static_cast<std::int64_t>(packing.bonds.size()));
  dem.advance(150, {});
  EXPECT_EQ(dem.left_domain().size(), 0u);
  dem.advance(150, {});
  EXPECT_EQ(dem.left_domain().size(), 1u);
  EXPECT_EQ(dem.n_active(), 35);
  EXPECT_FALSE(dem.is_active()[35]);
  EXPECT_TRUE(dem.is_active()[34]);
  dem.setup({});
  dem.advance(50, {});
  EXPECT_EQ(dem.n_bonds_intact(), bonds);
  EXPECT_EQ(sum_over_ranks(dem.particles().n), 35.);
  EXPECT_THROW(dem.insert({particles[35]}), std::logic_error); // taken from the store only once
}

// Particles fall out of the domain row by row. Gravity is the only force from outside. What is left, and what has gone, hold
// its work to round-off: of each step that deletes particles the books have the state at its start. When the particles are a
// block that vibrates, a bond that is cut still does the work of half a step on the end that stays, which the books do not
// have. With 1.3 m/s, bonds at a strain of 0.3 %, and 45 bonds cut this is below 1e-3 of the energy.
TEST(DemSide, LeaversTakeTheirEnergyAlong)
{
  for (const bool bonded : {false, true})
  {
    Packing packing = triangular_lattice(8, 6, 5e-4);
    if (!bonded)
      packing.bonds.clear();
    Settings s = settings(packing);
    DemSide dem(s);
    auto particles = all_particles(packing);
    const double fall = (packing.positions.row(1).maxCoeff() - s.domain_lower[1]) / (900. * s.time_step);
    for (NewParticle &p : particles)
    {
      const double x = packing.positions(0, p.index), y = packing.positions(1, p.index);
      p.velocity = {0.02 * bonded * fall * std::sin(3e3 * y), -fall * (1. + 0.03 * bonded * std::sin(5e3 * x)), 0.};
      p.angular_velocity[2] = 40. * std::cos(4e3 * x);
    }
    const double g = 0.2 * fall / (900. * s.time_step);
    double work = 0.;
    const ForceHook gravity = [&](Phase phase, Particles &all)
    {
      for (int i = 0; i < all.n; ++i)
      {
        all.force(1, i) -= all.mass[i] * g;
        if (phase == Phase::step) // half of the force before, half of this one, over the same way
          work -= s.time_step * all.mass[i] * g * all.velocity(1, i);
      }
    };
    start(dem, packing, particles, gravity);
    const auto held = [](const Energies &e)
    { return e.kinetic + e.finite_step + e.elastic + e.damping + e.friction + e.released; };
    const double initial = held(dem.energies());
    double worst = 0.;
    for (int k = 0; k < 100; ++k)
    {
      dem.advance(11, gravity);
      const Energies now = dem.energies();
      worst = std::max(worst, std::abs(held(now) + now.left - initial - sum_over_ranks(work)));
    }
    EXPECT_EQ(dem.n_active(), 0);
    EXPECT_GT(dem.energies().left, 0.9 * initial);
    EXPECT_LT(worst, (bonded ? 1e-3 : 1e-12) * initial);
  }
}

// Two loose particles overlap by 1 %. Their weight grows from 0.1 to 0.8: force k w o, energy k w o^2/2. With the force kept
// the overlap counts for an eighth, and so does the energy.
TEST(DemSide, ContactsKeepTheirForceWhenWeightsGrow)
{
  for (const bool kept : {false, true})
  {
    Packing packing = two_particles(0.5e-3, 0.5e-3, 1e-3);
    packing.bonds.clear();
    Settings s = settings(packing);
    DemSide dem(s);
    auto particles = all_particles(packing);
    const double overlap = 1e-5;
    particles[1].displacement = -overlap * packing.branch(0, 1).normalized();
    dem.insert(particles);
    dem.set_weights(Eigen::VectorXd::Constant(2, 0.1));
    dem.setup({});
    const double force = 0.1 * s.bond.k_n * overlap, energy = 0.5 * force * overlap;
    EXPECT_NEAR(dem.energies().elastic, energy, 1e-10 * energy);

    const Eigen::VectorXd heavier = Eigen::VectorXd::Constant(2, 0.8);
    if (kept)
      dem.prepare_weights(heavier);
    dem.set_weights(heavier);
    dem.setup({});
    const double growth = kept ? 1. : 8.;
    EXPECT_NEAR(dem.energies().elastic, (kept ? 1. / 8. : 8.) * energy, 1e-8 * energy);
    const Particles now = dem.particles();
    for (int i = 0; i < now.n; ++i)
      EXPECT_NEAR(now.force.col(i).norm(), growth * force, 1e-8 * force);
  }
}

// Two particles have rolled on each other by theta and -theta: no shear, and no energy, since the contact point is in the
// middle. A weight of one half of the first moves it by a sixth of the distance: the shear becomes d theta/3. The bond breaks
// when that is more than it can bear, and is left alone below.
TEST(DemSide, BondsThatRolledBreakBeforeWeightsChange)
{
  const double r = 0.5e-3, most = 1e-6;
  for (const double share : {0.8, 1.25})
  {
    Packing packing = two_particles(r, r, 2. * r);
    Settings s = settings(packing);
    s.bond.R_n = s.bond.R_t = most * s.bond.k_t;
    DemSide dem(s);
    auto particles = all_particles(packing);
    const double theta = share * 3. * most / (2. * r);
    particles[0].rotation[2] = theta;
    particles[1].rotation[2] = -theta;
    start(dem, packing, particles);
    const double failure = 0.5 * s.bond.k_t * most * most;
    EXPECT_LT(dem.energies().elastic, 1e-3 * failure);
    const Eigen::Vector2d lighter(0.5, 1.);
    dem.prepare_weights(lighter);
    dem.set_weights(lighter);
    dem.setup({});
    const bool breaks = share > 1.;
    EXPECT_EQ(dem.n_bonds_broken(), breaks ? 1 : 0);
    EXPECT_EQ(dem.n_bonds_intact(), breaks ? 0 : 1);
    if (breaks)
      EXPECT_LT(dem.energies().elastic, 1e-3 * failure);
    else // weight 3/4, and 1/4 (1/3)^2 3/4 of rolling resistance (4.10) over twice the angle
      EXPECT_GT(dem.energies().elastic, 0.4 * failure);
  }
}

TEST(DemSide, AllParticlesMayLeave)
{
  Packing packing = two_particles(0.5e-3, 0.5e-3, 1e-3);
  Settings s = settings(packing);
  DemSide dem(s);
  auto particles = all_particles(packing);
  for (NewParticle &p : particles)
    p.velocity[1] = 5e-3 / (200. * s.time_step);
  start(dem, packing, particles);
  int calls = 0;
  const ForceHook count = [&](Phase, Particles &) { ++calls; };
  dem.advance(300, count);
  EXPECT_EQ(dem.n_active(), 0);
  EXPECT_EQ(dem.left_domain().size(), 2u);
  EXPECT_EQ(dem.n_bonds_intact(), 0);
  dem.setup(count);
  dem.advance(10, count);
  EXPECT_EQ(calls, 311);
}

TEST(DemSide, OrderChangesWithTheArrays)
{
  const Packing packing = triangular_lattice(6, 6, 5e-4);
  DemSide dem(settings(packing));
  std::vector<NewParticle> first, second;
  for (const NewParticle &p : all_particles(packing))
    (p.index < 18 ? first : second).push_back(p);
  std::set<std::uint64_t> orders;
  std::vector<int> indices;
  bool changed = false;
  const ForceHook monitor = [&](Phase, Particles &p)
  {
    const bool known = !orders.insert(p.order).second;
    const std::vector<int> now(p.index, p.index + p.n);
    if (known && now != indices)
      changed = true;
    indices = now;
  };
  start(dem, packing, first, monitor);
  dem.advance(20, monitor);
  EXPECT_EQ(orders.size(), 1u); // a quiet run does not touch the order
  start(dem, packing, second, monitor);
  EXPECT_EQ(orders.size(), 2u);
  EXPECT_FALSE(changed);
}

TEST(DemSide, BondsReportForcesAndEnds)
{
  const Packing packing = triangular_lattice(5, 5, 5e-4);
  const Settings s = settings(packing);
  DemSide dem(s);
  auto particles = all_particles(packing);
  const double strain = 1e-4;
  for (NewParticle &p : particles)
    p.displacement = Eigen::Vector3d(strain * packing.positions(0, p.index), 0., 0.);
  start(dem, packing, particles);
  const std::vector<ActiveBond> bonds = dem.bonds();
  EXPECT_EQ(sum_over_ranks(static_cast<double>(bonds.size())), static_cast<double>(packing.bonds.size()));
  const double d = 1e-3;
  for (const ActiveBond &b : bonds)
  {
    EXPECT_LT(b.first, b.second);
    const Eigen::Vector3d stored = packing.positions.col(b.second) - packing.positions.col(b.first);
    const double cosine = stored.x() / d, sine = stored.y() / d;
    EXPECT_NEAR((b.b - b.a - stored - Eigen::Vector3d(strain * stored.x(), 0., 0.)).norm(), 0., 1e-15);
    // Small strain: second order terms are 1e-4 of the first.
    EXPECT_NEAR(b.normal_force, s.bond.k_n * strain * d * cosine * cosine, 3e-4 * s.bond.k_n * strain * d);
    EXPECT_NEAR(b.shear_force, std::abs(s.bond.k_t * strain * d * cosine * sine), 3e-4 * s.bond.k_n * strain * d);
  }
}

TEST(DemSide, RejectsSettingsThatMakeNoSense)
{
  const Packing packing = triangular_lattice(4, 4, 5e-4);
  const auto rejects = [&](const std::function<void(Settings &)> &spoil)
  {
    Settings s = settings(packing);
    spoil(s);
    EXPECT_THROW(DemSide dem(s), std::invalid_argument);
  };
  rejects([](Settings &s) { s.packing = nullptr; });
  rejects([](Settings &s) { s.bond.k_n = 0.; });
  rejects([](Settings &s) { s.bond.k_t = -1.; });
  rejects([](Settings &s) { s.bond.R_n = std::nan(""); });
  rejects([](Settings &s) { s.density = -2700.; });
  rejects([](Settings &s) { s.time_step = 0.; });
  rejects([](Settings &s) { s.local_damping = 1.; });
  rejects([](Settings &s) { s.domain_upper[1] = s.domain_lower[1]; });
}

TEST(DemSide, AdvanceNeedsASetup)
{
  const Packing packing = triangular_lattice(4, 4, 5e-4);
  DemSide dem(settings(packing));
  dem.insert(all_particles(packing));
  EXPECT_THROW(dem.advance(1, {}), std::logic_error);
  EXPECT_THROW(dem.energies(), std::logic_error);
  dem.setup({});
  EXPECT_NO_THROW(dem.advance(1, {}));
}

TEST(DemSide, NamesTheLibrary)
{
  EXPECT_EQ(library_version(), "LIGGGHTS 3.8.0");
}
