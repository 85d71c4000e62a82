// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_fixture.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
Eigen::Matrix<double, 6, 1> voigt(const Eigen::Matrix3d &m)
{
  Eigen::Matrix<double, 6, 1> result;
  result << m(0, 0), m(1, 1), m(2, 2), m(1, 2), m(0, 2), m(0, 1);
  return result;
}

BoundaryCondition where(const std::string &expression, const BoundaryKind kind)
{
  BoundaryCondition result;
  result.where = expression;
  result.kind = kind;
  return result;
}
} // namespace

// Weight is lumped mass times gravity, so a body falls as a point: v = g t, and u = g t^2/2 at the steps of the scheme. A
// smooth start T costs T/2 of the time.
TEST(FemLoads, FreeFall)
{
  Settings settings = box({0.3, 0.2, 0.}, 0.1);
  settings.gravity = {1., -9.81, 0.};
  for (const double ramp : {0., 1.})
  {
    const auto side = make_fem_side(settings);
    const double dt = 0.5 * side->stable_step();
    settings.gravity_ramp = ramp * 20. * dt;
    const auto falling = make_fem_side(settings);
    for (int n = 1; n <= 100; ++n)
      step(*falling, dt, n * dt);
    const double time = 100. * dt, effective = time - 0.5 * settings.gravity_ramp;
    const Eigen::Matrix3Xd v = falling->gather(NodalField::velocity), u = falling->gather(NodalField::displacement);
    for (int i = 0; i < v.cols(); ++i)
    {
      EXPECT_LT((v.col(i) - effective * settings.gravity).norm(), 1e-12 * v.col(i).norm());
      if (ramp == 0.)
      {
        EXPECT_LT((u.col(i) - 0.5 * time * time * settings.gravity).norm(), 1e-11 * u.col(i).norm());
      }
    }
    const Energies energies = falling->energies();
    // Work by the trapezoidal rule lacks (dt g)^2/8 of v^2/2 once the force has risen: 1/(4 90^2) = 3.1e-5 after 90 steps.
    EXPECT_NEAR(energies.boundary, energies.kinetic, (ramp == 0. ? 1e-10 : 3.2e-5) * energies.kinetic);
  }
}

// A column between rollers, loaded by its weight so slowly that it does not swing: vertical stress rho g depth, horizontal
// nu/(1 - nu) of it. A half cosine over ten periods leaves less than 1 % of swing.
TEST(FemLoads, ColumnUnderItsWeight)
{
  const double height = 1., h = 0.05;
  Settings settings = box({2. * h, height, 0.}, h);
  settings.boundary_conditions = {condition(0, BoundaryKind::roller), condition(1, BoundaryKind::roller),
                                  condition(2, BoundaryKind::fixed)};
  settings.gravity = {0., -9.81, 0.};
  settings.gravity_ramp = 40. * height / settings.material.speed_p();
  const auto side = make_fem_side(settings);
  const double dt = 0.8 * side->stable_step();
  const int n_steps = static_cast<int>(1.1 * settings.gravity_ramp / dt);
  for (int n = 1; n <= n_steps; ++n)
    step(*side, dt, n * dt);
  const double bottom = settings.material.density * 9.81 * height;
  const CellStress stress = side->cell_stress();
  for (std::size_t i = 0; i < stress.cell.size(); ++i)
  {
    double y = 0.;
    for (int a = 0; a < 4; ++a)
      y += 0.25 * side->mesh().nodes(1, side->mesh().cells(a, stress.cell[i]));
    const double exact = -settings.material.density * 9.81 * (height - y);
    EXPECT_NEAR(stress.sigma(1, i), exact, 0.01 * bottom);
    EXPECT_NEAR(stress.sigma(0, i), 0.25 * exact, 0.01 * bottom);
  }
}

// One-dimensional: a traction p on the end of a confined bar sends a front with stress p and velocity -p/(rho c).
TEST(FemLoads, TractionSendsAStressWave)
{
  const double h = 0.005, p = -2e6;
  Settings settings = box({1., 2. * h, 0.}, h);
  const double c = settings.material.speed_p(), impedance = settings.material.density * c;
  BoundaryCondition push = where("x < 1e-6", BoundaryKind::traction);
  push.traction = {-p, 0., 0.}; // on the face with normal -x
  push.ramp = 10. * h / c;
  settings.boundary_conditions = {condition(2, BoundaryKind::roller), condition(3, BoundaryKind::roller), push};
  const auto side = make_fem_side(settings);
  const double dt = 0.8 * side->stable_step();
  const int n_steps = static_cast<int>(0.7 / (c * dt));
  for (int n = 1; n <= n_steps; ++n)
    step(*side, dt, n * dt);
  double n_cells = 0., axial = 0.;
  const CellStress stress = side->cell_stress();
  for (std::size_t i = 0; i < stress.cell.size(); ++i)
  {
    const double x = side->mesh().nodes(0, side->mesh().cells(0, stress.cell[i]));
    if (x > 0.1 && x < 0.5)
    {
      n_cells += 1.;
      axial += stress.sigma(0, i);
    }
  }
  EXPECT_NEAR(global_sum(axial) / global_sum(n_cells), p, 2e-3 * std::abs(p)); // the ripple of the ramp averages out
  // Work put in = energy = p^2/impedance x time x area, less half the ramp.
  const Energies energies = side->energies();
  EXPECT_NEAR(energies.boundary, total(energies), 2e-3 * total(energies));
  EXPECT_NEAR(energies.boundary, p * p / impedance * n_steps * dt * 2. * h, 0.1 * energies.boundary);
}

namespace
{
Settings stressed_body(const int dim)
{
  Settings settings = box({0.4, 0.3, dim == 3 ? 0.3 : 0.}, 0.1);
  settings.mesh.refined = {{{0.1, 0.1, 0.1}, {0.2, 0.2, 0.2}, 1}};
  settings.initial_stress << -20e6, 3e6, 1e6, 3e6, -35e6, -2e6, 1e6, -2e6, -10e6;
  return settings;
}
} // namespace

// Homogeneous stress held by in-situ tractions, fixed, roller and absorbing sides is in equilibrium to round-off and stays so:
// 1e-13 of the force that the traction makes on a side a step, 200 steps of them accumulate to less than 1e-10 of sigma/(rho
// c).
TEST(FemLoads, InitialStressIsInEquilibrium)
{
  for (const int dim : {2, 3})
  {
    Settings settings = stressed_body(dim);
    settings.boundary_conditions = {condition(0, BoundaryKind::in_situ), condition(1, BoundaryKind::absorbing),
                                    condition(2, BoundaryKind::fixed), condition(3, BoundaryKind::in_situ)};
    if (dim == 3)
    {
      settings.boundary_conditions.push_back(condition(4, BoundaryKind::in_situ));
      settings.boundary_conditions.push_back(condition(5, BoundaryKind::absorbing));
    }
    const auto side = make_fem_side(settings);
    const Mesh &mesh = side->mesh();
    side->compute_forces();
    const Eigen::Matrix3Xd f = side->gather(NodalField::force), before = side->gather(NodalField::displacement);
    const double scale = 35e6 * (dim == 3 ? 0.01 : 0.1);
    for (int i = 0; i < mesh.n_nodes(); ++i)
    {
      if (mesh.nodes(1, i) > 0.)
      {
        EXPECT_LT(f.col(i).norm(), 1e-9 * scale) << dim << ' ' << mesh.nodes.col(i).transpose(); // u/E amplifies round-off
      }
    }
    const double dt = 0.8 * side->stable_step();
    for (int n = 1; n <= 200; ++n)
      step(*side, dt, n * dt);
    const double speed = 35e6 / (rock().density * rock().speed_p());
    EXPECT_LT(side->gather(NodalField::velocity).cwiseAbs().maxCoeff(), 1e-8 * speed);
    EXPECT_LT((side->gather(NodalField::displacement) - before).norm(), 1e-8 * before.norm());
    Eigen::Matrix3d expected = settings.initial_stress;
    const CellStress stress = side->cell_stress();
    for (int i = 0; i < stress.sigma.cols(); ++i)
    {
      if (dim == 2) // plane strain: out of plane follows from in plane, St. Venant-Kirchhoff differs from Hooke by the strain
      {
        expected(2, 2) = 0.2 * (expected(0, 0) + expected(1, 1));
        EXPECT_NEAR(stress.sigma(2, i), expected(2, 2), 2e-3 * 35e6);
        expected(2, 2) = stress.sigma(2, i);
        expected(0, 2) = expected(1, 2) = 0.;
      }
      EXPECT_LT((stress.sigma.col(i) - voigt(expected)).norm(), 1e-9 * 35e6);
    }
  }
}

// The surface that tools meet stays where it is: the middle of the top does not move.
TEST(FemLoads, InitialStressLeavesTheMiddleOfTheTop)
{
  const auto side = make_fem_side(stressed_body(2));
  const Eigen::Matrix3Xd u = side->gather(NodalField::displacement);
  for (int i = 0; i < u.cols(); ++i)
  {
    if ((side->mesh().nodes.col(i) - Eigen::Vector3d(0.2, 0.3, 0.)).norm() < 1e-9)
    {
      EXPECT_LT(u.col(i).norm(), 1e-18);
    }
  }
  EXPECT_GT(u.norm(), 1e-6);
  Settings impossible = stressed_body(2);
  impossible.initial_stress *= 1e6;
  EXPECT_NE(error_of(impossible).find("initial stress"), std::string::npos);
}

// Without what holds it, the initial stress is let go: the elastic energy turns into motion.
TEST(FemLoads, InitialStressDrivesFreeSides)
{
  const auto side = make_fem_side(stressed_body(2));
  const double initial = total(side->energies()), dt = 0.5 * side->stable_step();
  double fastest = 0.;
  for (int n = 1; n <= 60; ++n)
  {
    step(*side, dt, n * dt);
    fastest = std::max(fastest, side->energies().kinetic);
  }
  EXPECT_GT(fastest, 0.3 * initial);
}

TEST(FemLoads, ExpressionsSelectWhatIdsSelect)
{
  const auto moved = [](const BoundaryCondition &bottom, BoundaryCondition push)
  {
    Settings settings = box({0.6, 0.3, 0.}, 0.05);
    push.kind = BoundaryKind::velocity;
    push.velocity = {0.3, -0.5, 0.};
    settings.boundary_conditions = {bottom, push};
    const auto side = make_fem_side(settings);
    const double dt = 0.5 * side->stable_step();
    for (int n = 1; n <= 20; ++n)
      step(*side, dt, n * dt);
    return side->gather(NodalField::displacement);
  };
  const Eigen::Matrix3Xd by_id = moved(condition(2, BoundaryKind::fixed), condition(3, BoundaryKind::velocity));
  const Eigen::Matrix3Xd by_place =
    moved(where("y < 1e-6", BoundaryKind::fixed), where("y > 0.3 - 1e-6", BoundaryKind::velocity));
  EXPECT_GT(by_id.norm(), 0.);
  EXPECT_EQ(by_id, by_place);

  // A part of a side, which no id names.
  Settings settings = box({0.6, 0.3, 0.}, 0.05);
  settings.boundary_conditions = {where("abs(y - 0.3) < 1e-6 && x > 0.2 && x < 0.4", BoundaryKind::fixed)};
  const auto side = make_fem_side(settings);
  const std::vector<char> chosen = selected_faces(side->mesh(), settings.boundary_conditions[0]);
  EXPECT_EQ(std::count(chosen.begin(), chosen.end(), 1), 4);
}

TEST(FemLoads, UnusableConditionsGiveOneLine)
{
  const auto contains = [](const std::string &text, const std::string &part)
  { return text.find(part) != std::string::npos && text.find('\n') == std::string::npos; };
  Settings settings = box({0.6, 0.3, 0.}, 0.05);
  settings.boundary_conditions = {where("y < -1", BoundaryKind::fixed)};
  EXPECT_TRUE(contains(error_of(settings), "no boundary face"));
  settings.boundary_conditions = {where("y << 1", BoundaryKind::fixed)};
  EXPECT_TRUE(contains(error_of(settings), "no expression of x, y and z"));
  settings.boundary_conditions = {where("depth < 1", BoundaryKind::fixed)};
  EXPECT_TRUE(contains(error_of(settings), "'depth < 1'"));
  settings.boundary_conditions = {condition(0, BoundaryKind::fixed), condition(0, BoundaryKind::fixed)};
  EXPECT_TRUE(contains(error_of(settings), "id 0 is given twice"));
}

// A roller lets the rock slide, so shear across it is refused; shear in its plane, which the traction on it lacks, is not.
TEST(FemLoads, RollersCannotHoldShear)
{
  Settings settings = box({2., 2., 2.}, 1.);
  settings.initial_stress.diagonal() << -3e6, -2e6, -1e6;
  settings.boundary_conditions = {condition(0, BoundaryKind::roller)};
  EXPECT_NO_THROW(make_fem_side(settings));
  settings.initial_stress(1, 2) = settings.initial_stress(2, 1) = 1e6;
  EXPECT_NO_THROW(make_fem_side(settings));
  settings.initial_stress(0, 1) = settings.initial_stress(1, 0) = 1e6;
  EXPECT_THROW(make_fem_side(settings), std::invalid_argument);
  settings.boundary_conditions = {condition(0, BoundaryKind::in_situ)};
  EXPECT_NO_THROW(make_fem_side(settings));
}
