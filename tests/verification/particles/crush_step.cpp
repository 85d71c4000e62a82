// SPDX-License-Identifier: GPL-2.0-or-later
// The stable step covers rock that is broken to pieces, confined and pressed together.
#include "coupler/method/coupled_model.h"
#include "dem_side/bond_network/bond_network.h"
#include "tests/support/dem_test_packings.h"
#include "tests/support/stable_steps_of.h"

#include <gtest/gtest.h>

using namespace kerf;
namespace packings = kerf::dem::test;

namespace
{
struct Crushed
{
  double broken = 0.;  ///< share of the bonds
  double kinetic = 0.; ///< largest / kinetic energy of the whole body at the speed of the platen
};

/// A box of weak, undamped rock between a held lower, rolling lateral and a driven upper boundary, pressed together by a
/// quarter of its height. Undamped and with much friction, most contacts stick and nothing hides a growing mode.
Crushed crush(const dem::Packing &packing, double k_t_ratio, double fraction_of_step)
{
  fem::Settings rock;
  rock.comm = MPI_COMM_SELF;
  rock.dim = packing.dim;
  rock.mesh.lower = packing.lower;
  rock.mesh.upper = packing.upper;
  rock.mesh.cell_size = 0.5 * (packing.upper - packing.lower).maxCoeff();
  rock.material = {2400., 20e9, 0.2};
  const auto fem = fem::make_fem_side(rock);
  ModelSettings settings;
  settings.body.material = rock.material;
  settings.tool.kind = ToolKind::none;
  settings.bond.k_n = packing.dim == 2 ? 2e10 : 2e10 * packing.mean_diameter;
  settings.bond.k_t = k_t_ratio * settings.bond.k_n;
  settings.bond.R_n = settings.bond.R_t = 2e-4 * packing.mean_diameter * settings.bond.k_n;
  settings.bond.friction = 1.;
  const double height = packing.upper[1] - packing.lower[1], speed = 20.; // under 1 % of the wave speed
  std::vector<fem::BoundaryCondition> conditions = {
    {3, "", fem::BoundaryKind::velocity, {0., -speed, 0.}, Eigen::Vector3d::Zero(), 2e-6}};
  conditions.push_back({2, "", fem::BoundaryKind::fixed});
  for (const int id : {0, 1, 4, 5})
    if (id < 2 * packing.dim)
      conditions.push_back({id, "", fem::BoundaryKind::roller});
  ParticleBoundary boundary(fem->mesh(), settings.body.material, conditions, packing, 0.25 * packing.mean_diameter);

  const double dt = fraction_of_step * kerf::test::stable_steps_of(settings, Mode::dem, *fem, packing).dem;
  const dem::Settings particles = particle_settings(settings, packing, dt, MPI_COMM_SELF);
  ParticleWork work(dt, MPI_COMM_SELF), absorbed(dt, MPI_COMM_SELF);
  int n = 0;
  const dem::ForceHook hook = [&](dem::Phase phase, dem::Particles &all)
  {
    n += phase == dem::Phase::step;
    boundary.damp(all, absorbed);
    boundary.hold(all, n * dt, dt, work);
  };
  dem::DemSide side(particles);
  packings::start(side, packing, packings::all_particles(packing), hook);
  Crushed result;
  while (n * dt * speed < 0.25 * height)
  {
    side.advance(50, hook);
    result.kinetic = std::max(result.kinetic, side.energies().kinetic);
  }
  double mass = 0.;
  for (int i = 0; i < packing.size(); ++i)
    mass += particles.density * packing.volume(i);
  result.kinetic /= 0.5 * mass * speed * speed;
  result.broken = static_cast<double>(side.n_bonds_broken()) / static_cast<double>(packing.bonds.size());
  return result;
}

/// At 0.95 of the step the particles move as at half of it; collisions are chaotic, so maxima agree within a factor only. A
/// growing mode makes hundreds of it within a part of the thousands of steps.
void expect_stable(const dem::Packing &packing, double k_t_ratio)
{
  const Crushed fine = crush(packing, k_t_ratio, 0.5), coarse = crush(packing, k_t_ratio, 0.95);
  EXPECT_GT(coarse.broken, 0.85); // those between held particles stay
  EXPECT_LT(coarse.kinetic, 1.6 * fine.kinetic) << "k_t / k_n = " << k_t_ratio;
}

dem::Packing random_packing(unsigned seed)
{
  dem::PackingSettings settings;
  settings.mean_diameter = 1e-3;
  settings.upper = Eigen::Vector3d(20., 20., 0.) * settings.mean_diameter;
  settings.gap_tolerance = 0.02; // few bonds: the contacts gain most over them
  settings.seed = seed;
  return dem::generate_packing(settings);
}
} // namespace

TEST(StableStep, HoldsForACrushedRandomPacking)
{
  const dem::Packing packing = random_packing(1);
  for (const double ratio : {0.1, 0.3, 0.6})
    expect_stable(packing, ratio);
}

TEST(StableStep, HoldsForCrushedLattices)
{
  expect_stable(packings::triangular_lattice(20, 20, 5e-4), 0.25);
  expect_stable(packings::fcc_lattice(4, 5e-4), 0.25);
}

TEST(StableStep, ACrushedPackingBlowsUpWellAboveIt)
{
  // Shows that the two tests above can fail.
  const dem::Packing packing = random_packing(1);
  const Crushed fine = crush(packing, 0.3, 0.5);
  double growth = 1e300;
  try
  {
    growth = crush(packing, 0.3, 1.3).kinetic / fine.kinetic;
  }
  catch (const std::runtime_error &)
  {
  }
  EXPECT_GT(growth, 10.);
}

TEST(StableStep, ContactsOfLatticesAreTheirBonds)
{
  for (const dem::Packing &packing : {packings::triangular_lattice(12, 12, 5e-4), packings::fcc_lattice(3, 5e-4)})
    EXPECT_EQ(particle_frequency(packing, 1e9, 0.25e9, 2700.), dem::largest_frequency(packing, 1e9, 0.25e9, 2700.));
  const dem::Packing random = random_packing(2);
  const double ratio = particle_frequency(random, 1e9, 0.25e9, 2700.) / dem::largest_frequency(random, 1e9, 0.25e9, 2700.);
  EXPECT_GT(ratio, 1.);
  EXPECT_LT(ratio, 1.3);
}
