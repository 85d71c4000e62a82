// SPDX-License-Identifier: GPL-2.0-or-later
// Loads on the surface where the particle region ends below it or beside it: no part of them is lost.
#include "coupler/loading/boundary/tributary_areas.h"
#include "tests/support/coupled_strip.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace kerf;
using Eigen::Vector3d;
using test::Body;
using test::Strip;
using test::StripCase;

namespace
{
constexpr double d = Strip::d;

fem::BoundaryCondition condition(int id, fem::BoundaryKind kind)
{
  fem::BoundaryCondition result;
  result.id = id;
  result.kind = kind;
  return result;
}

/// A random block of cells of four diameters whose particle region ends some cells below the top and beside the left side.
Case random_block(int dim, int cells_below, int cells_beside)
{
  Case settings = test::lattice_rock(d);
  const double h = 4. * d;
  settings.body.dim = settings.packing.dim = dim;
  settings.body.mesh.upper = dim == 2 ? Vector3d(12. * h, 8. * h, 0.) : Vector3d(5. * h, 4. * h, 3. * h);
  settings.body.mesh.cell_size = h;
  settings.packing.kind = "random";
  settings.packing.radius_spread = 0.3;
  settings.packing.upper = settings.body.mesh.upper;
  settings.overlap.width = dim == 2 ? 3. * h : 2. * h;
  const Vector3d upper = settings.body.mesh.upper;
  settings.fixed_region = {{Vector3d(cells_beside * h - 0.1 * d, dim == 2 ? 3. * h : h, -1.),
                            Vector3d(dim == 2 ? 8. * h : 4. * h, upper[1] - cells_below * h + 0.1 * d, 1.)}};
  return settings;
}
} // namespace

// At every point of the surface the weights of both models sum to one, so areas and forces of a side are whole: round-off.
TEST(SurfaceWeights, SharesOfASideSumToItsArea)
{
  for (const int dim : {2, 3})
  {
    const dem::Packing packing = dem::generate_packing(random_block(dim, 0, 0).packing);
    for (const int below : {0, 1, 2})
    {
      Case settings = random_block(dim, below, below);
      settings.body.comm = MPI_COMM_SELF;
      const Vector3d upper = settings.body.mesh.upper; // hanging nodes at the corner of region and sides
      settings.body.mesh.refined = {{Vector3d(2. * d, upper[1] - 6. * d, -1.), Vector3d(10. * d, upper[1], 1.), 1}};
      const auto fem = fem::make_fem_side(settings.body);
      const fem::Mesh &mesh = fem->mesh();
      Overlap overlap(mesh, fem->quadrature_points(), fem->surface_positions(), packing, WeightFunction::linear,
                      settings.overlap.width);
      for (const int id : {0, 3})
      {
        TributaryAreas shares(mesh, fem::selected_faces(mesh, condition(id, fem::BoundaryKind::traction)), packing,
                              settings.body.surface_spacing);
        Overlap regions = overlap;
        const int number = regions.add_points(shares.points());
        regions.convert(cells_inside(mesh, settings.fixed_region));
        std::vector<char> takes(packing.size());
        for (int i = 0; i < packing.size(); ++i)
          takes[i] = regions.de_weights()[i] > 0.;
        shares.set_weights(1. - regions.fe_weights_at(number).array(), takes);
        double of_particles = 0.;
        for (const TributaryArea &share : shares.areas())
        {
          EXPECT_TRUE(takes[share.particle]);
          of_particles += share.area;
        }
        fem->set_weights(regions.fe_weights(), regions.fe_surface_weights());
        fem::SurfacePoints points;
        const Vector3d far = Vector3d::Constant(10.), normal = id == 0 ? Vector3d(-Vector3d::UnitX()) : Vector3d::UnitY();
        fem->surface_points(-far, far, {}, points);
        double of_cells = 0., whole = id == 0 ? settings.body.mesh.upper[1] : settings.body.mesh.upper[0];
        whole *= dim == 2 ? 1. : settings.body.mesh.upper[2];
        for (int q = 0; q < points.area.size(); ++q)
          if (points.normal.col(q).dot(normal) > 0.9)
            of_cells += points.area[q];
        if (below * 4. * d < 0.9 * settings.overlap.width)
          EXPECT_GT(of_particles, 0.02 * whole) << dim << ' ' << below << ' ' << id;
        EXPECT_NEAR(of_particles + of_cells, whole, 1e-12 * whole) << dim << ' ' << below << ' ' << id;
      }
    }
  }
}

namespace
{
/// A lattice strip that is pulled at its left end by the traction of a strain and held at the right end. The particle region
/// begins some cells beside the loaded end. Relative error of the strain between the loaded end and the end of the region.
double lattice_error(const std::string &method, double penalty_ratio, int cells_beside)
{
  constexpr double eps = 1e-5;
  double sum = 0.;
  for (const double sign : {-1., 1.})
  {
    StripCase strip{Strip()};
    Case &settings = strip.settings;
    settings.constraint.method = method;
    settings.constraint.penalty_ratio = penalty_ratio;
    settings.fixed_region[0].lower[0] = cells_beside * strip.strip.cell_length() - 0.1 * d;
    const fem::Material &rock = settings.body.material;
    fem::BoundaryCondition pull = condition(0, fem::BoundaryKind::traction);
    pull.traction[0] = -sign * eps * (rock.lame_lambda() + 2. * rock.lame_mu());
    settings.body.strain = fem::Strain::small;
    settings.body.boundary_conditions = {pull, condition(1, fem::BoundaryKind::fixed)};
    Body body(settings, strip.packing, Mode::fixed);
    body.set_state([&](const Vector3d &x)
                   { return Vector3d(sign * eps * (x[0] - settings.body.mesh.upper[0]) * Vector3d::UnitX()); },
                   [](const Vector3d &) { return Vector3d(Vector3d::Zero()); });
    body.model.start();
    body.model.advance(500);
    const double from = std::max(0., settings.fixed_region[0].lower[0] - settings.overlap.width) - 1e-3 * d;
    sum += sign * test::slope(body, 0, from, strip.strip.region_end() - d);
  }
  return std::abs(0.5 * sum / eps - 1.);
}
} // namespace

// The first column of the lattice lies on the loaded side, so columns are a trapezoidal rule there, too. What is left is the
// round-off of positions, see the patch test. Terms of second order cancel between tension and compression.
TEST(SurfaceWeights, LatticeIsExactBesideALoadedSide)
{
  for (const int beside : {0, 1, 2})
    EXPECT_LT(lattice_error("weak_multipliers", 0., beside), 1e-8) << beside;
}

// Springs give way to the load that the weights put on the particles, by as much as in the patch test.
TEST(SurfaceWeights, PenaltyIsCloseBesideALoadedSide)
{
  for (const int beside : {0, 1, 2})
  {
    EXPECT_LT(lattice_error("penalty", 1., beside), 5e-3) << beside;
    EXPECT_LT(lattice_error("penalty_mass_scaled", 0.25, beside), 5e-3) << beside;
  }
}

namespace
{
struct AtRest
{
  double strain = 0.; ///< mean of the components along x and y, relative error
  double energy = 0.; ///< elastic, relative error
  double kinetic = 0.;
};

/// A block under initial stress between sides that hold it, after it had the time to move: means over two transits.
AtRest block_under_stress(const Case &the_case, const dem::Packing &packing, Mode mode)
{
  Body body(the_case, packing, mode);
  body.model.start();
  const fem::Mesh &mesh = body.fem->mesh();
  const Eigen::Matrix3d exact = fem::initial_state(the_case.body).gradient;
  const double volume = the_case.body.mesh.upper[0] * the_case.body.mesh.upper[1];
  const fem::Material &rock = the_case.body.material;
  const Eigen::Matrix2d e = exact.topLeftCorner<2, 2>();
  const double whole = volume * (0.5 * rock.lame_lambda() * e.trace() * e.trace() + rock.lame_mu() * e.squaredNorm());
  const int steps = static_cast<int>(the_case.body.mesh.upper[1] / rock.speed_p() / body.dt / 4.) + 1, samples = 16;
  body.model.advance(4 * steps);
  AtRest mean;
  for (int sample = 0; sample < samples; ++sample)
  {
    body.model.advance(steps);
    const EnergyLedger energy = body.model.energies();
    mean.energy += (energy.elastic / whole - 1.) / samples;
    mean.kinetic += energy.kinetic / whole / samples;
    const Eigen::Matrix3Xd u = body.fem->gather(fem::NodalField::displacement), mass = body.fem->gather(fem::NodalField::mass);
    for (int c = 0; c < 2; ++c)
    {
      double n = 0., x = 0., y = 0., xx = 0., xy = 0.;
      for (int a = 0; a < mesh.n_nodes(); ++a)
        if (mass(0, a) > 0.)
        {
          const double X = mesh.nodes(c, a);
          n += 1.;
          x += X;
          y += u(c, a);
          xx += X * X;
          xy += X * u(c, a);
        }
      mean.strain += 0.5 / samples * std::abs((n * xy - x * y) / (n * xx - x * x) / exact(c, c) - 1.);
    }
  }
  return mean;
}
} // namespace

// Rest under initial stress, with a corner of the region near two loaded sides: below, beside, held or absorbing. Of a region
// three cells from the sides, which bears no load there, strain and energy differ by 1.5 and 1.6 %: this packing is softer here
// and stiffer there. The skin of the packing, in which bonds are missing, adds up to as much. With a part of the load lost the
// energy is a quarter too low.
TEST(SurfaceWeights, RandomBlockStaysUnderInitialStress)
{
  struct Place
  {
    int below, beside;
    fem::BoundaryKind kind;
  };
  Case settings = random_block(2, 0, 0);
  const dem::Packing packing = dem::generate_packing(settings.packing);
  const dem::ElasticCalibration bonds =
    dem::calibrate_elastic(packing, settings.body.material.young, settings.body.material.poisson);
  for (const std::string method : {"weak_multipliers", "penalty_mass_scaled"})
    for (const auto &[below, beside, kind] : {Place{3, 3, fem::BoundaryKind::in_situ}, Place{0, 1, fem::BoundaryKind::in_situ},
                                              Place{1, 1, fem::BoundaryKind::in_situ}, Place{2, 1, fem::BoundaryKind::in_situ},
                                              Place{1, 2, fem::BoundaryKind::absorbing}})
    {
      settings = random_block(2, below, beside);
      settings.bond.k_n = bonds.k_n;
      settings.bond.k_t = bonds.k_t;
      settings.constraint.method = method;
      settings.constraint.fluctuation_relaxation = 0.05;
      settings.activation.relaxation_steps = 60;
      settings.local_damping = 0.2;
      settings.body.initial_stress.diagonal() << -10e6, -5e6, 0.;
      settings.body.boundary_conditions = {condition(0, kind), condition(1, fem::BoundaryKind::roller),
                                           condition(2, fem::BoundaryKind::roller), condition(3, kind)};
      const AtRest result = block_under_stress(settings, packing, Mode::fixed);
      EXPECT_LT(result.strain, 0.04) << below << ' ' << beside;
      EXPECT_LT(std::abs(result.energy), 0.02) << below << ' ' << beside;
      EXPECT_LT(result.kinetic, 1e-3) << below << ' ' << beside;
    }
}

// At 40 and 5 MPa the static state uses up 0.8 of these strengths, so no bond breaks at rest. Those that did were overloaded by
// the motion of particles that had not relaxed, or had no weight.
TEST(SurfaceWeights, NoBondBreaksAtRest)
{
  Case settings = random_block(2, 2, 3);
  const dem::Packing packing = dem::generate_packing(settings.packing);
  const dem::ElasticCalibration bonds =
    dem::calibrate_elastic(packing, settings.body.material.young, settings.body.material.poisson);
  settings.bond.k_n = bonds.k_n;
  settings.bond.k_t = bonds.k_t;
  settings.bond.R_n = 3e4;
  settings.bond.R_t = 8e4;
  settings.bond.shear_friction = 0.5;
  settings.constraint.method = "weak_multipliers";
  settings.constraint.fluctuation_relaxation = 0.05;
  settings.activation.relaxation_steps = 10;
  settings.body.initial_stress.diagonal() << -40e6, -5e6, 0.;
  settings.body.boundary_conditions = {condition(0, fem::BoundaryKind::in_situ), condition(1, fem::BoundaryKind::roller),
                                       condition(2, fem::BoundaryKind::roller), condition(3, fem::BoundaryKind::in_situ)};
  for (const Mode mode : {Mode::fixed, Mode::dem})
  {
    Body body(settings, packing, mode);
    body.model.start();
    body.model.advance(1600);
    EXPECT_EQ(body.model.dem().n_bonds_broken(), 0) << static_cast<int>(mode);
    EXPECT_LT(body.model.energies().kinetic, 4e-3 * body.model.energies().elastic) << static_cast<int>(mode);
  }
}
