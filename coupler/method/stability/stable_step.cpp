// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/stability/stable_step.h"

#include "coupler/base/errors.h"
#include "coupler/base/mesh_geometry.h"
#include "coupler/loading/boundary/particle_boundary.h"
#include "coupler/loading/tool/tool.h"
#include "dem_side/bond_network/bond_network.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace kerf
{
namespace
{
/// Stable step after a spring is added to a system: omega^2 is at most the sum of both.
double with_spring(double step, double omega2)
{
  return 2. / std::sqrt(4. / (step * step) + omega2);
}

/// Factor by which contact damping reduces the stable step. The damping of a pair is a fraction xi of critical. The highest
/// mode of the packing involves more contacts, so xi_max = xi omega_max sqrt(m/(2 k_n)). The limit with damping is (2/omega)
/// (sqrt(1 + xi^2) - xi). Theory (8.6), (8.7).
double left_by_damping(const ModelSettings &settings, double omega, double mean_mass)
{
  const double xi = settings.bond.damping * omega * std::sqrt(mean_mass / (2. * settings.bond.k_n));
  return std::sqrt(1. + xi * xi) - xi;
}

/// Stable step while the tool is in contact with the mesh. The contact adds 2 k_s/(rho h) to omega^2 of a surface node with
/// area a and lumped mass rho a h/2, for cells of any shape.
double with_tool_on_surface(const double step, const ModelSettings &settings, const fem::Mesh &mesh)
{
  if (!settings.tool.present())
    return step;
  const double k = surface_stiffness(settings.tool, mesh.dim, settings.bond.k_n, settings.mean_diameter);
  return with_spring(step, 2. * k / (settings.body.material.density * smallest_edge(mesh)));
}

std::vector<char> particles_of(const Overlap &overlap, int n)
{
  std::vector<char> active(n);
  for (int i = 0; i < n; ++i)
    active[i] = overlap.needs_particle(i);
  return active;
}

/// Stable step of the model with @p cells converted; 0: no step is stable.
double limit_of_overlap_around(const std::vector<int> &cells, const ModelSettings &settings, fem::FemSide &fem,
                               const dem::Packing &packing, Constraint &constraint, double guess, MPI_Comm comm)
{
  Overlap overlap(fem.mesh(), fem.quadrature_points(), fem.surface_positions(), packing, settings.overlap.weight_function,
                  settings.overlap.width);
  overlap.convert(cells);
  fem.set_weights(overlap.fe_weights(), overlap.fe_surface_weights());
  const ParticleBoundary boundary(fem.mesh(), settings.body.material, settings.body.boundary_conditions, packing,
                                  settings.body.surface_spacing);
  CoupledOperator model(bond_material(settings, packing), constraint, fem, packing, overlap,
                        boundary.movable(overlap.tied_particles()), particles_of(overlap, packing.size()),
                        part_around(fem.mesh(), cells, reach_of_overlap(settings, constraint)), comm);
  const double limit = model.stable_step(guess);
  fem.set_weights(Eigen::VectorXd::Ones(fem.quadrature_points().cols()), Eigen::VectorXd::Ones(fem.surface_positions().cols()));
  return limit;
}

/// Cells in the middle of the mesh, so that the overlap surrounds them.
std::vector<int> cells_in_the_middle(const fem::Mesh &mesh, double reach)
{
  const Eigen::Vector3d lower = mesh.nodes.rowwise().minCoeff(), upper = mesh.nodes.rowwise().maxCoeff();
  Eigen::Vector3d middle = cell_centre(mesh, 0); // centre of the nearest cell, since the mesh may have a hole there
  const auto distance = [&](const Eigen::Vector3d &place) { return (place - 0.5 * (lower + upper)).norm(); };
  for (int cell = 1; cell < mesh.n_cells(); ++cell)
    if (const Eigen::Vector3d centre = cell_centre(mesh, cell); distance(centre) < distance(middle))
      middle = centre;
  return cells_inside(mesh, {Box{middle.array() - reach, middle.array() + reach}});
}

} // namespace

double smallest_edge(const fem::Mesh &mesh)
{
  double smallest = 1e300;
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    for (int c = 0; c < mesh.dim; ++c) // lexicographic order: edges join corner 0 to corners 1, 2 and 4
      smallest = std::min(smallest, (mesh.nodes.col(mesh.cells(1 << c, cell)) - mesh.nodes.col(mesh.cells(0, cell))).norm());
  return smallest;
}

dem::NetworkOperator::Material bond_material(const ModelSettings &settings, const dem::Packing &packing)
{
  return {settings.bond.k_n, settings.bond.k_t, packing.particle_density(settings.body.material.density)};
}

double particle_frequency(const dem::Packing &packing, double k_n, double k_t, double density)
{
  constexpr double pressed = 0.5; // gap / mean radius of pairs that come into contact in compressed rock
  dem::Packing contacts = packing;
  dem::bond_by_gap(contacts, std::max(pressed, packing.gap_tolerance));
  const double whole = dem::largest_frequency(packing, k_n, k_t, density);
  return contacts.bonds == packing.bonds ? whole : std::max(whole, dem::largest_frequency(contacts, k_n, k_t, density));
}

namespace
{
StableSteps elastic_steps(const ModelSettings &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing,
                          Constraint &constraint, MPI_Comm comm)
{
  StableSteps steps;
  steps.fem = with_tool_on_surface(fem.stable_step(), settings, fem.mesh());
  if (mode == Mode::fem)
  {
    steps.dem = std::numeric_limits<double>::infinity();
    steps.elastic = steps.fem;
    return steps;
  }
  const double density = packing.particle_density(settings.body.material.density);
  const double omega = particle_frequency(packing, settings.bond.k_n, settings.bond.k_t, density);
  double mean_mass = 0.;
  for (int i = 0; i < packing.size(); ++i)
    mean_mass += density * packing.volume(i) / packing.size();
  const double undamped_share = left_by_damping(settings, omega, mean_mass);
  steps.dem = 2. / omega * undamped_share;

  if (settings.tool.present())
  {
    // The contact with the tool adds at most k/m of the lightest particle to omega^2.
    const double k = settings.tool.stiffness_ratio * settings.bond.k_n;
    int lightest = 0;
    packing.radii.minCoeff(&lightest);
    steps.dem = with_spring(steps.dem, k / (density * packing.volume(lightest)));
  }
  if (mode == Mode::dem)
  {
    steps.elastic = steps.dem;
    return steps;
  }

  steps.refusal = constraint.refusal(smallest_edge(fem.mesh()) / packing.mean_diameter);
  if (steps.refusal != Refusal::none)
    return steps;
  const double sides = std::min(steps.fem, steps.dem);
  const auto solve_overlap = [&](const std::vector<int> &cells, double largest)
  {
    steps.overlap = undamped_share * limit_of_overlap_around(cells, settings, fem, packing, constraint, largest, comm);
    if (!(steps.overlap > 0.))
      steps.refusal = Refusal::unstable_overlap;
    steps.elastic = std::min(largest, steps.overlap);
  };
  if (const std::vector<int> cells = cells_inside(fem.mesh(), settings.fixed_region); mode == Mode::fixed && !cells.empty())
  {
    solve_overlap(cells, sides);
    return steps;
  }
  // Solve 4 (dt/sides)^2 + bound(dt) = 4 by bisection. The weight at the end of the overlap is about d/(2 L_o). Theory (8.10).
  const double lightest = mean_mass * 0.5 * packing.mean_diameter / std::max(settings.overlap.width, packing.mean_diameter);
  double lower = 0., upper = sides;
  for (int k = 0; k < 60; ++k)
  {
    const double middle = 0.5 * (lower + upper), ratio = middle / sides;
    (4. * ratio * ratio + constraint.bound_of_added_omega2(middle, lightest) <= 4. ? lower : upper) = middle;
  }
  steps.elastic = lower;
  if (constraint.depends_on_overlap())
    // The lightest particle at the end of an overlap governs. An overlap in the middle represents the later ones.
    solve_overlap(cells_in_the_middle(fem.mesh(), settings.overlap.width), lower);
  return steps;
}

/// What a contact of the tool whose stiffness follows the time step takes of the limit 4 of omega^2 dt^2. Theory (8.14).
double taken_by_contact(const ModelSettings &settings)
{
  const bool follows_step = settings.tool.present() && settings.tool.stiffness_ratio == 0.;
  return follows_step ? contact_share_of_step : 0.;
}

/// Factor by which local damping increases omega^2. The damping is a fraction of the force, opposite to the velocity. A motion
/// that reverses in every step moves against its springs, so the damping adds this fraction to their stiffness. Theory (8.11).
double stiffened_by_damping(const ModelSettings &settings)
{
  return 1. + settings.local_damping;
}
} // namespace

StableSteps stable_steps(const ModelSettings &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing,
                         Constraint &constraint, MPI_Comm comm)
{
  StableSteps steps = elastic_steps(settings, mode, fem, packing, constraint, comm);
  const double limit = 4. / (mode == Mode::fem ? 1. : stiffened_by_damping(settings)) - taken_by_contact(settings);
  steps.coupled = steps.elastic * std::sqrt(0.25 * limit);
  return steps;
}

} // namespace kerf
