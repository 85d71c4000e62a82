// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/penalty_constraint.h"
#include "tests/support/dummy_fem_side.h"
#include "tests/support/dummy_particles.h"
#include "tests/support/scattered_points.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

using namespace kerf;
using Eigen::Vector3d;

namespace
{
constexpr double h = 0.1;

PenaltyConstraint::Settings mass_scaled()
{
  PenaltyConstraint::Settings settings;
  settings.mass_scaled = true;
  settings.beta = 0.25;
  settings.time_step = 1e-3;
  return settings;
}

std::vector<TiedParticle> all_of(int n)
{
  std::vector<TiedParticle> particles(n);
  for (int i = 0; i < n; ++i)
    particles[i].index = i;
  return particles;
}

dem::Packing packing_at(const Eigen::Matrix3Xd &positions)
{
  dem::Packing packing;
  packing.positions = positions;
  packing.radii = Eigen::VectorXd::Constant(positions.cols(), 0.1 * h);
  return packing;
}

/// Applies once and gives the stored energy.
double apply(PenaltyConstraint &constraint, test::DummyParticles &particles, fem::FemSide &fem)
{
  dem::Particles view = particles.view();
  constraint.apply(dem::Phase::step, view, fem);
  return constraint.energy().stored;
}
} // namespace

// The exchange is the exact transpose: forces cancel and exert no moment about any point. Round-off of a sum of n terms.
TEST(PenaltyConstraint, ConservesMomentum)
{
  const int n = 200;
  const Eigen::Matrix3Xd reference = test::scattered_points(n, h);
  test::DummyFemSide fem(4, 3, h, 2.);
  Eigen::Matrix3Xd moved = reference + 0.01 * Eigen::Matrix3Xd::Random(3, n);
  moved.row(2).setZero();
  fem.displacement = 0.01 * Eigen::Matrix3Xd::Random(3, fem.mesh().n_nodes());
  fem.displacement.row(2).setZero();
  test::DummyParticles particles(moved);
  const dem::Packing packing = packing_at(reference);
  PenaltyConstraint constraint(mass_scaled(), packing);
  constraint.set_particles(all_of(n));
  const double energy = apply(constraint, particles, fem);

  const double scale = particles.f.norm();
  ASSERT_GT(scale, 0.);
  EXPECT_GT(energy, 0.);
  EXPECT_LT((particles.f.rowwise().sum() + fem.force.rowwise().sum()).norm(), 1e-12 * scale);
  double moment = 0.;
  for (int i = 0; i < n; ++i)
    moment += Vector3d(moved.col(i)).cross(Vector3d(particles.f.col(i)))[2];
  for (int a = 0; a < fem.mesh().n_nodes(); ++a)
    moment += Vector3d(fem.mesh().nodes.col(a) + fem.displacement.col(a)).cross(Vector3d(fem.force.col(a)))[2];
  EXPECT_LT(std::abs(moment), 1e-12 * scale);
}

// Forces belong to particles, wherever these stand in the arrays: sorted otherwise, and with some gone.
TEST(PenaltyConstraint, FollowsParticlesThroughTheArrays)
{
  const int n = 101; // not a multiple of anything that is done at once
  const Eigen::Matrix3Xd reference = test::scattered_points(n, h);
  test::DummyFemSide fem(4, 3, h, 2.);
  Eigen::Matrix3Xd moved = reference + 0.01 * Eigen::Matrix3Xd::Random(3, n);
  moved.row(2).setZero();
  const dem::Packing packing = packing_at(reference);
  PenaltyConstraint constraint(mass_scaled(), packing);
  constraint.set_particles(all_of(n));
  test::DummyParticles before(moved);
  apply(constraint, before, fem);
  ASSERT_GT(before.f.norm(), 0.);
  const Eigen::Matrix3Xd reaction = fem.force;

  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  for (const int left : {n, n - 10})
  {
    order.resize(left);
    test::DummyParticles after(Eigen::Matrix3Xd(moved(Eigen::all, order)));
    after.index = order;
    dem::Particles view = after.view();
    view.order = 1 + n - left;
    fem.compute_forces();
    constraint.apply(dem::Phase::step, view, fem);
    if (left == n)
    {
      EXPECT_LT((after.f - before.f(Eigen::all, order)).norm(), 1e-13 * before.f.norm());
      EXPECT_LT((fem.force - reaction).norm(), 1e-13 * reaction.norm());
    }
    EXPECT_LT((after.f.rowwise().sum() + fem.force.rowwise().sum()).norm(), 1e-12 * after.f.norm());
    EXPECT_GT((after.f.colwise().norm().array() > 0.).count(), left - 5);
  }
}

// A linear field (uniform strain, rotation, translation) is carried exactly by bilinear shape functions: no force at all.
TEST(PenaltyConstraint, NoForceInLinearFields)
{
  const int n = 50;
  const Eigen::Matrix3Xd reference = test::scattered_points(n, h);
  test::DummyFemSide fem(4, 3, h, 2.);
  Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();
  gradient.topLeftCorner<2, 2>() << 0.02, -0.5, 0.5, -0.01;
  const Vector3d translation(0.3, -0.2, 0.);
  fem.displacement = (gradient * fem.mesh().nodes).colwise() + translation;
  const Eigen::Matrix3Xd moved = reference + ((gradient * reference).colwise() + translation);
  test::DummyParticles particles(moved);
  const dem::Packing packing = packing_at(reference);
  PenaltyConstraint constraint(mass_scaled(), packing);
  constraint.set_particles(all_of(n));
  apply(constraint, particles, fem);
  const double k = 0.25 / 1e-6; // beta/dt^2 times a mass of one: the scale of a force for chi = 1
  EXPECT_LT(particles.f.norm(), 1e-13 * k);
  EXPECT_LT(fem.force.norm(), 1e-13 * k);
}

// One particle in one cell: k = beta mu/dt^2 with 1/mu = 1/m + sum N^2/M gives chi'' = -(beta/dt^2) chi whatever the masses.
TEST(PenaltyConstraint, MassScaledFrequency)
{
  Eigen::Matrix3Xd reference(3, 1);
  reference.col(0) = Vector3d(0.3 * h, 0.6 * h, 0.);
  for (const double node_mass : {1e-3, 1., 1e3})
  {
    test::DummyFemSide fem(1, 1, h, node_mass);
    const Vector3d chi(1e-3, -2e-3, 0.);
    test::DummyParticles particles(reference.colwise() + chi, 0.7);
    const dem::Packing packing = packing_at(reference);
    PenaltyConstraint constraint(mass_scaled(), packing);
    constraint.set_particles(all_of(1));
    apply(constraint, particles, fem);
    Vector3d acceleration = particles.f.col(0) / 0.7;
    const fem::Interpolation row = fem.locate(reference)[0];
    for (int a = 0; a < 4; ++a)
      acceleration -= row.N[a] * fem.force.col(row.nodes[a]) / node_mass;
    EXPECT_LT((acceleration + 0.25 / 1e-6 * chi).norm(), 1e-12 * 0.25 / 1e-6 * chi.norm());
  }
}

// Penalty energy 1/2 k chi^2 and force are consistent: f = -dE/dx by central differences (exact for a quadratic up to
// round-off).
TEST(PenaltyConstraint, ForceIsGradientOfEnergy)
{
  Eigen::Matrix3Xd reference(3, 1);
  reference.col(0) = Vector3d(0.3 * h, 0.6 * h, 0.);
  PenaltyConstraint::Settings settings;
  settings.mass_scaled = false;
  settings.stiffness = 5e4;
  const auto energy_at = [&](const Vector3d &chi, Vector3d *force)
  {
    test::DummyFemSide fem(1, 1, h, 1.);
    test::DummyParticles particles(reference.colwise() + chi);
    const dem::Packing packing = packing_at(reference);
    PenaltyConstraint constraint(settings, packing);
    constraint.set_particles(all_of(1));
    const double energy = apply(constraint, particles, fem);
    if (force)
      *force = particles.f.col(0);
    return energy;
  };
  const Vector3d chi(2e-3, 1e-3, 0.);
  Vector3d force;
  energy_at(chi, &force);
  const double step = 1e-4;
  for (int c = 0; c < 2; ++c)
  {
    const Vector3d shift = step * Vector3d::Unit(c);
    const double slope = (energy_at(chi + shift, nullptr) - energy_at(chi - shift, nullptr)) / (2. * step);
    EXPECT_NEAR(force[c], -slope, 1e-9 * force.norm());
  }
}
