// SPDX-License-Identifier: GPL-2.0-or-later
// Initial stress, tractions and weight act on both models alike.
#include "coupler/loading/boundary/tributary_areas.h"
#include "tests/support/coupled_body.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace kerf;
using Eigen::Vector3d;

namespace
{
constexpr double d = 1e-3; // particle spacing [m]

fem::BoundaryCondition condition(int id, fem::BoundaryKind kind)
{
  fem::BoundaryCondition result;
  result.id = id;
  result.kind = kind;
  return result;
}

/// The lattice in the middle of a block of finite elements.
Case lattice_case()
{
  Case settings = test::lattice_rock(d);
  settings.body.mesh.upper = Vector3d(64. * d, 32. * d, 0.);
  settings.body.mesh.cell_size = 4. * d;
  settings.packing.upper = settings.body.mesh.upper;
  settings.overlap.width = 12. * d;
  settings.activation.relaxation_steps = 30;
  settings.fixed_region.push_back({Vector3d(24. * d, -d, -1.), Vector3d(40. * d, 33. * d, 1.)});
  return settings;
}

struct Body : test::Body
{
  Body(const Case &the_case, Mode mode) : test::Body(the_case, mode) { model.start(); }
};

double sum_over_ranks(double value)
{
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  return value;
}
} // namespace

// A random packing and a disc, too: the shares are all of the faces' area, and normals point outwards.
TEST(TributaryAreas, AddUpToTheFaces)
{
  Case settings = lattice_case();
  settings.packing.kind = "random";
  settings.packing.radius_spread = 0.3;
  const dem::Packing packing = dem::generate_packing(settings.packing);
  settings.body.comm = MPI_COMM_SELF;
  const auto fem = fem::make_fem_side(settings.body);
  const Vector3d normals[4] = {-Vector3d::UnitX(), Vector3d::UnitX(), -Vector3d::UnitY(), Vector3d::UnitY()};
  for (int id = 0; id < 4; ++id)
  {
    const auto faces = fem::selected_faces(fem->mesh(), condition(id, fem::BoundaryKind::fixed));
    double area = 0.;
    const TributaryAreas shares(fem->mesh(), faces, packing, settings.body.surface_spacing);
    for (const TributaryArea &share : shares.areas())
    {
      area += share.area;
      EXPECT_LT((share.normal - normals[id]).norm(), 1e-12);
      const Vector3d x = packing.positions.col(share.particle);
      const double gap = std::abs(x[id / 2] - (id % 2 ? settings.body.mesh.upper[id / 2] : 0.)) - packing.radii[share.particle];
      EXPECT_LT(gap, 0.25 * d);
    }
    EXPECT_NEAR(area, (id < 2 ? 32. : 64.) * d, 1e-12 * d);
  }
}

// Weight moves both models at the same acceleration: nothing is exchanged, whatever the weights of the overlap. A strong
// gravity, so that the round-off of bond lengths, k_n x 1e-17 m a step, is below 1e-8 of the speed.
TEST(CoupledLoads, FreeFall)
{
  Case settings = lattice_case();
  settings.body.gravity = Vector3d(2e4, -9.81e4, 0.);
  settings.activation.relaxation_steps = 0; // it would look for rest under the weight
  for (const Mode mode : {Mode::fixed, Mode::dem})
  {
    Body body(settings, mode);
    body.model.advance(300);
    const dem::Particles particles = body.model.dem().particles();
    const Vector3d speed = settings.body.gravity * body.model.time();
    double worst = 0.;
    for (int i = 0; i < particles.n; ++i)
      worst = std::max(worst, (Vector3d(particles.velocity.col(i)) - speed).norm());
    EXPECT_LT(worst, 1e-8 * speed.norm());
    const EnergyLedger energy = body.model.energies();
    EXPECT_LT(energy.elastic + energy.coupling, 1e-10 * energy.kinetic);
    EXPECT_NEAR(energy.boundary_work, energy.kinetic, 1e-3 * energy.kinetic);
  }
}

// Bodies under in-situ stress between in-situ, absorbing and roller sides stay at rest. What moves is the lattice's skin: every
// other row ends half a diameter before the sides, and at its top half of the bonds are missing, so tractions by area meet
// particles that relax_particles by a part of the strain over a row or two of 30: a few per cent of the energy, most of it
// elastic.
TEST(CoupledLoads, InitialStressStays)
{
  Case settings = lattice_case();
  settings.body.initial_stress.diagonal() << -20e6, -30e6, 0.;
  settings.body.boundary_conditions = {condition(0, fem::BoundaryKind::absorbing), condition(1, fem::BoundaryKind::in_situ),
                                       condition(2, fem::BoundaryKind::roller), condition(3, fem::BoundaryKind::in_situ)};
  for (const Mode mode : {Mode::fixed, Mode::dem, Mode::fem})
  {
    Body body(settings, mode);
    const double elastic = body.model.energies().elastic;
    EXPECT_GT(elastic, 0.);
    const Eigen::Matrix3d gradient = fem::initial_state(settings.body).gradient;
    const double height = 32. * d, transit = height / settings.body.material.speed_p();
    body.model.advance(static_cast<int>(3. * transit / body.dt));
    EXPECT_LT(body.model.energies().kinetic, 2e-3 * elastic) << static_cast<int>(mode);
    EXPECT_NEAR(body.model.energies().elastic, elastic, 0.05 * elastic) << static_cast<int>(mode);

    // Mean strains of the particles inside, by least squares, over those of the initial state.
    double sums[4] = {0., 0., 0., 0.};
    const dem::Particles particles = body.model.dem().particles();
    for (int i = 0; i < particles.n; ++i)
    {
      const Vector3d x = body.packing.positions.col(particles.index[i]) - 0.5 * settings.body.mesh.upper;
      const Vector3d u = Vector3d(particles.position.col(i)) - Vector3d(body.packing.positions.col(particles.index[i]));
      if (std::abs(x[0]) > 8. * d || std::abs(x[1]) > 8. * d)
        continue;
      for (int c = 0; c < 2; ++c)
      {
        sums[2 * c] += x[c] * x[c];
        sums[2 * c + 1] += x[c] * u[c];
      }
    }
    for (double &sum : sums)
      sum = sum_over_ranks(sum);
    for (int c = 0; c < 2 && mode != Mode::fem; ++c)
      EXPECT_NEAR(sums[2 * c + 1] / sums[2 * c], gradient(c, c), 0.04 * std::abs(gradient(1, 1))) << static_cast<int>(mode);
  }
}

// A traction on both ends of a body of particles strains it as it strains the rock: p/E' along, with the skin's 3 %.
TEST(CoupledLoads, TractionStrainsParticles)
{
  Case settings = lattice_case();
  settings.local_damping = 0.7;
  const double p = 10e6;
  for (const int id : {0, 1})
  {
    fem::BoundaryCondition pull = condition(id, fem::BoundaryKind::traction);
    pull.traction = Vector3d(id == 0 ? -p : p, 0., 0.);
    pull.ramp = 4. * 64. * d / settings.body.material.speed_p();
    settings.body.boundary_conditions.push_back(pull);
  }
  Body body(settings, Mode::dem);
  body.model.advance(static_cast<int>(2.5 * settings.body.boundary_conditions[0].ramp / body.dt));
  double sums[2] = {0., 0.};
  const dem::Particles particles = body.model.dem().particles();
  for (int i = 0; i < particles.n; ++i)
  {
    const double x = body.packing.positions(0, particles.index[i]) - 32. * d;
    if (std::abs(x) > 16. * d)
      continue;
    sums[0] += x * x;
    sums[1] += x * (particles.position(0, i) - 32. * d);
  }
  const double strain = sum_over_ranks(sums[1]) / sum_over_ranks(sums[0]) - 1.;
  const double exact = p * (1. - 0.04) / settings.body.material.young;
  EXPECT_NEAR(strain, exact, 0.04 * exact);
}
