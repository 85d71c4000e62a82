// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_fixture.h"

#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
/// A bar that can only move along x.
Settings confined_bar(const double length, const double h)
{
  Settings settings = box({length, 2. * h, 0.}, h);
  settings.boundary_conditions = {condition(2, BoundaryKind::roller), condition(3, BoundaryKind::roller)};
  return settings;
}
} // namespace

// One-dimensional elasticity: a step of the end velocity V sends a front at c_p with stress -rho c_p V behind it.
TEST(FemWaves, StepVelocityAtTheEndOfAConfinedBar)
{
  const double h = 0.005, V = 1.;
  Settings settings = confined_bar(1., h);
  const double c = settings.material.speed_p();
  BoundaryCondition push = condition(0, BoundaryKind::velocity);
  push.velocity = {V, 0., 0.};
  push.ramp = 10. * h / c;
  settings.boundary_conditions.push_back(push);
  const auto side = make_fem_side(settings);
  const Mesh &mesh = side->mesh();
  const double dt = 0.8 * side->stable_step();
  const int n_steps = static_cast<int>(0.7 / (c * dt));
  for (int n = 1; n <= n_steps; ++n)
    step(*side, dt, n * dt);
  const double time = n_steps * dt;

  // Behind the front the ripple of the ramp averages out; strain V/c = 2.4e-4 makes the finite-strain law stiffer by 1.5 of it.
  const CellStress stress = side->cell_stress();
  double n_cells = 0., axial = 0., lateral = 0.;
  for (std::size_t i = 0; i < stress.cell.size(); ++i)
  {
    const double x = mesh.nodes(0, mesh.cells(0, stress.cell[i]));
    if (x > 0.1 && x < 0.5)
    {
      n_cells += 1.;
      axial += stress.sigma(0, i);
      lateral += stress.sigma(1, i);
    }
  }
  n_cells = global_sum(n_cells);
  axial = global_sum(axial) / n_cells;
  lateral = global_sum(lateral) / n_cells;
  const double exact = -settings.material.density * c * V;
  EXPECT_NEAR(axial, exact, 2e-3 * std::abs(exact));
  EXPECT_NEAR(lateral, exact * 0.2 / 0.8, 2e-3 * std::abs(exact));

  // Half height of the front lies half a ramp behind the front of the sharp step, to a cell.
  const Eigen::Matrix3Xd v = side->gather(NodalField::velocity);
  double front = 0.;
  for (int i = 0; i < mesh.n_nodes(); ++i)
    if (v(0, i) > 0.5 * V)
      front = std::max(front, mesh.nodes(0, i));
  EXPECT_NEAR(front, c * (time - 0.5 * push.ramp), h);

  // Work put in = energy in the bar = rho c V^2 (time - delay) per area (the ramp enters by less than its length, 5 %).
  const Energies energies = side->energies();
  EXPECT_NEAR(energies.boundary, total(energies), 2e-3 * total(energies));
  EXPECT_NEAR(energies.boundary, settings.material.density * c * V * V * time * 2. * h, 0.1 * energies.boundary);
}

namespace
{
/// A cosine-squared pulse about @p centre of half length 0.1 m that runs to the right at speed @p c; @p d: direction of motion.
void set_pulse(FemSide &side, const double centre, const double c, const int d)
{
  const double half = 0.1, height = 1e-5;
  const Eigen::Matrix3Xd &X = side.mesh().nodes;
  Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, X.cols()), v = u;
  for (int i = 0; i < X.cols(); ++i)
  {
    const double s = (X(0, i) - centre) / half;
    if (std::abs(s) < 1.)
    {
      u(d, i) = height * std::pow(std::cos(0.5 * M_PI * s), 2);
      v(d, i) = c * height * M_PI / half * std::cos(0.5 * M_PI * s) * std::sin(0.5 * M_PI * s);
    }
  }
  side.set_state(u, v);
}

/// Steps until a wave of speed c has travelled that far.
void travel(FemSide &side, const double distance, const double c)
{
  const double dt = 0.8 * side.stable_step();
  const int n_steps = static_cast<int>(distance / (c * dt));
  for (int n = 1; n <= n_steps; ++n)
    step(side, dt, n * dt);
}
} // namespace

// Energy balance: at 0.8 of the limit the step scheme's energy of a wave of 40 cells swings by (omega dt/2)^2 = 0.4 %.
// Normal incidence: the dashpot matches the impedance of the wave; what is left comes from the mesh (pulse of 40 cells).
TEST(FemWaves, AbsorbingEndTakesAPressurePulse)
{
  Settings settings = confined_bar(1., 0.005);
  settings.boundary_conditions.push_back(condition(1, BoundaryKind::absorbing));
  const auto side = make_fem_side(settings);
  const double c = settings.material.speed_p();
  set_pulse(*side, 0.6, c, 0);
  const double initial = total(side->energies());
  travel(*side, 0.75, c);
  const Energies left = side->energies();
  EXPECT_LT(total(left), 0.01 * initial);
  EXPECT_NEAR(left.absorbed + total(left), initial, 4e-3 * initial);
}

// The middle row of a slab so tall that nothing from its free sides arrives in time; pulse of 40 cells.
TEST(FemWaves, AbsorbingSideTakesAShearPulse)
{
  Settings settings = box({0.5, 1.4, 0.}, 0.005);
  settings.boundary_conditions = {condition(1, BoundaryKind::absorbing)};
  const auto side = make_fem_side(settings);
  const double c = settings.material.speed_s();
  set_pulse(*side, 0.3, c, 1);
  const auto fastest_of_middle_row = [&side]
  {
    const Eigen::Matrix3Xd v = side->gather(NodalField::velocity);
    double fastest = 0.;
    for (int i = 0; i < v.cols(); ++i)
      if (std::abs(side->mesh().nodes(1, i) - 0.7) < 0.005)
        fastest = std::max(fastest, v.col(i).norm());
    return fastest;
  };
  const double incident = fastest_of_middle_row();
  travel(*side, 0.1, c);
  EXPECT_GT(fastest_of_middle_row(), 0.9 * incident) << "not there yet";
  travel(*side, 0.25, c);
  EXPECT_LT(fastest_of_middle_row(), 0.03 * incident); // amplitude; energy is its square
}
