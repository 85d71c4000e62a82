// SPDX-License-Identifier: GPL-2.0-or-later
// Changes of models in a strained strip, and the limits at which modes are the same.
#include "coupler/base/mesh_geometry.h"
#include "tests/support/strip_front.h"

#include <gtest/gtest.h>
#include <set>

using namespace kerf;
using Eigen::Vector3d;
using test::Body;
using test::Direction;
using test::FrontChange;
using test::Strip;
using test::StripCase;

namespace
{
StripCase strip_with(std::string method, double penalty_ratio, bool random, int seed = 1)
{
  Strip shape;
  shape.random = random;
  shape.seed = seed;
  shape.fem = 8;
  shape.high = random ? 5 : 2;
  StripCase strip(shape);
  strip.settings.constraint.method = method;
  strip.settings.constraint.penalty_ratio = penalty_ratio;
  return strip;
}
} // namespace

// The moduli are the same and the projection of a uniform strain is exact: nothing moves but what the terms of second order in
// the strain, 1e-6, differ by; their stress jump squared is the kinetic energy.
TEST(Front, UniformLatticeChangesModelsWithoutNoise)
{
  StripCase strip = strip_with("multipliers", 0., false);
  test::hold_ends(strip.settings);
  Body body(strip.settings, strip.packing, Mode::fixed);
  body.set_state([](const Vector3d &x) { return Vector3d(1e-6 * x[0], 0., 0.); },
                 [](const Vector3d &) { return Vector3d(Vector3d::Zero()); });
  body.model.start();
  const FrontChange change = test::move_front(body, strip.strip, Direction::tension, 2, 1e-6);
  EXPECT_LT(change.kinetic, 1e-8);
  EXPECT_LT(std::abs(change.conversion), 1e-4);
  EXPECT_EQ(change.broken, 0);
}

// A random packing rests at places that fluctuate about the projected field, which would release 13 to 18 % of the layer's
// energy. Moved to rest first, less than 2 % of it starts to move, and less than 0.5 % gets into the particle region when the
// front moves by half an overlap. No bond breaks that is loaded to half of its strength.
TEST(Front, RandomPackingChangesModelsQuietly)
{
  for (const Direction direction : {Direction::tension, Direction::shear})
  {
    const FrontChange change = test::move_random_front(strip_with("multipliers", 0., true), direction, 2, 1e-5);
    std::cout << "[ front    ] conversion " << 100. * change.conversion << " %, kinetic " << 100. * change.kinetic
              << " %, into the particle region " << 100. * change.noise << " %" << std::endl;
    EXPECT_LT(change.kinetic, 0.02);
    EXPECT_LT(change.noise, 0.005);
    EXPECT_EQ(change.broken, 0);
  }
}

// No stress reaches an infinite sigma*: the adaptive run is the finite-element run, bit for bit.
TEST(Limits, NoActivationIsFiniteElements)
{
  StripCase strip{Strip()};
  strip.settings.activation.sigma_star = 1e300;
  strip.settings.activation.check_interval = 10;
  const auto run = [&](Mode mode)
  {
    Body body(strip.settings, strip.packing, 1e-7, mode);
    body.set_state([](const Vector3d &) { return Vector3d(Vector3d::Zero()); },
                   [](const Vector3d &x) { return Vector3d(std::sin(300. * x[0]), std::cos(200. * x[0]), 0.); });
    body.model.start();
    for (int k = 0; k < 30; ++k)
    {
      body.model.advance(10);
      body.model.adapt();
    }
    return body.fem->gather(fem::NodalField::displacement);
  };
  const Eigen::Matrix3Xd adaptive = run(Mode::adaptive), finite_elements = run(Mode::fem);
  EXPECT_GT(finite_elements.norm(), 0.);
  EXPECT_TRUE((adaptive.array() == finite_elements.array()).all());
}

// Everything is activated at once, or fixed from the start: the run is that of particles alone. Round-off of 300 steps.
TEST(Limits, FullActivationIsParticles)
{
  StripCase strip{Strip()};
  strip.settings.activation.sigma_star = 1e-300;
  strip.settings.activation.check_interval = 10;
  strip.settings.activation.relaxation_steps = 0;
  strip.settings.fixed_region = {{Vector3d(-1., -1., -1.), Vector3d(1., 1., 1.)}};
  const auto run = [&](Mode mode)
  {
    Body body(strip.settings, strip.packing, 1e-7, mode);
    body.set_state([](const Vector3d &x) { return Vector3d(1e-6 * x[0], 0., 0.); },
                   [](const Vector3d &x) { return Vector3d(std::sin(300. * x[0]), std::cos(200. * x[0]), 0.); });
    body.model.start();
    body.model.adapt();
    EXPECT_EQ(body.model.dem().n_active(), strip.packing.size());
    body.model.advance(300);
    return body.particle_displacements();
  };
  const Eigen::Matrix3Xd particles = run(Mode::dem), fixed = run(Mode::fixed), adaptive = run(Mode::adaptive);
  EXPECT_GT(particles.norm(), 0.);
  EXPECT_LT((fixed - particles).norm(), 1e-12 * particles.norm());
  EXPECT_LT((adaptive - particles).norm(), 1e-12 * particles.norm());
}

// An event takes the cells of the front along whose stress is above the fraction of sigma*; without a cell above sigma* there
// is none.
TEST(Rule, EventTakesTheFrontAlong)
{
  StripCase strip{Strip()};
  strip.settings.activation.criterion = Criterion::maximum_principal;
  const double h = strip.strip.cell_length(), front = strip.strip.region_end(), growth = 1e-4 / h;
  // Columns of cells at the front with mean strains of 1.5 and 0.5 growth h, none beyond. In plane strain, uniaxial.
  const double unit = growth * h * strip.settings.rock.density * std::pow(strip.settings.rock.speed_p(), 2);
  const auto displacement = [&](const Vector3d &x)
  {
    const double s = std::clamp(x[0] - front, 0., 2. * h);
    return Vector3d(growth * (2. * h * s - 0.5 * s * s), 0., 0.);
  };
  const auto columns = [&](double sigma_star, double fraction)
  {
    strip.settings.activation.sigma_star = sigma_star;
    strip.settings.activation.event_fraction = fraction;
    Body body(strip.settings, strip.packing, 1e-7, Mode::fixed);
    body.set_state(displacement, [](const Vector3d &) { return Vector3d(Vector3d::Zero()); });
    body.model.start();
    std::set<int> found;
    for (const int cell : body.model.rule().cells_to_convert(*body.fem, body.model.overlap()))
      found.insert(static_cast<int>((cell_centre(body.fem->mesh(), cell)[0] - front) / h));
    return found;
  };
  EXPECT_EQ(columns(unit, 1.), std::set<int>{0});
  EXPECT_EQ(columns(unit, 0.6), std::set<int>{0});
  EXPECT_EQ(columns(unit, 0.4), (std::set<int>{0, 1}));
  EXPECT_EQ(columns(0.4 * unit, 1.), (std::set<int>{0, 1}));
  EXPECT_EQ(columns(1.6 * unit, 0.), std::set<int>{});
}
