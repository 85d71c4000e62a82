// SPDX-License-Identifier: GPL-2.0-or-later
// Static patch test: a uniform strain goes through the overlap of a strip whose ends are held.
#include "tests/unit/coupled_strip.h"

#include <gtest/gtest.h>

using namespace kerf;
using Eigen::Vector3d;
using test::Body;
using test::Strip;
using test::StripCase;

namespace
{
enum Direction
{
  tension = 0, ///< u_x = eps x
  shear = 1    ///< u_y = gamma x
};

void hold_ends(Case &settings)
{
  for (const int id : {0, 1})
  {
    fem::BoundaryCondition end;
    end.id = id;
    end.kind = fem::BoundaryKind::fixed;
    settings.boundary_conditions.push_back(end);
  }
}

void strain(Body &body, Direction direction, double strain)
{
  body.set_state([&](const Vector3d &x) { return Vector3d(strain * x[0] * Vector3d::Unit(direction)); },
                 [](const Vector3d &) { return Vector3d(Vector3d::Zero()); });
  body.model.start();
}

/// Relative error of the strain of a lattice's core after 500 steps, several passages of a wave through the overlap. Terms of
/// second order of the strain, in which lattice and finite elements differ, cancel between tension and compression.
double lattice_error(ConstraintMethod method, double penalty_ratio, Direction direction)
{
  StripCase strip{Strip()};
  strip.settings.constraint = method;
  strip.settings.penalty_ratio = penalty_ratio;
  hold_ends(strip.settings);
  constexpr double eps = 1e-5;
  double sum = 0.;
  for (const double sign : {-1., 1.})
  {
    Body body(strip.settings, strip.packing, Mode::fixed);
    strain(body, direction, sign * eps);
    body.model.advance(500);
    sum += sign * test::slope(body, direction, 2. * Strip::d, strip.strip.region_end() - Strip::d);
  }
  return std::abs(0.5 * sum / eps - 1.);
}

/// Deviations of a random strip at rest.
struct PatchErrors
{
  double strain = 0.; ///< of the core's mean strain from that of particles alone, relative
  double energy = 0.; ///< excess of the body's energy, relative to the energy of the overlap
};

/// What the state of particles alone would hold in the coupled body: its bonds with the weights of the overlap, and a uniform
/// strain in the finite elements.
PatchErrors random_errors(const Case &method, int seed, Direction direction)
{
  Strip shape;
  shape.random = true;
  shape.seed = seed;
  shape.region = 8;
  shape.high = 5;
  StripCase strip(shape);
  strip.settings.constraint = method.constraint;
  strip.settings.penalty_ratio = method.penalty_ratio;
  strip.settings.fluctuation_relaxation = 0.05;
  strip.settings.local_damping = 0.4;
  hold_ends(strip.settings);
  constexpr double eps = 1e-5;
  constexpr int steps = 4000;
  const double from = 4. * Strip::d, to = shape.region_end() - 2. * Strip::d;

  Body coupled(strip.settings, strip.packing, Mode::fixed);
  strain(coupled, direction, eps);
  coupled.model.advance(steps);
  const EnergyLedger energy = coupled.model.energies();
  EXPECT_LT(energy.kinetic, 1e-5 * energy.elastic);

  Body particles(strip.settings, strip.packing, Mode::dem);
  strain(particles, direction, eps);
  particles.model.advance(steps);
  EXPECT_LT(particles.model.energies().kinetic, 1e-5 * particles.model.energies().elastic);
  const double whole = test::slope(particles, direction, from, to);
  particles.model.dem().set_weights(coupled.model.overlap().de_weights());
  particles.model.dem().setup([](dem::Phase, dem::Particles &) {});

  const fem::Material &rock = strip.settings.rock;
  const double modulus = direction == tension ? rock.lame_lambda() + 2. * rock.lame_mu() : rock.lame_mu();
  const double density = 0.5 * modulus * eps * eps; // of energy
  const double in_fem = density * (shape.fem + 0.5 * shape.overlap) * shape.cell_length() * shape.height();
  const double expected = particles.model.dem().energies().elastic + in_fem;
  PatchErrors errors;
  errors.strain = (test::slope(coupled, direction, from, to) - whole) / eps;
  errors.energy = (energy.elastic + energy.coupling - expected) / (density * shape.overlap_width() * shape.height());
  return errors;
}

/// Means over packings.
PatchErrors mean_random_errors(const Case &method, Direction direction, const std::vector<int> &seeds)
{
  PatchErrors mean;
  for (const int seed : seeds)
  {
    const PatchErrors one = random_errors(method, seed, direction);
    std::cout << "[ packing  ] " << seed << (direction == tension ? " tension" : " shear") << ": strain "
              << 100. * one.strain << " %, overlap energy " << 100. * one.energy << " %" << std::endl;
    mean.strain += std::abs(one.strain) / seeds.size();
    mean.energy += one.energy / seeds.size();
  }
  return mean;
}

Case method(ConstraintMethod constraint, double ratio = 0.)
{
  Case result;
  result.constraint = constraint;
  result.penalty_ratio = ratio;
  return result;
}
} // namespace

// The lattice's columns are a trapezoidal rule over overlap and cells, so the load that the weights put on the particles is
// what constant multipliers balance: exact up to round-off of positions, 1e-17 m over the core's 40 mm, and eps^2.
TEST(LatticePatch, MultipliersAreExact)
{
  EXPECT_LT(lattice_error(ConstraintMethod::multipliers, 0., tension), 1e-8);
  EXPECT_LT(lattice_error(ConstraintMethod::multipliers, 0., shear), 1e-8);
}

// A penalty k_p gives way to the same load by eps d (d/L_o)(k_n/k_p) at both ends of nothing but one overlap; over the core of 43 d
// that is 0.13 % for k_p = k_n, and vibrates to twice as much.
TEST(LatticePatch, PenaltyIsClose)
{
  for (const Direction direction : {tension, shear})
  {
    EXPECT_LT(lattice_error(ConstraintMethod::penalty, 1., direction), 5e-3);
    EXPECT_LT(lattice_error(ConstraintMethod::penalty_mass_scaled, 0.25, direction), 5e-3);
  }
}

// Weak multipliers tie means only, so the packing keeps its fluctuations: mean strain within 0.5 %, energy of the overlap
// within 2 % (means over packings; single ones scatter by about a per cent as pieces of them are softer or stiffer).
TEST(RandomPatch, MultipliersKeepTheModulus)
{
  for (const Direction direction : {tension, shear})
  {
    const PatchErrors errors = mean_random_errors(method(ConstraintMethod::multipliers), direction, {1, 2});
    EXPECT_LT(errors.strain, 5e-3);
    EXPECT_LT(std::abs(errors.energy), 0.02);
  }
}

// Tying every particle of a random packing to the smooth field takes its fluctuations away: too stiff.
TEST(RandomPatch, StiffPenaltyIsTooStiff)
{
  const PatchErrors errors = mean_random_errors(method(ConstraintMethod::penalty, 10.), shear, {1, 2});
  EXPECT_GT(errors.energy, 0.04);
}
