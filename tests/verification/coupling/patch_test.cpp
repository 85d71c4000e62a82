// SPDX-License-Identifier: GPL-2.0-or-later
// Static patch test: a uniform strain goes through the overlap of a strip whose ends are held.
#include "tests/support/strip_patch.h"

#include <gtest/gtest.h>

using namespace kerf;
using Eigen::Vector3d;
using test::Body;
using test::Direction;
using test::PatchErrors;
using test::Strip;
using test::StripCase;

namespace
{
void strain(Body &body, Direction direction, double strain)
{
  body.set_state([&](const Vector3d &x) { return Vector3d(strain * x[0] * test::unit(direction)); },
                 [](const Vector3d &) { return Vector3d(Vector3d::Zero()); });
  body.model.start();
}

/// Relative error of the strain of a lattice's core after 500 steps, several passages of a wave through the overlap. Terms of
/// second order of the strain, in which lattice and finite elements differ, cancel between tension and compression.
double lattice_error(StripCase strip, Direction direction)
{
  test::hold_ends(strip.settings);
  constexpr double eps = 1e-5;
  double sum = 0.;
  for (const double sign : {-1., 1.})
  {
    Body body(strip.settings, strip.packing, Mode::fixed);
    strain(body, direction, sign * eps);
    body.model.advance(500);
    sum += sign * test::slope(body, static_cast<int>(direction), 2. * Strip::d, strip.strip.region_end() - Strip::d);
  }
  return std::abs(0.5 * sum / eps - 1.);
}

double lattice_error(std::string method, double penalty_ratio, Direction direction)
{
  StripCase strip{Strip()};
  strip.settings.constraint.method = method;
  strip.settings.constraint.penalty_ratio = penalty_ratio;
  return lattice_error(strip, direction);
}

/// A rock with nu = 1/4: bonds carry no shear, k_t/k_n = 1 - 4 nu.
StripCase central_forces()
{
  StripCase strip{Strip()};
  strip.settings.constraint.method = "weak_multipliers";
  fem::Material &rock = strip.settings.body.material;
  rock.poisson = 0.25;
  strip.settings.bond.k_n = rock.young / (std::sqrt(3.) * 1.25 * 0.5);
  strip.settings.bond.k_t = 0.;
  return strip;
}

/// Means over packings.
PatchErrors mean_random_errors(const Case &method, Direction direction, const std::vector<int> &seeds)
{
  PatchErrors mean;
  for (const int seed : seeds)
  {
    const PatchErrors one = test::random_errors(method, seed, direction, 4);
    std::cout << "[ packing  ] " << seed << (direction == Direction::tension ? " tension" : " shear") << ": strain "
              << 100. * one.strain << " %, overlap energy " << 100. * one.energy << " %" << std::endl;
    mean.strain += std::abs(one.strain) / seeds.size();
    mean.energy += one.energy / seeds.size();
  }
  return mean;
}

Case method(std::string constraint, double ratio = 0.)
{
  Case result;
  result.constraint.method = constraint;
  result.constraint.penalty_ratio = ratio;
  return result;
}
} // namespace

// The lattice's columns are a trapezoidal rule over overlap and cells, so the load that the weights put on the particles is
// what constant multipliers balance: exact up to round-off of positions, 1e-17 m over the core's 40 mm, and eps^2. No
// multiplier balances couples: those of the bonds of a particle balance with any weights, see bond_weight().
TEST(LatticePatch, MultipliersAreExact)
{
  EXPECT_LT(lattice_error(central_forces(), Direction::tension), 1e-8);
  EXPECT_LT(lattice_error(central_forces(), Direction::shear), 1e-8);
  EXPECT_LT(lattice_error("weak_multipliers", 0., Direction::tension), 1e-8);
  EXPECT_LT(lattice_error("weak_multipliers", 0., Direction::shear), 1e-8);
}

// The same in space: face-centred cubic, columns of cube faces along x, isotropic for k_t = k_n, which means nu = 0 and
// E = 2 sqrt(2) k_n/d.
TEST(LatticePatch, MultipliersAreExactInSpace)
{
  const double d = Strip::d, edge = 3. * std::sqrt(2.) * d; // of a cell: three cubes, six planes
  Case settings = test::lattice_rock(d);
  settings.body.material.poisson = 0.;
  settings.bond.k_n = settings.bond.k_t = settings.body.material.young * d / (2. * std::sqrt(2.));
  settings.body.mesh.upper = Vector3d(9. * edge, 2. * edge, 2. * edge);
  settings.body.mesh.cell_size = edge;
  settings.body.mesh.periodic = {{false, true, true}};
  settings.packing.dim = settings.body.dim = 3;
  settings.packing.kind = "fcc";
  settings.packing.upper = settings.body.mesh.upper;
  settings.packing.periodic = settings.body.mesh.periodic;
  settings.packing.lattice = {0, 0.};
  settings.overlap.width = 3. * edge;
  settings.constraint.method = "weak_multipliers";
  settings.constraint.fluctuation_relaxation = 0.05;
  settings.fixed_region.push_back({Vector3d(0., -1., -1.), Vector3d(3. * edge, 1., 1.)});
  test::hold_ends(settings);
  constexpr double eps = 1e-5;
  for (const Direction direction : {Direction::tension, Direction::shear})
  {
    double sum = 0.;
    for (const double sign : {-1., 1.})
    {
      Body body(settings);
      strain(body, direction, sign * eps);
      EXPECT_GT(body.model.n_overlap_particles(), 500);
      body.model.advance(200);
      sum += sign * test::slope(body, static_cast<int>(direction), 2. * d, 3. * edge - d);
    }
    EXPECT_LT(std::abs(0.5 * sum / eps - 1.), 1e-8);
  }
}

// A penalty k_p gives way to the same load by eps d (d/L_o)(k_n/k_p) at both ends of nothing but one overlap; over the core of
// 43 d that is 0.13 % for k_p = k_n, and vibrates to twice as much.
TEST(LatticePatch, PenaltyIsClose)
{
  for (const Direction direction : {Direction::tension, Direction::shear})
  {
    EXPECT_LT(lattice_error("penalty", 1., direction), 5e-3);
    EXPECT_LT(lattice_error("penalty_mass_scaled", 0.25, direction), 5e-3);
  }
}

// Weak multipliers tie means only, so the packing keeps its fluctuations: mean strain within 0.5 %, energy of the overlap
// within 2 % (means over packings; single ones scatter by about a per cent as pieces of them are softer or stiffer).
TEST(RandomPatch, MultipliersKeepTheModulus)
{
  for (const Direction direction : {Direction::tension, Direction::shear})
  {
    const PatchErrors errors = mean_random_errors(method("weak_multipliers"), direction, {1, 2});
    EXPECT_LT(errors.strain, 5e-3);
    EXPECT_LT(std::abs(errors.energy), 0.02);
  }
}

// Tying every particle of a random packing to the smooth field takes its fluctuations away: too stiff.
TEST(RandomPatch, StiffPenaltyIsTooStiff)
{
  const PatchErrors errors = mean_random_errors(method("penalty", 4.), Direction::shear, {1, 2});
  EXPECT_GT(errors.energy, 0.03);
}

// With the corrector the springs tie particles to where they fluctuate to, and the overlap is no stiffer than its parts: the
// same springs without it are 4.6 % too stiff.
TEST(RandomPatch, CorrectedPenaltyKeepsTheModulus)
{
  Case corrected = method("penalty", 1.);
  corrected.constraint.corrector = true;
  const PatchErrors errors = mean_random_errors(corrected, Direction::shear, {1, 2});
  EXPECT_LT(errors.strain, 5e-3);
  EXPECT_LT(std::abs(errors.energy), 0.01);
}
