// SPDX-License-Identifier: GPL-2.0-or-later
// The coupled body as a whole: a triangular lattice in a block of finite elements with the lattice's own moduli.
#include "dem_side/bond_network/bond_network.h"
#include "tests/support/coupled_body.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

using namespace kerf;
using Eigen::Vector3d;
using test::Body;

namespace
{
constexpr double d = 1e-3; // particle spacing [m]

Case make_case(fem::BoundaryKind boundary)
{
  Case settings = test::lattice_rock(d);
  settings.mesh.lower = Vector3d::Zero();
  settings.mesh.upper = Vector3d(80. * d, 40. * d, 0.);
  settings.mesh.cell_size = 4. * d;
  for (int id = 0; id < 4; ++id)
  {
    fem::BoundaryCondition condition;
    condition.id = id;
    condition.kind = boundary;
    settings.boundary_conditions.push_back(condition);
  }
  settings.packing.lower = settings.mesh.lower;
  settings.packing.upper = settings.mesh.upper;
  settings.overlap.width = 16. * d;
  // Particles in the middle: the overlap is all around them and touches top and bottom.
  settings.fixed_region.push_back({Vector3d(30. * d, -d, -1.), Vector3d(50. * d, 41. * d, 1.)});
  return settings;
}

/// Linear momentum (x, y) and angular momentum of both sides.
Vector3d momenta(Body &body)
{
  const ConservedQuantities inventory =
    conserved_quantities(*body.fem, body.model.dem(), body.model.energies(), MPI_COMM_WORLD);
  return {inventory.momentum[0], inventory.momentum[1], inventory.angular_momentum[2]};
}

const auto zero = [](const Vector3d &) { return Vector3d(Vector3d::Zero()); };
} // namespace

// A translating body has nothing to exchange: no force, no energy but the kinetic one, whatever the weights. Round-off of
// positions (1e-16 x 0.1 m) gives forces of k_n x 1e-17 m, so velocities of (omega dt)^2/dt x 1e-17 m = 2e-10 m/s in a step; a
// random walk over 500 steps is 1e-9 of the speed, the worst of some thousand particles four times that.
TEST(CoupledBody, RigidTranslation)
{
  Body body(make_case(fem::BoundaryKind::free));
  const Vector3d speed(3., -2., 0.);
  body.set_state(zero, [&](const Vector3d &) { return speed; });
  body.model.start();
  body.model.advance(500);
  EXPECT_GT(body.model.n_overlap_particles(), 500);
  const dem::Particles particles = body.model.dem().particles();
  double worst = 0.;
  for (int i = 0; i < particles.n; ++i)
    worst = std::max(worst, (Vector3d(particles.velocity.col(i)) - speed).norm());
  EXPECT_LT(worst, 1e-8 * speed.norm());
  const EnergyLedger energy = body.model.energies();
  EXPECT_LT(energy.elastic + energy.coupling, 1e-12 * energy.kinetic);
}

// A rotating body stretches by its own inertia only: a slow rotation (rim speed 1e-4 c_p) leaves an elastic energy of order
// (v/c)^2 of the kinetic one, and the mean angular velocity of particles stays that of the body.
TEST(CoupledBody, RigidRotation)
{
  Body body(make_case(fem::BoundaryKind::free));
  const double omega = 10.;
  const Vector3d centre(40. * d, 20. * d, 0.);
  body.set_state(zero,
                 [&](const Vector3d &x) { return Vector3d(-omega * (x[1] - centre[1]), omega * (x[0] - centre[0]), 0.); });
  body.model.start();
  body.model.advance(500);
  const EnergyLedger energy = body.model.energies();
  EXPECT_LT(energy.elastic + energy.coupling, 1e-6 * energy.kinetic);
  const dem::Particles particles = body.model.dem().particles();
  double worst = 0.;
  for (int i = 0; i < particles.n; ++i)
    worst = std::max(worst, std::abs(particles.angular_velocity(2, i) - omega));
  EXPECT_LT(worst, 1e-3 * omega);
}

namespace
{
struct Method
{
  std::string constraint;
  double penalty_ratio, relaxation;
  const char *name;
  bool corrector = false;
};
const Method methods[] = {{"penalty", 0.3, 0., "penalty"},
                          {"penalty_mass_scaled", 0.25, 0., "penalty_mass_scaled"},
                          {"penalty_mass_scaled", 0.25, 0., "corrected_penalty", true},
                          {"multipliers", 0., 0.05, "multipliers"},
                          {"multipliers_diagonal", 0.5, 0., "multipliers_diagonal"}};

/// A smaller free block, particles in the middle.
Case small_block(const Method &method)
{
  Case settings = make_case(fem::BoundaryKind::free);
  settings.packing.upper = settings.mesh.upper = Vector3d(48. * d, 20. * d, 0.);
  settings.overlap.width = 12. * d;
  settings.fixed_region = {{Vector3d(20. * d, -d, -1.), Vector3d(28. * d, 21. * d, 1.)}};
  settings.constraint.method = method.constraint;
  settings.constraint.corrector = method.corrector;
  if (method.corrector) // a lattice has nothing to correct
  {
    settings.packing.kind = "random";
    settings.packing.radius_spread = 0.4;
    settings.packing.seed = 1;
  }
  settings.constraint.penalty_ratio = method.penalty_ratio;
  settings.constraint.fluctuation_relaxation = method.relaxation;
  return settings;
}

/// A vibrating, translating and turning block; the vibration is half of the motion.
void toss(Body &body)
{
  const double length = 48. * d, turn = 20.;
  body.set_state(
    zero, [&](const Vector3d &x)
    { return Vector3d(1. + std::sin(2. * M_PI * x[0] / length), 0.5 * std::cos(M_PI * x[0] / length) + turn * x[0], 0.); });
  body.model.start();
}
} // namespace

class CoupledMethods : public testing::TestWithParam<Method>
{
};
INSTANTIATE_TEST_SUITE_P(All, CoupledMethods, testing::ValuesIn(methods),
                         [](const auto &info) { return std::string(info.param.name); });

// Without outer forces the exchange conserves linear and angular momentum of the sum of both sides, over 10 000 steps, but for
// the round-off of what is tossed about.
TEST_P(CoupledMethods, ConserveMomenta)
{
  Body body(small_block(GetParam()));
  toss(body);
  const Vector3d before = momenta(body);
  body.model.advance(10000);
  const Vector3d after = momenta(body);
  const double mass = 2650. * 48. * 20. * d * d;
  EXPECT_NEAR(after[0], before[0], 1e-10 * mass);
  EXPECT_NEAR(after[1], before[1], 1e-10 * mass);
  EXPECT_NEAR(after[2], before[2], 1e-10 * mass * 48. * d);
  EXPECT_GT(body.model.energies().elastic, 1e-4 * body.model.energies().kinetic); // it did vibrate
}

// The ledger closes for every method, with what the constraint takes counted: the trapezoidal rule is exact for linear forces,
// and strains of 1e-4 leave terms of that size.
TEST_P(CoupledMethods, LedgerCloses)
{
  Body body(small_block(GetParam()));
  toss(body);
  const double before = body.model.energies().held();
  body.model.advance(2000);
  const EnergyLedger energy = body.model.energies();
  EXPECT_LT(std::abs(energy.residual()), 1e-4 * before);
  EXPECT_GE(energy.interface, -1e-6 * before);
}

// Methods that conserve energy keep it over 100 000 steps, about 1000 passages of a wave through the block: no drift beyond 0.1
// %.
TEST_P(CoupledMethods, KeepEnergy)
{
  if (GetParam().constraint == "multipliers_diagonal")
    GTEST_SKIP() << "damps what differs from particle to particle";
  Method method = GetParam();
  method.relaxation = 0.;
  Body body(small_block(method));
  toss(body);
  const double before = body.model.energies().held();
  body.model.advance(100000);
  EXPECT_NEAR(body.model.energies().held(), before, 1e-3 * before);
}

// Both sides share the mass: the sum of weighted masses is that of the rock. The lattice counts whole particles and its weights
// are sampled at centres, which is one particle row of a region of 52 rows: 2 %.
TEST(CoupledBody, MassIsShared)
{
  Body body(make_case(fem::BoundaryKind::free));
  body.model.start();
  ASSERT_EQ(body.model.events().size(), 1u);
  const ActivationEvent &event = body.model.events()[0];
  EXPECT_NEAR(event.before.mass, 2650. * 80. * 40. * d * d, 1e-9 * event.before.mass);
  EXPECT_NEAR(event.after.mass, event.before.mass, 0.02 * event.before.mass);
  EXPECT_GT(event.particles, 1000);
  EXPECT_EQ(event.particles, body.model.dem().n_active());
}

namespace
{
constexpr double patch_strain = 1e-4;

/// Mean strain of the particle core of a body that is held at uniform strain on its outer boundary, averaged over the slight
/// vibration that the coupling's own error sets off.
double core_strain(Body &body)
{
  double mean = 0.;
  constexpr int samples = 200;
  for (int k = 0; k < samples; ++k)
  {
    body.model.advance(10);
    // Least-squares slope of u_x over x, away from the ends of the overlap.
    double sums[2] = {0., 0.};
    const dem::Particles particles = body.model.dem().particles();
    for (int i = 0; i < particles.n; ++i)
    {
      const double x = body.packing.positions(0, particles.index[i]);
      if (x < 32. * d || x > 48. * d)
        continue;
      sums[0] += (x - 40. * d) * (x - 40. * d);
      sums[1] += (x - 40. * d) * (particles.position(0, i) - x);
    }
    MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    mean += sums[1] / sums[0] / samples;
  }
  return mean;
}

double strain_error(double penalty_ratio)
{
  Case settings = make_case(fem::BoundaryKind::fixed);
  settings.constraint.penalty_ratio = penalty_ratio;
  Body body(settings);
  body.set_state([](const Vector3d &x) { return Vector3d(patch_strain * x[0], 0., 0.); }, zero);
  body.model.start();
  EXPECT_LT(body.model.energies().coupling, 1e-20); // chi = 0 at the projected state
  const double elastic = body.model.energies().elastic;
  // The lattice has the energy density of the rock; the block's edges miss half bonds on the held faces.
  const double lame = 40e9 * 0.2 / (1.2 * 0.6), mu = 40e9 / 2.4;
  EXPECT_NEAR(elastic, 0.5 * (lame + 2. * mu) * patch_strain * patch_strain * 80. * 40. * d * d, 0.03 * elastic);
  const double error = core_strain(body) / patch_strain - 1.;
  EXPECT_LT(body.model.energies().kinetic, 0.01 * elastic);
  return error;
}
} // namespace

// Patch test: uniform strain, held at the outer boundary. A penalty is not exact: the weight gradient loads each particle with
// a ghost force k_n d^2 eps/L_o, which shifts it by chi = eps d (d/L_o)(k_n/k_p). The mass-scaled penalty with beta = 0.5 at
// 0.7 of the stable step has k_p of about 0.4 k_n where both sides weigh alike; two overlaps, 36 d apart, then change the
// strain of the core by at most 2 chi/(36 d eps) = 0.9 %. Twice beta must halve it.
TEST(CoupledBody, UniformStrainThroughTheOverlap)
{
  const double soft = std::abs(strain_error(0.5)), stiff = std::abs(strain_error(1.));
  EXPECT_LT(soft, 0.009);
  EXPECT_LT(stiff, 0.65 * soft);
}

namespace
{
/// Peak of kinetic over elastic energy after a body of random packing, uniformly strained and held, is let go.
double released_share(int relaxation_steps)
{
  Case settings = make_case(fem::BoundaryKind::fixed);
  settings.packing.kind = "random";
  settings.packing.radius_spread = 0.3;
  settings.packing.upper = settings.mesh.upper = Vector3d(56. * d, 32. * d, 0.);
  settings.overlap.width = 12. * d;
  settings.fixed_region = {{Vector3d(12. * d, -d, -1.), Vector3d(44. * d, 33. * d, 1.)}};
  settings.activation.relaxation_steps = relaxation_steps;
  const dem::ElasticCalibration bonds =
    dem::calibrate_elastic(dem::generate_packing(settings.packing), settings.rock.young, settings.rock.poisson);
  settings.bond.k_n = bonds.k_n;
  settings.bond.k_t = bonds.k_t;
  Body body(settings);
  body.set_state([](const Vector3d &x) { return Vector3d(patch_strain * x[0], 0., 0.); }, zero);
  body.model.start();
  double peak = 0.;
  for (int k = 0; k < 60; ++k)
  {
    body.model.advance(5);
    peak = std::max(peak, body.model.energies().kinetic / body.model.energies().elastic);
  }
  return peak;
}
} // namespace

// A random packing that is put where a smooth field says holds 10 to 15 % too much elastic energy, which appears as
// kinetic energy when it is let go. Ten relaxation steps leave about a per cent of it.
TEST(CoupledBody, NewParticlesAreAtRest)
{
  const double plain = released_share(0), relaxed = released_share(10);
  EXPECT_GT(plain, 0.02); // there is something to cure
  EXPECT_LT(relaxed, 0.01);
  EXPECT_LT(relaxed, 0.2 * plain);
}
