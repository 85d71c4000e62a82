// SPDX-License-Identifier: GPL-2.0-or-later
// A particle that belongs to no rock meets the surface of the finite elements.
#include "tests/support/coupled_body.h"

#include <gtest/gtest.h>

#include <algorithm>

using namespace kerf;
using Eigen::Vector3d;
using test::Body;

namespace
{
constexpr double d = 1e-3; // particle spacing [m]
constexpr double top = 12. * d;

/// A free block with particles at its left end; one of them, at its top, has no bonds.
class Block
{
public:
  Block()
  {
    Case settings = test::lattice_rock(d);
    settings.body.mesh.upper = Vector3d(32. * d, top, 0.);
    settings.body.mesh.cell_size = 4. * d;
    settings.packing.upper = settings.body.mesh.upper;
    settings.overlap.width = 8. * d;
    settings.fixed_region = {{Vector3d(-d, -d, -1.), Vector3d(8. * d, 13. * d, 1.)}};
    dem::Packing packing = dem::generate_packing(settings.packing);
    double highest = 0.;
    for (int i = 0; i < packing.size(); ++i)
      if (const Vector3d x = packing.positions.col(i); x[0] > 2. * d && x[0] < 6. * d && x[1] > highest)
        highest = x[1], loose = i;
    packing.bonds.erase(std::remove_if(packing.bonds.begin(), packing.bonds.end(),
                                       [this](const auto &bond) { return bond[0] == loose || bond[1] == loose; }),
                        packing.bonds.end());
    body = std::make_unique<Body>(settings, packing, 2e-8);
    body->set_state([](const Vector3d &) { return Vector3d(Vector3d::Zero()); },
                    [](const Vector3d &) { return Vector3d(Vector3d::Zero()); });
    body->model.start();
  }

  void throw_from(const Vector3d &place, const Vector3d &velocity)
  {
    dem::Particles particles = body->model.dem().particles();
    for (int i = 0; i < particles.n; ++i)
      if (particles.index[i] == loose)
      {
        particles.position.col(i) = place;
        particles.velocity.col(i) = velocity;
      }
    body->model.set_up_forces();
    body->model.advance(1); // what is loose is looked for at the end
  }

  /// Position and velocity.
  std::array<Vector3d, 2> particle()
  {
    Eigen::Matrix<double, 3, 2> state = Eigen::Matrix<double, 3, 2>::Zero();
    const dem::Particles particles = body->model.dem().particles();
    for (int i = 0; i < particles.n; ++i)
      if (particles.index[i] == loose)
        state << particles.position.col(i), particles.velocity.col(i);
    MPI_Allreduce(MPI_IN_PLACE, state.data(), 6, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    return {state.col(0), state.col(1)};
  }

  ConservedQuantities inventory()
  {
    return conserved_quantities(*body->fem, body->model.dem(), body->model.energies(), MPI_COMM_WORLD);
  }

  std::unique_ptr<Body> body;
  int loose = -1;
};
} // namespace

// Far from the particle region it bounces off finite elements alone. The surface is felt at points a quarter of a diameter
// apart, between which a disc sinks by (d/8)^2/d = 1.6 %. Forces and couples are opposite: both momenta are kept to round-off.
// The contact stores what it takes but for the points that come and go within a step: 1 %.
TEST(Loose, BouncesOffFiniteElements)
{
  Block block;
  block.throw_from(Vector3d(24.3 * d, top + 0.6 * d, 0.), Vector3d(0.2, -1., 0.));
  EXPECT_EQ(block.body->model.debris().n_debris(), 1);
  EXPECT_TRUE(block.body->model.debris().is_debris(block.loose));
  const ConservedQuantities before = block.inventory();
  const EnergyLedger at_start = block.body->model.energies();
  ASSERT_GT(at_start.held(), 0.);

  double lowest = 1.;
  bool touched = false;
  for (int k = 0; k < 60; ++k)
  {
    block.body->model.advance(200);
    const Vector3d x = block.particle()[0];
    lowest = std::min(lowest, x[1]);
    touched = touched || block.body->fem->energies().surface[static_cast<int>(fem::SurfaceLoad::debris)] != 0.;
  }
  EXPECT_TRUE(touched);
  EXPECT_GT(lowest, top + 0.5 * d - 1e-3 * d);
  const auto [x, v] = block.particle();
  EXPECT_GT(v[1], 0.3);
  EXPECT_NEAR(v[0], 0.2, 0.01); // waves tilt the surface
  EXPECT_GT(x[1], top + 0.5 * d);

  const ConservedQuantities after = block.inventory();
  const double momentum = before.momentum.norm();
  EXPECT_LT((after.momentum - before.momentum).norm(), 1e-10 * momentum);
  EXPECT_LT((after.angular_momentum - before.angular_momentum).norm(), 0.15 * momentum * d);
  EXPECT_LT(std::abs(block.body->model.energies().residual() - at_start.residual()), 0.01 * at_start.held());
}

// What comes off the rock beside the surface may lie in it. It starts without force, and is stopped when it goes deeper.
TEST(Loose, StartsWithoutForce)
{
  Block block;
  block.throw_from(Vector3d(24.3 * d, top + 0.4 * d, 0.), Vector3d::Zero());
  block.body->model.advance(500);
  EXPECT_LT(block.particle()[1].norm(), 1e-12);
  block.throw_from(Vector3d(24.3 * d, top + 0.4 * d, 0.), Vector3d(0., -1., 0.));
  block.body->model.advance(2000);
  EXPECT_GT(block.particle()[1][1], 0.);
}

// One that comes up through the surface from within the rock, where it met none, is let out: no overlap appears at once.
TEST(Loose, IsLetOutFromBelow)
{
  Block block;
  block.throw_from(Vector3d(24.3 * d, top - 0.2 * d, 0.), Vector3d(0., 5., 0.));
  for (int k = 0; k < 40; ++k)
  {
    block.body->model.advance(200);
    EXPECT_NEAR(block.particle()[1][1], 5., 1e-6);
  }
  EXPECT_GT(block.particle()[0][1], top + 0.5 * d);
}

// Over particles and overlap the lattice itself carries it: no pull down at the change from one to the other.
TEST(Loose, RollsFromParticlesToFiniteElements)
{
  Block block;
  block.throw_from(Vector3d(4. * d, top + 0.5 * d, 0.), Vector3d(20., -0.5, 0.));
  double lowest = 1.;
  for (int k = 0; k < 60; ++k)
  {
    block.body->model.advance(1000);
    const auto [x, v] = block.particle();
    if (x[0] > 30. * d || v[1] > 0.)
      break;
    lowest = std::min(lowest, x[1]);
  }
  EXPECT_GT(lowest, top + 0.3 * d);
}
