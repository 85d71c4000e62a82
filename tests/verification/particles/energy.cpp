// SPDX-License-Identifier: GPL-2.0-or-later
// The balance of energy of particles alone: what tool and boundary put in is stored, lost in a named way, or gone with the
// body.
#include "coupler/method/coupled_model.h"
#include "tests/support/dem_test_packings.h"

#include <algorithm>
#include <gtest/gtest.h>

using namespace kerf;
namespace test = kerf::dem::test;

namespace
{
constexpr double r = 5e-4;

/// A triangular lattice of discs that fills its mesh, in mode dem.
struct Body
{
  explicit Body(int columns = 24, int rows = 20) : packing(test::triangular_lattice(columns, rows, r))
  {
    fem::Settings rock;
    rock.mesh.lower = packing.lower;
    rock.mesh.upper = packing.upper;
    rock.mesh.cell_size = 4e-3;
    rock.material = {2400., 20e9, 0.2};
    fem = fem::make_fem_side(rock);
    settings.body.material = rock.material;
    settings.overlap.width = 4e-3;
    settings.constraint.penalty_ratio = 0.25;
    settings.bond = test::settings(packing).bond;
    settings.bond.k_n = 2e10;
    settings.bond.k_t = 5e9;
    settings.tool = ToolSettings();
    settings.tool.kind = ToolKind::none;
    settings.tool.radius = 4e-3;
    settings.tool.stiffness_ratio = 1.;
    settings.body.boundary_conditions = {condition(2, fem::BoundaryKind::fixed)};
  }
  static fem::BoundaryCondition condition(int id, fem::BoundaryKind kind) { return {id, "", kind}; }
  /// The disc comes from above, @p depth into the body at @p time.
  void press(double depth, double time)
  {
    settings.tool.kind = ToolKind::disc;
    const double x = 0.5 * (packing.lower[0] + packing.upper[0]), y = packing.upper[1] + settings.tool.radius;
    settings.tool.path = {{0., {x, y, 0.}}, {time, {x + 0.5 * depth, y - depth, 0.}}};
    settings.tool.smoothing_time = 0.2 * time;
    settings.tool.rolling = false;
    settings.tool.friction = 0.3;
    settings.tool.damping = 0.1;
  }

  struct Result
  {
    EnergyLedger end;
    double largest_work = 0., largest_residual = 0.;
    std::int64_t broken = 0;
    double relative() const { return largest_residual / largest_work; }
  };
  Result run(double time, int steps)
  {
    CoupledModel model(settings, Mode::dem, *fem, packing, time / steps, MPI_COMM_WORLD);
    model.start();
    Result result;
    for (int k = 0; k < 20; ++k)
    {
      model.advance(steps / 20);
      result.end = model.energies();
      result.largest_work = std::max(result.largest_work, std::abs(result.end.work()));
      result.largest_residual = std::max(result.largest_residual, std::abs(result.end.residual()));
    }
    result.broken = model.dem().n_bonds_broken();
    return result;
  }

  dem::Packing packing;
  std::unique_ptr<fem::FemSide> fem;
  ModelSettings settings;
};

/// Step of 1/4 of the stable one: omega^2 = 6.5 k_n / m for k_t = k_n / 4.
int steps_for(const Body &body, double time)
{
  const double mass = body.settings.body.material.density / body.packing.solid_fraction() * M_PI * r * r;
  return 20 * static_cast<int>(std::ceil(time / (0.25 * 2. / std::sqrt(6.5 * body.settings.bond.k_n / mass)) / 20.));
}

/// Elastic bodies: the balance holds up to the curvature of the potential, (1/12) U''' dx^3 a step: strains are 1e-3 and dx is
/// 1e-3 of the bond's stretch. 1e-6 of the work is asked for.
void expect_elastic_balance(Body &body, double time)
{
  const Body::Result result = body.run(time, steps_for(body, time));
  EXPECT_EQ(result.broken, 0);
  EXPECT_GT(result.largest_work, 0.);
  EXPECT_LT(result.relative(), 1e-6) << "residual " << result.largest_residual << " J of " << result.largest_work << " J";
  std::printf("  residual / work = %.2e\n", result.relative());
}
} // namespace

TEST(DemEnergy, ElasticBodyPressedByTheTool)
{
  Body body;
  body.press(2e-5, 2e-4);
  expect_elastic_balance(body, 2e-4);
}

TEST(DemEnergy, DampedElasticBodyPressedByTheTool)
{
  Body body;
  body.press(2e-5, 2e-4);
  body.settings.bond.damping = 0.1;
  body.settings.local_damping = 0.2;
  expect_elastic_balance(body, 2e-4);
}

TEST(DemEnergy, ElasticBodyWithAllKindsOfBoundaries)
{
  Body body;
  fem::BoundaryCondition top = Body::condition(3, fem::BoundaryKind::velocity);
  top.velocity = {0.05, 0.1, 0.};
  top.ramp = 5e-5;
  body.settings.body.boundary_conditions = {Body::condition(0, fem::BoundaryKind::absorbing),
                                            Body::condition(1, fem::BoundaryKind::roller),
                                            Body::condition(2, fem::BoundaryKind::fixed), top};
  expect_elastic_balance(body, 1e-4);
  body.settings.bond.damping = 0.1;
  expect_elastic_balance(body, 1e-4);
}

TEST(DemEnergy, CrushedBody)
{
  Body body;
  body.settings.bond.R_n = 1e-3 * 2. * r * body.settings.bond.k_n;
  body.settings.bond.R_t = 1e-3 * 2. * r * body.settings.bond.k_n;
  body.settings.bond.damping = 0.1;
  body.settings.local_damping = 0.1;
  body.press(1.5e-3, 5e-4);
  const int steps = steps_for(body, 5e-4);
  const Body::Result result = body.run(5e-4, steps);
  EXPECT_GT(result.broken, 100);
  EXPECT_GT(result.end.friction, 0.01 * result.largest_work);
  EXPECT_GT(result.end.released, 0.01 * result.largest_work);
  // Contacts close and open within a step, k/2 of gap times overlap each: second order in the step, 1e-4 here. 1e-3 is asked
  // for.
  EXPECT_LT(result.relative(), 4e-4) << "residual " << result.largest_residual << " J of " << result.largest_work << " J";
  std::printf("  %d broken, friction %.2f, released %.2f, damping %.2f of the work; residual / work = %.2e\n",
              static_cast<int>(result.broken), result.end.friction / result.largest_work,
              result.end.released / result.largest_work, result.end.damping / result.largest_work, result.relative());
}
