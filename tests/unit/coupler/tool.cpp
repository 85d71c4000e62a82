// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/tool/tool.h"
#include "coupler/base/mesh_geometry.h"
#include "tests/support/dummy_particles.h"
#include "tests/support/fem_fixture.h"
#include "tests/support/rolling_disc.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

using namespace kerf;
using Eigen::Vector3d;

namespace
{
/// Platens without damping, 4 apart at the start.
ToolSettings platens(double closing_speed, double stiffness_ratio, double friction)
{
  ToolSettings settings;
  settings.kind = ToolKind::platens;
  settings.closing_speed = closing_speed;
  settings.smoothing_time = 0.;
  settings.lower = 0.;
  settings.upper = 4.;
  settings.stiffness_ratio = stiffness_ratio;
  settings.friction = friction;
  settings.damping = 0.;
  return settings;
}
} // namespace

// Tool on one particle: force, reaction and power follow from the law; a rolling disc does not slide over a fixed surface.
TEST(Tool, ContactWithOneParticle)
{
  ToolSettings settings;
  settings.radius = 2.;
  settings.path = {{0., Vector3d(0., 2.45, 0.)}, {1., Vector3d(3., 2.45, 0.)}};
  settings.smoothing_time = 0.;
  settings.stiffness_ratio = 2.;
  settings.friction = 0.5;
  settings.damping = 0.1;
  settings.rolling = true;
  Tool tool(settings, 2, 1e4, 1., 1000., MPI_COMM_WORLD);
  tool.move_to(0.);
  Eigen::Matrix3Xd x = Eigen::Matrix3Xd::Zero(3, 1);
  test::DummyParticles particles(x);
  particles.weight[0] = 0.25;
  dem::Particles view = particles.view();
  tool.apply(view, nullptr);
  // Overlap 2 + 0.5 - 2.45 = 0.05; stiffness = weight 0.25 x ratio 2 x k_n.
  EXPECT_NEAR(particles.f(1, 0), -0.25 * 2. * 1e4 * 0.05, 1e-9);
  EXPECT_NEAR(particles.f(0, 0), 0., 1e-9); // v_x + spin R = 0 at the lowest point
  EXPECT_NEAR(tool.total(tool.local_load()).force[1], particles.f(1, 0), 1e-9);
  EXPECT_NEAR(tool.local_load().power, 0., 1e-9);
}

// Two particles between platens that have closed by 0.1 each: both forces are k times that, the load is one of them, and the
// power is that of both.
TEST(Tool, PlatensPressFromBothSides)
{
  const ToolSettings settings = platens(0.2, 2., 0.);
  Tool tool(settings, 2, 1e4, 1., 1000., MPI_COMM_WORLD);
  Eigen::Matrix3Xd x(3, 2);
  x << 0., 5., 0.5, 3.5, 0., 0.; // radius 0.5: touching at the start
  test::DummyParticles particles(x);
  dem::Particles view = particles.view();
  tool.move_to(0.);
  tool.apply(view, nullptr);
  EXPECT_EQ(particles.f.norm(), 0.);
  tool.move_to(1.);
  tool.apply(view, nullptr);
  const double force = 0.5 * 2. * 1e4 * 0.1; // weight 0.5 of the dummies
  EXPECT_NEAR(particles.f(1, 0), force, 1e-9);
  EXPECT_NEAR(particles.f(1, 1), -force, 1e-9);
  EXPECT_NEAR(tool.local_load().force[1], -force, 1e-9);
  EXPECT_NEAR(tool.local_load().power, 2. * force * 0.1, 1e-9);
  EXPECT_NEAR(tool.platens()[0], 0.1, 1e-15);
  EXPECT_NEAR(tool.platens()[1], 3.9, 1e-15);
}

// Platens that pull hold the particles that touch them at the start, in tension and compression, and no others; the load is
// negative and the particles slide along them freely.
TEST(Tool, PlatensThatPull)
{
  ToolSettings settings = platens(-0.2, 2., 0.5);
  Tool tool(settings, 2, 1e4, 1., 1000., MPI_COMM_WORLD);
  Eigen::Matrix3Xd x(3, 3);
  x << 0., 5., 0., 0.52, 3.5, 2., 0., 0., 0.; // radius 0.5: gaps 0.02 and 0, the third is free
  dem::Packing packing;
  packing.positions = x;
  packing.radii = Eigen::VectorXd::Constant(3, 0.5);
  packing.gap_tolerance = 0.1;
  tool.hold(packing);
  test::DummyParticles particles(x);
  particles.v.row(0).setConstant(3.);
  dem::Particles view = particles.view();
  tool.move_to(0.);
  tool.apply(view, nullptr);
  EXPECT_NEAR(particles.f.norm(), 0., 1e-12);
  tool.move_to(1.);
  tool.apply(view, nullptr);
  const double force = 0.5 * 2. * 1e4 * 0.1; // weight 0.5 of the dummies
  EXPECT_LT((particles.f.col(0) + force * Vector3d::UnitY()).norm(), 1e-9);
  EXPECT_LT((particles.f.col(1) - force * Vector3d::UnitY()).norm(), 1e-9);
  EXPECT_EQ(particles.f.col(2).norm(), 0.);
  EXPECT_NEAR(tool.local_load().force[1], force, 1e-9);
  EXPECT_NEAR(tool.local_load().power, 2. * force * 0.1, 1e-9);
  EXPECT_EQ(tool.touched().size(), 2u);

  // Without a stiffness ratio the spring follows the mass, 1 kg, and the step: 1.4 m/dt^2 without damping.
  settings.stiffness_ratio = 0.;
  Tool stiff(settings, 2, 1e4, 1., 1000., MPI_COMM_WORLD);
  stiff.hold(packing);
  stiff.set_time_step(0.01, 1.);
  particles.f.setZero();
  stiff.move_to(1.);
  stiff.apply(view, nullptr);
  EXPECT_NEAR(particles.f(1, 0), -1.4 / 1e-4 * 0.1, 1e-9);
  EXPECT_NEAR(particles.f(1, 1), 1.4 / 1e-4 * 0.1, 1e-9);
}

// A stiffness that follows the time step holds as it pushes: the same displacement gives the same force, pulled or pressed.
TEST(Tool, PlatensPullWithTheStiffnessOfTheTimeStep)
{
  double force[2];
  for (const int pull : {0, 1})
  {
    const ToolSettings settings = platens(pull ? -0.2 : 0.2, 0., 0.);
    Tool tool(settings, 2, 1e4, 1., 1000., MPI_COMM_WORLD);
    tool.set_time_step(1e-3, 1.);
    Eigen::Matrix3Xd x(3, 2);
    x << 0., 5., 0.5, 3.5, 0., 0.; // radius 0.5: touching at the start
    dem::Packing packing;
    packing.positions = x;
    packing.radii = Eigen::VectorXd::Constant(2, 0.5);
    packing.gap_tolerance = 0.1;
    tool.hold(packing);
    test::DummyParticles particles(x);
    dem::Particles view = particles.view();
    tool.move_to(1.);
    tool.apply(view, nullptr);
    force[pull] = particles.f(1, 0);
  }
  EXPECT_GT(force[0], 1.);
  EXPECT_NEAR(force[1] / force[0], -1., 1e-12);
}

// The surface of the finite elements pushes back like particles d apart: one on each length d in the plane, on each d^2 in
// space.
TEST(Tool, SurfaceIsAsStiffAsParticles)
{
  struct OnePoint : fem::SurfaceContact
  {
    void surface_points(const Vector3d &, const Vector3d &, const fem::NearTest &near,
                        fem::SurfacePoints &points) const override
    {
      EXPECT_TRUE(near(place, 0.));
      EXPECT_FALSE(near(Vector3d(0., -0.5, 0.7), 0.9)); // 0.05 away
      points.position = place;
      points.velocity = Vector3d::Zero();
      points.area = Eigen::VectorXd::Constant(1, 0.02);
    }
    void add_surface_forces(const Eigen::Matrix3Xd &forces, fem::SurfaceLoad) override { pushed = forces.col(0); }
    const Vector3d place = Vector3d(0., 0.46, 0.7); // 0.01 inside
    Vector3d pushed = Vector3d::Zero();
  };
  ToolSettings settings = test::rolling_disc(0.8);
  settings.stiffness_ratio = 2.;
  const double d = 0.1, k_n = 1e4;
  Eigen::Matrix3Xd nothing(3, 0);
  test::DummyParticles none(nothing);
  for (const int dim : {2, 3})
  {
    Tool tool(settings, dim, k_n, d, 1000., MPI_COMM_WORLD);
    OnePoint surface;
    dem::Particles view = none.view();
    tool.apply(view, &surface);
    const double expected = 2. * k_n / std::pow(d, dim - 1) * 0.02 * 0.01;
    EXPECT_LT((surface.pushed + expected * Vector3d::UnitY()).norm(), 1e-12 * expected);
    EXPECT_NEAR(tool.local_load().force[1], -expected, 1e-12 * expected);
  }
}

// Without a stiffness ratio the contact takes the share of the step that is left for it: spring and dashpot of a particle add
// beta + 4 xi sqrt(beta) = 1.4 to omega^2 dt^2, whatever its mass.
TEST(Tool, StiffnessFollowsTheStep)
{
  for (const double damping : {0., 0.1, 1.})
  {
    ToolSettings settings = test::rolling_disc(0.);
    settings.path = {{0., Vector3d(0., 2.45, 0.)}};
    settings.damping = damping;
    const double dt = 1e-3, density = 1000., layer = 0.2;
    Tool tool(settings, 2, 1e4, 1., density, MPI_COMM_WORLD);
    tool.set_time_step(dt, layer);
    tool.move_to(0.);
    Eigen::Matrix3Xd x = Eigen::Matrix3Xd::Zero(3, 1);
    test::DummyParticles particles(x, 3.);
    dem::Particles view = particles.view();
    tool.apply(view, nullptr);
    const double resting = -particles.f(1, 0) / 0.05; // stiffness: 0.05 inside, at rest
    const double beta = resting * dt * dt / 3.;
    EXPECT_NEAR(beta + 4. * damping * std::sqrt(beta), contact_share_of_step, 1e-9);
  }
}

// Cells with a part of their surface within reach, also of the way until the next look.
TEST(Tool, NearCells)
{
  const auto fem = fem::make_fem_side(fem::test::box({8., 2., 0.}, 1.)); // cells of 1, the upper row has the numbers 8 to 15
  ToolSettings settings = test::rolling_disc(0.);
  settings.path = {{0., Vector3d(4.5, 4.1, 0.)}, {1., Vector3d(4.5, 3.1, 0.)}};
  Tool tool(settings, 2, 1e4, 1., 1000., MPI_COMM_WORLD);
  const auto numbers = [&](double reach, double duration)
  {
    std::set<double> middles; // along x
    for (const NearCell &near : tool.near_cells(*fem, reach, duration))
    {
      const Vector3d centre = cell_centre(fem->mesh(), near.cell);
      EXPECT_EQ(near.curvature_radius, 2.);
      EXPECT_EQ(centre[1], 1.5);
      middles.insert(centre[0]);
    }
    return middles;
  };
  EXPECT_TRUE(numbers(0.09, 0.).empty()); // 0.1 above the rock
  EXPECT_EQ(numbers(0.15, 0.), std::set<double>({4.5}));
  EXPECT_EQ(numbers(0., 0.15), std::set<double>({4.5})); // moves by 0.15 meanwhile
  EXPECT_EQ(numbers(0.3, 0.), std::set<double>({3.5, 4.5, 5.5}));
}

TEST(Tool, ClearanceOfTheDisc)
{
  const auto fem = fem::make_fem_side(fem::test::box({2., 2., 0.}, 1.));
  ToolSettings settings;
  settings.radius = 0.5;
  settings.path = {{0., Vector3d(1., 3., 0.)}};
  EXPECT_NEAR(Tool::clearance(settings, *fem), 0.5, 1e-14); // centre 1 above the top
  settings.path = {{0., Vector3d(1., 2.3, 0.)}};
  EXPECT_NEAR(Tool::clearance(settings, *fem), -0.2, 1e-14);
  settings.path = {{0., Vector3d(1., 1.5, 0.)}};
  EXPECT_NEAR(Tool::clearance(settings, *fem), -1., 1e-14); // inside: the top is nearer than the other sides
}
