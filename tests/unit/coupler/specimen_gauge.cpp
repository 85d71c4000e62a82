// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/specimen_gauge.h"
#include "coupler/application/calibration/ratio_search.h"
#include "coupler/loading/tool/tool.h"
#include "tests/support/dummy_fem_side.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace kerf;
using Eigen::Vector3d;

// The face of a platen is the integral of its speed; after the start-up it has lost half the start-up time.
TEST(Platen, MovesWithSmoothStart)
{
  const double speed = 0.3, ramp = 0.5;
  Platen platen(1., -speed, ramp); // faces down
  double y = 1.;
  const double dt = 1e-4;
  for (int k = 0; k < 10000; ++k)
  {
    platen.move_to((k + 0.5) * dt);
    y += dt * platen.speed;
  }
  platen.move_to(1.);
  EXPECT_NEAR(platen.y, 1. - speed * (1. - 0.5 * ramp), 1e-14);
  EXPECT_NEAR(platen.y, y, 1e-8); // midpoint rule, dt^2
  EXPECT_DOUBLE_EQ(platen.speed, -speed);
  platen.move_to(0.);
  EXPECT_EQ(platen.speed, 0.);
}

// Two particles between platens that have closed by 0.1 each: both forces are k times that, the load is one of them, and the
// power is that of both.
TEST(Tool, PlatensPressFromBothSides)
{
  ToolSettings settings;
  settings.kind = ToolKind::platens;
  settings.closing_speed = 0.2;
  settings.smoothing_time = 0.;
  settings.lower = 0.;
  settings.upper = 4.;
  settings.stiffness_ratio = 2.;
  settings.friction = 0.;
  settings.damping = 0.;
  Tool tool(settings, 2, 1e4, 1., 1000., MPI_COMM_WORLD);
  Eigen::Matrix3Xd x(3, 2);
  x << 0., 5., 0.5, 3.5, 0., 0.; // radius 0.5: touching at the start
  test::DummyParticles particles(x);
  test::DummyFemSide fem(1, 1, 1., 1.);
  dem::Particles view = particles.view();
  tool.move_to(0.);
  tool.apply(view, fem);
  EXPECT_EQ(particles.f.norm(), 0.);
  tool.move_to(1.);
  tool.apply(view, fem);
  const double force = 0.5 * 2. * 1e4 * 0.1; // weight 0.5 of the dummies
  EXPECT_NEAR(particles.f(1, 0), force, 1e-9);
  EXPECT_NEAR(particles.f(1, 1), -force, 1e-9);
  EXPECT_NEAR(tool.local_load().force[1], -force, 1e-9);
  EXPECT_NEAR(tool.local_load().power, 2. * force * 0.1, 1e-9);
  EXPECT_NEAR(tool.platens()[0], 0.1, 1e-15);
  EXPECT_NEAR(tool.platens()[1], 3.9, 1e-15);
}

namespace
{
/// Linear loading up to the peak at strain 1e-3, then a linear fall to a fifth; bonds break from 80 % of the peak on.
SpecimenRecord record_of(double modulus, double lateral)
{
  SpecimenRecord record;
  for (int k = 0; k <= 150; ++k)
  {
    SpecimenState state;
    const double strain = 1e-5 * k;
    state.axial_strain = strain;
    state.lateral_strain = lateral * strain;
    state.stress = k <= 100 ? modulus * strain : modulus * 1e-3 * (1. - 0.016 * (k - 100));
    state.middle_stress = 1.1 * state.stress;
    state.broken_bonds = k < 80 ? 0 : k - 80;
    record.add(state);
  }
  return record;
}
} // namespace

TEST(SpecimenRecord, ModuliAndStrength)
{
  const double E = 20e9, nu = 0.25;
  const SpecimenResult solid = record_of(E, nu).result(3);
  EXPECT_NEAR(solid.young, 1.1 * E, 1e-9 * E);
  EXPECT_NEAR(solid.nominal_young, E, 1e-9 * E); // a straight line is fitted to round-off
  EXPECT_NEAR(solid.poisson, nu, 1e-9);
  EXPECT_NEAR(solid.strength, 20e6, 1.);
  EXPECT_NEAR(solid.peak_strain, 1e-3, 1e-12);
  EXPECT_EQ(solid.linear_broken, 0.);
  EXPECT_TRUE(solid.peak_passed);

  // In plane strain the press shows E/(1 - nu^2) and nu/(1 - nu).
  const SpecimenResult flat = record_of(E / (1. - nu * nu), nu / (1. - nu)).result(2);
  EXPECT_NEAR(flat.nominal_young, E, 1e-9 * E);
  EXPECT_NEAR(flat.poisson, nu, 1e-9);
}

TEST(SpecimenRecord, EndOfTheTest)
{
  SpecimenRecord record;
  SpecimenState state;
  state.stress = 10.;
  record.add(state);
  state.stress = 1.;
  record.add(state);
  EXPECT_FALSE(record.fell_below(0.5)); // the stress swings, but nothing has broken
  EXPECT_FALSE(record.result(2).young > 0.);
  state.broken_bonds = 1;
  record.add(state);
  EXPECT_TRUE(record.fell_below(0.5));
  EXPECT_FALSE(record.fell_below(0.05));
}

namespace
{
/// Where the search ends for a given law of the ratio, and how often it asks; 0: out of reach.
template <typename Law>
std::pair<double, int> search_ratio(const Law &law, double target)
{
  RatioSearch search;
  double q = 1.5;
  for (int n = 1; n < 30; ++n)
  {
    const double off = std::log(law(q) / target);
    if (std::abs(off) < 0.005)
      return {q, n};
    search.add(q, off);
    q = search.next();
    if (q == 0.)
      return {0., n};
  }
  return {-1., 30};
}
} // namespace

// A rising ratio, as in two dimensions, and one with its largest value at q = 1, as in three.
TEST(RatioSearch, FindsTheRatioOnEitherSideOfATurn)
{
  const auto rising = [](double q) { return 3. * std::sqrt(q); };
  for (const double q : {0.3, 1., 1.6, 5.})
  {
    const auto [found, n] = search_ratio(rising, rising(q));
    EXPECT_NEAR(found, q, 0.02 * q);
    EXPECT_LE(n, 9);
  }
  const auto turning = [](double q) { return 10. / (1. + std::pow(std::log(q), 2)); };
  for (const double ratio : {9.5, 8., 6.})
    EXPECT_NEAR(turning(search_ratio(turning, ratio).first), ratio, 0.01 * ratio);
}

TEST(RatioSearch, KnowsWhenItIsOutOfReach)
{
  const auto turning = [](double q) { return 10. / (1. + std::pow(std::log(q), 2)); };
  EXPECT_EQ(search_ratio(turning, 11.).first, 0.);
  EXPECT_EQ(search_ratio([](double q) { return 3. * std::sqrt(q); }, 20.).first, 0.);
}
