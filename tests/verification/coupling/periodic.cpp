// SPDX-License-Identifier: GPL-2.0-or-later
// Coupled strips that repeat themselves across y: the overlap depends on x only, waves stay plane.
#include "coupler/base/mesh_geometry.h"
#include "tests/support/coupled_body.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

using namespace kerf;
using Eigen::Vector3d;
using test::Body;

namespace
{
constexpr double d = 1e-3; // particle spacing [m]
const double column = 0.5 * std::sqrt(3.) * d;
constexpr int cells_x = 20, columns_a_cell = 4;
const double h = columns_a_cell * column, cell_height = 4. * d, height = 2. * cell_height;

/// Particles left of the tenth cell, an overlap of five cells, finite elements right of it; overlap and particle region end at
/// columns of the lattice.
Case make_case()
{
  Case settings = test::lattice_rock(d);
  settings.body.mesh.upper = Vector3d(cells_x * h, height, 0.);
  settings.body.mesh.cell_size = h;
  settings.body.mesh.periodic = {{false, true, false}};
  settings.packing.upper = settings.body.mesh.upper;
  settings.packing.periodic = settings.body.mesh.periodic;
  settings.packing.lattice = {1, 0.};
  settings.overlap.width = 5. * h;
  settings.fixed_region.push_back({Vector3d(0., -d, -1.), Vector3d(10. * h, height + d, 1.)});
  return settings;
}

const auto zero = [](const Vector3d &) { return Vector3d(Vector3d::Zero()); };

/// Largest difference between columns of a field at places that are the same along x and, modulo @p period, along y [m].
double unevenness(const Eigen::Matrix3Xd &points, const Eigen::Matrix3Xd &field, double period)
{
  std::map<std::pair<long, long>, Vector3d> of_place;
  double worst = 0.;
  for (int i = 0; i < points.cols(); ++i)
  {
    const long along = std::lround(1e3 * points(0, i) / column), repeats = std::lround(1e3 * period / d);
    const auto entry = of_place.emplace(std::pair(along, std::lround(1e3 * points(1, i) / d) % repeats), field.col(i));
    worst = std::max(worst, (entry.first->second - field.col(i)).norm());
  }
  return worst;
}
} // namespace

TEST(PeriodicOverlap, DistancesGoAcrossTheSeam)
{
  const Case settings = make_case();
  const dem::Packing packing = dem::generate_packing(settings.packing);
  fem::Settings fem_settings;
  fem_settings.mesh = settings.body.mesh;
  fem_settings.material = settings.body.material;
  const auto fem = fem::make_fem_side(fem_settings);
  const fem::Mesh &mesh = fem->mesh();
  // One cell at the upper seam: the distance of any particle is that to the nearest of the cell's images, also when several
  // images are within reach.
  int chosen = -1;
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    if (cell_centre(mesh, cell)[1] > height - cell_height && std::abs(cell_centre(mesh, cell)[0] - 7.5 * h) < 0.1 * h)
      chosen = cell;
  ASSERT_GE(chosen, 0);
  const double reach = 4. * h;
  RegionDistance distance(mesh, packing.positions, reach);
  distance.add_cell(chosen);
  const Vector3d lower = mesh.nodes.col(mesh.cells(0, chosen)), upper = mesh.nodes.col(mesh.cells(3, chosen));
  for (int i = 0; i < packing.size(); ++i)
  {
    double exact = reach;
    for (int image = -3; image <= 3; ++image)
    {
      const Vector3d x = packing.positions.col(i) - image * Vector3d(0., height, 0.);
      exact = std::min(exact, (lower - x).cwiseMax(x - upper).cwiseMax(0.).norm());
    }
    EXPECT_NEAR(distance.values()[i], exact, 1e-14);
  }

  // A region from side to side: weights are functions of x, linear here, and sum to one.
  Overlap overlap(mesh, fem->quadrature_points(), fem->surface_positions(), packing, settings.overlap.weight_function,
                  settings.overlap.width);
  overlap.convert(cells_inside(mesh, settings.fixed_region));
  const Eigen::VectorXd de = overlap.de_weights(), fe = overlap.fe_weights();
  const auto alpha = [&](double x) { return std::clamp((x - 10. * h) / settings.overlap.width, 0., 1.); };
  for (int i = 0; i < packing.size(); ++i)
    EXPECT_NEAR(de[i], 1. - alpha(packing.positions(0, i)), 1e-12);
  for (int q = 0; q < fe.size(); ++q)
    EXPECT_NEAR(fe[q], alpha(fem->quadrature_points()(0, q)), 1e-12);
}

// A translation by more than the height of the strip: particles come back on the other side, the nodes do not, and nothing is
// to be exchanged. Round-off of the displacements, 1e-18 m x k_n, over 500 steps.
TEST(PeriodicBody, TranslatesThroughTheSeam)
{
  Body body(make_case());
  const Vector3d speed(10., 1.3 * height / (500. * body.dt), 0.);
  body.set_state(zero, [&](const Vector3d &) { return speed; });
  body.model.start();
  body.model.advance(500);
  EXPECT_GT(body.model.n_overlap_particles(), 100);
  const dem::Particles particles = body.model.dem().particles();
  double worst = 0.;
  for (int i = 0; i < particles.n; ++i)
    worst = std::max(worst, (Vector3d(particles.velocity.col(i)) - speed).norm());
  EXPECT_LT(worst, 1e-9 * speed.norm());
  EXPECT_EQ(body.model.dem().left_domain().size(), 0u);
  const EnergyLedger energy = body.model.energies();
  EXPECT_LT(energy.elastic + energy.coupling, 1e-12 * energy.kinetic);
}

namespace
{
/// A pulse from the finite elements through the overlap into the particles, displacements along @p direction.
void run_pulse(Body &body, int direction, double amplitude)
{
  const double speed = direction == 0 ? body.settings.body.material.speed_p() : body.settings.body.material.speed_s();
  const auto shape = [](const Vector3d &x) { return std::abs(x[0] - 16. * h) < 3. * h ? (x[0] - 16. * h) / (3. * h) : 1.; };
  body.set_state([&](const Vector3d &x)
                 { return Vector3d(amplitude * std::pow(std::cos(0.5 * M_PI * shape(x)), 2) * Vector3d::Unit(direction)); },
                 [&](const Vector3d &x)
                 {
                   const double slope = -amplitude * M_PI / (6. * h) * std::sin(M_PI * shape(x)); // runs to the left
                   return Vector3d(speed * slope * Vector3d::Unit(direction));
                 });
  body.model.start();
  body.model.advance(static_cast<int>(9. * h / (speed * body.dt)));
}
} // namespace

// With one stiffness for all particles, and a cell that is a multiple of the lattice, plane P and S pulses stay plane: every
// plane x = const moves as one, and P pulses move along x only. Forces at the seam are those of any other place, to round-off.
TEST(PeriodicBody, PlanePulsesStayPlane)
{
  for (const int direction : {0, 1})
  {
    Case settings = make_case();
    settings.constraint.method = "penalty";
    settings.constraint.penalty_ratio = 0.5;
    Body body(settings);
    const double amplitude = 1e-4 * d;
    run_pulse(body, direction, amplitude);
    const Eigen::Matrix3Xd u = body.particle_displacements(), u_fem = body.fem->gather(fem::NodalField::displacement);
    EXPECT_GT(u.row(direction).cwiseAbs().maxCoeff(), 0.5 * amplitude);
    EXPECT_LT(unevenness(body.packing.positions, u, 1e-3 * d), 1e-8 * amplitude);
    EXPECT_LT(unevenness(body.fem->mesh().nodes, u_fem, 1e-3 * d), 1e-8 * amplitude);
    if (direction == 0)
    {
      EXPECT_LT(u.row(1).cwiseAbs().maxCoeff(), 1e-8 * amplitude);
      EXPECT_LT(u_fem.row(1).cwiseAbs().maxCoeff(), 1e-8 * amplitude);
    }
  }
}

// The mass-scaled stiffness depends on the place in the cell (1e-3 of the pulse): then what repeats itself is the cell, and the
// one at the seam is like the other.
TEST(PeriodicBody, CellsAtTheSeamAreLikeOthers)
{
  for (const int direction : {0, 1})
  {
    Body body(make_case());
    const double amplitude = 1e-4 * d;
    run_pulse(body, direction, amplitude);
    const Eigen::Matrix3Xd u = body.particle_displacements(), u_fem = body.fem->gather(fem::NodalField::displacement);
    EXPECT_GT(u.row(direction).cwiseAbs().maxCoeff(), 0.5 * amplitude);
    EXPECT_LT(unevenness(body.packing.positions, u, cell_height), 1e-8 * amplitude);
    EXPECT_LT(unevenness(body.fem->mesh().nodes, u_fem, cell_height), 1e-8 * amplitude);
  }
}

// Noise on all nodes: what the finite elements lose the particles get, to round-off of 1000 steps.
TEST(PeriodicBody, KeepsItsMomentum)
{
  Body body(make_case());
  body.set_state(
    zero, [](const Vector3d &x)
    { return Vector3d(std::sin(1e4 * x[0] + 3.), std::cos(7e3 * x[0]) + 0.5 * std::sin(2. * M_PI * x[1] / height), 0.); });
  body.model.start();
  const ConservedQuantities before = conserved_quantities(*body.fem, body.model.dem(), body.model.energies(), MPI_COMM_WORLD);
  body.model.advance(1000);
  const ConservedQuantities after = conserved_quantities(*body.fem, body.model.dem(), body.model.energies(), MPI_COMM_WORLD);
  const double whole = body.settings.body.material.density * cells_x * h * height;
  EXPECT_NEAR(before.mass, whole, 0.01 * whole); // weights are integrated on one side, summed on the other
  EXPECT_LT((after.momentum - before.momentum).norm(), 1e-11 * whole);
}
